"""What our fit is measured against: an optimum found without anything of ours, and peers that do what they should."""

import numpy as np
import pytest

from benchmarks.identification.identify_log import cramer_rao
from benchmarks.identification.identify_peers import (
    by_sysid,
    installed_sysid,
    most_likely,
    our_fit,
    peers,
    residuals,
    run_events,
)
from benchmarks.table import Table
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import bare, excitation, noisy_draw, truth, with_friction


@pytest.fixture(scope="module")
def robot():
    return load_robot("axebot")


@pytest.fixture(scope="module")
def clean(robot):
    return simulate(robot, excitation(), 0.01)


@pytest.fixture(scope="module")
def true(robot):
    return np.array(list(truth(robot).values()))


def test_motion_from_event_to_event_is_the_exact_engines(robot, clean):
    assert np.abs(run_events(robot, clean.voltage[:-1], 0.01) - clean.twist).max() < 1e-13


def test_our_fit_ends_at_the_optimum_that_scipy_finds(robot, clean, true):
    """Stops and reversals kink the likelihood: draw 1 has two optima, 0.06 standard errors and 5e-4 apart."""
    std = cramer_rao(robot, clean)
    for seed, nearness, depth in ((0, 1e-3, 1e-6), (1, 0.1, 5e-3), (2, 1e-3, 1e-6)):
        log = noisy_draw(clean, seed)
        residual = residuals(robot, log, run_events)
        found, best = our_fit(with_friction(robot, 2.0 * true), log), most_likely(robot, log)
        assert np.abs((found - best) / std).max() < nearness
        assert 0.5 * float(np.sum(residual(found) ** 2) - np.sum(residual(best) ** 2)) < depth


def test_a_log_without_noise_gives_the_truth_back(robot, clean, true):
    std = cramer_rao(robot, clean)
    assert np.abs((our_fit(with_friction(robot, 2.0 * true), bare(clean)) - true) / std).max() < 1e-3


def test_a_peer_that_is_not_installed_is_named_with_the_way_to_get_it(monkeypatch):
    monkeypatch.setattr("benchmarks.identification.identify_peers.installed", lambda name: None)
    table = Table("", [])
    assert [peer.name for peer in peers(table)] == ["scipy least_squares + solve_ivp (LSODA, tanh 0.01)"]
    for note, name in zip(table.notes, ("mujoco.sysid", "lmfit"), strict=True):
        assert note.startswith(f"{name} skipped: not installed here (python -m pip install -r benchmarks/peers.txt)")


def test_the_model_of_mujoco_is_the_robot(robot, clean, true):
    """A short log without noise: Coulomb friction within 10 % of the truth. A force or mass in a wrong unit shows."""
    if installed_sysid() is None:
        pytest.skip("mujoco.sysid is not installed here")
    run = simulate(robot, excitation(4.0), 0.01)
    found = by_sysid(with_friction(robot, 1.2 * true), bare(run), True)
    assert found[3:] == pytest.approx(true[3:], rel=0.1)
