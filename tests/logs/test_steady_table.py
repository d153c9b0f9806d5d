"""Steady tables, from a file and from arrays."""

import numpy as np
import pytest

from omnidyn.errors import InputError
from omnidyn.logs.steady_table import SteadyTable, read_steady_table


@pytest.fixture
def write(write):
    return lambda content, name="steady.csv": write(content, name)


def test_a_table_with_everything(write):
    table = read_steady_table(
        write(
            "axis,speed,force,speed_std,force_std,u1_V,u2_V,u3_V,i1_A\nx,0.37,2.48,0.01,0.05,0,2,-2,\nyaw,5.84,0.14,0.1,0.01,1,1,1,3\n"
        )
    )
    assert table.axis == ("x", "yaw")
    assert table.axis_index.tolist() == [0, 2]
    assert table.speed.tolist() == [0.37, 5.84]
    assert table.force.tolist() == [2.48, 0.14]
    assert table.speed_std.tolist() == [0.01, 0.1]
    assert table.force_std.tolist() == [0.05, 0.01]
    assert table.voltage.tolist() == [[0, 2, -2], [1, 1, 1]]
    assert np.isnan(table.current[0, 0])
    assert table.twists.tolist() == [[0.37, 0, 0], [0, 0, 5.84]]
    assert table.force_from == "table"
    assert len(table.sha256) == 64
    assert table.notes == ()


def test_the_letters_of_the_paper_are_taken_with_a_note(write):
    table = read_steady_table(write("axis,speed,force\nv,1,2\nv_n,1,2\nw,1,2\n"))
    assert table.axis == ("x", "y", "yaw")
    assert table.notes == ("axis v was read as x", "axis v_n was read as y", "axis w was read as yaw")


def test_a_european_table_says_so(write):
    table = read_steady_table(write("axis;speed;force\nx;0,37;2,48\n"))
    assert (table.speed[0], table.force[0]) == (0.37, 2.48)
    assert "numbers have a decimal comma" in table.notes


@pytest.mark.parametrize("units", ["-,m/s,N", ",[m/s],[N]", "-,SI,SI"])
def test_a_row_of_units_that_agrees(write, units):
    assert read_steady_table(write(f"axis,speed,force\n{units}\nx,1,2\n")).speed.tolist() == [1.0]


@pytest.mark.parametrize(
    "content, words",
    [
        (
            "axis,speed,force\n-,rpm,N\nyaw,1,2\n",
            r"column speed: the row of units names another unit; got rpm; expected SI or rad/s",
        ),
        ("axis,speed,force\n-,mm/s,N\nx,1,2\n", r"got mm/s; expected SI or m/s; convert the column"),
        (
            "axis,speed,force,u1_V\n-,m/s,N,mV\nx,1,2,3\n",
            r"column u1_V: the row of units names another unit; got mV; expected V",
        ),
        ("axis,speed,force\nz,1,2\n", r"steady\.csv:2, column axis: no such axis; got z; expected x, y or yaw"),
        ("axis,speed,force\n1,1,2\n", r"steady\.csv:2, column axis: not text; got 1\.0; expected x, y or yaw"),
        ("axis,speed,force\nx,,2\n", r"steady\.csv:2, column speed: a number is missing"),
        ("axis,speed,force\nx,1,2\nx,1,abc\n", r"steady\.csv:3, column force: not a number; got abc"),
        (
            "axis,speed,force\nx,1e5,2\n",
            r"steady\.csv:2, column speed: number out of range; got 100000\.0; expected .*10000 m/s",
        ),
        ("axis,speed,force,force_std\nx,1,2,0\n", r"steady\.csv:2, column force_std: number out of range; got 0\.0"),
        ("axis,speed,force,force_std\nx,1,2,-1\n", r"column force_std: number out of range; got -1\.0"),
        (
            "axis,speed,force,force_std,speed_std\nx,1,2,1,-1\n",
            r"column speed_std: number out of range; got -1\.0; expected a number, 0",
        ),
        ("axis,speed,force,speed_std\nx,1,2,1\n", r"speed_std without force_std; expected both"),
        ("axis,speed,force,force_sd\nx,1,2,1\n", r"unknown column; got force_sd; .*did you mean force_std\?"),
        ("axis,speed\nx,1\n", r"a column is missing; got axis, speed; .*add force"),
        ("axis,speed,force,u1_V,u3_V\nx,1,2,0,0\n", r"unknown column; got u3_V; .*did you mean u"),
        ("axis,speed,force\n", r"no rows; got 0 samples"),
    ],
)
def test_it_refuses_a_file(write, content, words):
    with pytest.raises(InputError, match=words):
        read_steady_table(write(content))


@pytest.mark.parametrize(
    "fields, words",
    [
        ({"axis": ["x"]}, r"axis: wrong shape; got 1 axes; expected 2, one per speed"),
        ({"axis": ["x", "up"]}, r"row 1, column axis: no such axis; got up"),
        ({"force": [1.0]}, r"force: wrong shape; got \(1,\); expected \(points,\) with 2 points"),
        ({"force": [1.0, np.nan]}, r"row 1, column force: number out of range; got nan"),
        ({"speed": [[1.0], [2.0]]}, r"speed: wrong shape; got \(2, 1\)"),
        ({"speed": ["a", "b"]}, r"speed: not numbers"),
        ({"speed": [1.0, np.inf]}, r"row 1, column speed: number out of range; got inf"),
        ({"twist": [[1.0, 0.0], [1.0, 0.0]]}, r"twist: wrong shape; got \(2, 2\); expected \(points, 3\)"),
        ({"force_from": "guess"}, r"unknown origin of the force; got guess; expected table, current, voltage"),
        ({"speed": [], "force": [], "axis": []}, r"no rows; got 0 samples"),
    ],
)
def test_it_refuses_arrays(fields, words):
    with pytest.raises(InputError, match=words):
        SteadyTable(**{"axis": "x", "speed": [1.0, 2.0], "force": [1.0, 2.0], **fields})


def test_arrays_are_copied_and_read_only():
    speed = np.array([1.0, 2.0])
    table = SteadyTable("y", speed, [1.0, 2.0])
    speed[0] = 9.0
    assert table.speed[0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        table.speed[0] = 3.0
