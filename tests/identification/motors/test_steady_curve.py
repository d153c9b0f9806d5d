"""Motors whose steady speed is no line of their input, beside straight ones; speeds by the exact exponential."""

from dataclasses import replace

import numpy as np
import pytest

import omnidyn
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import MotorFit, MotorLine
from omnidyn.identification.motors.into_robot import motors_into_robot
from omnidyn.identification.motors.log import motor_logs
from omnidyn.identification.motors.motor_verdict import motors_verdict
from omnidyn.identification.motors.steady_curve import curves_of_logs, curves_of_points, steady_speed
from omnidyn.identification.motors.study import study_points
from omnidyn.logs.motor_table import MotorTable
from omnidyn.model.drive import Drive
from omnidyn.model.friction import Friction
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate

# A bridge that opens between its pulses: duty [%] and speed [rad/s], as reported of a real one.
DUTY, SPEED = np.array([8.0, 16.0, 27.0, 51.0, 98.0]), np.array([5.0, 14.0, 23.0, 29.0, 33.0])
SUPPLY, DT = 12.0, 0.01


def table(put_in, speed):
    return MotorTable(put_in, speed, np.zeros(len(put_in), dtype=int), "duty", "%")


def bent(duty):
    return np.sign(duty) * np.interp(100.0 * np.abs(duty), [0.0, *DUTY], [0.0, *SPEED])


def straight(duty):
    return 35.0 * np.sign(duty) * np.maximum(np.abs(duty) - 0.04, 0.0)


def log(speed_of, duty, seed=0, noise=0.1, lag=0.1, hold=150):
    """A motor that comes to speed_of(duty) with a lag, every level held."""
    rng, t = np.random.default_rng(seed), np.arange(hold) * DT
    speed, parts = 0.0, []
    for level in duty:
        parts.append(speed_of(level) + (speed - speed_of(level)) * np.exp(-t / lag))
        speed = speed_of(level) + (speed - speed_of(level)) * np.exp(-hold * DT / lag)
    w = np.concatenate(parts) + noise * rng.standard_normal(hold * len(duty))
    columns = {"duty": np.repeat(duty, hold)[:, None], "wheel_speed": w[:, None]}
    return Run(t=np.arange(len(w)) * DT, **columns, supply=np.full(len(w), SUPPLY))


def levels(seed, count=5):
    rng = np.random.default_rng(seed)
    size = rng.permutation(np.concatenate([DUTY / 100.0, rng.uniform(0.05, 1.0, count)]))
    return np.concatenate([[0.0], size * rng.choice([-1.0, 1.0], len(size))])


def codes(study):
    return {statement.code for statement in study.statements}


def test_the_reported_bridge_is_no_line_and_has_no_negative_dead_band():
    study = study_points(table(np.concatenate([DUTY, -DUTY]), np.concatenate([SPEED, -SPEED])))
    (curve,) = study.curves
    assert np.allclose(curve.level, DUTY)
    assert np.allclose(curve.speed, SPEED)
    assert codes(study) == {"speed_no_line", "start_not_seen", "sets_off_below"} & codes(study) | {"speed_no_line"}
    assert [part.code for part in study.verdict.numbers["parts"]] == ["motors_no_line"]
    assert not study.motors[0].dead_band_seen
    assert curve.straight == (0.0, 0.0)  # no three of these levels lie on a line within 2 % of the largest speed


@pytest.mark.parametrize("method", [MotorLine(), MotorFit()], ids=["line", "fit"])
def test_both_methods_tell_the_curve_of_a_log(method):
    study = identify([log(bent, levels(1))], None, method)
    assert "speed_no_line" in codes(study)
    assert "he speed of motor 1 is no line of the input" in str(study.verdict)
    assert "no dead band" not in str(study.verdict)
    assert not any(motor.dead_band_seen for motor in (*study.motors, *study.plain))
    assert all(np.isnan(start.value["offset"]) for start in study.starts)


def test_a_motor_with_a_curve_answers_to_its_input():
    study = identify([log(bent, levels(1))], None, MotorLine())
    deaf = [replace(motor, answers=False) for motor in study.study.motors]
    assert motors_verdict(deaf).code == "no_motor_answers"
    assert [part.code for part in motors_verdict(deaf, curves=study.study.curves).numbers["parts"]] == [
        "motors_no_line"
    ]


def test_the_map_is_within_five_percent_in_eight_of_ten():
    good = 0
    for seed in range(10):
        curves, _ = curves_of_logs(motor_logs([log(bent, levels(seed), seed)]))
        if curves:
            at = np.interp(DUTY, [0.0, *curves[0].level], [0.0, *curves[0].speed])
            good += bool(np.abs(at / SPEED - 1.0).max() < 0.05)
    assert good >= 8


