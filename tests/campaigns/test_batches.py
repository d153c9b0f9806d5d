"""Samples that are moved together give what one after the other give, wherever a shard is cut."""

import numpy as np
import pytest

from omnidyn.campaigns import batches
from omnidyn.campaigns.batches import batch_columns, batched
from omnidyn.campaigns.spec import parse_spec
from omnidyn.campaigns.tasks import SIMULATE_METRICS, TRACK_METRICS, LoadedSpec
from omnidyn.errors import InputError
from omnidyn.model.robot_file import load_robot, robot_to_toml, save_robot

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
    made = LoadedSpec(parse_spec(SPEC | changes), tmp_path)
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


def late_robot(tmp_path, latency):
    robot = load_robot("axebot")
    save_robot(robot.replace(drive=robot.drive.replace(latency=latency)), tmp_path / "late.toml")
    return str(tmp_path / "late.toml")


def test_a_latency_moves_together_too(tmp_path):
    made = problem(tmp_path, robot=late_robot(tmp_path, 0.0132))
    assert batched(made)
    columns, rows = batch_columns(made, 3, 9), [made.measure(sample) for sample in made.samples(3, 9)]
    for name, column in columns.items():
        assert column == pytest.approx([row[name] for row in rows], rel=1e-10, abs=1e-12, nan_ok=True), name


@pytest.mark.parametrize(
    "controller, noise, latency",
    [
        ("pid", 0.0, 0.0),
        ("pid", 0.01, 0.0),
        ("pid", 0.1, 0.0),
        ("pid_no_friction", 0.0, 0.0),
        ("pid", 0.01, 13e-6),
        ("pid", 0.01, 0.033),
    ],
)
def test_loops_together_are_those_of_track(tmp_path, controller, noise, latency):
    """An eight so fast that voltages meet their limit; noise so large that poses are doubted."""
    task = {"path": "eight:period_s=3.5", "controller": controller, "duration_s": 1.2, "noise_m_s": noise}
    made = problem(tmp_path, robot=late_robot(tmp_path, latency), simulate=None, track=task, samples=12)
    assert batched(made)
    columns = batch_columns(made, 2, 9)
    assert tuple(columns) == TRACK_METRICS
    assert columns["saturated_share"].max() > 0.0
    rows = [made.measure(sample) for sample in made.samples(2, 9)]
    for name, column in columns.items():
        assert column == pytest.approx([row[name] for row in rows], rel=1e-7, abs=1e-9, nan_ok=True), name


MECANUM = load_robot("mecanum")
NONE = {"viscous": (0.0, 0.0, 0.0), "coulomb": (0.0, 0.0, 0.0)}
HOLDS = {"viscous": (0.5, 0.5, 0.01), "coulomb": (1.0, 1.0, 0.05), "breakaway": (2.0, 2.0, 0.1)}
DISC = {"coulomb": (1.8, 1.8), "viscous": 0.9, "yaw_coulomb": 0.1}
BODY = {"body.mass_kg": {"factor": [0.8, 1.2]}, "friction": {"factor": [0.5, 1.5]}}
MOTOR = BODY | {"motor.resistance_ohm": {"factor": [0.8, 1.2]}, "motor.voltage_limit_V": {"factor": [0.4, 1.0]}}


@pytest.mark.parametrize(
    "friction, vary, engine, near",
    [
        ({}, BODY, "fixed step", 1e-5),
        ({}, MOTOR, "fixed step", 1e-5),
        ({"direction": DISC, "axes": NONE}, BODY, "fixed step", 1e-5),
        ({"wheels": {"coulomb": 0.6, "viscous": 0.2}, "axes": NONE}, BODY, "tol", 1e-8),
        ({"axes": HOLDS}, MOTOR, "tol", 1e-8),
    ],
)
def test_loops_of_other_robots_are_those_of_track(tmp_path, friction, vary, engine, near):
    """Distances to 1e-5 m where steps are fixed; `track` takes the steps that its tolerance needs."""
    save_robot(MECANUM.replace(friction=friction or MECANUM.friction), tmp_path / "mine.toml")
    task = {"path": "eight:period_s=4", "duration_s": 1.0, "noise_m_s": 0.002}
    made = problem(tmp_path, robot=str(tmp_path / "mine.toml"), simulate=None, track=task, samples=6, vary=vary)
    assert batched(made)
    moving, _ = batches._moving(batches._fleet(made, 0, 6), 0.02, np.zeros(3))
    assert all(engine in name for name in moving.engines)
    columns = batch_columns(made, 0, 6)
    rows = [made.measure(sample) for sample in made.samples(0, 6)]
    scale = {"effort_V": 1e2, "restlessness_V": 1e3, "energy_J": 1e3, "rmse_heading_rad": 10.0}
    for name, column in columns.items():
        bound = 0.021 if name == "settling_s" else near * scale.get(name, 1.0)
        assert column == pytest.approx([row[name] for row in rows], rel=1e-9, abs=bound, nan_ok=True), name


def test_loops_of_robots_that_are_drawn_are_those_of_track(tmp_path):
    text = robot_to_toml(load_robot("axebot")).replace("mass_kg = 1.5", "mass_kg = { value = 1.5, std = 0.1 }")
    (tmp_path / "mine.toml").write_text(text)
    task = {"path": "circle", "duration_s": 0.4}
    drawn = {"robot": str(tmp_path / "mine.toml"), "robot_draws": True, "vary": {}, "samples": 30}
    made = problem(tmp_path, simulate=None, track=task, **drawn)
    assert batched(made)
    column = batch_columns(made, 3, 9)["worst_position_m"]
    assert column == pytest.approx(
        [made.measure(sample)["worst_position_m"] for sample in made.samples(3, 9)], rel=1e-9
    )


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
        {"simulate": None, "track": {"path": "circle"}, "vary": VARY | {"path.radius_m": {"range": [0.5, 1.0]}}},
        {"simulate": None, "track": {"path": "circle"}, "vary": {"drive.latency_s": {"range": [0.0, 0.1]}}},
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
