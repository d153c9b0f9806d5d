"""Which column is what: names of real logs, doubts that are said, maps that come back equal."""

import numpy as np
import pytest

from omnidyn import load_robot, read_log
from omnidyn.errors import InputError
from omnidyn.logs.column import Column
from omnidyn.logs.columns.guess import guess_columns
from omnidyn.logs.columns.mapping import ColumnMap, load_map, map_to_toml, parse_column, save_map
from omnidyn.logs.columns.names import read_name
from omnidyn.logs.readers.read_table import read_table
from omnidyn.units import parse_unit
from tests.support.codes import said

ROWS = 20


def table_of(tmp_path, columns, units=None, name="log.csv"):
    """A table with these columns; a number stands for a column of it."""
    values = {key: np.broadcast_to(np.asarray(value, float), (ROWS,)) for key, value in columns.items()}
    lines = [",".join(values)]
    if units:
        lines.append(",".join(units))
    lines += [",".join(repr(float(column[k])) for column in values.values()) for k in range(ROWS)]
    path = tmp_path / name
    path.write_text("\n".join(lines) + "\n", "utf-8")
    return read_table(path)


def clock(step):
    return np.arange(ROWS) * step


def found(columns):
    return {key: (column.name, column.unit, column.side) for key, column in columns.columns.items()}


@pytest.mark.parametrize(
    ("name", "component"),
    [
        ("u1_V", "u1"),
        ("w2_cmd_rad_s", "w2_cmd"),
        ("vx_cmd_m_s", "vx_cmd"),
        ("heading_rad", "heading"),
        ("supply_V", "supply"),
        ("a3_rad", "a3"),
        ("d1_duty", "d1"),
        ("motor_1_volts", "u1"),
        ("motor1_rpm", "w1"),
        ("Motor2Current_mA", "i2"),
        ("wheelSpeed3_rad_s", "w3"),
        ("vbx_sp_m_s", "vx_cmd"),
        ("wb_sp_rad_s", "omega_cmd"),
        ("cmd_vel_x_m_s", "vx_cmd"),
        ("yaw_rate_deg_s", "omega"),
        ("gyro_z_deg_s", "omega"),
        ("battery_voltage_V", "supply"),
        ("rpm1", "w1"),
        ("RPM_1", "w1"),
        ("motor2Rpm", "w2"),
        ("wheelrpm3", "w3"),
        ("rpm_1_filtered", "w1"),
        ("current_mA_1", "i1"),
        ("gyro_dps_z", "omega"),
        ("V1_V", "u1"),
        ("field.motor1.voltage_V", "u1"),
        ("phi_deg", "heading"),
        ("v_n_m_s", "vy"),
        ("x_mm", "x"),
        ("pwm1_duty", "d1"),
    ],
)
def test_a_column_is_known_by_its_name_and_unit(tmp_path, name, component):
    columns = guess_columns(table_of(tmp_path, {"t_s": clock(0.01), name: 0.5}))
    assert list(columns.columns) == ["t", component]
    assert columns.columns[component].name == name
    assert columns.unused == ()


@pytest.mark.parametrize(
    ("names", "components"),
    [
        (["/odom/twist/twist/linear/x", "/odom/twist/twist/linear/y", "/odom/twist/twist/angular/z"], "vx vy omega"),
        (["twist.twist.linear.x", "twist.twist.angular.z", "pose.pose.position.y"], "vx omega y"),
        (["/cmd_vel/linear/x", "/cmd_vel/linear/y", "/cmd_vel/angular/z"], "vx_cmd vy_cmd omega_cmd"),
        (["/joint_states/wheel_1_joint/velocity", "/joint_states/wheel_2_joint/position"], "w1 a2"),
        (["/joint_states/velocity[0]", "/joint_states/velocity[1]", "/joint_states/velocity[2]"], "w1 w2 w3"),
        (["/imu/angular_velocity/z"], "omega"),
        (["robot2/wheel1/speed", "robot2/wheel2/speed", "robot2/wheel3/speed"], "w1 w2 w3"),
        (["imu0_gyro_z", "w1_rad_s", "w2_rad_s"], "omega w1 w2"),
        (["battery0_voltage", "w1_rad_s"], "supply w1"),
    ],
)
def test_the_names_of_topics_are_known(tmp_path, names, components):
    columns = guess_columns(table_of(tmp_path, {"t_s": clock(0.01), **dict.fromkeys(names, 0.5)})).columns
    assert {columns[key].name: key for key in columns if key != "t"} == dict(
        zip(names, components.split(), strict=True)
    )


