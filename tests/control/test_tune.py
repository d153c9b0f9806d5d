"""tune: it finds what a grid finds, holds it against robots it has not seen, and says what it gave up."""

from typing import Any

import numpy as np
import pytest

import omnidyn
from omnidyn.control import tune as tuning
from omnidyn.control.circumstances import Circumstances
from omnidyn.control.controllers import ControllerFile, load_controller, save_controller
from omnidyn.control.instruments import Instruments
from omnidyn.control.margins import loop_margins
from omnidyn.control.mpc.settings import POSE, Settings
from omnidyn.control.pushes import push_force, pushes
from omnidyn.errors import InputError
from omnidyn.model.log_effects import Sensors
from omnidyn.model.robot import Prior
from omnidyn.model.robot_file import load_robot

AXEBOT = load_robot("axebot")
KNOWN = AXEBOT.replace(
    priors={f"friction.axes.coulomb[{k}]": Prior(std=0.2 * c) for k, c in enumerate(AXEBOT.friction.axes.coulomb)}
)
QUICK = {"duration": 1.4, "draws": 2, "evaluations": 4, "noise": 0.02}
SLOW = "zigzag"


def test_a_search_finds_what_a_grid_finds():
    """Two settings, a cost in closed form: the best of a fine grid is no better than 10 % of it."""

    def cost(gains: Any) -> float:
        a, b = gains["a"], gains["b"][0]
        return 1.0 + np.log(a / 5.0) ** 2 + np.log(b / 0.02) ** 2 + 0.3 * np.log(a / 5.0) * np.log(b / 0.02)

    start = {"a": 1.0, "b": (0.1, 0.2)}
    found: Any = tuning._search(start, {"a": (0.1, 50.0), "b": (0.0, 1e9)}, cost, 60)
    assert cost(found) < 1.1
    assert found["b"][1] == pytest.approx(2.0 * found["b"][0])
    grid = [cost({"a": a, "b": (b,)}) for a in np.geomspace(0.1, 50.0, 60) for b in np.geomspace(0.001, 1.0, 60)]
    assert cost(found) < 1.1 * min(grid)


def test_a_search_keeps_to_bounds_and_stays_near():
    def cost(gains: Any) -> float:
        return 1.0 / gains["n"] + 1.0 / gains["w"]

    assert tuning._search({"n": 20, "w": 1.0}, {"n": (10, 60), "w": (0.0, 1e9)}, cost, 50) == {"n": 60, "w": 16.0}


def test_over_the_robots_that_may_be_meant(tmp_path):
    said = []
    found = omnidyn.tune(KNOWN, ["eight", SLOW], "speed", progress=said.append, **QUICK)
    assert (found.draws, found.uncertain) == (2, True)
    assert found.after.cost <= found.before.cost
    assert found.evaluations == len(said) <= 4
    words = " ".join(str(found).split())
    assert "over 2 robots drawn from the std" in words
    assert "which the search has not seen" in words
    assert "given up: " in words
    save_controller(found.controller, tmp_path / "own.toml")
    assert load_controller(tmp_path / "own.toml") == found.controller
    again = omnidyn.tune(KNOWN, ["eight", SLOW], "speed", **QUICK)
    assert again.gains == found.gains


def test_a_bad_start_is_left_and_by_how_much_is_said(tmp_path):
    """From a pid a tenth as fast as it may be: better on paths, pushes and noise of which the search knew nothing."""
    (tmp_path / "slow.toml").write_text('schema = 1\ncontroller = "pid"\n[options]\nfaster = 0.3\n', "utf-8")
    found = omnidyn.tune(AXEBOT, None, str(tmp_path / "slow.toml"), draws=1, evaluations=5, duration=2.0)
    assert found.better
    assert found.after.cost < 0.7 * found.before.cost
    assert not set(found.paths) & set(found.judged_on)
    assert found.verdict.code == "gains_tuned"
    assert f"{1e3 * found.before.mean:.3g} mm and {1e3 * found.before.heading:.3g} mrad before" in str(found.verdict)
    assert found.uncertain is False
    slow, tuned = (
        omnidyn.track(AXEBOT, "circle:turn_rad_s=1", ControllerFile("pid", options), noise=0.005, duration=4.0)
        for options in (found.start, found.gains)
    )
    assert tuned.rmse_position < 0.8 * slow.rmse_position


def test_settings_that_win_are_kept_and_that_is_said(monkeypatch):
    """A search that returns what is worse elsewhere: the start stays, with the figures of both."""
    monkeypatch.setattr(tuning, "_search", lambda start, bounds, cost, count: {**start, "faster": 0.1})
    found = omnidyn.tune(AXEBOT, SLOW, "pid", **QUICK)
    assert not found.better
    assert found.gains == found.start == {"faster": 3.0, "integral": 0.25}
    assert found.verdict.code == "gains_kept"
    assert found.tried.cost > found.before.cost == found.after.cost
    words = str(found.verdict)
    assert f"began with: {1e3 * found.before.mean:.3g} mm and" in words
    assert f"tried is {1e3 * found.tried.mean:.3g} mm and" in words


