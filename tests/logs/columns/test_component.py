"""What a name says: a sensor is no motor, percent is a duty, counts per second ask for their counts per turn."""

import numpy as np
import pytest

from omnidyn.logs.columns.guess import guess_columns
from omnidyn.units import parse_unit
from tests.logs.columns.test_guess import ROWS, clock, table_of
from tests.support.codes import said


def guessed(tmp_path, more, **options):
    return guess_columns(table_of(tmp_path, {"t_s": clock(0.01), **more}), **options)


def taken(columns):
    return {key: (column.name, column.unit) for key, column in columns.columns.items() if key != "t"}


SENSORS = [
    "encoder_V",
    "ntc_V",
    "pot_V",
    "hall_V",
    "hall_A",
    "encoder_A",
    "adc_V",
    "potentiometer_voltage_V",
    "Hall_Voltage",
    "thermistor_volts",
    "ENCODER_V",
    "encoderVoltage",
    "ntc1_V",
    "hall_1_mV",
    "sync_V",
]


@pytest.mark.parametrize("name", SENSORS)
def test_the_volts_of_a_sensor_are_none_of_a_motor(tmp_path, name):
    columns = guessed(tmp_path, {name: 2.5, "duty_pct": 40.0, "speed_rad_s": 9.0})
    drives = {key: value for key, value in taken(columns).items() if key[0] in "udi"}
    assert drives in ({"d1": ("duty_pct", "pct")}, {})  # a number makes it another column of no motor
    assert not {key for key in taken(guessed(tmp_path, {name: 2.5, "speed_rad_s": 9.0})) if key[0] in "udi"}


@pytest.mark.parametrize("name", ["motor_current_sensor_A", "current_sense_A", "adc_current_A"])
def test_a_current_may_say_its_sensor(tmp_path, name):
    assert taken(guessed(tmp_path, {name: 2.5})) == {"i1": (name, "A")}
    assert taken(guessed(tmp_path, {"motor_voltage_sense_V": 2.5})) == {"u1": ("motor_voltage_sense_V", "V")}
    assert taken(guessed(tmp_path, {"sensor_voltage_V": 2.5, "sensor_V": 2.5, "sense_V": 2.0})) == {}


def test_volts_of_what_no_word_says_to_be_a_motor_stand_back(tmp_path):
    columns = guessed(tmp_path, {"logic_V": 5.0, "duty_%": 40.0, "speed_rad_s": 9.0})
    assert taken(columns) == {"d1": ("duty_%", "%"), "w1": ("speed_rad_s", "rad/s")}
    assert columns.unused == ("logic_V",)
    assert said(columns.doubts) == ()


@pytest.mark.parametrize(
    "name", ["duty_pct", "pwm_pct", "duty_percent", "DUTY_PCT", "throttle_%", "duty_cycle_pct", "Tastgrad_%"]
)
def test_percent_is_a_duty(tmp_path, name):
    columns = guessed(tmp_path, {name: 50.0, "speed_rad_s": 9.0})
    assert columns.columns["d1"].name == name
    assert columns.columns["d1"].factor == 0.01
    assert said(columns.doubts) == ()


@pytest.mark.parametrize(("name", "component"), [("cmd_pct", "d1"), ("motor_cmd_%", "d1"), ("cmd_V", "u1")])
def test_what_is_commanded_in_percent_or_volts_drives_the_motor(tmp_path, name, component):
    assert guessed(tmp_path, {name: 50.0, "speed_rad_s": 9.0}).columns[component].name == name


@pytest.mark.parametrize("name", ["humidity_%", "efficiency_pct", "soc_%", "cpu_load_percent"])
def test_percent_of_what_no_word_says_to_be_a_motor_is_left(tmp_path, name):
    columns = guessed(tmp_path, {name: 50.0, "speed_rad_s": 9.0})
    assert list(columns.columns) == ["t", "w1"]
    assert said(columns.doubts) == ()