@pytest.mark.parametrize(
    "name",
    [
        "twist/linear/z",
        "twist/angular/x",
        "/imu/angular_velocity/y",
        "pose/orientation/z",
        "vz",
        "imu/linear_acceleration/x",
    ],
)
def test_what_a_topic_says_of_other_axes_is_left_alone(tmp_path, name):
    assert list(guess_columns(table_of(tmp_path, {"t_s": clock(0.01), name: 0.5})).columns) == ["t"]


def test_two_wheels_named_by_their_place_are_no_log_of_one_motor(tmp_path):
    columns = guess_columns(table_of(tmp_path, {"t_s": clock(0.01), "left_vel": 1, "right_vel": 2}))
    assert list(columns.columns) == ["t"]
    assert said(columns.doubts) == (
        "left_vel, right_vel look like w1, but no number says which wheel each is (say `column` w1=left_vel and so "
        "on): not taken",
    )


@pytest.mark.parametrize("name", ["temps [s]", "tiempo (ms)", "X_Value [us]"])
def test_the_only_column_with_a_unit_of_time_is_the_clock(tmp_path, name):
    columns = guess_columns(table_of(tmp_path, {name: clock(1.0), "w1_rad_s": 1}))
    assert columns.columns["t"].name == name.partition(" ")[0]


@pytest.mark.parametrize("name", ["ax", "temperature1", "motor_1_temp", "dx", "torque2", "index", "foo", "err1"])
def test_what_no_run_holds_is_left_alone(tmp_path, name):
    columns = guess_columns(table_of(tmp_path, {"t_s": clock(0.01), name: 0.5}))
    assert list(columns.columns) == ["t"]
    assert columns.unused == (name,)


def test_a_units_row_gives_the_units(tmp_path):
    table = table_of(tmp_path, {"t": clock(10.0), "w1": 1, "i1": 2}, ["ms", "rpm", "mA"])
    assert found(guess_columns(table)) == {
        "t": ("t", "ms", "wheel"),
        "w1": ("w1", "rpm", "wheel"),
        "i1": ("i1", "mA", "wheel"),
    }


def test_the_columns_of_the_robotino(tmp_path):
    names = [
        "t",
        "xsetspeed",
        "ysetspeed",
        "setvel",
        "m1setvel",
        "m1pos",
        "m1vel",
        "m1cur",
        "xcur",
        "rotcur",
        "xpos",
        "ang",
        "dx",
        "dang",
    ]
    units = ["ms", "m/s", "m/s", "rad/s", "rad/s", "ticks", "rad/s", "A", "A", "A", "pix", "deg", "mm", "deg"]
    columns = guess_columns(table_of(tmp_path, {name: clock(31.0) if name == "t" else 1.0 for name in names}, units))
    assert {key: column.name for key, column in columns.columns.items()} == {
        "t": "t",
        "i1": "m1cur",
        "heading": "ang",
        "vx_cmd": "xsetspeed",
        "vy_cmd": "ysetspeed",
        "omega_cmd": "setvel",
        "w1": "m1vel",
        "w1_cmd": "m1setvel",
    }
    assert columns.columns["w1"].side == columns.columns["w1_cmd"].side == "motor"
    doubts = " ".join(said(columns.doubts))
    assert "m1pos looks like a1, but counts per turn are not known" in doubts
    assert 'the unit pix is unknown: not taken; say `column` "x=xpos:UNIT"' in doubts


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("rpm1", "rpm"),
        ("RPM_1", "rpm"),
        ("motor2Rpm", "rpm"),
        ("wheelrpm3", "rpm"),
        ("w1_rpm_filt", "rpm"),
        ("current_mA_2", "mA"),
        ("gyro_dps_z", "dps"),
        ("speed_rad_s_3", "rad/s"),
        ("yaw_deg_est", "deg"),
    ],
)
def test_a_unit_may_stand_anywhere_in_a_name(tmp_path, name, unit):
    columns = guess_columns(table_of(tmp_path, {"t_s": clock(0.01), name: 0.5})).columns
    assert [column.unit for key, column in columns.items() if key != "t"] == [unit]


