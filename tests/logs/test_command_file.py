"""Voltage files: what each row holds for, and what is refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from omnidyn.errors import InputError
from omnidyn.logs.command_file import _regular, read_commands

HEADER = "t_s,u1_V,u2_V,u3_V\n"


@pytest.fixture
def write(write):
    return lambda content, name="u.csv": write(content, name)


def test_each_row_holds_until_the_next_and_the_last_as_long_as_the_one_before(write):
    voltage, dt, t0, sha = read_commands(write(HEADER + "1,0,3,-3\n1.5,0,0,0\n3,1,1,1\n"), 3)
    assert voltage.tolist() == [[0, 3, -3], [0, 0, 0], [1, 1, 1]]
    assert dt.tolist() == [0.5, 1.5, 1.5]
    assert t0 == 1.0
    assert len(sha) == 64


def test_columns_are_taken_by_name(write):
    held = read_commands(write("u2_V,t_s,u1_V,u3_V\n2,0,1,3\n2,1,1,3\n"), 3)
    assert held.voltage.tolist() == [[1, 2, 3], [1, 2, 3]]


def test_a_row_of_units_is_taken_if_it_is_right(write):
    assert len(read_commands(write(HEADER + "s,V,V,V\n0,0,0,0\n1,0,0,0\n"), 3).dt) == 2
    with pytest.raises(InputError, match=r"column t_s: the row of units contradicts the name; got ms; expected s"):
        read_commands(write(HEADER + "ms,V,V,V\n0,0,0,0\n1,0,0,0\n"), 3)


@pytest.mark.parametrize(
    "rows, duration, expected",
    [
        ("0,0,0,0\n", 2.5, [2.5]),
        ("0,0,0,0\n1,0,0,0\n", 4.0, [1.0, 3.0]),
        ("5,0,0,0\n6,0,0,0\n", 4.0, [1.0, 3.0]),  # counted from the first row
        ("0,0,0,0\n1,0,0,0\n2,0,0,0\n", 1.5, [1.0, 0.5]),
        ("0,0,0,0\n1,0,0,0\n2,0,0,0\n", 1.0, [1.0]),
        ("0,0,0,0\n0.1,0,0,0\n0.2,0,0,0\n", 0.3, [0.1, 0.1, 0.1]),  # all equal: 0.3 - 0.2 is not 0.1
    ],
)
def test_a_duration_ends_the_last_row(write, rows, duration, expected):
    held = read_commands(write(HEADER + rows), 3, duration)
    assert held.dt.tolist() == expected
    assert len(held.voltage) == len(expected)


def test_rows_beyond_the_duration_are_noted(write):
    held = read_commands(write(HEADER + "0,0,0,0\n1,0,0,0\n2,0,0,0\n"), 3, 1.0)
    assert held.notes == ("2 rows begin after the duration: left out",)


def test_decimal_times_on_a_grid_have_one_dt(write):
    rows = "".join(f"{k * 0.01:.2f},0,0,0\n" for k in range(2000))
    assert set(read_commands(write(HEADER + rows), 3).dt.tolist()) == {0.01}
    epoch = "".join(f"1700000000.{k:03d},0,0,0\n" for k in range(900))
    assert set(read_commands(write(HEADER + epoch), 3).dt.tolist()) == {0.001}


def test_an_irregular_grid_stays_irregular(write):
    rows = "0,0,0,0\n0.01,0,0,0\n0.0200001,0,0,0\n"
    assert read_commands(write(HEADER + rows), 3).dt.tolist() == [0.01, 0.0200001 - 0.01, 0.0200001 - 0.01]


@given(st.lists(st.floats(1e-6, 1e3), min_size=1, max_size=50), st.floats(-1e3, 1e3))
def test_the_steps_add_up_to_the_times(steps, start):
    t = start + np.concatenate([[0.0], np.cumsum(steps)])
    if (np.diff(t) > 0.0).all():
        assert np.abs(start + np.cumsum(_regular(t)) - t[1:]).max() <= 1e-9


@pytest.mark.parametrize(
    "content, words",
    [
        (HEADER, r"no rows; got 0 samples"),  # 3
        (HEADER + "0,1,2,3\n", r"u\.csv: one row: how long it holds is not said; .*; add `duration` SECONDS"),  # 4
        (
            HEADER + "0,1,2,3\n0,1,2,3\n",
            r"u\.csv:3, column t_s: the same time stands twice; got 0 after 0; expected increasing",
        ),  # 20
        (
            HEADER + "1,1,2,3\n0,1,2,3\n",
            r"u\.csv:3, column t_s: time runs backwards; got 0 after 1; .*sort the rows",
        ),  # 17
        (
            "t_s,u1_V,u2_V\n0,1,2\n1,1,2\n",
            r"for another number of wheels; got t_s, u1_V, u2_V; expected t_s, u1_V, u2_V, u3_V",
        ),
        (
            "t_s,u1_V,u2_V,u3_V,u4_V\n0,1,2,3,4\n1,1,2,3,4\n",
            r"for another number of wheels; .*expected t_s, u1_V, u2_V, u3_V;",
        ),
        ("t_s,u1_V,u2_V,u3\n0,1,2,3\n1,1,2,3\n", r"unknown column; got u3; .*did you mean u3_V\?"),
        ("time,u1_V,u2_V,u3_V\n0,1,2,3\n1,1,2,3\n", r"unknown column; got time; expected t_s, u1_V, u2_V, u3_V"),
        ("u1_V,u2_V,u3_V\n1,2,3\n", r"a column is missing; .*add t_s"),
        (HEADER + "0,1,2,3\n1,1,,3\n", r"u\.csv:3, column u2_V: a number is missing"),
        (HEADER + "0,1,2,3\n1,1,1e999,3\n", r"u\.csv:3, column u2_V: not a finite number"),
    ],
)
def test_it_refuses(write, content, words):
    with pytest.raises(InputError, match=words):
        read_commands(write(content), 3)


@pytest.mark.parametrize("duration", [0.0, -1.0, float("nan"), float("inf")])  # 33
def test_it_refuses_a_duration_that_is_none(write, duration):
    with pytest.raises(InputError, match=r"cannot simulate for that long; got .*; expected a duration above 0 s"):
        read_commands(write(HEADER + "0,1,2,3\n"), 3, duration)


def test_it_refuses_more_rows_than_the_limit(write):  # 33
    with pytest.raises(InputError, match=r"too many rows; got 2; expected at most 1; .*`max_steps`"):
        read_commands(write(HEADER + "0,1,2,3\n1,1,2,3\n"), 3, max_steps=1)


KINDS = {
    "duty": ("t_s,d1_duty,d2_duty,d3_duty,supply_V\n0,0.5,-0.5,0,12\n0.1,1,0,0,11.5\n", 3),
    "wheel_speed_command": ("t_s,w1_cmd_rad_s,w2_cmd_rad_s\n0,5,-5\n0.1,0,0\n", 2),
    "twist_command": ("t_s,vx_cmd_m_s,vy_cmd_m_s,omega_cmd_rad_s\n0,0.5,0,1\n0.1,0,0,0\n", 4),
}


@pytest.mark.parametrize("kind", KINDS)
def test_other_kinds_of_commands_are_told_by_their_columns(tmp_path, kind):
    text, wheels = KINDS[kind]
    (tmp_path / "c.csv").write_text(text)
    held = read_commands(tmp_path / "c.csv", wheels)
    assert held.kind == kind
    assert held.dt.tolist() == [0.1, 0.1]
    first = text.splitlines()[1].split(",")[1:]
    assert held.rows[0].tolist() == [float(cell) for cell in first][: held.rows.shape[1]]
    assert (held.supply.tolist() == [12.0, 11.5]) if kind == "duty" else held.supply is None
    with pytest.raises(InputError, match=r"this file holds no voltages; got"):
        _ = held.voltage


@pytest.mark.parametrize("kind", KINDS)
def test_a_run_file_is_a_command_file_and_what_was_measured_is_not_used(tmp_path, kind):
    text, wheels = KINDS[kind]
    names, *rows = text.splitlines()
    beside = [*(f"a{k + 1}_rad" for k in range(wheels)), "vx_m_s", "omega_rad_s"]
    lines = [",".join([names, *beside]), *(f"{row}," + "1.5," * wheels + ",0.2" for row in rows)]
    (tmp_path / "c.csv").write_text(text)
    (tmp_path / "run.csv").write_text("\n".join(lines) + "\n")
    alone, held = read_commands(tmp_path / "c.csv", wheels), read_commands(tmp_path / "run.csv", wheels)
    assert (held.kind, held.rows.tolist(), held.dt.tolist()) == (kind, alone.rows.tolist(), alone.dt.tolist())
    assert (held.supply is None) == (kind != "duty")
    assert any("is not used: a1_rad" in str(note) for note in held.notes)


def test_a_log_as_it_was_recorded_is_sent_to_the_commands_that_read_it(tmp_path):
    (tmp_path / "log.csv").write_text("stamp_ms,duty1,duty2,duty3,enc1\n0,0,0,0,7\n10,0,0,0,7\n")
    with pytest.raises(InputError, match=r"no commands by their names; .*`compare`.*`convert`"):
        read_commands(tmp_path / "log.csv", 3)


def test_a_duty_file_for_another_number_of_wheels_is_refused(tmp_path):
    (tmp_path / "c.csv").write_text(KINDS["duty"][0])
    with pytest.raises(InputError, match=r"another number of wheels.*d4_duty"):
        read_commands(tmp_path / "c.csv", 4)