def test_a_charge_in_percent_is_no_supply(tmp_path):
    columns = guessed(tmp_path, {"battery_pct": 80.0, "w1_rad_s": 1.0})
    assert list(columns.columns) == ["t", "w1"]
    assert said(columns.doubts) == ()


def test_a_speed_in_percent_is_asked_about_and_its_command_is_a_duty(tmp_path):
    assert taken(guessed(tmp_path, {"speed_cmd_1_pct": 50.0})) == {"d1": ("speed_cmd_1_pct", "pct")}
    columns = guessed(tmp_path, {"speed_1_pct": 50.0})
    assert taken(columns) == {}
    assert "pct is no unit of a turn rate" in said(columns.doubts)[0]


def test_the_power_of_a_motor_is_a_duty_and_that_in_watts_is_not(tmp_path):
    columns = guessed(tmp_path, {"motor_1_power": -0.5, "motor_2_power": 0.7})
    assert taken(columns) == {"d1": ("motor_1_power", "duty"), "d2": ("motor_2_power", "duty")}
    assert taken(guessed(tmp_path, {"motor_1_power_W": 0.5, "power [W]": 0.5})) == {}
    beside = guessed(tmp_path, {"u1_V": 5.0, "power1": 0.5, "battery_power": 0.3})
    assert taken(beside) == {"u1": ("u1_V", "V")}
    assert said(beside.doubts) == ()
    sides = guessed(tmp_path, {"Power_left": -0.5, "Power_right": 0.7})
    assert said(sides.doubts) == (
        "Power_left, Power_right look like d1, but no number says which wheel each is (say `column` d1=Power_left and "
        "so on): not taken",
    )


@pytest.mark.parametrize("name", ["enc1_ticks_per_s", "speed1_ticks_s", "velocity1TicksPerSecond", "w1 [counts/s]"])
def test_counts_per_second_ask_for_the_counts_per_turn(tmp_path, name):
    columns = guessed(tmp_path, {name: 300.0})
    assert "counts per turn are not known: not taken; say `assume` w=ticks/COUNTS_PER_TURN/s" in said(columns.doubts)[0]
    column = guessed(tmp_path, {name: 300.0}, assume={"w": "ticks/150/s"}).columns["w1"]
    assert 300.0 * column.factor == pytest.approx(4.0 * np.pi)


def test_inches_are_a_place_and_what_goes_in_is_none(tmp_path):
    columns = guessed(tmp_path, {"x_in": 10.0, "y (in)": 20.0, "vx_in_s": 1.0, "voltage_in_1": 3.0})
    assert [columns.columns[key].factor for key in ("x", "y", "vx")] == [0.0254] * 3
    assert "u1" not in columns.columns or columns.columns["u1"].unit == "V"


@pytest.mark.parametrize(
    ("name", "units"),
    [
        ("u1_V", "`assume` u=duty/255"),
        ("d1_duty", "`assume` d=duty/255"),
        ("pwm1", "`assume` d=duty/255"),
        ("duty_1_%", "`assume` d=duty/255"),
    ],
)
def test_numbers_that_cannot_be_what_they_are_called_are_asked_about(tmp_path, name, units):
    values = np.round(np.linspace(-230.0, 230.0, ROWS))
    columns = guessed(tmp_path, {name: values})
    assert taken(columns) == {}
    assert said(columns.doubts)[0].endswith(f"not taken; say {units}")
    letter, unit = units.removeprefix("`assume` ").split("=")
    column = guessed(tmp_path, {name: values}, assume={letter: unit}).columns["d1"]  # the remedy works
    assert column.factor == pytest.approx(1.0 / 255.0)


@pytest.mark.parametrize(("unit", "asked"), [("V", True), ("duty", True), ("%", True), ("duty/255", False)])
def test_a_unit_that_is_assumed_is_held_against_the_numbers(tmp_path, unit, asked):
    columns = guessed(tmp_path, {"pwm1": np.round(np.linspace(-230.0, 230.0, ROWS))}, assume={"d": unit})
    assert bool(said(columns.doubts)) is asked
    if asked:
        assert said(columns.doubts)[0].endswith("say `assume` d=duty/255")