@pytest.mark.parametrize(("name", "step", "unit"), [("millis", 20.0, "ms"), ("micros", 5e3, "us")])
def test_the_clocks_of_a_microcontroller_say_their_unit(tmp_path, name, step, unit):
    columns = guess_columns(table_of(tmp_path, {name: 4123 + clock(step), "rpm1": 1.0})).columns
    assert columns["t"].name == name
    assert parse_unit(columns["t"].unit).size == parse_unit(unit).size


def test_whole_numbers_of_an_encoder_are_counts_and_no_radians(tmp_path):
    columns = guess_columns(table_of(tmp_path, {"t_s": clock(0.01), "enc1": clock(7.0), "enc2": clock(-7.0)}))
    assert list(columns.columns) == ["t"]
    assert said(columns.doubts) == (
        "enc1, enc2 look like a1, a2, but counts per turn are not known: not taken; say `assume` "
        "a=ticks/COUNTS_PER_TURN",
    )
    assert "a1" in guess_columns(table_of(tmp_path, {"t_s": clock(0.01), "angle1": clock(0.25)})).columns


def test_a_turn_rate_beyond_any_robot_is_not_taken_as_rad_s(tmp_path):
    columns = guess_columns(table_of(tmp_path, {"t_s": clock(0.01), "gyro_z": clock(20.0)}))
    assert "omega" not in columns.columns
    assert 'say `column` "omega=gyro_z:deg/s"' in said(columns.doubts)[0]
    assert "omega" in guess_columns(table_of(tmp_path, {"t_s": clock(0.01), "gyro_z": clock(0.2)})).columns


def test_an_unknown_unit_in_brackets_is_a_doubt(tmp_path):
    columns = guess_columns(table_of(tmp_path, {"t_s": clock(0.01), "omega [pix/s]": 1.0, "speed1 (pix/s)": 2.0}))
    assert list(columns.columns) == ["t"]
    assert all("the unit pix/s is unknown: not taken" in doubt for doubt in said(columns.doubts))
    assert len(columns.doubts) == 2


def test_german_degrees_are_degrees(tmp_path):
    columns = guess_columns(table_of(tmp_path, {"t_s": clock(0.01), "vx": 1, "omega [Grad/s]": 57.0}))
    assert parse_unit(columns.columns["omega"].unit).size == parse_unit("deg/s").size


def test_v_with_a_number_may_be_volts_or_a_speed(tmp_path):
    columns = guess_columns(table_of(tmp_path, {"t_s": clock(0.01), "V_1": 1, "V_2": 2, "omega_1": 3}))
    assert said(columns.doubts) == (
        "V_1, V_2 look like u1, u2, which may be voltages or speeds (say `column` u1=V_1:V and so on): not taken",
    )


def test_a_name_that_spells_voltage_is_in_volts(tmp_path):
    names = {"field.motor1.voltage": 5.0, "Spannung 2": -4.0}
    columns = guess_columns(table_of(tmp_path, {"t_s": clock(0.01), **names})).columns
    assert columns["u1"].unit == columns["u2"].unit == "V"


def test_volts_or_percent_is_asked_once_for_all_wheels(tmp_path):
    doubts = said(guess_columns(table_of(tmp_path, {"t_s": clock(0.01), "pwm1": 45.0, "pwm2": 47.0})).doubts)
    assert len(doubts) == 1
    assert "pwm1, pwm2 look like d1, d2, but no unit is given, and up to 47 may be volts or percent" in doubts[0]


def test_counts_are_an_angle_once_their_counts_per_turn_are_said(tmp_path):
    table = table_of(tmp_path, {"t_s": clock(0.01), "enc1": clock(5.0)})
    assert "a1" not in guess_columns(table_of(tmp_path, {"t": clock(0.01), "m1pos": 3}, ["s", "ticks"])).columns
    columns = guess_columns(table, assume={"a": "ticks/2000"})
    assert columns.columns["a1"] == Column("enc1", "ticks/2000")


@pytest.mark.parametrize(
    ("step", "unit"), [(0.01, "s"), (11.0, "ms"), (0.002, "s"), (31.0, "ms"), (20_000.0, "us"), (2e7, "ns")]
)
def test_time_without_a_unit_is_taken_where_it_is_unmistakable(tmp_path, step, unit):
    columns = guess_columns(table_of(tmp_path, {"t": clock(step), "w1": 1.0}))
    assert columns.columns["t"].unit == unit
    assert any("taken as " + unit in note for note in said(columns.notes))


