"""Fixed steps within a row: the same as shorter rows, and nearer to the engine that keeps a tolerance."""

import numpy as np
import pytest

from omnidyn.model.friction import DirectionFriction, Friction
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.batch.batch import simulate_batch
from omnidyn.simulation.simulate import simulate

ROWS = np.random.default_rng(5).uniform(-6.0, 6.0, (12, 3)).repeat(5, axis=0)
DT, CUTS = 0.02, 8


@pytest.fixture(scope="module")
def robots():
    exact = load_robot("axebot")
    disc = DirectionFriction(coulomb=(1.8, 1.8), viscous=0.9, yaw_coulomb=0.09, yaw_viscous=0.01)
    turning = exact.replace(friction=Friction(direction=disc), body=exact.body.replace(rotating_frame=True))
    limited = turning.replace(motor=turning.motor.replace(current_limit=2.0))
    return [exact, turning, limited, exact]


def test_substeps_are_shorter_rows_to_the_last_bit(robots):
    cut = simulate_batch(robots, ROWS, DT, substeps=CUTS, every=5)
    short = simulate_batch(robots, ROWS.repeat(CUTS, axis=0), DT / CUTS, every=5 * CUTS)
    np.testing.assert_array_equal(cut.twists[1:3], short.twists[1:3])
    np.testing.assert_array_equal(cut.poses[1:3], short.poses[1:3])
    whole = simulate_batch(robots, ROWS, DT, every=5)
    np.testing.assert_array_equal(cut.twists[[0, 3]], whole.twists[[0, 3]])  # the exact engine needs none


def test_substeps_come_near_to_the_engine_with_a_tolerance(robots):
    true = simulate(robots[1], ROWS, DT, tol=1e-8).twist
    off = [
        np.abs(simulate_batch(robots[1:2], ROWS, DT, substeps=n, every=1).twists[0] - true).max() for n in (1, 4, 16)
    ]
    assert off[1] < 0.5 * off[0]
    assert off[2] < 0.5 * off[1]
    assert off[2] < 8e-3


def test_statistics_are_over_all_steps(robots):
    run = simulate_batch(robots, ROWS, DT, substeps=CUTS, statistics=True)
    steps = simulate_batch(robots, ROWS.repeat(CUTS, axis=0), DT / CUTS, every=1).twists[:, 1:]
    np.testing.assert_allclose(run.twist_statistics.mean[1], steps[1].mean(axis=0), atol=1e-12)
    np.testing.assert_allclose(run.twist_statistics.rms[1], np.sqrt((steps[1] ** 2).mean(axis=0)), atol=1e-12)


def test_what_was_clipped_counts_rows(robots):
    words = [simulate_batch(robots[1:2], 2.0 * ROWS, DT, substeps=n).warnings[0].numbers for n in (1, CUTS)]
    assert words[0] == words[1]
