"""The reader on every file of the real logs, as they are. What is expected was counted by other means."""

import csv
import math

import pytest

from omnidyn.logs.readers.read_table import read_table

NAMES = (
    "t xsetspeed ysetspeed setvel m1setvel m2setvel m3setvel m1pos m2pos m3pos m1vel m2vel m3vel m1cur m2cur m3cur "
    "xcur ycur rotcur xpos ypos ang dx dy dang"
)
ROBOTINO = NAMES.split()


def python_rows(path, separator, first):
    """The numbers of a file by Python's own csv and float: the rows from line `first` on."""
    with open(path, encoding="utf-8", newline="") as stream:
        rows = list(csv.reader(stream, delimiter=separator))[first - 1 :]
    return [[float(cell.strip("; \r")) for cell in row if cell.strip("; \r")] for row in rows if row]


def same(table, rows):
    assert len(table) == len(rows)
    for k, name in enumerate(table.names):
        expected = [row[k] for row in rows]
        for got, want in zip(table.columns[name].tolist(), expected, strict=True):
            assert got == want or (math.isnan(got) and math.isnan(want))


def test_every_run_of_robotino(data):
    paths = sorted((data / "robotino" / "one_surface_type").rglob("*.csv"))
    assert len(paths) == 252
    for path in paths:
        table = read_table(path)
        assert list(table.names) == ROBOTINO
        assert table.units["t"] == "ms"
        assert table.units["xpos"] == "pix"
        assert table.titles["m1setvel"] == "1st motor set speed"
        assert all(table.numbers(name).size == len(table) for name in ROBOTINO)
        assert table.lines[0] == 4


def test_robotino_is_read_to_the_last_digit(data):
    path = data / "robotino" / "one_surface_type" / "gray_surface" / "exp00.csv"
    same(read_table(path), python_rows(path, ";", 4))


def test_a_robotino_run_says_what_was_decided(data):
    table = read_table(data / "robotino" / "one_surface_type" / "green_surface" / "exp00.csv")
    assert table.notes == (
        "line 3 gives the names, line 2 the units, line 1 the titles",
        "columns are separated by a semicolon",
        "every row ends with a semicolon: the blank last column was left out",
    )


@pytest.mark.parametrize("name", ["step1", "step2", "chirp1", "chirp2", "noise1", "noise2", "impulse1", "impulse2"])
def test_the_motor_bench(data, name):
    path = data / "odrive_umn" / "demo_data" / f"{name}.csv"
    table = read_table(path)
    assert table.names == ("timestep (8Hz)", "voltage", "position", "velocity")
    assert [table.units[each] for each in table.names] == ["#", "V", "turns", "turns/s"]
    assert table.lines[0] == 13
    assert table.notes == (
        "line 11, a comment, was read as the header, line 12 as the units",
        "every row ends with a semicolon: it was left out",
    )
    same(table, python_rows(path, ",", 13))
    missing = int(sum(map(math.isnan, table.numbers("velocity", missing=True).tolist())))
    assert missing == path.read_text().count("nan,nan,nan,nan")


@pytest.mark.parametrize(
    "name, columns",
    [("motor_tests/stage1_1", 12), ("rotation_tests/stage2_1", 12), ("sensor_data/exp1", 13), ("sensor_data/exp5", 13)],
)
def test_the_student_robot(data, name, columns):
    path = data / "udea_three_omni" / f"{name}.txt"
    table = read_table(path)
    assert table.names[:6] == ("t", "ax", "ay", "alpha", "w1", "w2")
    assert len(table.names) == columns
    assert len(table) == 1200
    same(table, python_rows(path, ",", 2))


def test_the_camera_tracks(data):
    for path in sorted((data / "udea_three_omni" / "video_trajectories").glob("*.csv")):
        same(read_table(path), python_rows(path, ",", 2))
