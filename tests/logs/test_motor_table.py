"""Tables of inputs and steady speeds of motors, told by the names of their columns."""

import numpy as np
import pytest

from omnidyn.errors import InputError
from omnidyn.logs.motor_table import MotorTable, is_motor_table, read_motor_table


def read(tmp_path, text):
    path = tmp_path / "table.csv"
    path.write_text(text)
    return read_motor_table(path)


@pytest.mark.parametrize(
    ("head", "row", "kind", "unit", "put_in", "speed"),
    [
        ("voltage_V,speed", "2,3", "voltage", "V", 2.0, 3.0),
        ("duty,speed", "0.5,3", "duty", "%", 50.0, 3.0),
        ("duty_%,rpm", "50,60", "duty", "%", 50.0, 2.0 * np.pi),
        ("current_A,speed_rpm", "1,60", "current", "A", 1.0, 2.0 * np.pi),
        ("input,speed", "120,3", "input", "units", 120.0, 3.0),
        ("input [V],speed [rpm]", "2,60", "voltage", "V", 2.0, 2.0 * np.pi),
    ],
)
def test_columns_say_what_they_are(tmp_path, head, row, kind, unit, put_in, speed):
    table = read(tmp_path, f"{head}\n{row}\n{row}\n")
    assert (table.kind, table.unit) == (kind, unit)
    assert table.put_in == pytest.approx([put_in] * 2)
    assert table.speed == pytest.approx([speed] * 2)
    assert table.motor.tolist() == [0, 0]


def test_a_duty_beyond_1_is_percent(tmp_path):
    table = read(tmp_path, "duty,speed\n0,0\n50,3\n")
    assert table.put_in.tolist() == [0.0, 50.0]
    assert "read as percent" in table.notes[-1]


def test_motors_are_counted_from_1(tmp_path):
    assert read(tmp_path, "input,speed,motor\n1,2,1\n1,2,3\n").motor.tolist() == [0, 2]
    with pytest.raises(InputError, match=r"table.csv:3, column motor: no number of a motor; got 0"):
        read(tmp_path, "input,speed,motor\n1,2,1\n1,2,0\n")


def test_a_log_is_no_table():
    assert is_motor_table(["input", "speed"])
    assert is_motor_table(["Duty_%", "RPM", "motor"])
    assert not is_motor_table(["t_s", "voltage_V", "speed"])
    assert not is_motor_table(["axis", "speed", "force"])
    assert not is_motor_table(["speed"])
    assert not is_motor_table(["input", "voltage", "speed"])


def test_wrong_tables_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"no table of motors; got a, b; expected input,speed"):
        read(tmp_path, "a,b\n1,2\n")
    with pytest.raises(InputError, match=r"names another unit; got turn/s; expected rad/s or rpm"):
        read(tmp_path, "input,speed [turn/s]\n1,2\n")
    with pytest.raises(InputError, match=r"columns of different lengths; got \[1, 2\]"):
        MotorTable(np.zeros(2), np.zeros(1), np.zeros(2, dtype=np.int64), "duty", "%")
