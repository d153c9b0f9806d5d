"""What a free run of a motor needs beside slope and lag, against logs made in small steps by a loop of its own."""

import numpy as np
import pytest

from omnidyn import MotorFit, identify, load_robot, read_log
from omnidyn.identification.motors.choice import run_motor
from omnidyn.identification.motors.fit import fit_motor
from omnidyn.identification.motors.into_robot import motors_into_robot
from tests.support.codes import codes
from tests.support.held_axis import DT, FINE, axis, run_of, stairs

TICK = 2.0 * np.pi / 2000.0  # [rad] of an encoder


def study_of(run, **how):
    return identify([run], None, MotorFit(between="hold", **how)).study


@pytest.fixture(scope="module")
def offset_run():
    put_in = stairs(0)
    return run_of(put_in, axis(put_in, offset=0.09)[1])


@pytest.fixture(scope="module")
def offset_study(offset_run):
    return study_of(offset_run)


def test_an_offset_is_found_and_told_both_ways(offset_study):
    (motor,) = offset_study.motors
    for name, true in (("slope", 0.5), ("dead_band", 0.4), ("offset", 0.09), ("lag", 0.05)):
        assert abs(motor.value[name] - true) < 4.0 * motor.std[name] + 2e-3 * true  # and what the steps are off by
    (told,) = [part for part in [motor.statement().numbers["offset"]] if part]
    assert told.code == "offset_as_friction"
    assert told.numbers["forward"] == pytest.approx(0.49, rel=0.02)
    assert told.numbers["backward"] == pytest.approx(0.31, rel=0.02)
    assert "V forward and 0.31" in str(told)


def test_held_out_blocks_are_predicted_down_to_the_noise(offset_study, offset_run):
    """The noise over the spread of the speeds; slope and lag alone are far worse."""
    blocks = offset_study.motors[0].blocks
    assert blocks.written == pytest.approx(0.02 / float(np.std(offset_run.wheel_speed)), rel=0.1)
    assert blocks.plain > 5.0 * blocks.written
    assert "motor_held_out_blocks" in codes(offset_study.statements)
    assert set(offset_study.motors[0].rejected) == {"latency"}


def test_what_does_not_improve_held_out_blocks_is_not_kept():
    put_in = stairs(1)
    (motor,) = study_of(run_of(put_in, axis(put_in, band=0.0)[1])).motors
    assert set(motor.rejected) == {"dead_band", "offset", "latency"}
    assert motor.blocks.written == pytest.approx(motor.blocks.plain)
    assert motor.rejected["dead_band"][1] < 0.05
    assert "no dead band is kept" in str(motor.statement())


