"""Rows 13, 14 and 17 to 29 of BAD_INPUTS: logs that can be read, and would hurt whoever trusts them.

Where a row is tested at more depth: 13, 14, 17, 20 test_read_log.py; 19 test_guess.py, check/test_time_base.py;
18 check/test_time_base.py, comparison/test_replay.py; 21 check/test_time_base.py; 22-26 check/test_scale.py,
check/test_values.py, check/test_wiring.py; 27, 28 check/test_motion.py; 29 benchmarks/logs/check.py.
"""

import numpy as np
import pytest

from omnidyn import SteadyState, check, identify, load_robot, read_log, simulate, write_run
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.logs.read_log import LogOptions, recorded_log
from omnidyn.logs.segments import segments

ROBOT = load_robot("axebot")
DT = 0.01


@pytest.fixture(scope="module")
def run():
    """A drive with every axis in it, and noise from a fixed seed."""
    rng = np.random.default_rng(11)
    levels = rng.uniform(-5.0, 5.0, (30, 3)).repeat(60, axis=0)
    run = simulate(ROBOT, levels, DT)
    noise = {"current": 0.02, "wheel_speed": 0.1, "twist": np.array([0.01, 0.01, 0.05])}
    return run.replace(**{name: getattr(run, name) + rng.normal(size=(len(run), 3)) * s for name, s in noise.items()})


def log_of(run, tmp_path, **options):
    return recorded_log(write_run(run, tmp_path / "run.csv"), ROBOT, LogOptions(**options))


def text_of(run, tmp_path):
    return write_run(run, tmp_path / "run.csv").read_text().splitlines()


def fault(verdict, code):
    """The words of the one finding of this kind."""
    (finding,) = verdict.of(code)
    return f"{finding.severity} {finding.subject}: {finding}"


def test_a_clean_log_has_nothing_to_heed(run, tmp_path):
    verdict = check(log_of(run, tmp_path), ROBOT)
    assert verdict.counts["error"] == verdict.counts["warning"] == 0


def test_13_blank_cells_are_aligned_and_counted(run, tmp_path):
    lines = text_of(run, tmp_path)
    for k in range(2, len(lines)):
        if k % 3:
            cells = lines[k].split(",")
            cells[1] = ""
            lines[k] = ",".join(cells)
    (tmp_path / "sparse.csv").write_text("\n".join(lines))
    read = read_log(tmp_path / "sparse.csv")
    assert next(warning for warning in read.warnings if warning.code == "on_change").subject == "u1"


def test_14_too_many_missing_rows_are_refused(run, tmp_path):
    lines = text_of(run, tmp_path)
    width = lines[0].count(",")
    lines[1::4] = ["nan" + ",nan" * width] * len(lines[1::4])
    (tmp_path / "holes.csv").write_text("\n".join(lines))
    with pytest.raises(InputError, match=r"rows hold no time or no number; got first in line 2; expected at most 20%"):
        read_log(tmp_path / "holes.csv")


def test_17_time_that_goes_back_is_refused(run, tmp_path):
    lines = text_of(run, tmp_path)
    lines[50], lines[51] = lines[51], lines[50]
    (tmp_path / "back.csv").write_text("\n".join(lines))
    with pytest.raises(InputError, match=r"back.csv:52: time goes back; .* use `sort`"):
        read_log(tmp_path / "back.csv")
    assert check(recorded_log(tmp_path / "back.csv"), ROBOT).has_errors


def test_18_a_gap_splits_the_log(run):
    t = np.concatenate([run.t[:500], run.t[500:] + 0.5])
    assert segments(t) == [slice(0, 500), slice(500, len(t))]
    assert segments(run.t) == [slice(0, len(run))]


def test_19_a_time_that_may_be_two_units_is_refused(tmp_path):
    (tmp_path / "t.csv").write_text("t,w1_rad_s\n0,1\n0.5,1\n1,1\n1.5,1\n")
    with pytest.raises(InputError, match=r"cannot tell the time of the rows: .*t=t:s.* or .*t=t:ms"):
        read_log(tmp_path / "t.csv")


def test_20_time_that_stands_still_is_refused(tmp_path):
    (tmp_path / "t.csv").write_text("t_s,w1_rad_s\n7,1\n7,2\n7,3\n")
    with pytest.raises(InputError, match=r"time stands still; got t = 7 s in all 3 rows"):
        read_log(tmp_path / "t.csv")


def test_21_an_irregular_rate_is_said(run, tmp_path):
    rng = np.random.default_rng(5)
    log = log_of(run, tmp_path)
    shaken = log.rows(np.sort(rng.choice(len(log), len(log) // 2, replace=False)))
    assert check(shaken, ROBOT).of("jitter")


def test_22_rpm_read_as_rad_s_is_found(run, tmp_path):
    rpm = run.replace(wheel_speed=run.wheel_speed * 60.0 / (2.0 * np.pi))
    words = fault(check(log_of(rpm, tmp_path), ROBOT), "unit")
    assert "error" in words
    assert "rpm" in words


def test_23_milliamperes_and_unsigned_currents_are_found(run, tmp_path):
    assert "mA" in fault(check(log_of(run.replace(current=run.current * 1e3), tmp_path), ROBOT), "unit")
    (tmp_path / "run.csv").unlink()
    unsigned = log_of(run.replace(current=np.abs(run.current)), tmp_path)
    assert "error" in fault(check(unsigned, ROBOT), "unsigned")


def test_24_a_duty_given_as_voltage_is_found(run, tmp_path):
    assert "duty" in fault(check(log_of(run.replace(voltage=run.voltage / 6.0), tmp_path), ROBOT), "unit")


def test_25_a_battery_that_sags_is_said(run, tmp_path):
    load = np.abs(run.current).sum(axis=1)
    supply = 12.0 - 2.4 * load / load.max()
    assert "supply" in fault(check(log_of(run.replace(supply=supply), tmp_path), ROBOT), "sag")


def test_26_a_coarse_encoder_is_said(run, tmp_path):
    step = 2.0
    coarse = run.replace(wheel_speed=np.round(run.wheel_speed / step) * step)
    assert "steps of 2" in fault(check(log_of(coarse, tmp_path), ROBOT), "quantised")


def test_27_a_robot_that_never_moved_gives_no_friction(tmp_path):
    still = simulate(ROBOT, [[0.0, 0.5, -0.5]] * 500, DT)
    assert check(log_of(still, tmp_path), ROBOT).of("never_moved")
    with pytest.raises(InsufficientDataError, match=r"nothing|steady|moved"):
        identify([still], ROBOT, SteadyState())


def test_28_a_blocked_robot_is_found(run, tmp_path):
    speed, twist, current = (np.array(getattr(run, name)) for name in ("wheel_speed", "twist", "current"))
    speed[600:720], twist[600:720] = 0.0, 0.0
    resistance = float(np.mean(ROBOT.motor.resistance))
    current[600:720] = run.voltage[600:720] / resistance
    blocked = run.replace(wheel_speed=speed, twist=twist, current=current)
    codes = {finding.code for finding in check(log_of(blocked, tmp_path), ROBOT).findings}
    assert codes & {"blocked", "stuck"}


def test_29_slip_is_found(run, tmp_path):
    twist = np.array(run.twist)
    twist[400:1200] *= 0.6
    codes = {finding.code for finding in check(log_of(run.replace(twist=twist), tmp_path), ROBOT).findings}
    assert codes & {"slip", "path_ratio"}
