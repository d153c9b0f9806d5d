"""Fits to positions, to logs that hold the same thing twice, and on floors that are not level."""

import numpy as np
import pytest

from omnidyn.errors import InputError
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.model.log_effects import LogEffects
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import NOISE, TRUTH, voltages
from tests.support.codes import codes

PUSHED = np.array([1.5 * 9.81 * np.sin(np.radians(1.0)), -0.1, 0.004])  # [N, N, N m]


@pytest.fixture(scope="module")
def clean(axebot):
    voltage = voltages(np.random.default_rng(21))
    return simulate(axebot, voltage, 0.01, pose=[1.0, -2.0, 0.5])


def holds(fit, many=4.5):
    return all(abs(fit.value[key] - true) <= many * fit.std[key] for key, true in TRUTH.items())


def captured(run, seed, **channels):
    """Its pose as motion capture has it: noise of 2 mm and 5 mrad that knows nothing of the rows before."""
    noise = np.random.default_rng(seed).normal(size=run.pose.shape) * [0.002, 0.002, 0.005]
    return Run(t=run.t, voltage=run.voltage, pose=run.pose + noise, **channels)


def test_a_pose_alone(axebot, clean):
    fit = identify(captured(clean, 1), axebot, OutputError(nuisances=())).estimate
    assert holds(fit)
    assert list(fit.noise) == ["heading[0]", "position[0]", "position[1]"]
    assert list(fit.noise.values()) == pytest.approx([0.005, 0.002, 0.002], rel=0.05)
    assert fit.covariance == "white"


def test_a_pose_beside_the_twist_narrows_the_intervals(axebot, clean):
    twist = clean.twist + np.random.default_rng(2).normal(size=clean.twist.shape) * NOISE
    both = identify(captured(clean, 3, twist=twist), axebot, OutputError(nuisances=())).estimate
    plain = identify(Run(t=clean.t, voltage=clean.voltage, twist=twist), axebot, OutputError(nuisances=())).estimate
    assert holds(both)
    assert len(both.noise) == 6
    assert all(both.std[key] < 0.7 * std for key, std in plain.std.items())


def test_a_position_without_heading_finds_where_the_robot_faced(axebot, clean):
    log = captured(clean, 4)
    pose = log.pose.copy()
    pose[:, 2] = np.nan
    fit = identify(log.replace(pose=pose), axebot, OutputError(nuisances=("latency",))).estimate
    assert holds(fit)
    assert list(fit.nuisances) == ["latency.position"]
    assert list(fit.noise) == ["position[0]", "position[1]"]


@pytest.mark.parametrize("hold", ["before", "mean"])
def test_odometry_that_is_the_integral_of_its_twist_is_left_out(axebot, clean, hold):
    """Euler's rule from row to row, as firmware does it, from noisy twists."""
    twist = clean.twist + np.random.default_rng(5).normal(size=clean.twist.shape) * NOISE
    rate = twist[:-1] if hold == "before" else 0.5 * (twist[1:] + twist[:-1])
    heading = 0.5 + np.concatenate([[0.0], np.cumsum(rate[:, 2] * 0.01)])
    east = np.cos(heading[:-1]) * rate[:, 0] - np.sin(heading[:-1]) * rate[:, 1]
    north = np.sin(heading[:-1]) * rate[:, 0] + np.cos(heading[:-1]) * rate[:, 1]
    path = np.vstack([[0.0, 0.0], np.cumsum(np.column_stack([east, north]) * 0.01, axis=0)])
    log = Run(t=clean.t, voltage=clean.voltage, twist=twist, pose=np.round(np.column_stack([path, heading]), 5))
    fit = identify(log, axebot, OutputError(nuisances=())).estimate
    assert list(fit.noise) == ["twist[0]", "twist[1]", "twist[2]"]
    assert codes(fit.warnings).count("nothing_new") == 2
    asked = identify(log, axebot, OutputError(nuisances=(), outputs=["twist", "pose"])).estimate
    assert len(asked.noise) == 6
    assert "same_data_twice" in codes(asked.warnings)


def test_an_unknown_output_is_refused(axebot, clean):
    with pytest.raises(InputError, match="no such output"):
        identify(captured(clean, 1), axebot, OutputError(outputs=["place"]))


