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
    with pytest.raises(InputError, match=r"not a table of motors; got a, b; expected input,speed"):
        read(tmp_path, "a,b\n1,2\n")
    with pytest.raises(InputError, match=r"names another unit; got turn/s; expected rad/s or rpm"):
        read(tmp_path, "input,speed [turn/s]\n1,2\n")
    with pytest.raises(InputError, match=r"columns of different lengths; got \[1, 2\]"):
        MotorTable(np.zeros(2), np.zeros(1), np.zeros(2, dtype=np.int64), "duty", "%")


def test_a_table_says_that_its_rows_are_points(tmp_path):
    table = read(tmp_path, "duty_pct,speed\n10,3\n50,9\n")
    assert table.put_in.tolist() == [10.0, 50.0]
    assert table.notes[0] == "2 rows without a time are taken as points at steady speed; of a log, give its `rate`"


def test_a_log_without_a_time_is_no_table_of_points(tmp_path):
    """Rows that follow each other under an input that swings, or very many of them."""
    phase = np.linspace(0.0, 6.0 * np.pi, 300)
    log = "\n".join(f"{6.0 * np.sin(a):.4f},{200.0 * np.sin(a - 0.3):.3f}" for a in phase)
    with pytest.raises(
        InputError, match=r"a log without a time.*; got 300 rows.*; say how many rows a second: `rate` HZ"
    ):
        read(tmp_path, f"voltage,speed\n{log}\n")
    long = "\n".join(f"{k / 200},{k / 5}" for k in range(1200))
    with pytest.raises(InputError, match="got 1200 rows"):
        read(tmp_path, f"voltage,speed\n{long}\n")
    up_and_down = "\n".join(f"{6 - abs(k - 150) / 25:.3f},{300 - 2 * abs(k - 150)}" for k in range(301))
    assert len(read(tmp_path, f"voltage,speed\n{up_and_down}\n")) == 301
