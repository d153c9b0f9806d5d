"""What a friction table takes: ranges, defaults and words, to their ends, as docs/robot-file.md promises."""

import math

import pytest

from omnidyn.errors import InputError
from omnidyn.model.friction import AxesFriction, DirectionFriction, WheelFriction

LEVEL, SPEED, STIFFNESS = (0.0, 1e6), (1e-7, 1e3), (1e-3, 1e12)
SHARED = {"stribeck_exponent": (0.3, 10.0), "dahl_exponent": (0.5, 4.0), "elastic_share": (0.0, 0.99)}
BRISTLES = {"stiffness": STIFFNESS, "damping": LEVEL, "damping_speed": SPEED}
SPEEDS = {"stribeck_speed": SPEED, "karnopp_speed": SPEED}
BACKWARD = {"coulomb_backward": LEVEL, "breakaway_backward": LEVEL}
YAW = {f"yaw_{key}": bounds for key, bounds in (BRISTLES | SPEEDS).items()}
RANGES = {
    AxesFriction: {"viscous": LEVEL, "coulomb": LEVEL, "breakaway": LEVEL} | BACKWARD | SPEEDS | BRISTLES | SHARED,
    WheelFriction: {"viscous": LEVEL, "coulomb": LEVEL, "breakaway": LEVEL} | BACKWARD | SPEEDS | BRISTLES | SHARED,
    DirectionFriction: {key: LEVEL for key in ("viscous", "coulomb", "breakaway", "yaw_coulomb")}
    | {"yaw_breakaway": LEVEL, "yaw_viscous": LEVEL}
    | SPEEDS
    | BRISTLES
    | YAW
    | SHARED,
}
LAW = {"karnopp_speed": "karnopp", "dahl_exponent": "dahl", "elastic_share": "elastoplastic"}
LAW |= dict.fromkeys(("stiffness", "damping", "damping_speed"), "lugre")
PAIRS = ("coulomb", "breakaway")
NEEDED = {AxesFriction: {"viscous": (0.0,) * 3, "coulomb": (0.0,) * 3}}
DEFAULTS = {
    AxesFriction: {"karnopp_speed": (1e-4, 1e-4, 1e-4)},
    DirectionFriction: {"karnopp_speed": 1e-4, "yaw_karnopp_speed": 1e-4, "coulomb": (0.0, 0.0), "viscous": 0.0}
    | {"yaw_coulomb": 0.0, "yaw_viscous": 0.0, "yaw_breakaway": None, "yaw_stiffness": None, "ellipse": "dissipation"},
    WheelFriction: {"karnopp_speed": 1e-4, "coulomb": 0.0, "viscous": 0.0, "coulomb_backward": None},
}
SHARED_DEFAULTS = {"breakaway": None, "law": "coulomb", "stribeck_speed": None, "stribeck_exponent": 2.0} | {
    "stribeck_shape": "exponential",
    "stiffness": None,
    "damping": None,
    "damping_speed": None,
    "dahl_exponent": 1.0,
    "elastic_share": 0.7,
}


def of(table, key, value):
    """A table in which only one number is not its default, and the law is one that takes it."""
    numbers = NEEDED.get(table, {}) | {"law": LAW.get(key.removeprefix("yaw_"), "coulomb")}
    if table is AxesFriction and key not in SHARED:
        value = (value,) * 3
    if table is DirectionFriction and key in PAIRS:
        value = (value,) * 2
    return getattr(table(**numbers | {key: value}), key), value


@pytest.mark.parametrize(
    "table, key", [(table, key) for table, ranges in RANGES.items() for key in ranges], ids=lambda each: str(each)
)
def test_a_number_may_go_to_the_ends_of_its_range_and_no_further(table, key):
    low, high = RANGES[table][key]
    for value in (low, high):
        found, expected = of(table, key, value)
        assert found == expected
    for value in (math.nextafter(low, -math.inf), math.nextafter(high, math.inf), math.nan, True):
        with pytest.raises(InputError):
            of(table, key, value)


@pytest.mark.parametrize("table", RANGES)
def test_what_is_left_out_has_the_default_of_the_documentation(table):
    bare = table(**NEEDED.get(table, {}))
    for key, value in (SHARED_DEFAULTS | DEFAULTS[table]).items():
        assert getattr(bare, key) == value
    for key, word in (("law", "viscous"), ("stribeck_shape", "gauss"), ("ellipse", "round")):
        with pytest.raises(InputError):
            table(**NEEDED.get(table, {}) | {key: word})


def test_wheels_may_have_a_number_each():
    law = WheelFriction(coulomb=(1.0, 2.0), breakaway=2.5, viscous=(0.1, 0.2))
    assert (law.coulomb, law.breakaway, law.viscous) == ((1.0, 2.0), 2.5, (0.1, 0.2))
    with pytest.raises(InputError):
        WheelFriction(viscous=(0.1, 1.1e6))