def test_an_mpc_begins_with_what_follows_from_its_robot_and_its_sensors():
    found = omnidyn.tune(
        AXEBOT, SLOW, "mpc", duration=1.5, draws=1, evaluations=3, sensors="encoder:2048,pose:60Hz,40ms"
    )
    assert found.sensors == "encoder:2048,pose:60Hz,40ms"
    assert found.start["pose"] == POSE
    assert found.start["horizon"] == 20
    assert found.start["pose_noise"] == (1e-3, 1e-3, 2e-3) != Settings().of(AXEBOT, 0.02).pose_noise
    assert set(found.gains) == set(tuning.TUNED["mpc"])


def test_pushes_come_and_go_and_are_those_of_their_seed():
    force = np.array([2.0, 3.0, 0.1])
    push, same, other = (pushes(force, 6.0, np.random.default_rng(seed)) for seed in (1, 1, 2))
    t = np.arange(0.0, 6.0, 0.02)
    wrenches = np.array([push(x) for x in t])
    assert np.array_equal(wrenches, [same(x) for x in t])
    assert not np.array_equal(wrenches, [other(x) for x in t])
    assert (np.abs(wrenches) <= 3.0 * force).all()
    assert 0.1 < wrenches.any(axis=1).mean() < 0.7
    np.testing.assert_allclose(
        push_force(AXEBOT), np.maximum(AXEBOT.friction.axes.coulomb, 0.5 * np.array([1.5, 1.5, 0.025]))
    )


def test_paths_are_as_fast_as_a_robot_can():
    weak = AXEBOT.replace(motor=AXEBOT.motor.replace(voltage_limit=2.5))
    assert tuning._paths(AXEBOT)[0][0].name.startswith("eight:period_s=6,")
    assert tuning._paths(weak)[0][0].name.startswith("eight:period_s=24,")
    assert omnidyn.path_demand(weak, tuning._paths(weak)[0][0]).follows


def test_it_begins_where_a_file_says(tmp_path):
    (tmp_path / "own.toml").write_text(
        'schema = 1\ncontroller = "pid"\n[options]\nfaster = 1.25\nfriction = false\n', encoding="utf-8"
    )
    found = omnidyn.tune(AXEBOT, SLOW, str(tmp_path / "own.toml"), **{**QUICK, "evaluations": 2})
    assert found.start == {"faster": 1.25, "integral": 0.25}
    assert found.controller.options["friction"] is False


@pytest.mark.parametrize(
    "options, words",
    [
        ({"controller": "feedforward"}, "has no gains; got feedforward; expected pid or speed"),
        ({"draws": 0}, "draws: out of range; got 0"),
        ({"evaluations": 1.5}, "evaluations: out of range"),
        ({"path": []}, "nothing to follow"),
        ({"path": ["eigt"]}, "did you mean eight"),
    ],
)
def test_what_cannot_be_tuned_is_refused(options, words):
    with pytest.raises(InputError, match=words):
        omnidyn.tune(AXEBOT, **{"path": "eight", **options})


def test_settings_without_a_delay_margin_are_left(tmp_path):
    """An observer that takes all at once: 5 ms that nobody knows of, and the loop swings. Nothing found is so."""
    bold = tmp_path / "bold.toml"
    bold.write_text(
        'schema = 1\ncontroller = "mpc"\n[options]\npush_walk = [8.0, 8.0, 25.0]\nvolts = 1e-5\n'
        "pose = [3e4, 3e4, 3e3]\n",
        "utf-8",
    )
    robot = AXEBOT.replace(sensors=Sensors(twist="mean", encoder_counts=4096))
    control = load_controller(bold).make(robot)
    around = Circumstances(sensors=Instruments(robot.sensor_model, odometry=True))
    assert loop_margins(robot, control, around).delay < tuning.LEAST_DELAY
    found = omnidyn.tune(robot, ["eight", SLOW], str(bold), draws=2, evaluations=8, duration=2.0)
    assert found.margins.delay >= tuning.LEAST_DELAY
    assert "before the loop no longer settles" in " ".join(str(found).split())


def test_robots_of_the_search_are_late_early_and_measured_worse():
    kit = Instruments(Sensors(twist="mean", encoder_counts=2048, pose_rate_Hz=30.0, pose_noise_m=1e-3))
    late, early, same = tuning._variants([AXEBOT.replace(drive=AXEBOT.drive.replace(latency=0.02))] * 3, kit)
    assert [round(variant.plant.drive.latency, 6) for variant in (late, early, same)] == [0.03, 0.01, 0.02]
    assert late.kit == same.kit == kit
    worse = early.kit.sensors
    assert (worse.encoder_counts, worse.pose_rate, worse.pose_noise) == (1024, 15.0, 2e-3)
