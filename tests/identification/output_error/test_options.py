"""Options that can be misread: what is fixed, draws of a bootstrap, breakaway, one name as a string."""

import re

import numpy as np
import pytest

from omnidyn.errors import InputError, InsufficientDataError, UnsupportedError
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.model.keys import BOX
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import excitation, noisy

BREAKAWAY = "friction.axes.breakaway"
KT, GEAR = "motor.torque_constant_Nm_A", "motor.gear_ratio"


@pytest.fixture(scope="module")
def runs(axebot):
    return [noisy(simulate(axebot, excitation(6.0, seed=20 + k), 0.01), k) for k in range(5)]


def test_what_is_fixed_must_be_there(axebot, runs):
    """A key with a typing error would hold nothing, and the fit would go on without a word."""
    misspelt = r"unknown key; got friction\.axes\.viscos\[0\]; did you mean friction\.axes\.viscous"
    with pytest.raises(InputError, match=misspelt):
        identify(runs, axebot, OutputError(start="rest", nuisances=(), fixed=["friction.axes.viscos[0]"]))
    with pytest.raises(InputError, match=misspelt):
        identify(runs, axebot, OutputError(fixed=["friction.axes.viscos[0]"], nuisances=()), groups=[*"aaabb"])
    fit = identify(
        runs, axebot, OutputError(start="rest", nuisances=(), fixed=["body.mass_kg", f"{BREAKAWAY}[0]"])
    ).estimate
    assert set(fit.value) == set(BOX)


def test_a_string_is_one_name(axebot, runs):
    fit = identify(runs, axebot, OutputError(start="rest", nuisances=(), fixed=BOX[0])).estimate
    assert set(fit.value) == set(BOX[1:])
    assert set(identify(runs, axebot, OutputError(start="rest", nuisances=(), free=BOX[0])).value) == {BOX[0]}
    profiled = identify(runs, axebot, OutputError(start="rest", nuisances=(), fixed=BOX[0], profile=BOX[4])).estimate
    changed = [key for key in fit.ci95 if fit.ci95[key] != profiled.ci95[key]]
    assert changed == [BOX[4]]


FEW = "too few draws for a 95 % interval; got {}; expected 20 or more"
NONE = "not a number of draws; got {}; expected 0 or a whole number above it"


@pytest.mark.parametrize(("draws", "said"), [(1, FEW), (2, FEW), (-5, NONE), (3.5, NONE), (True, NONE)])
def test_a_bootstrap_needs_draws(axebot, runs, draws, said):
    """Of two draws an interval need not even hold the value."""
    message = re.escape("bootstrap: " + said.format(draws))
    with pytest.raises(InputError, match=message):
        identify(runs, axebot, OutputError(start="rest", nuisances=(), bootstrap=draws))
    names = [*"aaaaabbbbb"]
    with pytest.raises(InputError, match=message):
        identify([*runs, *runs], axebot, OutputError(bootstrap=draws, nuisances=()), groups=names)


def test_breakaway_of_all_axes_or_of_one(axebot, runs):
    every = identify(runs[:2], axebot, OutputError(start="rest", nuisances=(), free=[*BOX, BREAKAWAY])).estimate
    assert set(every.value) == {*BOX, *(f"{BREAKAWAY}[{axis}]" for axis in range(3))}
    but_one = identify(
        runs[:2], axebot, OutputError(start="rest", nuisances=(), free=[*BOX, BREAKAWAY], fixed=[f"{BREAKAWAY}[0]"])
    ).estimate
    assert f"{BREAKAWAY}[0]" not in but_one.value
    with pytest.raises(InputError, match=r"no such entry; got friction\.axes\.breakaway\[5\]; .* from 0 to 2"):
        identify(runs, axebot, OutputError(start="rest", nuisances=(), free=[*BOX, f"{BREAKAWAY}[5]"]))
    with pytest.raises(InputError, match="expected at least one beside breakaway"):
        identify(runs, axebot, OutputError(start="rest", nuisances=(), free=[f"{BREAKAWAY}[0]"]))
    with pytest.raises(UnsupportedError, match="breakaway is not profiled in groups"):
        identify(runs, axebot, OutputError(free=[*BOX, f"{BREAKAWAY}[0]"], nuisances=()), groups=[*"aaabb"])


def test_numbers_that_only_show_together(axebot, runs):
    """None of them has a profile, nor draws, that say more than the likelihood; and a remedy that helps."""
    free = [*BOX, KT, GEAR]
    fit = identify(
        runs, axebot, OutputError(start="rest", nuisances=(), free=free, profile=[KT, BOX[4]], bootstrap=20)
    ).estimate
    assert fit.ci95[KT][1] == fit.ci95[GEAR][1] == fit.std[KT] == np.inf
    assert np.isfinite(fit.ci95[BOX[4]]).all()
    with pytest.raises(InsufficientDataError, match=r"made up for by others.*leave out one that is known"):
        identify(
            runs,
            axebot,
            OutputError(
                start="rest",
                nuisances=(),
                free=[*free[:-1], "motor.resistance_ohm", "body.mass_kg", "body.inertia_kg_m2"],
            ),
        )