def pushed(robot, voltage, force, dt=0.01, **more):
    """simulate with a push on the body: the volts that push as hard are added, the log does not hold them."""
    mass = np.array([robot.body.mass, robot.body.mass, robot.body.inertia])
    from omnidyn.model.dynamics import state_space

    wide = robot.replace(motor=robot.motor.replace(voltage_limit=100.0))
    run = simulate(wide, voltage + np.linalg.solve(state_space(robot).B, force / mass), dt, **more)
    return run.replace(voltage=np.vstack([voltage, voltage[-1:]]))


def test_a_push_is_found_and_friction_with_it(axebot, clean):
    run = pushed(axebot, clean.voltage[:-1], PUSHED)
    log = Run(
        t=run.t, voltage=run.voltage, twist=run.twist + np.random.default_rng(6).normal(size=run.twist.shape) * NOISE
    )
    fit = identify(log, axebot, OutputError(nuisances=("push",))).estimate
    assert holds(fit)
    for axis, true in zip(("x", "y", "yaw"), PUSHED, strict=True):
        own = fit.nuisances[f"push.{axis}"]
        assert abs(own.value - true) <= 4.5 * own.std
        assert own.unit == ("N m" if axis == "yaw" else "N")
    assert fit.nuisances["push.x"].value > 10.0 * fit.nuisances["push.x"].std
    again = simulate(
        fit.robot.replace(motor=fit.robot.motor.replace(voltage_limit=100.0)), log.voltage[:-1], 0.01, log=fit.robot.log
    )
    assert np.sqrt(np.mean((again.twist - run.twist) ** 2, axis=0)) == pytest.approx(np.zeros(3), abs=0.005)


SLOPE = (0.26, -0.35)  # [N] along x and y of the room: 1.7 degrees


def on_a_slope(robot, clean, seed):
    """A log of speeds and heading of a robot that turns on a slope."""
    run = simulate(robot, clean.voltage[:-1], 0.01, log=LogEffects(tilt=SLOPE))
    rng = np.random.default_rng(seed)
    pose = np.full_like(run.pose, np.nan)
    pose[:, 2] = run.pose[:, 2] + 0.002 * rng.normal(size=len(run))
    twist = run.twist + rng.normal(size=run.twist.shape) * NOISE
    return run, Run(t=run.t, voltage=run.voltage, twist=twist, pose=pose, source="on a slope")


@pytest.mark.parametrize("heading", [True, False], ids=["heading logged", "speeds alone"])
def test_a_slope_is_found_and_friction_with_it(axebot, clean, heading):
    run, log = on_a_slope(axebot, clean, 6)
    assert np.ptp(run.pose[:, 2]) > 2.0  # it turns
    fit = identify(log if heading else log.replace(pose=None), axebot, OutputError(nuisances=("tilt",))).estimate
    assert holds(fit)
    for axis, true in zip("xy", SLOPE, strict=True):
        own = fit.nuisances[f"tilt.{axis}"]
        assert abs(own.value - true) <= 4.0 * own.std
        assert own.unit == "N"
        assert abs(own.value) > 10.0 * own.std
    again = simulate(fit.robot, log.voltage[:-1], 0.01, log=fit.robot.log)
    assert np.sqrt(np.mean((again.twist - run.twist) ** 2, axis=0)) == pytest.approx(np.zeros(3), abs=0.005)


def test_the_diagnosis_names_a_slope_of_a_robot_that_turns(axebot, clean):
    _, log = on_a_slope(axebot, clean, 7)
    fit = identify(log, axebot, OutputError(nuisances=())).estimate
    assert fit.lack_of_fit is not None
    first = fit.lack_of_fit.remedies[0]
    assert (first.key, first.same_as) == ("tilt", ())
    assert "floor that is not level" in str(fit.lack_of_fit.statement())
    by_default = identify(log, axebot, OutputError(), quick=True)  # where it predicts better, it is fitted
    assert {"tilt.x", "tilt.y"} <= set(by_default.nuisances)
    assert "constant_force" in codes(by_default.warnings)


@pytest.mark.long
def test_the_diagnosis_names_a_push_in_the_body(axebot, clean):
    run = pushed(axebot, clean.voltage[:-1], PUSHED * [1.0, 0.0, 0.0])
    log = Run(
        t=run.t, voltage=run.voltage, twist=run.twist + np.random.default_rng(7).normal(size=run.twist.shape) * NOISE
    )
    fit = identify(log, axebot, OutputError(nuisances=())).estimate
    assert fit.lack_of_fit is not None
    first = fit.lack_of_fit.remedies[0]
    assert "push" in {first.key, *first.same_as}
    assert "constant push in the body" in str(fit.lack_of_fit.statement())
    assert "push.x" in identify(log, axebot, OutputError(), quick=True).nuisances
    level = Run(t=clean.t, voltage=clean.voltage, twist=clean.twist + (log.twist - run.twist))
    assert not identify(level, axebot, OutputError()).lack_of_fit.remedies


