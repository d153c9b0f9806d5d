"""Cases of names, units and times that once went wrong: their right values stand in the EXPECT.md of each."""

import subprocess
import sys

import numpy as np
import pytest

from omnidyn import MotorLine, identify, read_log
from omnidyn.errors import InputError
from omnidyn.logs.motor_table import read_motor_table
from omnidyn.logs.read_log import recorded_log
from tests.support.cases import case
from tests.support.codes import said


def made(name, folder):
    """The files that the script of a case makes."""
    script = case(f"logs/{name}/make.py")
    subprocess.run([sys.executable, script], cwd=folder, check=True, env={"PYTHONPATH": str(script.parents[1])})
    return folder


def numbers(run):
    """(slope, dead band, lag [s]) of the first motor."""
    found = identify([run], None, MotorLine()).study.to_dict()["motors"][0]["parameters"]
    return [found[key]["value"] for key in ("slope", "dead_band", "lag")]


@pytest.mark.long
def test_a_rate_stands_for_the_time():
    slope, dead_band, lag = numbers(read_log(case("logs/no_time/named.csv"), rate=500.0))
    assert slope == pytest.approx(0.16667, rel=1e-3)
    assert dead_band == pytest.approx(2.92, abs=0.01)
    assert lag == pytest.approx(0.120, abs=0.002)


def test_a_log_without_a_time_is_no_table_of_points():
    with pytest.raises(InputError, match="a log without a time, and no table of steady points; got 10000 rows"):
        read_motor_table(case("logs/no_time/named.csv"))


def test_the_drive_is_what_the_name_says_and_no_sensor():
    log = recorded_log(case("logs/sensor_volts/one_way.csv"))
    assert log.columns.columns["d1"].name == "duty_pct"
    assert "u1" not in log.columns.columns
    assert any("encoder_V looks like a1, but V is no unit of an angle" in doubt for doubt in said(log.columns.doubts))


@pytest.mark.long
@pytest.mark.parametrize("file", ["bench.csv", "one_way.csv", "ntc.csv"])
def test_a_motor_beside_its_sensors(tmp_path, file):
    slope, dead_band, _ = numbers(read_log(made("sensor_volts", tmp_path) / file))
    assert slope == pytest.approx(0.16667, rel=1e-3)
    assert dead_band == pytest.approx(2.92, abs=0.01)


@pytest.mark.parametrize(("file", "component"), [("angle.csv", "a1"), ("heading.csv", "heading")])
def test_an_angle_that_jumps_by_360_is_asked_about(tmp_path, file, component):
    path = made("degrees_wrap", tmp_path) / file
    log = recorded_log(path)
    assert component not in log.columns.columns
    assert "it jumps as degrees do" in said(log.columns.doubts)[0]
    assert ptp(read_log(path, columns={component: f"{path.stem}:deg"}), component) > 2.0 * np.pi


def ptp(run, component):
    values = run.wheel_angle[:, 0] if component == "a1" else run.pose[:, 2]
    return float(np.ptp(values))


@pytest.mark.long
def test_an_angle_in_degrees_gives_the_motor():
    slope, dead_band, lag = numbers(read_log(case("logs/degrees_wrap/angle.csv"), assume={"a": "deg"}))
    assert slope == pytest.approx(0.0200, rel=1e-3)
    assert dead_band == pytest.approx(0.350, abs=0.003)
    assert lag == pytest.approx(0.120, abs=0.002)


def test_an_oscilloscope_has_its_units_in_the_second_line():
    run = read_log(case("logs/scope_csv/scope.csv"))
    assert run.t[0] == pytest.approx(-0.1)
    assert (run.voltage[0, 0], run.current[0, 0]) == pytest.approx((6.0, 4.0))
    assert len(run) == 4000


@pytest.mark.long
def test_the_array_of_a_board_shifts_no_motor(tmp_path):
    folder = made("array_numbers", tmp_path)
    for file in ("with_board.wpilog", "without.wpilog"):
        log = recorded_log(folder / file)
        names = {key: column.name for key, column in log.columns.columns.items()}
        assert [names[f"u{k}"] for k in (1, 2, 3, 4)] == [f"/drive/motor{k}/voltage_V" for k in (1, 2, 3, 4)]
        assert [names[f"w{k}"] for k in (1, 2, 3, 4)] == [f"/drive/motor{k}/velocity_rad_s" for k in (1, 2, 3, 4)]
        motors = identify([log.to_run()], None, MotorLine()).study.to_dict()["motors"]
        bands = [motor["parameters"]["dead_band"]["value"] for motor in motors[:4]]
        assert bands == pytest.approx([0.3, 0.4, 0.5, 0.6], abs=0.01)


def test_a_map_may_name_columns_with_the_unit_of_the_header():
    from omnidyn import load_robot

    folder = case("logs/four_wheels_counts_pose/map.toml").parent
    run = read_log(folder / "f1.csv", load_robot(folder / "ftc.toml"), columns=folder / "map.toml")
    assert run.pose[0, 0] == pytest.approx(11.971 * 0.0254)
    assert run.duty.shape[1] == run.wheel_angle.shape[1] == 4