@pytest.mark.parametrize(
    ("largest", "scale"), [(255.0, "duty/255"), (1000.0, "duty/1000"), (1023.0, "duty/1023"), (3600.0, "duty/4095")]
)
def test_the_scale_of_a_pwm_is_the_next_one(tmp_path, largest, scale):
    columns = guessed(tmp_path, {"pwm1": np.linspace(-largest, largest, ROWS)})
    assert said(columns.doubts)[0].endswith(f"not taken; say `assume` d={scale}")


def test_widths_of_servo_pulses_are_no_pwm(tmp_path):
    columns = guessed(tmp_path, {"pwm1": np.linspace(1100.0, 1900.0, ROWS)})
    assert "1100 to 1900 look like widths of servo pulses: log (width - 1500) / 500, a duty" in said(columns.doubts)[0]


def test_what_may_be_asked_of_a_driver_is_believed(tmp_path):
    assert "d1" in guessed(tmp_path, {"d1_duty": np.linspace(-1.7, 1.7, ROWS)}).columns  # a sum of sticks
    assert "u1" in guessed(tmp_path, {"u1_V": np.linspace(-48.0, 48.0, ROWS)}).columns


STEPS = np.arange(ROWS) * 130.0


@pytest.mark.parametrize("name", ["angle", "Winkel", "pos", "ENCODER", "angle_rad", "wheel_angle", "enc1", "a1_rad"])
@pytest.mark.parametrize("values", [STEPS % 360.0, (STEPS + 180.0) % 360.0 - 180.0, np.round(STEPS * 1.37) % 360.0])
def test_an_angle_that_jumps_by_360_is_asked_about_whatever_its_name(tmp_path, name, values):
    columns = guessed(tmp_path, {"voltage_V": 3.0, name: values})
    assert not {"a1", "heading"} & columns.columns.keys()
    assert "it jumps as degrees do" in said(columns.doubts)[0]
    assert "deg" in said(columns.doubts)[0].rpartition("say ")[2]
    assert guessed(tmp_path, {name: values}, assume={"a": "deg"}).columns["a1"].unit == "deg"


@pytest.mark.parametrize("values", [STEPS / 57.3, STEPS / 57.3 % 6.28, STEPS, STEPS * 10.0 + 0.5])
def test_an_angle_that_does_not_is_not_asked_about(tmp_path, values):
    columns = guessed(tmp_path, {"voltage_V": 3.0, "angle_rad": values})
    assert columns.columns["a1"].unit == "rad"
    assert said(columns.doubts) == ()


@pytest.mark.parametrize(
    ("header", "want"),
    [
        ("Zeit [s];Tastgrad [%];Drehzahl [U/min];Strom [A]", {"d1": "%", "w1": "rpm", "i1": "A"}),
        ("temps (s);tension (V);vitesse (tr/min);courant (mA)", {"u1": "V", "w1": "rpm", "i1": "mA"}),
        ("Tiempo [s];Tensión [V];Velocidad [rad/s];Corriente [A]", {"u1": "V", "w1": "rad/s", "i1": "A"}),
        ("TIME (S);DUTY (%);SPEED (RPM);CURRENT (A)", {"d1": "%", "w1": "rpm", "i1": "A"}),
    ],
)
def test_tables_of_other_languages_with_decimal_commas(tmp_path, header, want):
    from omnidyn.logs.readers.read_table import read_table

    path = tmp_path / "log.csv"
    rows = [f"{0.01 * k:.2f};{k / 2:.3f};{k:.3f};{0.1 * k:.3f}".replace(".", ",") for k in range(ROWS)]
    path.write_text("\n".join([header, *rows]), "utf-8")
    columns = guess_columns(read_table(path))
    assert {key: column.unit for key, column in columns.columns.items() if key != "t"} == want
    assert said(columns.doubts) == ()
    assert parse_unit(columns.columns["t"].unit).size == 1.0