def test_an_axis_that_is_none_is_refused(axebot, clean):
    with pytest.raises(InputError, match="no such axis"):
        identify(captured(clean, 1), axebot, OutputError(nuisances=("tilt.yaw",)))
    with pytest.raises(InputError, match="no such axis"):
        identify(captured(clean, 1), axebot, OutputError(nuisances=("push.z",)))


def test_the_noise_of_a_student_t_fit_is_a_standard_deviation(axebot, clean):
    """Of the Gaussian noise: 2 % outliers change it by less than what they add to the plain one."""
    rng = np.random.default_rng(8)
    noise = rng.normal(size=clean.twist.shape) * NOISE
    fit = identify(
        Run(t=clean.t, voltage=clean.voltage, twist=clean.twist + noise),
        axebot,
        OutputError(nuisances=(), loss="student-t"),
    ).estimate
    assert list(fit.noise.values()) == pytest.approx(list(NOISE), rel=0.04)
    noise += 1.0 * rng.normal(size=noise.shape) * (rng.random(noise.shape) < 0.02)
    wild = identify(
        Run(t=clean.t, voltage=clean.voltage, twist=clean.twist + noise),
        axebot,
        OutputError(nuisances=(), loss="student-t"),
    ).estimate
    assert list(wild.noise.values()) == pytest.approx(list(NOISE), rel=0.1)


def test_what_a_log_holds_and_a_fit_does_not_use_is_listed_with_the_reason(axebot, clean):
    """By default nothing is left out, on a robot of either engine."""
    for robot in (axebot, axebot.replace(body=axebot.body.replace(rotating_frame=True))):
        log = captured(clean, 9, twist=clean.twist + np.random.default_rng(9).normal(size=clean.twist.shape) * NOISE)
        log = Run(**{"t": log.t[:300]} | {name: values[:300] for name, values in log.channels.items()})
        log = log.replace(wheel_angle=np.floor(np.cumsum(clean.wheel_speed[:300], axis=0) * 0.01 / 1e-3) * 1e-3)
        whole = identify(log, robot, OutputError(nuisances=())).estimate
        assert whole.unused == ()
        assert {name.partition("[")[0] for name in whole.noise} == {"twist", "heading", "position", "wheel_angle"}
    asked = identify(
        log.replace(twist_command=log.twist), axebot, OutputError(outputs=["twist"], nuisances=())
    ).estimate
    assert (*map(str, asked.unused),) == (
        "twist_command: the voltage that reached the motors drives the model",
        "heading: not among the outputs asked for",
        "position: not among the outputs asked for",
        "wheel_angle: not among the outputs asked for",
    )
    assert "not used: heading: not among the outputs asked for" in asked.summary()
    assert asked.to_dict()["unused"] == [each.to_dict() for each in asked.unused]
    both = identify(
        [log, log.replace(pose=None, source="bare")], axebot, OutputError(outputs=["twist"], nuisances=())
    ).estimate
    assert "heading: not among the outputs asked for (1 of 2 logs, such as a log)" in [*map(str, both.unused)]


def test_an_interval_over_many_powers_of_ten_is_none(axebot):
    """Yaw is driven hardly beyond its friction: what little moves drowns in noise, and says nothing of the inertia."""
    voltage = np.tile([0.0, -4.0, 4.0], (400, 1)) + np.where(np.arange(400) % 100 < 20, 0.18, 0.0)[:, None]
    run = simulate(axebot, voltage, 0.01)
    assert 0.0 < np.abs(run.twist[:, 2]).max() < 0.1
    twist = run.twist + np.random.default_rng(1).normal(size=run.twist.shape) * [0.01, 0.01, 0.2]
    free = ["friction.axes.coulomb[0]", "body.inertia_kg_m2"]
    fit = identify(
        Run(t=run.t, voltage=run.voltage, twist=twist), axebot, OutputError(free=free, nuisances=(), start="rest")
    ).estimate
    print(fit.summary())
    assert fit.unidentifiable == ("body.inertia_kg_m2",)
    assert np.isfinite(fit.std["friction.axes.coulomb[0]"])
