"""Options that can be misread: what is fixed, draws of a bootstrap, breakaway, one name as a string."""

from functools import partial

import numpy as np
import pytest

from omnidyn.errors import InputError, InsufficientDataError, UnsupportedError
from omnidyn.identification import whole_logs as whole
from omnidyn.identification.whole_logs import identify_groups
from omnidyn.model.keys import BOX
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import excitation, noisy

fit_output_error = partial(whole.fit_output_error, nuisances=(), start="rest")

BREAKAWAY = "friction.axes.breakaway"
KT, GEAR = "motor.torque_constant_Nm_A", "motor.gear_ratio"


@pytest.fixture(scope="module")
def runs(axebot):
    return [noisy(simulate(axebot, excitation(6.0, seed=20 + k), 0.01), k) for k in range(5)]


def test_what_is_fixed_must_be_there(axebot, runs):
    """A key with a typing error would hold nothing, and the fit would go on without a word."""
    misspelt = r"unknown key; got friction\.axes\.viscos\[0\]; did you mean friction\.axes\.viscous"
    with pytest.raises(InputError, match=misspelt):
        fit_output_error(runs, axebot, fixed=["friction.axes.viscos[0]"])
    with pytest.raises(InputError, match=misspelt):
        identify_groups(runs, axebot, [*"aaabb"], fixed=["friction.axes.viscos[0]"], nuisances=())
    fit = fit_output_error(runs, axebot, fixed=["body.mass_kg", f"{BREAKAWAY}[0]"])
    assert set(fit.value) == set(BOX)


def test_a_string_is_one_name(axebot, runs):
    fit = fit_output_error(runs, axebot, fixed=BOX[0])
    assert set(fit.value) == set(BOX[1:])
    assert set(fit_output_error(runs, axebot, free=BOX[0]).value) == {BOX[0]}
    profiled = fit_output_error(runs, axebot, fixed=BOX[0], profile=BOX[4])
    changed = [key for key in fit.ci95 if fit.ci95[key] != profiled.ci95[key]]
    assert changed == [BOX[4]]


@pytest.mark.parametrize("draws", [1, 2, -5, 3.5, True])
def test_a_bootstrap_needs_draws(axebot, runs, draws):
    """Of two draws an interval need not even hold the value."""
    with pytest.raises(InputError, match=r"bootstrap: too few draws for a 95 % interval; got .*; expected 20 or more"):
        fit_output_error(runs, axebot, bootstrap=draws)
    names = [*"aaaaabbbbb"]
    with pytest.raises(InputError, match=r"bootstrap: too few draws for a 95 % interval"):
        identify_groups([*runs, *runs], axebot, names, bootstrap=draws, nuisances=())


def test_breakaway_of_all_axes_or_of_one(axebot, runs):
    every = fit_output_error(runs[:2], axebot, free=[*BOX, BREAKAWAY])
    assert set(every.value) == {*BOX, *(f"{BREAKAWAY}[{axis}]" for axis in range(3))}
    but_one = fit_output_error(runs[:2], axebot, free=[*BOX, BREAKAWAY], fixed=[f"{BREAKAWAY}[0]"])
    assert f"{BREAKAWAY}[0]" not in but_one.value
    with pytest.raises(InputError, match=r"no such entry; got friction\.axes\.breakaway\[5\]; .* from 0 to 2"):
        fit_output_error(runs, axebot, free=[*BOX, f"{BREAKAWAY}[5]"])
    with pytest.raises(InputError, match="expected at least one beside breakaway"):
        fit_output_error(runs, axebot, free=[f"{BREAKAWAY}[0]"])
    with pytest.raises(UnsupportedError, match="breakaway is not profiled in groups"):
        identify_groups(runs, axebot, [*"aaabb"], free=[*BOX, f"{BREAKAWAY}[0]"], nuisances=())


def test_numbers_that_only_show_together(axebot, runs):
    """None of them has a profile, nor draws, that say more than the likelihood; and a remedy that helps."""
    free = [*BOX, KT, GEAR]
    fit = fit_output_error(runs, axebot, free=free, profile=[KT, BOX[4]], bootstrap=20)
    assert fit.ci95[KT][1] == fit.ci95[GEAR][1] == fit.std[KT] == np.inf
    assert np.isfinite(fit.ci95[BOX[4]]).all()
    with pytest.raises(InsufficientDataError, match=r"made up for by others.*leave out one that is known"):
        fit_output_error(runs, axebot, free=[*free[:-1], "motor.resistance_ohm", "body.mass_kg", "body.inertia_kg_m2"])
