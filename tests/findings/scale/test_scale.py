"""Units, gears, radii, slip and lag: what is proportional but not equal, or late."""

from dataclasses import replace

import numpy as np
import pytest

from omnidyn.findings.check import check
from omnidyn.findings.signal.robust import clusters, slope
from omnidyn.logs.log import Log
from omnidyn.simulation.simulate import simulate
from omnidyn.telling.codes import remedy


def test_noise_in_both_channels_does_not_pull_a_slope_down():
    rng = np.random.default_rng(0)
    truth = np.repeat(rng.normal(size=400), 25)
    x, y = truth + 2.0 * rng.normal(size=len(truth)), 0.7 * truth + rng.normal(size=len(truth))
    plain = float(x @ y / (x @ x))
    line = slope(y, x, *clusters(len(x), 0.01))
    assert plain < 0.2  # what least squares makes of it
    assert abs(line.value - 0.7) < 4.0 * line.error
    assert line.error < 0.1


@pytest.mark.parametrize(
    "factor, unit", [(60.0 / (2.0 * np.pi), "rpm"), (180.0 / np.pi, "deg/s"), (19.0, "rad/s@motor")]
)
@pytest.mark.parametrize("without", [(), ("twist", "pose"), ("current", "voltage"), ("twist", "pose", "current")])
def test_a_wrong_unit_of_speed(log, robot, with_channels, grave, factor, unit, without):
    broken = with_channels(wheel_speed=factor * log.channels["wheel_speed"], **dict.fromkeys(without))
    verdict = check(broken, robot)
    (finding,) = verdict.of("unit")
    assert finding.numbers["mistake"][0] == unit
    assert finding.severity == "error"
    assert grave(verdict) == {"unit"}


def test_milliamperes(log, robot, with_channels):
    (finding,) = check(with_channels(current=1e3 * log.channels["current"]), robot).of("unit")
    assert finding.numbers["mistake"] == ("mA", "A")


def test_a_duty_read_as_volts(log, robot, with_channels):
    duty = log.channels["voltage"] / 6.0
    (finding,) = check(with_channels(voltage=duty, current=None, twist=None, pose=None), robot).of("unit")
    assert finding.numbers["mistake"] in (("duty", "V"), ())


@pytest.mark.parametrize("off", [0.95, 1.05, 1.3])
def test_a_wrong_gear_is_told_by_floor_and_motor_together(log, robot, with_channels, grave, off):
    verdict = check(with_channels(wheel_speed=off * log.channels["wheel_speed"]), robot)
    (finding,) = verdict.of("gear")
    assert finding.numbers["ratio"] == pytest.approx(1.0 / off, rel=0.01)
    assert grave(verdict) == {"gear"}


def test_a_wrong_wheel_radius_is_told_from_a_wrong_gear(log, robot, grave):
    small = robot.replace(wheels=robot.wheels.replace(wheel_radius=0.9 * 0.035))
    verdict = check(log, small)
    assert grave(verdict) == {"wheel_radius"}
    assert verdict.of("wheel_radius")[0].numbers["floor_ratio"] == pytest.approx(1.0 / 0.9, rel=0.01)


def test_a_wrong_robot_radius(log, robot, grave):
    verdict = check(log, robot.replace(wheels=robot.wheels.replace(robot_radius=0.08)))
    assert grave(verdict) == {"robot_radius"}
    assert verdict.of("robot_radius")[0].numbers["ratio"] == pytest.approx(0.8, rel=0.01)


def test_slip_everywhere_is_told_by_the_motors(log, robot, with_channels, grave):
    verdict = check(with_channels(twist=0.7 * log.channels["twist"], pose=None), robot)
    (finding,) = verdict.of("slip")
    assert finding.numbers["floor_ratio"] == pytest.approx(0.7, rel=0.01)
    assert grave(verdict) == {"slip"}
    # Without currents slip, radius and gear look the same, and all are named.
    alone = check(with_channels(twist=0.7 * log.channels["twist"], pose=None, current=None), robot)
    assert "it slips, or the gear ratio" in str(alone.of("path_ratio")[0])


