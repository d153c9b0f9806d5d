"""Units: what one is in SI, from outside: definitions of the units themselves."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from omnidyn import units
from omnidyn.errors import InputError
from omnidyn.units import known_unit, parse_unit


@pytest.mark.parametrize(
    ("text", "quantity", "one_in_si"),
    [
        ("rpm", "turn rate", 2 * math.pi / 60),
        ("1/min", "turn rate", 2 * math.pi / 60),
        ("rot/s", "turn rate", 2 * math.pi),
        ("turns/s", "turn rate", 2 * math.pi),
        ("deg/s", "turn rate", math.pi / 180),
        ("°/s", "turn rate", math.pi / 180),
        ("rad_s", "turn rate", 1.0),
        ("rad/s", "turn rate", 1.0),
        ("mA", "current", 1e-3),
        ("%", "duty", 0.01),
        ("duty/255", "duty", 1 / 255),
        ("pwm", "duty", 1 / 255),
        ("pwm/1023", "duty", 1 / 1023),
        ("ticks/2000", "angle", 2 * math.pi / 2000),
        ("ticks", "count", 1.0),
        ("1.84 mm", "length", 1.84e-3),
        ("0.125 ms", "time", 1.25e-4),
        ("µs", "time", 1e-6),
        ("V", "voltage", 1.0),
        ("Volt", "voltage", 1.0),
        ("km/h", "speed", 1 / 3.6),
        ("pct", "duty", 0.01),
        ("PERCENT", "duty", 0.01),
        ("in", "length", 0.0254),
        ("in/s", "speed", 0.0254),
        ("ft", "length", 0.3048),
        ("ticks/s", "count rate", 1.0),
        ("counts per second", "count rate", 1.0),
        ("ticks/100ms", "count rate", 10.0),
        ("ticks/150/s", "turn rate", 2 * math.pi / 150),
        ("ticks/537.7/s", "turn rate", 2 * math.pi / 537.7),
        ("ticks/s/150", "turn rate", 2 * math.pi / 150),
        ("ticks/4096/100ms", "turn rate", 2 * math.pi / 4096 * 10),
        ("ticks/48/min", "turn rate", 2 * math.pi / 48 / 60),
        ("2 mm/s", "speed", 2e-3),
        ("RPM", "turn rate", 2 * math.pi / 60),
        ("Rad/Sec", "turn rate", 1.0),
        ("tr/min", "turn rate", 2 * math.pi / 60),
        ("SECOND", "time", 1.0),
        ("Ampere", "current", 1.0),
        ("W", "power", 1.0),
    ],
)
def test_one_of_a_unit_in_si(text, quantity, one_in_si):
    unit = parse_unit(text)
    assert unit.quantity == quantity
    assert unit.size == pytest.approx(one_in_si, rel=1e-15)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "furlong",
        "rad/",
        "ticks/0",
        "0 mm",
        "pix",
        "1e999 m",
        "m/s/s",
        "ticks/0.0",
        "ticks/0/s",
        "m/0s",
        "pix/s",
        "V/s",
        "m/V",
        "ticks/kg",
        "MA",
    ],
)
def test_what_is_no_unit_is_refused(text):
    assert known_unit(text) is None
    with pytest.raises(InputError, match="unit"):
        parse_unit(text)


def test_the_nearest_unit_is_named():
    with pytest.raises(InputError, match=r"unknown unit; got rads/s; expected .*; did you mean rad/s\?"):
        parse_unit("rads/s")


def test_a_long_text_is_no_unit_and_soon_known_for_none():
    assert known_unit("a/s" * 100_000) is None


@given(st.text(max_size=20) | st.text(alphabet="ticks/ms0123456789. ", max_size=20))
def test_any_text_is_a_unit_or_refused(text):
    unit = known_unit(text)
    assert unit is None or (unit.size > 0.0 and math.isfinite(unit.size))


DEFINED = {  # what one of each is in SI; mutants of the table survived where only some of its names were tried
    1.0: "duty "
    "s V volt volts A amp amps m m/s rad rad/s ticks tick counts count pulses pulse cts N W Nm kg m/s2 rad/s2",
    1e-3: "ms mV mA mm mm/s mrad mrad/s mN mW mNm g",
    1e-2: "cV cm cm/s percent",
    1e3: "km kN kW",
    0.1: "dV",
    60.0: "min",
    3600.0: "h Ah",
    3.6: "mAh",
    1e-6: "us",
    1e-9: "ns",
    0.0254: "inch",
    0.3048: "ft",
    math.pi / 180: "deg dps",
    2 * math.pi: "rev turn turns rot rev/s turn/s rps Hz",
    2 * math.pi / 60: "rpm rev/min rot/min 1/min",
}
OTHERS = {  # signs beside letters, and names that are not one word
    1.0: ("N m", "N·m", "N⋅m", "N*m", "N.m", "°C", "degC", "m/s^2", "m/s²", "rad/s^2", "rad/s²"),
    1e-6: ("\N{MICRO SIGN}s", "\N{GREEK SMALL LETTER MU}s"),
    0.01: ("%", "pct"),
    1 / 3.6: ("km/h",),
    math.pi / 180: ("°", "deg/s", "°/s"),
    2 * math.pi: ("turns/s", "rot/s"),
    0.0254: ("in",),
    1 / 255: ("pwm",),
}
EACH = [(text, one) for one, names in DEFINED.items() for text in names.split()]
EACH += [(text, one) for one, names in OTHERS.items() for text in names]


@pytest.mark.parametrize("text, one", EACH)
def test_one_of_each_name_is_its_definition(text, one):
    assert parse_unit(text).size == pytest.approx(one, rel=1e-15)


def test_no_name_is_left_out():
    assert {name for names in units._TABLE.values() for name in names} <= {text for text, _ in EACH}