@pytest.mark.parametrize(
    ("step", "units"),
    [(0.5, ("s", "ms")), (2.0, ("s", "ms")), (500.0, ("ms", "us")), (1100.0, ("ms", "us")), (5e5, ("us", "ns"))],
)
def test_time_that_may_be_two_units_is_not_taken(tmp_path, step, units):
    columns = guess_columns(table_of(tmp_path, {"t": clock(step), "w1": 1.0}))
    assert "t" not in columns.columns
    assert all(f'`column` "t=t:{unit}"' in said(columns.doubts)[0] for unit in units)


def test_a_counter_is_no_clock(tmp_path):
    table = table_of(tmp_path, {"timestep (8Hz)": clock(45.0), "voltage": 1.0}, ["#", "V"])
    columns = guess_columns(table)
    assert "t" not in columns.columns
    assert "timestep" in " ".join(said(columns.doubts))


def test_volts_or_duty_is_not_guessed(tmp_path):
    table = table_of(tmp_path, {"t_s": clock(0.01), "u1": 45.0})
    columns = guess_columns(table)
    assert "u1" not in columns.columns
    assert "`assume` u=V" in said(columns.doubts)[0]
    assert guess_columns(table, assume={"u": "%"}).columns["d1"] == Column("u1", "%")
    assert guess_columns(table, assume={"u1": "V"}).columns["u1"] == Column("u1", "V")


def test_volts_within_the_limit_of_the_robot_are_volts(tmp_path):
    robot = load_robot("axebot")
    columns = guess_columns(table_of(tmp_path, {"t_s": clock(0.01), "u1": 5.5, "u2": 0.7}), robot)
    assert columns.columns["u1"].unit == "V"
    assert "u2" not in columns.columns  # 0.7 V, or a duty of 0.7


def test_commands_tell_the_side_of_the_gear(tmp_path):
    robot = load_robot("robotino")
    vx = np.linspace(0.1, 0.3, ROWS)
    rim = [-np.sin(np.radians(angle)) * vx for angle in (60.0, 180.0, 300.0)]
    body = {"t_s": clock(0.01), "vx_cmd_m_s": vx, "vy_cmd_m_s": 0.0, "omega_cmd_rad_s": 0.0}
    for factor, side in ((1.0, "wheel"), (16.0, "motor")):
        speeds = {f"w{k + 1}_cmd_rad_s": factor * each / 0.040 for k, each in enumerate(rim)}
        columns = guess_columns(table_of(tmp_path, {**body, **speeds}), robot)
        assert columns.columns["w1_cmd"].side == side


def test_counts_that_a_name_puts_before_the_gear_are_said_to_be_there(tmp_path):
    """`m1` may be motor 1 as well as wheel 1: taken in silence, every angle was off by the gear ratio."""
    table = table_of(tmp_path, {"t_s": clock(0.01), **{f"m{k}_ticks": np.arange(ROWS) for k in (1, 2, 3)}})
    columns = guess_columns(table, assume={"a": "ticks/48"})
    assert columns.columns["a1"].side == "motor"
    (note,) = (note for note in said(columns.notes) if "m1_ticks" in note)
    assert "ticks/COUNTS@wheel" in note
    for side in ("motor", "wheel"):
        settled = guess_columns(table, assume={"a": f"ticks/48@{side}"})
        assert settled.columns["a1"].side == side
        assert not any("m1_ticks" in note for note in said(settled.notes))


def test_an_assumed_unit_may_say_the_side_of_the_gear(tmp_path):
    """It was refused as an unknown unit; only a column of its own could have a side."""
    table = table_of(tmp_path, {"t_s": clock(0.01), "enc1": np.arange(ROWS), "enc2": np.arange(ROWS), "w1": 2.0})
    columns = guess_columns(table, assume={"a": "ticks/48@motor", "w1": "rpm@motor"}).columns
    assert columns["a2"] == Column("enc2", "ticks/48", "motor")
    assert columns["w1"] == Column("w1", "rpm", "motor")
    assert guess_columns(table, assume={"a": "ticks/48@wheel"}).columns["a1"] == Column("enc1", "ticks/48")
    robot = load_robot("axebot")
    run = read_log(tmp_path / "log.csv", robot, assume={"a": "ticks/48@motor"})
    turn = 2.0 * np.pi / 48.0 / 19.0  # the gear of the AxeBot is 19
    assert run.wheel_angle[:, 0] == pytest.approx(turn * np.arange(ROWS))
    with pytest.raises(InputError, match="unknown side of the gear; got ticks/48@shaft; expected @motor or @wheel"):
        guess_columns(table, assume={"a": "ticks/48@shaft"})
    volts = table_of(tmp_path, {"t_s": clock(0.01), "u1": 2.0})
    with pytest.raises(InputError, match="only speeds and angles of wheels have a motor side; got u1: u1"):
        guess_columns(volts, assume={"u": "V@motor"})


