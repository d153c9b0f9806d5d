"""Nuisances that soak up what a model misses in a part of the log are taken out; those that are there stay."""

from unittest.mock import patch

import numpy as np
import pytest

from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error import fit
from omnidyn.identification.output_error.fit import Fit
from omnidyn.identification.output_error.linear import blocks as held_out
from omnidyn.identification.output_error.linear.blocks import BlockProducts, _without, _without_it, rejected_nuisances
from omnidyn.identification.selection.blocks import compare_blocks
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import excitation, noisy_draw

VOLTS = excitation(60.0, 100.0)
PART = slice(1500, 1900)


@pytest.fixture(scope="module")
def robot():
    return load_robot("axebot")


def solved(log, robot):
    """The fit with all that is automatic, and supported by the likelihood."""
    with patch.object(fit, "rejected_nuisances", lambda solution: {}):
        return Fit.of([log], robot, OutputError()).solve()


def lame_for_a_while(robot):
    """For 4 s of 60 a volt of each motor is lost: no number of the robot, and no dead band, is that."""
    volts = VOLTS.copy()
    volts[PART] = np.sign(volts[PART]) * np.maximum(np.abs(volts[PART]) - 1.0, 0.0)
    clean, real = simulate(robot, VOLTS, 0.01), simulate(robot, volts, 0.01)
    log = noisy_draw(clean, 0)
    return log.replace(twist=log.twist - clean.twist + real.twist)


def test_what_soaks_up_a_part_of_the_log_is_not_fitted(robot):
    log = lame_for_a_while(robot)
    found = solved(log, robot)
    assert set(rejected_nuisances(found)) == {"latency.twist", "dead_band"} == set(found.solver.problem.names[6:])
    estimate = identify(log, robot, OutputError()).estimate
    assert not estimate.nuisances
    harmful = [each for each in estimate.warnings if each.code == "harmful_nuisance"]
    assert len(harmful) == 2
    assert all(each.numbers["blocks"] == 10 and each.numbers["gain"] > 0.0 for each in harmful)
    assert "of 10 are predicted better without it" in str(harmful[0])


@pytest.mark.parametrize("late", [1, 3])
def test_a_latency_that_is_there_stays(robot, late):
    log = noisy_draw(simulate(robot, VOLTS, 0.01), late)
    twist = log.twist.copy()
    twist[late:] = twist[:-late]
    assert rejected_nuisances(solved(log.replace(twist=twist), robot)) == {}


def test_nothing_is_looked_at_where_the_likelihood_is_sure_of_none(robot, monkeypatch):
    monkeypatch.setattr(held_out, "_blocks", None)
    assert rejected_nuisances(solved(noisy_draw(simulate(robot, VOLTS, 0.01), 0), robot)) == {}


def test_a_nuisance_that_was_asked_for_is_fitted_whatever_it_does(robot):
    estimate = identify(lame_for_a_while(robot), robot, OutputError(nuisances=("latency", "dead_band"))).estimate
    assert set(estimate.nuisances) == {"latency.twist", "dead_band"}


def test_the_error_of_blocks_is_that_of_fits_to_all_others():
    """Against least squares over the rows themselves."""
    rng, count = np.random.default_rng(2), 400
    columns, residual = rng.standard_normal((count, 4)), rng.standard_normal(count)
    parts = np.split(np.arange(count), 10)
    every = np.column_stack([residual, columns])
    blocks = object.__new__(BlockProducts)
    blocks.size = np.concatenate([[1.0], np.linalg.norm(columns, axis=0)])
    every = every / blocks.size
    blocks.matrix, blocks.total = np.array([every[own].T @ every[own] for own in parts]), every.T @ every

    def error(kept, left, own):
        others = np.setdiff1d(np.arange(count), own)
        by = np.linalg.lstsq(columns[np.ix_(others, kept)], left[others], rcond=None)[0]
        return float(((left[own] - columns[np.ix_(own, kept)] @ by) ** 2).sum())

    step, at = 0.3, np.arange(1, 5)
    with_ = np.array([error([0, 1, 2, 3], residual, own) for own in parts])
    without = np.array([error([0, 1, 3], residual - step * columns[:, 2], own) for own in parts])
    assert _without(blocks, 2, step).held_out(at[at != 3]) == pytest.approx(without, rel=1e-9)
    comparison = _without_it(blocks, at, 2, step)
    assert (comparison.better, comparison.blocks) == ((without < with_).sum(), 10)
    assert comparison.p == pytest.approx(compare_blocks(with_, without).p, rel=1e-9)
