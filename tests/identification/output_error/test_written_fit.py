"""Which fit is written: by free runs on held-out blocks, of logs that plain NumPy made."""

from dataclasses import replace

import numpy as np
import pytest

import omnidyn
from omnidyn import OutputError
from omnidyn.identification.output_error.linear.free_run import FreeRun
from omnidyn.identification.whole_logs import as_answered
from omnidyn.model.first_guess import first_guess
from omnidyn.model.keys import Key
from tests.support import plain_robot

PUSH = (0.8, -0.5, 0.03)


def share_of_noise(log):
    """What noise alone is of the spread of the wheel speeds: nothing predicts better."""
    return np.exp(np.log(plain_robot.NOISE / log.wheel_speed.std(axis=0)).mean())


def codes(result):
    return [warning.code for warning in result.warnings]


@pytest.fixture(scope="module")
def late(tmp_path_factory):
    """A log of a robot 20 ms late, whose file has another wheel radius and inertia."""
    folder = tmp_path_factory.mktemp("late")
    given = plain_robot.robot(folder, radius=0.0505, inertia=0.6 * plain_robot.INERTIA)
    return given, plain_robot.log(3, late_rows=1)


def test_a_latency_does_not_stand_in_for_wheel_radius_and_inertia(late):
    given, log = late
    result = omnidyn.identify(log, given, quick=True)
    assert result.value["wheels.wheel_radius_m"] == pytest.approx(plain_robot.RADIUS, rel=0.005)
    assert result.value["body.inertia_kg_m2"] == pytest.approx(plain_robot.INERTIA, rel=0.01)
    assert result.nuisances["latency.wheel_speed"].value == pytest.approx(0.02, abs=0.002)
    truths = (*plain_robot.VISCOUS, *plain_robot.COULOMB)
    for key, truth in zip(list(result.value)[:6], truths, strict=True):
        assert result.value[key] == pytest.approx(truth, rel=0.05)
    blocks = result.held_out
    assert blocks.written < 1.1 * share_of_noise(log)
    assert blocks.plain > 5.0 * blocks.written
    assert blocks.given > 5.0 * blocks.written
    assert "size_fitted" in codes(result)
    assert "late_by_rows" not in codes(result)


def test_no_wheel_is_a_tenth_of_what_its_file_says(tmp_path):
    """A robot without the forces of a turning frame, that its file has: what fits best then is no wheel."""
    wheels = plain_robot.robot(tmp_path).wheels
    guess = first_guess("new", wheels, plain_robot.MASS, 6.0, shape="axes")
    result = omnidyn.identify(plain_robot.log(5, late_rows=2, dead_band=0.5), guess, quick=True)
    assert "size_fitted" not in codes(result)
    assert "wheels.wheel_radius_m" not in result.value


def test_what_was_asked_for_by_name_is_kept_and_doubted(late):
    given, log = late
    result = omnidyn.identify(log, given, OutputError(free="friction"), quick=True)
    assert set(result.value) == {key for key in result.value if key.startswith("friction.")}
    (late_by,) = (warning for warning in result.warnings if warning.code == "late_by_rows")
    assert late_by.numbers["without"] > 1.5 * late_by.numbers["error"] > 0.0
    assert "by the best fit without it" in str(late_by)


def test_a_latency_is_said_as_the_table_has_it(late):
    """What judges a latency is a fit before its errors are weighed; what is said of it is of the answer."""
    given, log = late
    estimate = omnidyn.identify(log, given, OutputError(free="friction"), quick=True).estimate
    (late_by,) = (warning for warning in estimate.warnings if warning.code == "late_by_rows")
    name = f"latency.{late_by.subject}"
    assert late_by.numbers["latency"] == estimate.nuisances[name].value
    other = replace(estimate.nuisances[name], value=1.25 * estimate.nuisances[name].value)
    (again,) = (
        warning
        for warning in as_answered(replace(estimate, nuisances={name: other})).warnings
        if warning.code == "late_by_rows"
    )
    assert again.numbers["latency"] == other.value
    assert again.numbers["rows"] == pytest.approx(1.25 * late_by.numbers["rows"])
    none = replace(other, value=1e-3)
    assert "late_by_rows" not in {each.code for each in as_answered(replace(estimate, nuisances={name: none})).warnings}


def test_errors_that_remember_give_way_to_least_squares_that_predict_better(late):
    given, log = late
    by_default = omnidyn.identify(log, given, OutputError(nuisances=()), quick=True)
    coloured = omnidyn.identify(log, given, OutputError(nuisances=(), covariance="autoregressive"), quick=True)
    assert "white_predicts_better" in codes(by_default)
    assert by_default.held_out.written < 0.96 * coloured.held_out.written
    assert by_default.held_out.written == by_default.held_out.plain


