"""Samples that are moved together give what one after the other give, wherever a shard is cut."""

import numpy as np
import pytest

from omnidyn.campaigns import batches
from omnidyn.campaigns.batches import batch_columns, batched
from omnidyn.campaigns.spec import parse_spec
from omnidyn.campaigns.tasks import SIMULATE_METRICS, TRACK_METRICS, Problem
from omnidyn.errors import InputError

VARY = {
    "body.mass_kg": {"range": [1.0, 2.0]},
    "wheels.wheel_radius_m": {"factor": [0.9, 1.1]},
    "friction": {"factor": [0.3, 6.0]},
    "friction.axes.coulomb[1]": {"range": [0.5, 2.0]},
}
VOLTS = {"voltage_V": [0.0, 2.0, -2.0], "duration_s": 0.5, "dt_s": 0.005}
SPEC = {"schema": 1, "robot": "axebot", "samples": 64, "vary": VARY, "simulate": VOLTS}


def problem(tmp_path, **changes):
    """A problem whose spec was checked."""
    made = Problem(parse_spec(SPEC | changes), tmp_path)
    made.check()
    return made


def test_together_is_one_after_the_other(tmp_path):
    made = problem(tmp_path)
    assert batched(made)
    columns = batch_columns(made, 3, 40)
    assert tuple(columns) == SIMULATE_METRICS
    rows = [made.measure(sample) for sample in made.samples(3, 40)]
    for name, column in columns.items():
        assert column == pytest.approx([row[name] for row in rows], rel=1e-10, abs=1e-12, nan_ok=True), name
    assert np.any(columns["drift_m"] == 0.0)  # some stick: exactly
    assert np.any(columns["drift_m"] > 0.01)


def test_a_shard_may_be_cut_anywhere(tmp_path):
    made = problem(tmp_path)
    whole, parts = batch_columns(made, 0, 64), [batch_columns(made, 0, 5), batch_columns(made, 5, 64)]
    for name, column in whole.items():
        assert np.array_equal(column, np.concatenate([part[name] for part in parts]), equal_nan=True)


@pytest.mark.parametrize("controller, noise", [("pid", 0.0), ("pid", 0.01), ("pid_no_friction", 0.0)])
def test_loops_together_are_those_of_track(tmp_path, controller, noise):
    """An eight so fast that voltages meet their limit."""
    task = {"path": "eight:period_s=3.5", "controller": controller, "duration_s": 1.2, "noise_m_s": noise}
    made = problem(tmp_path, simulate=None, track=task, samples=12)
    assert batched(made)
    columns = batch_columns(made, 2, 9)
    assert tuple(columns) == TRACK_METRICS
    assert columns["saturated_share"].max() > 0.0
    rows = [made.measure(sample) for sample in made.samples(2, 9)]
    for name, column in columns.items():
        assert column == pytest.approx([row[name] for row in rows], rel=1e-7, abs=1e-9, nan_ok=True), name


def test_loops_may_be_cut_anywhere(tmp_path, monkeypatch):
    monkeypatch.setattr(batches, "LOOPS", 16)
    made = problem(tmp_path, simulate=None, track={"path": "circle", "duration_s": 0.3, "noise_m_s": 0.01})
    whole, parts = batch_columns(made, 0, 64), [batch_columns(made, 0, 21), batch_columns(made, 21, 64)]
    for name, column in whole.items():
        assert np.array_equal(column, np.concatenate([part[name] for part in parts]), equal_nan=True)


def test_metrics_that_are_chosen_are_the_same(tmp_path):
    whole, few = batch_columns(problem(tmp_path), 0, 64), ["drift_m", "turned_rad"]
    chosen = batch_columns(problem(tmp_path, metrics=few), 0, 64)
    assert [*chosen] == few
    assert all(np.array_equal(chosen[name], whole[name]) for name in few)
    with pytest.raises(InputError, match="did you mean drift_m"):
        problem(tmp_path, metrics=["drift"])


@pytest.mark.parametrize(
    "changes",
    [
        {"vary": VARY | {"simulate.scale": {"range": [0.0, 1.0]}}},
        {"simulate": None, "track": {"path": "circle", "delay": 1}},
        {"simulate": None, "track": {"path": "circle", "controller": "mpc"}},
        {"simulate": None, "track": {"path": "circle", "sensors": "encoder"}},
        {"vary": VARY | {"motor.resistance_ohm": {"factor": [0.9, 1.1]}}},
        {
            "robot": "mecanum",
            "simulate": VOLTS | {"voltage_V": [0.5, 2.0, -2.0, 1.0]},
            "vary": {"body.mass_kg": {"factor": [0.9, 1.1]}},
        },
    ],
)
def test_what_cannot_be_moved_together_is_not(tmp_path, changes):
    assert not batched(problem(tmp_path, **changes))


def test_a_number_that_no_robot_file_has_is_refused(tmp_path):
    with pytest.raises(InputError, match="coulomb"):
        batch_columns(problem(tmp_path, vary={"friction.axes.coulomb[1]": {"std": 2.0}}), 0, 64)
