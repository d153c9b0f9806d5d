"""A drive behind a table of wheels: what is sent, what is recorded, and what is refused before anything moves."""

import copy

import numpy as np
import pytest

import omnidyn
from omnidyn.driving.simulated import SimulatedRobot
from omnidyn.driving.tabled import TabledConnection
from omnidyn.errors import InputError
from tests.support.worn_lekiwi import DT, GAIN, LEKIWI, ROWS, Worn, corrected, program, table_of

HEAD = "wheel,direction,gain,dead_band_rad_s,most_rad_s,missed_rad_s\n"


def test_what_is_sent_makes_the_wheels_turn_as_planned():
    worn, plain = Worn(), SimulatedRobot(LEKIWI, rate=1.0 / DT)
    record = omnidyn.drive(program(), TabledConnection(worn, table_of()))
    assert record.is_complete, str(record.verdict)
    assert record.run is not None
    sent = np.array(worn.sent)
    rows = sent[np.flatnonzero(sent.any(axis=1))[0] - 12 :][: len(ROWS)]
    np.testing.assert_allclose(rows, corrected(ROWS), atol=1e-12)
    np.testing.assert_allclose(np.asarray(record.run.wheel_speed_command)[: len(ROWS) - 1], ROWS[:-1], atol=1e-12)
    ideal = omnidyn.drive(program(), plain).run  # noise of the same seed
    assert ideal is not None
    np.testing.assert_allclose(np.asarray(record.run.wheel_speed), np.asarray(ideal.wheel_speed), atol=1e-9)
    without = omnidyn.drive(program(), Worn()).run
    assert without is not None
    assert np.nanmax(np.abs(np.asarray(without.wheel_speed) - ideal.wheel_speed)) > 0.1


def test_the_stops_of_a_drive_hold_behind_a_table():
    record = omnidyn.drive(program(area=(0.1, 0.1)), TabledConnection(Worn(), table_of()))
    assert not record.is_complete
    assert "border" in str(record.verdict)


@pytest.mark.parametrize(
    ("made", "table", "words"),
    [
        (
            program,
            lambda: table_of(np.ones((2, 4)), np.zeros((2, 4))),
            "the table of another robot; got 4 wheels",
        ),
        (
            lambda: program(np.tile([[0.0, 3.0, -3.0]], (20, 1)), omnidyn.load_robot("axebot")),
            table_of,
            "for speeds that a firmware holds; got a program of voltage for axebot",
        ),
        (lambda: program(20.0 * ROWS), lambda: table_of(0.1 + 0.0 * GAIN), "speeds beyond what the motor reaches"),
    ],
)
def test_what_no_table_is_for_is_refused_before_the_line_is_open(made, table, words):
    worn = Worn()
    with pytest.raises(InputError, match=words):
        omnidyn.drive(made(), TabledConnection(worn, table()))
    assert (worn.opened, worn.sent) == (0, [])


def test_a_program_of_speeds_that_no_motor_reaches_is_refused():
    with pytest.raises(InputError, match=r"speeds beyond what the motor reaches; got 1.5e\+06 rad/s at wheel 1"):
        program(1e6 * ROWS)


@pytest.mark.parametrize("table", ["wheels.csv", None, 4])
def test_what_is_no_table_is_refused(table):
    with pytest.raises(InputError, match="expected TabledConnection"):
        TabledConnection(Worn(), table)


@pytest.mark.parametrize("name", ["held", "progress", "follow"])
def test_what_cannot_be_called_is_refused_before_the_line_is_open(name):
    worn = Worn()
    with pytest.raises(InputError, match=f"{name}: not a function; got 3; expected"):
        omnidyn.drive(program(), worn, **{name: 3})  # type: ignore[arg-type]
    assert worn.opened == 0


def test_a_copy_is_a_connection_too():
    assert copy.copy(TabledConnection(Worn(), table_of())).sent == []


@pytest.mark.parametrize("field", ["gain", "dead_band", "most", "missed"])
@pytest.mark.parametrize("value", ["nan", "inf", "-1", "1e300", "0"])
def test_numbers_of_no_wheel_are_refused(tmp_path, field, value):
    number = ["gain", "dead_band", "most", "missed"].index(field)
    if value == "0" and field in ("dead_band", "missed"):
        return
    if value == "1e300" and field in ("most", "missed"):
        return
    cells = ["1", "0.1", "3", "0.01"]
    lines = [",".join([str(wheel), str(way), *cells]) for wheel in (1, 2, 3) for way in (1, -1)]
    cells[number] = value
    lines[3] = ",".join(["2", "-1", *cells])
    (tmp_path / "wheels.csv").write_text(HEAD + "\n".join(lines) + "\n")
    with pytest.raises(InputError, match=r"wheels\.csv") as caught:
        omnidyn.read_wheel_table(tmp_path / "wheels.csv")
    assert caught.value.got
    assert caught.value.expected or caught.value.remedy