def test_a_constant_push_is_fitted_where_it_is_there(tmp_path):
    log = plain_robot.log(5, push=PUSH)
    result = omnidyn.identify(log, plain_robot.robot(tmp_path), quick=True)
    for axis, truth in zip(("x", "y", "yaw"), PUSH, strict=True):
        found = result.nuisances[f"push.{axis}"]
        assert abs(found.value - truth) < max(4.0 * found.std, 0.02 * abs(truth))
    (force,) = (warning for warning in result.warnings if warning.code == "constant_force")
    assert "10 of 10 blocks are predicted better" in str(force)
    assert result.held_out.written < 1.1 * share_of_noise(log)
    assert result.held_out.plain > 3.0 * result.held_out.written


@pytest.mark.parametrize("dead_band", [0.2, 0.8])
def test_a_dead_band_that_the_file_does_not_hold_is_fitted_without_a_diagnosis(tmp_path, dead_band):
    """One motor differs by a ten-thousandth: the axes couple, and no engine is exact."""
    given = plain_robot.robot(tmp_path)
    given = given.replace(motor=given.motor.replace(resistance=(plain_robot.OHM,) * 2 + (1.0001 * plain_robot.OHM,)))
    result = omnidyn.identify(plain_robot.log(5, dead_band=dead_band), given, quick=True)
    found = result.nuisances["dead_band"]
    assert abs(found.value - dead_band) < 4.0 * found.std
    assert result.robot.drive.dead_band == found.value
    truths = [*plain_robot.VISCOUS, *plain_robot.COULOMB]
    for (key, value), truth in zip(result.value.items(), truths, strict=True):
        assert abs(value - truth) < 4.0 * result.std[key], key
    (warning,) = (warning for warning in result.warnings if warning.code == "driver_dead_band")
    assert f"the first {found.value:.3g} V" in str(warning)
    straight = omnidyn.identify(plain_robot.log(5), given, quick=True)
    assert "dead_band" not in straight.nuisances


def test_a_right_model_has_no_push_and_is_as_good_as_the_plain_fit(tmp_path):
    log = plain_robot.log(6)
    result = omnidyn.identify(log, plain_robot.robot(tmp_path), quick=True)
    assert not any(name.startswith(("push", "tilt")) for name in result.nuisances)
    assert result.held_out.written == pytest.approx(result.held_out.plain, rel=0.02)
    assert result.held_out.written < 1.05 * share_of_noise(log)
    assert result.held_out.given > 2.0 * result.held_out.written
    assert set(result.value) == set(
        omnidyn.identify(log, plain_robot.robot(tmp_path), OutputError(free="friction")).value
    )


def test_a_latency_that_a_log_cannot_tell_from_none_is_not_written(tmp_path, late):
    """It would split every row of a run: it is reported with its interval, and the file has none."""
    log = plain_robot.log(6)
    noise = 1.0 * np.random.default_rng(7).normal(size=log.wheel_speed.shape)
    noisy = log.replace(wheel_speed=log.wheel_speed + noise)
    result = omnidyn.identify(noisy, plain_robot.robot(tmp_path), quick=True)
    found = result.nuisances["latency.wheel_speed"]
    assert 0.0 < abs(found.value) < 2.0 * found.std
    assert result.robot.drive.latency == 0.0
    assert result.robot.log is None or not result.robot.log.latency.wheel_speed
    assert "latency_like_zero" in codes(result)
    given, late_log = late
    assert omnidyn.identify(late_log, given, quick=True).robot.drive.latency == pytest.approx(0.02, abs=0.002)


def test_a_current_that_is_read_before_its_command_is_of_the_voltage_before(tmp_path):
    """It is late by nothing that can be told from 0, and 0 is the other side of a jump: the right fit had failed."""
    log = plain_robot.log(6)
    before = np.vstack([log.voltage[:1], log.voltage[:-1]])
    emf = plain_robot.CONSTANT * plain_robot.GEAR * log.wheel_speed
    noise = 0.03 * np.random.default_rng(8).normal(size=emf.shape)
    log = log.replace(current=(before - emf) / plain_robot.OHM + noise)
    result = omnidyn.identify(log, plain_robot.robot(tmp_path), quick=True)
    assert 0.0 < result.nuisances["latency.current"].value < 1e-4
    rmse = omnidyn.compare(result.robot, log).rmse
    assert all(rmse[name] < 0.05 for name in ("i1", "i2", "i3"))


