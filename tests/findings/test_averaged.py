"""Speeds that are means over rows are told by their noise, and a bench log of such a speed gives the true dead band."""

import numpy as np
import pytest

from omnidyn.findings.check import check
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import MotorLine
from omnidyn.identification.motors.log import averaged_statements, motor_logs
from omnidyn.identification.motors.window_fit import fit_line
from omnidyn.identification.motors.windows import motor_windows
from omnidyn.logs.log import Log
from omnidyn.logs.read_log import recorded_log
from omnidyn.logs.window_means import rows_of_mean
from omnidyn.run import Run
from tests.findings.redundant import ROBOT, recorded
from tests.support.cases import case

SLOPE, DEAD_BAND, LAG = 0.02, 0.35, 0.12  # V s/rad, V, s


def bench(seconds=60.0, dt=0.01, seed=1):
    """(t, voltage, speed) of a motor u = c sgn w + k (w + lag w'), sticking exactly, the voltage held."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds / dt)) * dt
    ramp = 6.0 * np.abs(((t / 10.0) % 2.0) - 1.0) * np.sign(np.sin(np.pi * t / 20.0 + 1e-9))
    voltage = np.where(t < 40.0, ramp, np.where((t % 4.0) < 2.0, 4.0, -2.0))
    speed, now, h = np.zeros(len(t)), 0.0, dt / 10.0
    for k in range(1, len(t)):
        for _ in range(10):
            free = now + h * (voltage[k - 1] - SLOPE * now) / (SLOPE * LAG)
            now = np.sign(free) * max(0.0, abs(free) - h * DEAD_BAND / (SLOPE * LAG))
        speed[k] = now
    return t, voltage, speed + 0.05 * rng.normal(size=len(t))


def mean(values, rows):
    return np.convolve(values, np.full(rows, 1.0 / rows))[: len(values)]


@pytest.fixture(scope="module")
def motor():
    return bench()


@pytest.mark.parametrize("rows", [4, 7, 20, 64])
def test_a_mean_over_rows_is_told_by_its_noise(motor, rows):
    assert rows_of_mean(mean(motor[2], rows)) == rows
    assert rows_of_mean(np.round(mean(motor[2], rows), 3)) == rows


def test_what_is_no_mean_is_not_called_one(motor):
    rng = np.random.default_rng(0)
    assert rows_of_mean(motor[2]) == 0
    assert rows_of_mean(np.repeat(motor[2][::8], 8)) == 0  # held for eight rows
    assert rows_of_mean(np.repeat(rng.integers(0, 2, 600), 10) + 0.0) == 0  # a command of random steps
    ripple = np.sin(0.2 * np.pi * np.arange(5000)) + 0.01 * rng.normal(size=5000)
    assert rows_of_mean(ripple) == 0
    assert rows_of_mean(np.zeros(1000)) == 0
    assert rows_of_mean(np.full(1000, np.nan)) == 0


def test_check_says_it_once():
    log = recorded(wheel_speed=lambda speed: np.column_stack([mean(each, 12) for each in speed.T]))
    above = [(finding.code, finding.subject) for finding in check(log, ROBOT).findings if finding.severity != "note"]
    assert above == [("averaged", "w1 w2 w3")]  # that it is late, too, is a consequence
    (finding,) = check(log, ROBOT).of("averaged")
    assert finding.numbers["seconds"] == pytest.approx(0.24)


def test_the_case_of_a_motor_controller():
    (finding,) = check(recorded_log(case("logs/averaged_speed/average20.csv"))).of("averaged")
    assert finding.numbers["rows"] == 20.0


@pytest.mark.parametrize("rows", [8, 20])
def test_the_dead_band_of_an_averaged_speed_is_the_true_one(motor, rows):
    t, voltage, speed = motor
    logs = motor_logs([Run(t=t, voltage=voltage[:, None], wheel_speed=mean(speed, rows)[:, None])])
    line = fit_line(motor_windows(logs), 0, "bench")
    assert line.value["dead_band"] == pytest.approx(DEAD_BAND, abs=0.005)
    assert line.value["slope"] == pytest.approx(SLOPE, rel=0.002)
    (statement,) = averaged_statements(logs)
    assert statement.numbers == {"motors": ("1",), "rows": rows, "allowed": True}


@pytest.mark.long
def test_the_study_of_motors_says_it(motor):
    t, voltage, speed = motor
    study = identify(Run(t=t, voltage=voltage[:, None], wheel_speed=mean(speed, 20)[:, None]), None, MotorLine()).study
    low, high = study.motors[0].ci95["dead_band"]
    assert low - 1e-3 < DEAD_BAND < high + 1e-3
    assert [each.numbers["rows"] for each in study.warnings if each.code == "speed_is_mean"] == [20]


def test_a_log_of_few_rows_says_nothing():
    t = np.arange(100) * 0.01
    assert not check(Log(t, {"wheel_speed": np.sin(t)[:, None]}, np.arange(100))).of("averaged")
