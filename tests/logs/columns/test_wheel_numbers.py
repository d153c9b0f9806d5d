"""Which wheel a number means: families of names count for themselves; a board's array shifts nobody."""

import pytest

from omnidyn.logs.columns.guess import guess_columns
from tests.logs.columns.test_guess import clock, table_of
from tests.support.codes import said

DRIVE = [f"/drive/motor{k}/{what}" for k in (1, 2, 3, 4) for what in ("voltage_V", "velocity_rad_s")]
NAMED = {f"u{k}": f"/drive/motor{k}/voltage_V" for k in (1, 2, 3, 4)} | {
    f"w{k}": f"/drive/motor{k}/velocity_rad_s" for k in (1, 2, 3, 4)
}


def taken(tmp_path, names):
    columns = guess_columns(table_of(tmp_path, {"t_s": clock(0.01), **dict.fromkeys(names, 1)}))
    return {key: column.name for key, column in columns.columns.items() if key != "t"}, columns


@pytest.mark.parametrize("board", ["/pdp/currents_A[{}]", "/power/current{}_A", "currents[{}]", "channel_{}_current_A"])
@pytest.mark.parametrize("places", [8, 16])
def test_the_currents_of_a_board_shift_no_wheel(tmp_path, board, places):
    found, columns = taken(tmp_path, [*DRIVE, *(board.format(k) for k in range(places))])
    assert found == NAMED
    assert not any("numbered from 0" in note for note in said(columns.notes))
    (doubt,) = said(columns.doubts)
    assert f"there are {places} beside 4 motors (say `column` i1={board.format(0)} and so on): not taken" in doubt


def test_an_array_of_as_many_places_as_motors_counts_from_0_alone(tmp_path):
    found, columns = taken(tmp_path, [*DRIVE, *(f"/driver/currents_A[{k}]" for k in range(4))])
    assert found == NAMED | {f"i{k + 1}": f"/driver/currents_A[{k}]" for k in range(4)}
    assert "wheels are numbered from 0 in the file: 0 is wheel 1 (u, w from 1)" in said(columns.notes)


def test_a_sensor_that_is_missing_does_not_move_the_others_of_its_style(tmp_path):
    names = [*(f"motor{k}_voltage_V" for k in range(3)), "motor1_current_A", "motor2_current_A"]
    found, _ = taken(tmp_path, names)
    assert found == {"u1": names[0], "u2": names[1], "u3": names[2], "i2": "motor1_current_A", "i3": "motor2_current_A"}


def test_commands_and_measurements_are_families_of_their_own(tmp_path):
    found, _ = taken(tmp_path, ["w0_cmd_rad_s", "w1_cmd_rad_s", "w2_cmd_rad_s", "w1_rpm", "w2_rpm", "w3_rpm"])
    assert [found[f"w{k}"] for k in (1, 2, 3)] == ["w1_rpm", "w2_rpm", "w3_rpm"]
    assert [found[f"w{k}_cmd"] for k in (1, 2, 3)] == ["w0_cmd_rad_s", "w1_cmd_rad_s", "w2_cmd_rad_s"]


@pytest.mark.parametrize(
    ("name", "component", "unit"),
    [
        ("/motor1/velocity_rad_s/data", "w1", "rad/s"),
        ("/motor2/current_mA/data[0]", "i2", "mA"),
        ("/drive/velocity_rpm/wheel_1", "w1", "rpm"),
        ("/Drive/Motor3/DriveVelocityRadPerSec", "w3", "rad/s"),
        ("/drive/motor1/appliedVolts", "u1", "volts"),
        ("/motor1/velocity_rad_s.value", "w1", "rad/s"),
        ("/robot_A/wheel1/speed_rpm", "w1", "rpm"),
    ],
)
def test_a_unit_in_the_name_of_a_topic_counts(tmp_path, name, component, unit):
    columns = guess_columns(table_of(tmp_path, {"t_s": clock(0.01), name: 1})).columns
    assert [(key, column.name, column.unit) for key, column in columns.items() if key != "t"] == [
        (component, name, unit)
    ]