def test_wheels_may_be_counted_from_zero(tmp_path):
    columns = guess_columns(table_of(tmp_path, {"t_s": clock(0.01), "w0_rpm": 1, "w1_rpm": 2, "w2_rpm": 3}))
    assert [columns.columns[f"w{k}"].name for k in (1, 2, 3)] == ["w0_rpm", "w1_rpm", "w2_rpm"]
    assert any("numbered from 0" in note for note in said(columns.notes))


def test_names_of_a_run_file_may_be_counted_from_zero_too(tmp_path):
    names = ["u0_V", "u1_V", "u2_V", "w0_cmd_rad_s", "w1_cmd_rad_s", "w2_cmd_rad_s", "i1_A", "i2_A"]
    columns = guess_columns(table_of(tmp_path, {"t_s": clock(0.01), **dict.fromkeys(names, 1)}))
    assert {key: column.name for key, column in columns.columns.items() if key != "t"} == {
        "u1": "u0_V",
        "u2": "u1_V",
        "u3": "u2_V",
        "i2": "i1_A",
        "i3": "i2_A",
        "w1_cmd": "w0_cmd_rad_s",
        "w2_cmd": "w1_cmd_rad_s",
        "w3_cmd": "w2_cmd_rad_s",
    }
    assert said(columns.doubts) == ()


@pytest.mark.parametrize(("speed", "more"), [("w{}_rad_s", ()), ("wheel{}_rpm", ()), ("w{}_rad_s", ("enc0_deg",))])
def test_what_counts_farther_than_wheels_from_zero_counts_from_one(tmp_path, speed, more):
    names = ["u0_V", "u1_V", "u2_V", *more, *(speed.format(k) for k in (1, 2, 3))]
    columns = guess_columns(table_of(tmp_path, {"t_s": clock(0.01), **dict.fromkeys(names, 1)}))
    assert [columns.columns[f"u{k}"].name for k in (1, 2, 3)] == ["u0_V", "u1_V", "u2_V"]
    assert [columns.columns[f"w{k}"].name for k in (1, 2, 3)] == [speed.format(k) for k in (1, 2, 3)]
    assert "wheels are numbered from 0 in the file: 0 is wheel 1 (w from 1)" in said(columns.notes)


def test_a_units_row_that_contradicts_a_name_is_still_refused(tmp_path):
    columns = guess_columns(table_of(tmp_path, {"t_s": clock(0.01), "w1_rad_s": 1}, ["s", "rad"]))
    assert list(columns.columns) == ["t"]
    assert said(columns.doubts) == (
        "w1_rad_s looks like w1, but rad is no unit of a turn rate: not taken; say `assume` w=UNIT",
    )


def test_units_in_capitals_are_units(tmp_path):
    columns = guess_columns(table_of(tmp_path, {"T_S": clock(0.01), "W1_RAD_S": 1, "I1_A": 2, "VX_M_S": 1}))
    assert {key: (column.name, column.unit) for key, column in columns.columns.items() if key != "t"} == {
        "w1": ("W1_RAD_S", "rad/s"),
        "i1": ("I1_A", "A"),
        "vx": ("VX_M_S", "m/s"),
    }


@pytest.mark.parametrize(
    ("yaw", "taken"),
    [
        (np.arange(ROWS) * 30.0 % 360.0, ""),
        ((np.arange(ROWS) * 30.0 + 180.0) % 360.0 - 180.0, ""),
        (np.arange(ROWS) * 0.5 % 6.28, "rad"),
        (np.arange(ROWS) * 30.0, ""),
        (np.arange(ROWS) * 3.0, "rad"),
    ],
)
def test_a_heading_that_jumps_as_degrees_do_is_not_taken_as_radians(tmp_path, yaw, taken):
    columns = guess_columns(table_of(tmp_path, {"t_s": clock(0.01), "x_m": 1, "yaw": yaw}))
    assert (columns.columns["heading"].unit if "heading" in columns.columns else "") == taken
    if not taken:
        assert said(columns.doubts) == (
            "yaw looks like heading, but no unit is given, and it jumps as degrees do: not taken; say `column` "
            '"heading=yaw:deg"',
        )


