"""Every name and unit that the page on logs gives is read as what it says there."""

import re
from pathlib import Path

import numpy as np
import pytest

from omnidyn.logs.columns.guess import guess_columns
from omnidyn.logs.columns.mapping import quantity_of
from omnidyn.logs.columns.names import read_name
from omnidyn.logs.columns.wheel_places import FARTHEST_ANGLE
from omnidyn.logs.read_log import read_log
from omnidyn.logs.readers.read_table import read_table
from omnidyn.logs.table.table import FileTable
from omnidyn.units import DUTY, parse_unit

PAGE = (Path(__file__).parents[3] / "docs" / "logs.md").read_text("utf-8")
ROWS = 60
T, SWING = 0.01 * np.arange(ROWS), 0.6 * np.sin(0.4 * np.arange(ROWS))
LINES = [[cell.strip() for cell in line.strip("|").split("|")] for line in PAGE.splitlines() if line.startswith("| ")]
TABLE = next(k for k, cells in enumerate(LINES) if cells[:2] == ["channel", "components"])
NAMES = [name for cells in LINES[TABLE + 2 : TABLE + 11] for name in re.findall(r"[a-z]\w*", cells[1])]
NAMES += ["d2", "i3", "a2", "w2_cmd", "omega_cmd", "vy_cmd"]  # what ".." stands for
LISTED = re.search(r"^Units: (.*?)each with", PAGE, re.MULTILINE | re.DOTALL)[1]
UNITS = [word for text in re.findall(r"`([^`]*)`", LISTED) for word in text.split() if "ticks" not in word]


def taken(columns, units=None):
    cells = {"t_s": T, "vx": SWING, **columns}  # a body, so that omega is its own
    table = FileTable(tuple(cells), cells, np.arange(ROWS) + 2, units or {}, "log.csv", "", ())
    return guess_columns(table)


def test_the_page_has_names_and_units():
    assert {"u1", "d1", "a1", "w1_cmd", "vx_cmd", "heading", "supply", "f1"} <= {*NAMES}
    assert {"cV", "pwm", "turns/s", "min"} <= {*UNITS}


@pytest.mark.parametrize("name", sorted({*NAMES} - {"vx"}))
def test_a_name_alone_is_its_component_or_asked_about(name):
    columns = taken({name: SWING})
    assert name in columns.columns or [doubt.components for doubt in columns.doubts] == [(name,)]
    assert name[0] == "u" or name in columns.columns  # volts or duty?


@pytest.mark.parametrize("form", ["{}_{}", "{} [{}]", "row"])
def test_a_name_with_a_unit_is_its_component(tmp_path, form):
    wrong, count = [], 0
    for name in sorted({*NAMES} - {"vx"}):
        for unit in UNITS:
            parsed = parse_unit(unit)
            if parsed.quantity != quantity_of(name):
                continue
            values = SWING * 5.0 / parsed.size if parsed.quantity != DUTY else SWING / parsed.size
            header = name if form == "row" else form.format(name, unit.replace("/", "/" if "[" in form else "_per_"))
            lines = [f"t_s,vx_m_s,{header}", *["s,m/s," + unit] * (form == "row")]
            lines += [f"{t!r},{s!r},{v!r}" for t, s, v in zip(*(c.tolist() for c in (T, SWING, values)), strict=True)]
            path = tmp_path / "log.csv"
            path.write_text("\n".join(lines) + "\n", "utf-8")
            column = guess_columns(read_table(path)).columns.get(name)
            count += 1
            if column is None or parse_unit(column.unit).size != pytest.approx(parsed.size):
                wrong.append((header, unit))
    assert count > 60
    assert wrong == []


@pytest.mark.parametrize("header", ["d1,d2,d3", "d1_%,d2_%,d3_%", "d1 [%],d2 [%],d3 [%]", "d1_pwm,d2_pwm,d3_pwm"])
@pytest.mark.parametrize("first", [0, 1])
def test_duties_are_read_as_the_page_calls_them(tmp_path, header, first):
    """None of these was read, and `--assume d=duty` found no column."""
    scale = 255.0 if "pwm" in header else 100.0 if "%" in header else 1.0
    header = header if first else header.replace("1", "0").replace("2", "1").replace("3", "2")
    path = tmp_path / "log.csv"
    rows = [f"{t:.2f},{scale * s},{scale * s / 2},{-scale * s}" for t, s in zip(T, SWING, strict=True)]
    path.write_text("\n".join([f"t_s,{header}", *rows]) + "\n", "utf-8")
    run = read_log(path)
    np.testing.assert_allclose(run.duty, np.outer(SWING, [1.0, 0.5, -1.0]), atol=1e-12)
    if scale == 1.0:
        np.testing.assert_array_equal(read_log(path, assume={"d": "duty"}).duty, run.duty)


@pytest.mark.parametrize("name", ["d1_cm", "dist1", "D1", "A1", "humidity_%", "d1_error", "a1_x", "ad1"])
def test_what_only_has_the_letter_is_nothing(name):
    assert set(taken({name: SWING}).columns) == {"t", "vx"}


@pytest.mark.parametrize(
    "name", re.findall(r"`(\w[^`]*)`", re.search(r"in the name \((.*?)\), or is", PAGE, re.DOTALL)[1])
)
def test_a_unit_in_a_name_is_read_as_the_page_says(name):
    columns = taken({name: SWING})
    if name == "millis":  # a clock
        assert columns.columns["t"].name == "t_s"
        return
    (component,) = {*columns.columns} - {"vx", "t"} or {doubt.components[0] for doubt in columns.doubts}
    assert component[0] in "wi"


def test_a_place_in_a_name_says_the_wheel_as_the_page_says():
    names = re.findall(r"`(\w+)`", re.search(r"A name that says a place \((.*?)\)", PAGE)[1])
    assert names
    assert [read_name(name).place for name in names] == [45.0] * len(names)
    assert "four are counted front left, front right, rear left, rear right" in PAGE
    columns = taken({f"{place}_rad_s": SWING for place in ("rr", "fr", "rl", "fl")}).columns
    assert [columns[f"w{k}"].name[:2] for k in (1, 2, 3, 4)] == ["fl", "fr", "rl", "rr"]
    assert f"within {FARTHEST_ANGLE:.0f} degrees" in PAGE
