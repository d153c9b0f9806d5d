"""Logs whose columns are constant, or hold numbers that no sensor gives: a sentence, never a traceback or a warning.

The log is of three wheels with a lag of 60 ms, which shares nothing with simulation/.
"""

import numpy as np
import pytest

from omnidyn.cli import main
from tests.support.cases import case

ROWS = 150
CHANNELS = {
    "voltage": "u1_V u2_V u3_V",
    "duty": "d1_duty d2_duty d3_duty",
    "speed": "w1_rad_s w2_rad_s w3_rad_s",
    "counts": "a1_rad a2_rad a3_rad",
    "pose": "x_m y_m heading_rad",
    "twist": "vx_m_s vy_m_s omega_rad_s",
    "current": "i1_A i2_A i3_A",
    "supply": "supply_V",
    "time": "t_s",
}
LOGS = {
    "volts": ("voltage", "speed", "pose", "current", "supply"),
    "duties": ("duty", "supply", "counts", "pose"),
    "twists": ("voltage", "twist"),
}
COMMANDS = {
    "check": ("check", "log.csv", "--robot", "axebot"),
    "identify": ("identify", "log.csv", "--robot", "axebot", "--quick"),
    "steady": ("identify", "log.csv", "--robot", "axebot", "--method", "steady-state"),
    "motors": ("identify", "log.csv", "--what", "motors"),
    "free runs": ("identify", "log.csv", "--what", "motors", "--method", "output-error"),
    "compare": ("compare", "log.csv", "--robot", "axebot"),
    "init": (
        "init",
        "r",
        "--log",
        "log.csv",
        "--mass",
        "2",
        "--wheel-radius",
        "0.03",
        "--robot-radius",
        "0.1",
        "-o",
        "-",
    ),
}
COLUMNS = {  # what becomes of a column
    "constant": lambda column: np.full(ROWS, 3.0),
    "zero": lambda column: np.zeros(ROWS),
    "huge": lambda column: np.full(ROWS, 1e300),
    "tiny": lambda column: np.full(ROWS, 1e-300),
    "a huge cell": lambda column: np.where(np.arange(ROWS) == 70, -1e300, column),
    "a tiny cell": lambda column: np.where(np.arange(ROWS) == 70, 1e-300, column),
}
SHORT = [
    ("volts", "speed", "zero"),
    ("volts", "voltage", "constant"),
    ("twists", "twist", "a huge cell"),
    ("duties", "counts", "tiny"),
    ("duties", "time", "constant"),
]


def columns():
    """Name -> column of every channel, all from one motion."""
    row = np.arange(ROWS)
    volts = np.column_stack([4.0 * (row // 15 % 2), 3.0 - 6.0 * (row // 21 % 2), -4.0 * (row // 27 % 2)])
    speed = np.zeros((ROWS, 3))
    for k in range(1, ROWS):
        speed[k] = speed[k - 1] + 0.3 * (6.0 * volts[k - 1] - speed[k - 1])
    random = np.random.default_rng(2)
    twist = 0.035 * speed @ np.array([[0.0, -0.6, 0.6], [-0.7, 0.3, 0.3], [3.3, 3.3, 3.3]]).T
    every = {
        "voltage": volts,
        "duty": volts / 6.0,
        "speed": speed + 0.05 * random.normal(size=speed.shape),
        "counts": np.round(0.02 * np.cumsum(speed, axis=0) / 0.01) * 0.01,
        "twist": twist,
        "pose": 0.02 * np.cumsum(twist, axis=0),
        "current": (volts - 0.11 * speed) / 1.7,
        "supply": np.full((ROWS, 1), 6.0) + 0.01 * random.normal(size=(ROWS, 1)),
        "time": 0.02 * row[:, None],
    }
    return {name: dict(zip(names.split(), every[name].T, strict=True)) for name, names in CHANNELS.items()}


def write(path, log, channel, kind, wheels=3):
    """The log, what becomes of columns of one channel, of so many wheels."""
    table = {}
    for name in ("time", *LOGS[log]):
        for k, (key, column) in enumerate(columns()[name].items()):
            table[key] = COLUMNS[kind](column) if name == channel and k < wheels else column
    rows = zip(*table.values(), strict=True)
    path.write_text(f"{','.join(table)}\n" + "\n".join(",".join(f"{x:.9g}" for x in row) for row in rows) + "\n")


def check(command, capsys):
    """A command ends with a sentence; what was asked for was made, or nothing of it was begun."""
    code = main(list(command))
    out, err = capsys.readouterr()
    assert code in (0, 3, 4), err
    assert "bug:" not in err
    assert "Warning" not in err
    assert out or err.startswith("omnidyn: ")
    return code, err


@pytest.mark.parametrize("log, channel, kind", SHORT)
@pytest.mark.some(2)
def test_no_absurd_column_ends_in_a_traceback(tmp_path, monkeypatch, capsys, log, channel, kind):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "log.csv", log, channel, kind)
    for name in ("check", "motors", "compare", "init"):
        check(COMMANDS[name], capsys)


EVERY = [(log, name) for log, names in LOGS.items() for name in ("time", *names)]
TURNS = [(*EVERY[k], ("constant", "zero", "huge", "a huge cell")[k % 4]) for k in range(len(EVERY))]


@pytest.mark.long
@pytest.mark.parametrize("log, channel, kind", TURNS)
def test_so_it_is_of_every_column_and_command(tmp_path, monkeypatch, capsys, log, channel, kind):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "log.csv", log, channel, kind, wheels=1 if kind == "constant" else 3)
    for name in ("check", "motors") if "huge" in kind else ("identify", "steady", "free runs"):
        check(COMMANDS[name], capsys)


def test_a_number_that_no_sensor_gives_is_named_with_its_place(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "log.csv", "twists", "twist", "a huge cell")
    code, err = check(COMMANDS["check"], capsys)
    assert code == 3
    assert "log.csv:72, column vx_m_s: no sensor gives such a number; got -1e+300; expected at most 1e+20" in err
    assert check((*COMMANDS["check"], "--skip-bad-rows"), capsys)[0] != 3
    text = (tmp_path / "log.csv").read_text()
    (tmp_path / "log.csv").write_text(text.replace("-1e+300", ""))
    assert check(COMMANDS["check"], capsys)[0] != 3


def test_motors_that_have_one_speed_have_no_line(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "log.csv", "volts", "speed", "constant")
    code, err = check(COMMANDS["motors"], capsys)
    assert code == 4
    assert "is 3 in every row, while its voltage says that the wheel turns" in err
    code, err = check((*COMMANDS["motors"], "--method", "steady-state"), capsys)
    assert code == 4
    assert "a line needs several speeds; got 3 rad/s in every window" in err


@pytest.mark.parametrize("folder", ["", "code/path_1e300"])
def test_a_path_beyond_all_rooms_is_refused(tmp_path, monkeypatch, capsys, folder):
    path = tmp_path / "path.csv"
    path.write_text("t_s,x_m,y_m,heading_rad\n0,0,0,0\n1,1e300,0,0\n2,0,0,0\n")
    code, err = check(("track", "axebot", "--path", str(case(f"{folder}/path.csv") if folder else path)), capsys)
    assert code == 3
    assert "column x_m: no sensor gives such a number; got 1e+300" in err