def test_a_log_of_one_motor_needs_no_numbers(tmp_path):
    table = table_of(
        tmp_path, {"time": clock(0.01), "voltage": 1, "position": 2, "velocity": 3}, ["s", "V", "turns", "turns/s"]
    )
    columns = guess_columns(table)
    assert {key: column.name for key, column in columns.columns.items()} == {
        "t": "time",
        "u1": "voltage",
        "a1": "position",
        "w1": "velocity",
    }


def test_two_columns_for_one_component_take_the_first_and_say_so(tmp_path):
    columns = guess_columns(table_of(tmp_path, {"t_s": clock(0.01), "w1_rad_s": 1, "wheel_speed_1_rpm": 2}))
    assert columns.columns["w1"].name == "w1_rad_s"
    assert "wheel_speed_1_rpm looks like w1, which is w1_rad_s already: not taken" in said(columns.doubts)


@pytest.mark.parametrize(
    ("text", "component", "column"),
    [
        ("u1=motor_1_volts:V", "u1", Column("motor_1_volts", "V")),
        ("w2=-m2vel:rpm@motor", "w2", Column("m2vel", "rpm", "motor", True)),
        ("w2=m2vel@motor", "w2", Column("m2vel", "rad/s", "motor")),
        ("w2=m2vel", "w2", Column("m2vel", "rad/s")),
        ("t=timestep (8Hz):0.125 ms", "t", Column("timestep (8Hz)", "0.125 ms")),
        ("x=a:b", "x", Column("a:b", "m")),
    ],
)
def test_a_column_on_the_command_line(text, component, column):
    assert parse_column(text, ["a:b"]) == (component, column)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("u1", "cannot read the mapping"),
        ("u1=", "cannot read the mapping"),
        ("q7=a:V", "unknown channel"),
        ("u1=a:parsec", "unknown unit"),
    ],
)
def test_a_column_that_cannot_be_read_is_refused(text, words):
    with pytest.raises(InputError, match=words):
        parse_column(text)


def test_a_unit_of_another_quantity_is_refused():
    with pytest.raises(InputError, match=r"w1 cannot have this unit; got V \(voltage\); expected a turn rate"):
        ColumnMap({"w1": Column("a", "V")})
    with pytest.raises(InputError, match=r"say how many make a turn: ticks/2000"):
        ColumnMap({"a1": Column("a", "ticks")})
    with pytest.raises(InputError, match="only speeds and angles of wheels have a motor side"):
        ColumnMap({"u1": Column("a", "V", "motor")})


def test_a_map_comes_back_equal(tmp_path):
    columns = ColumnMap(
        {
            "t": Column('odd "name"\t', "ms"),
            "w1": Column("m1vel", "rpm", "motor", True, 0.02),
            "x": Column("xpos", "1.84 mm"),
        }
    )
    save_map(columns, tmp_path / "map.toml")
    assert load_map(tmp_path / "map.toml") == columns


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[w1", "not valid TOML"),
        ("schema = 7", "unknown schema"),
        ("[w1]\ncolumn = 'a'", "a column is not described"),
        ("[w1]\ncolumn = 'a'\nunit = 'rpm'\ncolour = 'red'", "unknown key; got colour"),
        ("[w1]\ncolumn = 3\nunit = 'rpm'", "column has the wrong type"),
        ("[w1]\ncolumn = 'a'\nunit = 'rpm'\nlatency_s = true", "latency_s has the wrong type"),
        ("[w1]\ncolumn = 'a'\nunit = 'rpm'\nlatency_s = 1e400", "not a latency"),
        ("[w1]\ncolumn = 'a'\nunit = 'rpm'\nside = 'left'", "unknown side"),
        ("[nope]\ncolumn = 'a'\nunit = 'rpm'", "unknown channel"),
        ("w1 = 3", "a column is not described"),
    ],
)
def test_a_bad_map_is_refused_with_its_table(tmp_path, text, words):
    path = tmp_path / "map.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=words) as error:
        load_map(path)
    assert str(path) in str(error.value)


def test_the_text_of_a_map_is_stable():
    assert map_to_toml(ColumnMap({"t": Column("a", "s")})).splitlines()[1:] == [
        "schema = 1",
        "",
        "[t]",
        'column = "a"',
        'unit = "s"',
    ]