def test_no_row_after_a_start_from_rest_is_left_out(tmp_path):
    """Voltage from the first row on, 20 ms late: what was before is known, and the first rows tell the latency."""
    log, given = plain_robot.log(7, late_rows=1, still=0, levels=3, held=15), plain_robot.robot(tmp_path)
    result = omnidyn.identify(log, given, OutputError(start="rest", nuisances=("latency",)), quick=True)
    assert result.nuisances["latency.wheel_speed"].value == pytest.approx(0.02, abs=0.001)
    first = np.arange(len(log))[:, None] < 6
    early = log.replace(wheel_speed=np.where(first, log.wheel_speed + 1.0, log.wheel_speed))
    moved = omnidyn.identify(early, given, OutputError(start="rest", nuisances=("latency",)), quick=True)
    assert max(moved.noise.values()) > 3.0 * max(result.noise.values())  # rows before 0.3 s count


def test_the_robot_as_it_was_given_is_written_where_it_predicts_better(tmp_path):
    """A log of a second with much noise, of a robot whose file is right."""
    given = plain_robot.robot(tmp_path)
    for axis, (viscous, coulomb) in enumerate(zip(plain_robot.VISCOUS, plain_robot.COULOMB, strict=True)):
        given = Key.parse(f"friction.axes.viscous[{axis}]").set(given, viscous)
        given = Key.parse(f"friction.axes.coulomb[{axis}]").set(given, coulomb)
    log = plain_robot.log(0, levels=2, held=14)
    noisy = log.replace(wheel_speed=log.wheel_speed + 3.0 * np.random.default_rng(0).normal(size=log.wheel_speed.shape))
    result = omnidyn.identify(noisy, given, quick=True)
    assert "given_predicts_better" in codes(result)
    assert result.robot == given
    assert result.held_out.written == result.held_out.given


def test_one_run_is_better_by_more_than_its_blocks_scatter():
    rows, spread = np.array([100.0, 100.0]), np.array([1.0, 2.0])
    even = FreeRun(np.full((10, 2), 4.0), rows, spread)
    assert even.error == pytest.approx(np.sqrt(np.sqrt(0.4) * np.sqrt(0.4) / 2.0))
    better = FreeRun(np.full((10, 2), 3.0), rows, spread)
    assert better.improvement(even).better == 10
    assert even.improvement(better) is None
    hardly = FreeRun(np.full((10, 2), 3.8), rows, spread)
    assert hardly.improvement(even) is None  # 5 % of the squares
    before, after = np.full((10, 2), 4.0), np.full((10, 2), 4.6)
    before[3], after[3] = 40.0, 20.0
    assert FreeRun(after, rows, spread).improvement(FreeRun(before, rows, spread)) is None  # in one block of ten


def test_a_robot_that_predicts_the_tail_better_is_said_to_be_kept(tmp_path):
    """Few rows, and errors that last half the log: blocks between others look predicted by whatever follows them."""
    log, given = plain_robot.log(3, levels=16, held=20, still=10), plain_robot.robot(tmp_path)
    rng, half = np.random.default_rng(1003), len(log) // 2
    fade, errors = np.exp(-2.0 / half), rng.standard_normal((len(log), 3))
    for k in range(1, len(log)):
        errors[k] = fade * errors[k - 1] + np.sqrt(1.0 - fade**2) * errors[k]
    for axis, (viscous, coulomb) in enumerate(zip(plain_robot.VISCOUS, plain_robot.COULOMB, strict=True)):
        given = Key.parse(f"friction.axes.viscous[{axis}]").set(given, viscous)
        given = Key.parse(f"friction.axes.coulomb[{axis}]").set(given, coulomb)
    slow = log.replace(wheel_speed=log.wheel_speed + 1.5 * errors)
    first = slow.replace(t=slow.t[:half], voltage=slow.voltage[:half], wheel_speed=slow.wheel_speed[:half])
    (kept,) = (
        warning
        for warning in omnidyn.identify(first, given, quick=True).warnings
        if warning.code == "given_predicts_tail_better"
    )
    assert "keep the robot as given" in kept.with_remedy
    assert kept.numbers["blocks"] == 4
    right = plain_robot.log(3, levels=8)
    assert "given_predicts_tail_better" not in codes(omnidyn.identify(right, plain_robot.robot(tmp_path), quick=True))


def test_the_tail_is_compared_by_itself():
    rows, spread = np.array([100.0]), np.array([1.0])
    blocks, tail = np.full((10, 1), 4.0), np.full((4, 1), 4.0)
    fitted, given = FreeRun(blocks, rows, spread, tail=tail), FreeRun(1.2 * blocks, rows, spread, tail=0.5 * tail)
    assert given.improvement(fitted) is None
    assert given.tail_improvement(fitted).gain == pytest.approx(0.5)
    assert fitted.tail_improvement(given) is None
    assert FreeRun(blocks, rows, spread).tail_improvement(fitted) is None
