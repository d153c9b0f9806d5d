"""Numbers that no channel of a robot has are asked about, with the unit in which they make sense; others are taken."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import omnidyn
from omnidyn.logs.columns.guess import guess_columns
from omnidyn.logs.log import Log
from omnidyn.logs.table.table import FileTable
from omnidyn.model.robot_file import load_robot
from tests.support.bags import BagMaker, write_mcap
from tests.support.codes import said

ROWS = 60


def guessed(columns, robot=None, assume=None):
    cells = {name: np.broadcast_to(np.asarray(values, dtype=float), ROWS) for name, values in columns.items()}
    cells = {"t_s": 0.01 * np.arange(ROWS), **cells}
    return guess_columns(
        FileTable(tuple(cells), cells, np.arange(ROWS) + 2, {}, "log.csv", "", ()), robot, assume or {}
    )


SWING = np.sin(0.4 * np.arange(ROWS))
RIGHT = {  # a robot of two cells, 8.1 A, 40 rad/s and 1.6 m/s on a field of 9 m: what is logged, in SI
    "supply": 7.4 - 0.2 * SWING**2,
    "u1": 7.1 * SWING,
    "i1": 8.1 * SWING,
    "w1": 80.0 * SWING,
    "vx": 1.6 * SWING,
    "x": 4.5 + 4.5 * SWING,
}


@pytest.mark.parametrize(
    ("name", "component", "per_unit", "unit"),
    [
        ("batteryVoltage", "supply", 1000.0, "mV"),
        ("batteryVoltage", "supply", 100.0, "cV"),
        ("battery", "supply", 1000.0, "mV"),
        ("vbat_V", "supply", 1000.0, "mV"),  # a name that is wrong
        ("batteryVoltage", "supply", 60.0, "V/60"),  # of a converter
        ("batteryVoltage", "supply", 128.0, "V/128"),
        ("voltage", "u1", 1000.0, "mV"),
        ("voltage1", "u1", 1000.0, "mV"),
        ("voltage1", "u1", 100.0, "cV"),
        ("u1_V", "u1", 1000.0, "mV"),
        ("current1", "i1", 1000.0, "mA"),
        ("wheel_speed_1", "w1", 180.0 / np.pi, "deg/s"),
        ("wheel_speed_1", "w1", 1000.0 / np.pi, "ticks/2000/s"),
        ("vx", "vx", 1000.0, "mm/s"),
        ("vx", "vx", 100.0, "cm/s"),
        ("vx", "vx", 1.0 / 0.0254, "in/s"),
        ("x", "x", 1000.0, "mm"),
    ],
)
def test_numbers_that_cannot_be_are_asked_about_and_the_remedy_makes_sense_of_them(name, component, per_unit, unit):
    values = RIGHT[component] * per_unit
    columns = guessed({name: values})
    assert component not in columns.columns
    (words,) = said(columns.doubts)
    remedy = words.rpartition("not taken; ")[2].replace("COUNTS_PER_VOLT", unit[2:]).replace("COUNTS_PER_TURN", "2000")
    assert re.search(rf"[=:]{re.escape(unit)}(?!\w)", remedy), remedy
    assert "duty/" not in remedy or "volt" not in name
    assert not any(name in note for note in said(columns.notes))
    column = guessed({name: values}, assume={component.rstrip("1"): unit}).columns[component]
    np.testing.assert_allclose(values * column.factor, RIGHT[component], rtol=1e-9, atol=1e-9)


@given(
    st.floats(2.0, 96.0),
    st.floats(0.0, 150.0),
    st.floats(0.0, 2000.0),
    st.floats(0.0, 15.0),
    st.floats(0.0, 30.0),
    st.floats(-1e6, 1e6),
    st.floats(0.0, 200.0),
)
def test_what_robots_have_is_taken(volts, amps, speed, metres_s, turn_rate, origin, field):
    """One cell or a bus of 96 V, at rest or as fast as motors are, on a field far from the origin of its map."""
    columns = guessed(
        {
            "batteryVoltage": volts,
            "voltage1": max(volts, 2.0) * SWING,
            "current1": amps * SWING,
            "w1": speed * SWING,
            "vx": metres_s * SWING,
            "vy": metres_s * SWING,
            "omega": turn_rate * SWING,
            "x": origin + field * SWING,
            "y": origin - field * SWING,
        }
    )
    assert said(columns.doubts) == ()
    assert {"supply", "u1", "i1", "w1", "vx", "vy", "omega", "x", "y"} <= columns.columns.keys()


def test_a_robot_says_what_its_supply_can_be():
    """Tenths of a volt: 124 V is asked about by itself, 74 V beside a robot of 6 V."""
    axebot = load_robot("axebot")
    assert "supply" in guessed({"battery": 74.0}).columns
    (words,) = said(guessed({"battery": 74.0}, axebot).doubts)
    assert "supply=battery:dV" in words
    assert "supply" in guessed({"battery": 25.2}, axebot).columns


def test_a_current_in_a_unit_that_is_given_is_for_check_where_a_robot_says_more():
    assert "i1" not in guessed({"i1_A": 900.0 * SWING}).columns
    assert "i1" in guessed({"i1_A": 900.0 * SWING}, load_robot("axebot")).columns
    assert "i1" not in guessed({"i1": 900.0 * SWING}, load_robot("axebot")).columns


def test_a_unit_that_a_user_says_is_believed():
    assert guessed({"battery": 7400.0}, assume={"supply": "V"}).columns["supply"].unit == "V"
    assert guessed({"vx": 500.0 * SWING}, assume={"vx": "m/s"}).columns["vx"].unit == "m/s"


def test_a_position_in_a_unit_that_is_given_may_be_far_away():
    assert {"x", "y"} <= guessed({"x_m": 9000.0 * SWING, "y_m": 9000.0 * SWING}).columns.keys()
    assert not {"x", "y"} & guessed({"x": 9000.0 * SWING, "y": 9000.0 * SWING}).columns.keys()


def test_a_message_of_a_battery_in_millivolts_is_asked_about(tmp_path):
    """sensor_msgs/BatteryState has volts; some drivers publish millivolts."""
    pytest.importorskip("mcap")
    pytest.importorskip("rosbags")
    for volts in (12.6, 12_600.0):
        maker = BagMaker()
        for k in range(100):
            maker.battery(0.1 * k, volts)
            maker.joints(0.1 * k, ["wheel_1", "wheel_2", "wheel_3"], [], np.full(3, np.sin(0.1 * k)))
        path = write_mcap(maker, tmp_path / f"{volts:g}.mcap")
        run = omnidyn.read_log(path)
        assert (run.supply is None) == (volts > 100.0)
        if run.supply is None:
            assert any("12600 V is no supply of a robot" in words for words in said(run.warnings))
            again = omnidyn.read_log(path, assume={"supply": "mV"})
            assert again.supply[-1] == pytest.approx(12.6)


# Units that a name does not say: right, asked about, or named by check; asked rarely where a name says them


@pytest.mark.parametrize("seed", range(3))
def test_no_voltage_is_wrong_in_silence(seed):
    """A battery or motors in volts, millivolts, hundredths, or steps of a converter of 10 or 12 bits."""
    rng, asked = np.random.default_rng(seed), 0
    for _ in range(200):
        cells, sag = rng.integers(2, 13), 0.1 * rng.random(ROWS)
        name, component = [("battery", "supply"), ("voltage", "u1"), ("vbat", "supply")][rng.integers(3)]
        volts = 3.7 * cells * (1.0 - sag) * (SWING if component == "u1" else 1.0)
        per_volt = [1.0, 1000.0, 100.0, 1023.0 / 55.0, 4095.0 / 55.0][kind := rng.integers(5)]
        columns = guessed({name: np.round(volts * per_volt, 2)})
        if component in columns.columns:
            unit = columns.columns[component].unit
            size = {"V": 1.0, "mV": 1e-3, "cV": 1e-2}[unit]
            assert size * per_volt == pytest.approx(1.0) or np.abs(volts * per_volt).max() < 100.0, (name, kind, cells)
        else:
            assert [doubt.components for doubt in columns.doubts] == [(component,)]
        unit = ["V", "mV", "cV"][rng.integers(3)]
        said_unit = guessed({f"{name}_{unit}": volts / {"V": 1.0, "mV": 1e-3, "cV": 1e-2}[unit]})
        asked += component not in said_unit.columns
    assert asked <= 10


@pytest.mark.parametrize("unit", ["rad", "deg", "turns"])
@pytest.mark.parametrize("seed", range(6))
def test_an_angle_in_another_unit_is_named_beside_its_speed(unit, seed):
    rng, rows = np.random.default_rng(seed), 1500
    step = 10.0 ** rng.uniform(-3.0, -1.8)  # slower rows turn by more than pi in degrees: taken for a wrap
    rate = rng.uniform(0.5, 2.0) * np.sin(np.linspace(0.0, 40.0, rows) * rng.uniform(0.5, 1.0))
    turned = np.cumsum(rate) * step + 0.001 * rng.normal(size=rows)
    factor = {"rad": 1.0, "deg": 180.0 / np.pi, "turns": 1.0 / (2.0 * np.pi)}[unit]
    channels = {"twist": np.column_stack([0.2 * rate, 0.0 * rate, rate]), "pose": np.zeros((rows, 3))}
    channels["pose"][:, 2] = turned * factor
    verdict = omnidyn.check(Log(np.arange(rows) * step, channels, np.arange(rows) + 2))
    codes = {finding.code for finding in verdict.findings if "heading" in finding.subject or "omega" in finding.subject}
    assert bool(codes & {"unit", "scale", "time_unit"}) == (unit != "rad")


@pytest.mark.parametrize("name", ["heading", "heading_rad"])
@pytest.mark.parametrize("seed", range(6))
def test_a_heading_that_cannot_be_followed_from_row_to_row_is_asked_about(name, seed):
    rng, rows = np.random.default_rng(seed), 600
    step, rate = rng.uniform(0.05, 0.2), rng.uniform(1.5, 3.0) * np.sin(np.linspace(0.0, 40.0, rows))  # 4 deg a row
    turned = np.cumsum(rate) * step + 0.001 * rng.normal(size=rows)
    wrapped = np.angle(np.exp(1j * turned))
    spun = np.cumsum(np.full(rows, rng.uniform(1.0, 2.5) / step)) * step  # 2.5 rad a row, never wrapped
    for angle in (turned, wrapped, wrapped % (2.0 * np.pi), spun):
        assert "heading" in guess_of(name, angle, step).columns
    columns = guess_of(name, np.degrees(turned), step)
    assert "heading" not in columns.columns
    assert "it jumps as degrees do" in said(columns.doubts)[0]
    assert "heading" in guess_of("heading_deg", np.degrees(turned), step).columns


def guess_of(name, values, step):
    cells = {"t_s": step * np.arange(len(values)), name: values}
    return guess_columns(FileTable(tuple(cells), cells, np.arange(len(values)) + 2, {}, "log.csv", "", ()), None, {})