@pytest.mark.parametrize("name", ["", " ", "\x00", "ü" * 300, "1" * 50, "_" * 80, "a_b_c_d_e_f_g_h"])
def test_any_name_can_be_read(name):
    read_name(name)


@pytest.mark.parametrize("cell", ["#N/A", "NA", "None", "0x10", "1_000", "true", "-", "\u22125.0", "1.5D+00"])
def test_one_word_in_a_column_of_numbers_is_refused_and_drops_no_wheel(tmp_path, cell):
    path = tmp_path / "log.csv"
    rows = [f"{0.01 * k:.2f},{cell if k == 7 else k},{2 * k}" for k in range(ROWS)]
    path.write_text("\n".join(["t_s,w1_rad_s,w2_rad_s", *rows]), "utf-8")
    with pytest.raises(InputError, match=r"log.csv:9, column w1_rad_s: not a number; got "):
        read_log(path)
    assert len(read_log(path, skip_bad_rows=True)) == ROWS - 1
    columns = read_log(path, columns={"w1": "w2_rad_s:rad/s"}).wheel_speed
    np.testing.assert_array_equal(columns[:, 0], 2.0 * np.arange(ROWS))


def test_cells_with_their_unit_are_doubted_in_words(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("t_s,u1,w1_rad_s,mode1\n" + "".join(f"{0.01 * k:.2f},{k}.5V,{k},fast\n" for k in range(ROWS)))
    columns = guess_columns(read_table(path))
    assert said(columns.doubts) == ("u1 looks like u1, but cells such as 0.5V are no numbers: not taken",)
    assert columns.unused == ("u1", "mode1")


@pytest.mark.parametrize("cell", ['"1,234.5"', "12.5%", "3.5 rad/s"])
def test_they_are_doubted_too_where_no_other_column_has_a_number(tmp_path, cell):
    path = tmp_path / "log.csv"
    path.write_text("t_s,w1_rad_s,w2_rad_s\n" + "".join(f"{0.01 * k:.2f},{cell},{cell}\n" for k in range(ROWS)))
    words = cell.strip('"')
    assert said(guess_columns(read_table(path)).doubts) == (
        f"w1_rad_s, w2_rad_s look like w1, w2, but cells such as {words} are no numbers: not taken",
    )


@pytest.mark.parametrize("cells", ["11/20/2026 10:00:{:02d} AM", "{:02d} sec", '"1,0{:02d}.0"'])
def test_a_time_in_words_that_are_not_known_is_refused_with_a_cell(tmp_path, cells):
    path = tmp_path / "log.csv"
    path.write_text("time,w1_rad_s\n" + "".join(f"{cells.format(k)},{k}\n" for k in range(ROWS)))
    with pytest.raises(InputError, match=r"time looks like t, but cells such as .*; write seconds, or dates such as"):
        read_log(path)


def write_twins(tmp_path, second, name="w1_rad_s"):
    rows = [f"{0.01 * k:g},{k},{second(k)}" for k in range(ROWS)]
    path = tmp_path / "twins.csv"
    path.write_text("\n".join([f"t_s,{name},{name}", *rows]) + "\n")
    return path


def test_two_columns_of_one_name_that_differ_are_asked_about(tmp_path):
    path = write_twins(tmp_path, lambda k: k + 1)
    words = r"two columns of one name; got w1_rad_s, 2 times.*`column` \"w1=w1_rad_s:rad/s\" or \"w1=w1_rad_s~2:rad/s\""
    with pytest.raises(InputError, match=words):
        read_log(path)
    run = read_log(path, columns={"w1": "w1_rad_s~2:rad/s"})
    np.testing.assert_array_equal(run.wheel_speed[:, 0], np.arange(ROWS) + 1.0)


def test_two_columns_of_one_name_that_are_equal_or_of_no_channel_are_no_question(tmp_path):
    np.testing.assert_array_equal(read_log(write_twins(tmp_path, lambda k: k)).wheel_speed[:, 0], np.arange(ROWS))
    table = table_of(tmp_path, {"t_s": clock(0.01), "u1_V": 1.0})
    assert set(guess_columns(table).columns) == {"t", "u1"}
    assert set(guess_columns(read_table(write_twins(tmp_path, lambda k: -k, "humidity"))).columns) == {"t"}