def test_slip_in_a_stretch_with_its_rows(log, robot, with_channels, grave):
    twist = log.channels["twist"].copy()
    twist[600:1100] *= 0.9
    verdict = check(with_channels(twist=twist, pose=None), robot)
    (finding,) = verdict.of("slip")
    assert finding.numbers["ratio"] == pytest.approx(0.9, abs=0.02)
    assert finding.numbers["from_s"] == pytest.approx(6.0, abs=0.4)
    assert finding.numbers["to_s"] == pytest.approx(11.0, abs=0.4)
    assert grave(verdict) == {"slip"}


@pytest.mark.parametrize("name, rows", [("twist", 1), ("twist", 4), ("wheel_speed", 2), ("current", 1)])
def test_a_late_channel(log, robot, with_channels, name, rows):
    late = np.vstack([log.channels[name][:1]] * rows + [log.channels[name][:-rows]])
    found = check(with_channels(pose=None, **{name: late}), robot).of("lag")
    sizes = [abs(finding.numbers["rows"]) for finding in found if name in finding.subject]
    assert sizes
    assert sizes[0] == pytest.approx(rows, abs=0.25)


def test_late_poses_stay_where_they_are(log, robot, with_channels):
    late = np.vstack([log.channels["pose"][:1]] * 6 + [log.channels["pose"][:-6]])
    (finding,) = check(with_channels(pose=late, twist=None), robot).of("lag")
    assert finding.numbers["late"] == "pose"
    assert "leave it: identify fits how late poses are" in remedy(finding)


def test_half_a_row_is_a_note(log, robot, with_channels):
    # Differences of counts are the speed half a row ago.
    angle = np.cumsum(log.channels["wheel_speed"], axis=0) * 0.01
    speed = np.diff(angle, axis=0, prepend=angle[:1]) / 0.01
    mean = 0.5 * (speed + np.vstack([speed[:1], speed[:-1]]))
    found = check(with_channels(wheel_speed=mean, pose=None, current=None), robot).of("lag")
    assert [finding.severity for finding in found] == ["note"]
    assert found[0].numbers["rows"] == pytest.approx(0.5, abs=0.1)


def test_a_latency_that_is_known_is_no_lag(log, robot, with_channels):
    from omnidyn.logs.column import Column
    from omnidyn.logs.columns.mapping import ColumnMap

    late = np.vstack([log.channels["twist"][:1]] * 3 + [log.channels["twist"][:-3]])
    units = {"vx": "m/s", "vy": "m/s", "omega": "rad/s"}
    columns = {name: Column(name, unit, latency=0.03) for name, unit in units.items()}
    broken = with_channels(twist=late, pose=None)
    assert check(broken, robot).of("lag")
    assert not check(replace(broken, columns=ColumnMap(columns)), robot).of("lag")


def test_one_wheel_with_another_scale(log, robot, with_channels):
    speed = log.channels["wheel_speed"] * [1.0, 1.07, 1.0]
    (finding,) = check(with_channels(wheel_speed=speed, pose=None), robot).of("wheel_scale")
    assert finding.subject == "w2"
    assert finding.numbers["ratio"] == pytest.approx(1.07, abs=0.01)


# ---- logs without noise ---------------------------------------------------------------------------------


def exact_log(robot, voltage, rate=100.0):
    run = simulate(robot, voltage, 1.0 / rate, tol=None)
    channels = {name: getattr(run, name) for name in ("voltage", "current", "wheel_speed", "twist", "pose")}
    return Log(run.t, channels, np.arange(len(run)) + 2, source="run.csv")


@pytest.mark.parametrize("turning", [40, 100, 200])
@pytest.mark.parametrize("without", [(), ("twist",), ("current",), ("twist", "current")])
@pytest.mark.some(4)
def test_a_short_turn_of_our_own_exact_log_is_no_outlier(robot, with_channels, grave, turning, without):
    straight = [(0.0, level, -level) for level in (3, -3, 4, -4, 5, -5) for _ in range(200)]
    rows = [*straight, *[(0.0, 0.0, 0.0)] * 100, *[(5.5, 5.5, 5.5)] * turning]
    log = with_channels(exact_log(robot, np.array(rows)), **dict.fromkeys(without))
    assert grave(check(log, robot)) == set()


def test_a_slope_is_not_made_of_what_rounding_left():
    ids, count = clusters(1000, 0.01)
    x = np.full(1000, 1e-17)
    x[900:] = 3.0
    y = np.where(x > 1.0, 2.0 * x, 0.0)
    line = slope(y, x, ids, count)
    assert line.value == pytest.approx(2.0)