def test_straight_drivers_get_no_map():
    """At most one in twenty: tables and logs, with noise up to a tenth of the largest speed."""
    found = 0
    for seed in range(100):
        rng = np.random.default_rng(seed)
        put_in = rng.uniform(8.0, 100.0, rng.integers(5, 20)) * rng.choice([-1.0, 1.0])
        noise = rng.choice([0.2, 1.0, 3.5]) * rng.standard_normal(len(put_in))
        found += bool(curves_of_points(table(put_in, straight(put_in / 100.0) + noise))[0])
    assert found <= 5
    logs = ([log(straight, levels(seed), seed, noise=0.3)] for seed in range(20))
    assert sum(bool(curves_of_logs(motor_logs(each))[0]) for each in logs) <= 1


def test_what_has_not_settled_is_no_point():
    t = np.arange(100) * DT
    value, std = steady_speed(t, 20.0 - 15.0 * np.exp(-t / 0.6))
    assert abs(value - 20.0) < std < 1.0
    assert steady_speed(t, 20.0 - 15.0 * np.exp(-t / 5.0))[1] > 1.0
    assert steady_speed(t, 20.0 + 0.1 * np.random.default_rng(0).standard_normal(100))[1] < 0.2
    duty = np.array([0.98, 0.51, 0.16, 0.27, 0.9, 0.4, 0.2, 0.7, 0.08])
    whole = log(bent, duty, lag=0.5, hold=300)
    short = whole.replace(t=whole.t[:-260], **{name: values[:-260] for name, values in whole.channels.items()})
    (curve,) = identify([short], None, MotorLine()).curves
    assert curve.unsettled == pytest.approx(8.0)
    assert curve.level[0] == pytest.approx(16.0)


def test_what_never_settles_is_not_tested():
    study = identify([log(bent, levels(5), lag=3.0)], None, MotorLine())
    assert not study.curves
    (note,) = [warning for warning in study.warnings if warning.code == "straightness_not_tested"]
    assert note.numbers["steady"] < 5 <= note.numbers["held"]


def test_a_line_that_misses_is_said():
    """A motor that coasts down slowly: no line of any lag, and few of its inputs come to a steady speed."""
    run = log(bent, levels(5), lag=0.1)
    speed, rows = run.wheel_speed[:, 0].copy(), np.arange(len(run))
    for k in rows[1:]:
        speed[k] = max(speed[k], speed[k - 1] - 0.05)
    study = identify([run.replace(wheel_speed=speed[:, None])], None, MotorLine())
    assert "line_misses" in {warning.code for warning in study.warnings}
    assert "no dead band" not in str(study.verdict)


def test_the_robot_file_turns_as_the_motors_did():
    """Without friction a robot that turns on the spot has the speed of its motors alone."""
    study = identify([log(bent, levels(2), noise=0.02)], None, MotorLine())
    plain = omnidyn.load_robot("axebot").replace(friction=Friction(), drive=Drive(kind="duty", dead_band=0.2))
    motor = plain.motor.replace(voltage_limit=SUPPLY)
    numbers = motors_into_robot(study, plain.replace(motor=motor))
    written = numbers.robot
    assert written.drive.dead_band == 0.0
    assert {remark.code for remark in numbers.remarks} >= {"map_written", "map_holds_friction"}
    emf = written.motor.emf_constant
    written = written.replace(motor=written.motor.replace(emf_constant=emf[0], torque_constant=emf[0]))
    for duty, speed in zip(DUTY / 100.0, SPEED, strict=True):
        run = simulate(written, duty=np.full((400, 3), duty), dt=0.05, supply=SUPPLY)
        assert run.wheel_speed[-1] == pytest.approx(speed, rel=0.05)


def test_a_map_that_not_all_motors_have_is_not_written():
    one, other = log(bent, levels(3)), log(straight, levels(3))
    both = one.replace(
        duty=np.hstack([one.duty, other.duty]), wheel_speed=np.hstack([one.wheel_speed, other.wheel_speed])
    )
    robot = omnidyn.load_robot("axebot")
    numbers = motors_into_robot(identify([both], None, MotorLine()), robot)
    assert not numbers.robot.drive.voltage_map
    assert [str(remark) for remark in numbers.remarks if "not all motors have a curve" in str(remark)]


def test_a_straight_line_takes_the_map_out():
    robot = omnidyn.load_robot("axebot").replace(drive=Drive(voltage_map=((1.0, 2.0), (5.0, 5.0))))
    numbers = motors_into_robot(identify([log(straight, levels(4))], None, MotorLine()), robot)
    assert not numbers.robot.drive.voltage_map
    assert "map_removed" in {remark.code for remark in numbers.remarks}
