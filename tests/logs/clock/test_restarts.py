"""Boards and counters that begin again within a log: a gap there, said, and right numbers on both sides."""

import numpy as np
import pytest

from omnidyn import MotorLine, check, identify, load_robot, read_log
from omnidyn.errors import InputError
from omnidyn.logs.read_log import LogOptions, recorded_log
from omnidyn.logs.segments import segments
from omnidyn.run import Run
from tests.support.cases import case
from tests.support.codes import said
from tests.support.counted import ROW, bench, counts_of, write_columns

TICKS = {"a": "ticks/2048"}
ROBOT_ASSUME = {"d": "duty/255", "a": "ticks/1440"}


@pytest.fixture(scope="module")
def motor():
    t, volts, speed = bench()
    return t, volts, counts_of(speed)


def three_wheels(tmp_path, wheels, row=1500):
    t = np.arange(3000) * 0.02
    speed = np.column_stack([np.sin(t + k) * (6.0 + k) + k for k in range(3)])
    counts = np.round(np.cumsum(speed, axis=0) * 0.02 * 2048 / (2.0 * np.pi))
    counts[row:, wheels] -= counts[row, wheels]
    head = "t_s,omega_rad_s,enc1,enc2,enc3"
    return write_columns(tmp_path / "log.csv", head, t, -speed.mean(axis=1) / 4.0, counts), speed


@pytest.mark.parametrize("wheels", [[0, 1, 2], [1]])
@pytest.mark.parametrize("robot", [None, "axebot"])
def test_counters_that_begin_again_are_a_gap_with_and_without_a_robot(tmp_path, wheels, robot):
    path, speed = three_wheels(tmp_path, wheels)
    model = load_robot(robot) if robot else None
    log = recorded_log(path, model, LogOptions(assume=TICKS))
    verdict = check(log, model)
    (finding,) = verdict.of("counter_restart")
    assert finding.severity == "warning"
    assert finding.rows == ((1502, 1502),)
    assert finding.subject == " ".join(f"a{k + 1}" for k in wheels)
    assert not verdict.of("gap")  # one cause
    run = log.to_run()
    assert len(segments(run.t)) == 2
    assert len(run) == 2996
    turned = np.ptp(np.cumsum(speed, axis=0), axis=0) * 0.02
    np.testing.assert_allclose(np.ptp(run.wheel_angle, axis=0), turned, atol=0.1)


@pytest.mark.long
def test_a_motor_is_identified_across_a_restart(tmp_path, motor):
    t, volts, counts = motor
    seen = counts.copy()
    seen[2700:] -= seen[2700]
    path = write_columns(tmp_path / "reset.csv", "t_s,voltage_V,enc", t, volts, seen)
    (found,) = identify([read_log(path, assume=TICKS)], None, MotorLine()).motors
    assert found.value["slope"] == pytest.approx(0.1, rel=2e-3)


def test_a_run_made_in_memory_is_judged_too(motor):
    t, volts, counts = motor
    angle = counts * 2.0 * np.pi / 2048
    angle[2700:] -= angle[2700]
    (finding,) = check(Run(t=t, voltage=volts[:, None], wheel_angle=angle[:, None])).of("counter_restart")
    assert finding.severity == "error"
    assert finding.rows == ((2700, 2700),)


def serial(tmp_path, cut="0.5,1", text=("Kiwi v1.2 ready",), again=True):
    """A log over a serial line: half a line, then the board starts again, with its text and its header."""
    head = "t_s,u1_V,enc1"
    count = np.cumsum(np.round(3.0 + 2.0 * np.sin(np.arange(600) / 40.0)))
    rows = [f"{0.8 + 0.02 * k:.2f},1,{count[k]:.0f}" for k in range(400)]
    later = [f"{0.6 + 0.02 * k:.2f},1,{count[k]:.0f}" for k in range(200)]
    rows.insert(137, cut)
    path = tmp_path / "serial.csv"
    path.write_text("\n".join([head, *rows, *([head] if again else []), *text, *later]) + "\n")
    return path


@pytest.mark.parametrize(
    ("text", "again"), [(("Kiwi v1.2 ready",), True), ((), True), (("boot", "ok"), False), ((), False)]
)
def test_a_board_that_restarts_makes_two_recordings(tmp_path, text, again):
    path = serial(tmp_path, text=text, again=again)
    with pytest.raises(InputError, match="leave such rows out with `skip_bad_rows`"):
        read_log(path, assume=TICKS)
    log = recorded_log(path, options=LogOptions(assume=TICKS, skip_bad_rows=True))
    verdict = check(log)
    (finding,) = verdict.of("clock_restart")
    assert "at 0.6 s after 8.78 s" in str(finding)
    assert not verdict.has_errors
    assert not verdict.of("gap")
    assert not verdict.of("counter_restart")
    run = log.to_run()
    first, second = segments(run.t)
    assert (first.stop, second.stop) == (400, 600)
    np.testing.assert_allclose(np.diff(run.t[second]), 0.02, atol=1e-9)
    assert run.wheel_angle is not None
    assert (np.diff(run.wheel_angle[:, 0]) >= 0.0).all()
    assert [len(part) for part in log.recordings()] == [400, 200]


def test_a_single_row_out_of_order_is_no_restart(tmp_path):
    t = np.arange(200) * ROW
    t[120] = 0.003
    path = write_columns(tmp_path / "log.csv", "t_s,w1_rad_s", t, t)
    with pytest.raises(InputError, match="time goes back"):
        read_log(path)


def test_a_single_time_far_from_all_others_costs_its_row(tmp_path):
    t = np.arange(200) * ROW
    t[120] = -428_000.0
    run = read_log(write_columns(tmp_path / "log.csv", "t_s,w1_rad_s", t, np.arange(200.0)))
    assert len(run) == 199
    assert float(run.t[-1]) == pytest.approx(1.99)
    assert any(
        "1 row has a time far from all others (first: -428000 s in line 122)" in words for words in said(run.warnings)
    )


def test_the_cases_of_counters_and_boards():
    log = recorded_log(case("logs/count_restart/reset.csv"), options=LogOptions(assume=TICKS))
    assert check(log).of("counter_restart")[0].rows == ((2702, 2702),)
    robot = load_robot(case("logs/counter_reset/kiwi_d.toml"))
    for model in (None, robot):
        log = recorded_log(case("logs/counter_reset/kiwi2_reset.csv"), model, LogOptions(assume=ROBOT_ASSUME))
        verdict = check(log, model)
        assert verdict.of("counter_restart")[0].subject == "a1 a2 a3"
        assert not verdict.of("slip")
    options = LogOptions(assume=ROBOT_ASSUME, skip_bad_rows=True)
    log = recorded_log(case("logs/serial_restart/kiwi2_glitch.csv"), robot, options)
    assert not check(log, robot).has_errors
    assert [len(part) for part in log.recordings()] == [1245, 1249]


@pytest.mark.long
def test_the_cases_give_the_right_motor():
    run = read_log(case("logs/count_restart/reset.csv"), assume=TICKS)
    (motor,) = identify([run], None, MotorLine()).motors
    assert motor.value["slope"] == pytest.approx(0.02, rel=1e-3)