def test_the_start_from_rest_counts_with_a_latency_too():
    """Half a row late, a step from rest: every row is fitted and predicted, the first ones too."""
    put_in = stairs(2)
    run = run_of(put_in, axis(put_in, late=FINE // 2)[1])
    fit = fit_motor(run, latency=True, between="hold")
    assert fit.count == len(run)
    assert np.isfinite(run_motor(fit, run)[0]).all()
    assert abs(fit.value["latency.wheel_speed"] - 0.5 * DT) < 4.0 * fit.std["latency.wheel_speed"] + DT / FINE
    assert fit.ci95["dead_band"][0] <= 0.4 <= fit.ci95["dead_band"][1]


@pytest.mark.parametrize("late", [0.0, 0.5, 1.0])
def test_the_half_row_of_encoder_differences_is_not_the_latency_of_the_drive(late):
    """A speed made of two counts is the mean over the row before it: half a row late by itself. late: rows."""
    put_in = 3.0 * stairs(7)
    count = np.floor(axis(put_in, late=int(late * FINE))[0] / TICK)
    run = run_of(put_in, np.diff(count, prepend=count[0]) * TICK / DT, noise=0.0)
    fit = fit_motor(run, latency=True, between="hold")
    assert fit.value["latency.wheel_angle"] == pytest.approx(late * DT, abs=0.03 * DT)


def test_a_latency_of_more_than_two_rows_is_a_warning():
    put_in = stairs(3, levels=20)
    late = [identify([run_of(put_in, axis(put_in, late=n)[1])], None, MotorFit(between="hold")) for n in (75, 175)]
    one_and_a_half, three_and_a_half = (codes(found.study.warnings) for found in late)
    assert "late_by_rows" in three_and_a_half
    assert "late_by_rows" not in one_and_a_half


def test_slopes_that_differ_by_direction_are_said():
    """4.49 and 6.68 V s/rad."""
    put_in = 10.0 * stairs(4)
    study = study_of(run_of(put_in, axis(put_in, slope=(4.49, 6.68), inertia=0.25)[1], noise=0.005))
    (said,) = [statement for statement in study.statements if statement.code == "slopes_differ_by_direction"]
    forward, backward = said.numbers["slopes"]
    assert forward == pytest.approx(4.49, rel=0.03)
    assert backward == pytest.approx(6.68, rel=0.03)


def test_slopes_that_are_one_are_not_said_to_differ(offset_study):
    assert "slopes_differ_by_direction" not in codes(offset_study.statements)


def test_whether_a_motor_answers_rests_on_its_speed_and_not_on_an_interval():
    put_in = stairs(5)
    speed = axis(put_in, band=0.0)[1]
    noise = np.random.default_rng(0).standard_normal(len(speed))
    deaf, loud = (
        run_of(put_in, 0.0 * speed, noise=0.5),
        run_of(put_in, speed + 3.0 * np.repeat(noise, 40)[: len(speed)]),
    )
    assert study_of(deaf).verdict.code == "no_motor_answers"
    assert study_of(loud).verdict.code == "motors_answer"


def test_an_offset_becomes_friction_unequal_by_direction_in_the_robot_file(offset_study):
    """Newtons at the rim by a volt at rest: l K_t/(R r); forward dead_band + offset, backward dead_band - offset."""
    robot = load_robot("axebot")
    numbers = motors_into_robot(offset_study, robot)
    told, motor = numbers.value, numbers.robot.motor
    push = motor.gear_ratio * np.atleast_1d(motor.torque_constant)[0]
    push = push * motor.gear_efficiency / motor.resistance / robot.wheels.wheel_radius
    forward, backward = (told[f"friction.wheels.{name}[0]"] for name in ("coulomb", "coulomb_backward"))
    assert forward == pytest.approx(0.49 * push, rel=0.02)
    assert backward == pytest.approx(0.31 * push, rel=0.02)
    assert numbers.robot.friction.wheels.backward[0] == backward


@pytest.mark.parametrize("names, unit", [("t_s,f1_N,x_m", "N"), ("t_s,u1_V,vx_m_s", "V")])
@pytest.mark.some(1)
def test_an_axis_in_metres_is_a_motor(tmp_path, names, unit):
    """Force or voltage in, position or speed out."""
    put_in = stairs(6)
    x, speed = axis(put_in, offset=0.09)
    rng = np.random.default_rng(0)
    out = (
        x + 1e-4 * rng.standard_normal(len(x)) if names.endswith("x_m") else speed + 0.02 * rng.standard_normal(len(x))
    )
    log = tmp_path / "axis.csv"
    np.savetxt(log, np.column_stack([DT * np.arange(len(x)), put_in, out]), delimiter=",", header=names, comments="")
    study = study_of(read_log(log))
    (motor,) = study.motors
    assert (motor.unit, motor.travel) == (unit, "m")
    assert motor.value["offset"] == pytest.approx(0.09, rel=0.05)
    assert f"{unit} s/m" in str(study.statements[0])
    assert study.to_dict()["motors"][0]["travel_unit"] == "m"


def test_a_line_that_a_free_run_follows_down_to_the_noise_is_no_curve():
    """Short holds, of which five only are steady: these alone looked bent."""
    put_in = stairs(276)
    run = run_of(put_in, axis(put_in, slope=(0.2805, 0.2805), band=0.2593)[1], 276, noise=0.0225)
    study = study_of(run)
    assert not study.curves
    assert study.motors[0].value["dead_band"] == pytest.approx(0.2593, abs=0.004)
