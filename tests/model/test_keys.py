"""Keys: every number of a robot file has one name, and the name says what is asked of it."""

import pytest

from omnidyn.errors import InputError
from omnidyn.model.drive import Drive
from omnidyn.model.first_guess import first_guess
from omnidyn.model.keys import BOX, TORQUE, Key, all_keys, expand, find_key, friction_keys, gain_keys, unit, with_priors
from omnidyn.model.robot import Prior
from omnidyn.model.robot_file import load_robot, parse_robot, preset_names, robot_to_toml
from omnidyn.model.wheels import Wheels
from tests.support.robot_keys import KEYS

PLAIN = {"kg m²": "kg m^2", "degree": "deg", "Ω": "ohm", "1": ""}
NUMBERS = [key for key in KEYS if key.unit]
NAMES = [f"{key.table}.{key.key}" for key in NUMBERS]
RESISTANCE = "motor.resistance_ohm"


def is_list(name):
    """Whether an index makes sense: every list does, and what may be one per wheel."""
    return find_key(f"{name}[0]") is not None


def test_the_page_has_the_numbers_of_all_tables():
    assert len(NUMBERS) >= 33
    tables = {"body", "wheels", "motor", "drive", "friction.axes", "friction.direction", "friction.wheels", "floor"}
    assert {key.table for key in NUMBERS} == {Key.parse(name).table for name in NAMES} == tables


@pytest.mark.parametrize("key", NUMBERS, ids=lambda key: f"{key.table}.{key.key}")
def test_every_number_has_the_unit_of_the_page(key):
    """friction.axes: three units, one an item. Others: one for all items and for the whole."""
    units, name = key.unit.split(", "), f"{key.table}.{key.key}"
    assert Key.parse(name).unit == unit(name) == PLAIN.get(units[0], units[0])
    assert is_list(name) == ("×" in key.allowed or "one per wheel" in key.allowed)
    for index in range(2 if key.allowed.startswith("2 ×") else 3 if is_list(name) else 0):
        expected = units[min(index, len(units) - 1)]
        assert unit(f"{name}[{index}]") == PLAIN.get(expected, expected)


@pytest.mark.parametrize("name", [*NAMES, *BOX, "motor.gear_ratio[12]", "friction.direction.coulomb[1]"])
def test_a_key_gives_its_text_back(name):
    key = Key.parse(name)
    assert str(key) == name
    assert key == Key.parse(name)
    assert name.startswith(f"{key.part}.")
    assert key.name == f"{key.table}.{key.field}"


@pytest.mark.parametrize(
    "text, words",
    [
        ("body.mas_kg", "unknown key; got body.mas_kg; did you mean body.mass_kg"),
        ("mass_kg", "did you mean body.mass_kg"),
        ("motor.zzz", "unknown key; got motor.zzz; expected motor.resistance_ohm or motor.inductance_H"),
        ("zzz", "expected a key such as body.mass_kg"),
        ("body", "a table, not a number; got body; expected a number in it, such as body.mass_kg"),
        ("motor.electrical", "not a number; got motor.electrical"),
        ("body.rotating_frame", "not a number; got body.rotating_frame"),
        ("body.mass_kg[0]", r"has no index; got body.mass_kg\[0\]; expected body.mass_kg"),
        ("friction.axes.coulomb[3]", r"no such entry; got friction.axes.coulomb\[3\]; expected an index from 0 to 2"),
        ("friction.direction.coulomb[2]", "expected an index from 0 to 1"),
        ("friction.axes.coulomb[-1]", "not a key"),
        ("friction.axes.coulomb[x]", "not a key"),
        ("body.mass kg", "not a key"),
        ("", "not a key"),
        (None, "not a key"),
    ],
)
def test_what_is_no_key(text, words):
    with pytest.raises(InputError, match=words):
        Key.parse(text)


@pytest.mark.parametrize("name", preset_names())
def test_every_number_of_a_robot_is_got_and_set(name):
    robot = load_robot(name)
    for text in all_keys(robot):
        key = Key.parse(text)
        value = key.get(robot)
        assert isinstance(value, float)
        assert key.set(robot, value) == robot
        assert key.get(key.set(robot, 1.5 * value + 0.5, checked=False)) == 1.5 * value + 0.5


def test_all_keys_are_those_that_the_file_writes(axebot):
    wanted = ["body.mass_kg", "body.inertia_kg_m2", *(f"wheels.azimuth_deg[{w}]" for w in range(3))]
    assert list(all_keys(axebot)[:5]) == wanted
    assert all_keys(axebot)[-6:] == BOX
    assert "motor.gear_efficiency" not in all_keys(axebot)
    told = axebot.replace(priors={"motor.gear_efficiency": Prior(std=0.1)})
    assert "motor.gear_efficiency" in all_keys(told)


def test_one_wheel_of_what_stands_once(axebot, four_wheel):
    assert Key.parse(f"{RESISTANCE}[2]").get(axebot) == 1.69
    assert Key.parse(f"{RESISTANCE}[2]").set(axebot, 2.0).motor.resistance == (1.69, 1.69, 2.0)
    assert Key.parse(f"{RESISTANCE}[3]").set(four_wheel, 2.0).motor.resistance == (1.69, 1.69, 1.69, 2.0)
    assert Key.parse(RESISTANCE).set(axebot, 2.0).motor.resistance == 2.0


@pytest.mark.parametrize(
    "text, words",
    [
        (f"{RESISTANCE}[3]", "no such entry; .* expected an index from 0 to 2"),
        ("friction.axes.coulomb", r"needs an index; got friction.axes.coulomb; .*friction.axes.coulomb\[2\]"),
        ("motor.current_limit_A", "motor.current_limit_A: not a number of this robot"),
    ],
)
def test_what_this_robot_does_not_have(axebot, text, words):
    for use in (lambda key: key.get(axebot), lambda key: key.set(axebot, 1.0)):
        with pytest.raises(InputError, match=words):
            use(Key.parse(text))


def test_a_value_out_of_its_range_is_refused_by_its_key(axebot):
    with pytest.raises(InputError, match=r"^body\.mass_kg: cannot use this value; got -1"):
        Key.parse("body.mass_kg").set(axebot, -1.0)
    assert Key.parse("body.mass_kg").set(axebot, -1.0, checked=False).body.mass == -1.0


@pytest.mark.parametrize(
    "text, level, axis, wheel, symbol, words",
    [
        ("friction.axes.coulomb[0]", "coulomb", 0, None, "Cx", "Coulomb friction forward"),
        ("friction.axes.viscous[2]", "viscous", 2, None, "Bw", "viscous friction turning"),
        ("friction.axes.breakaway[1]", "breakaway", 1, None, "Sy", "breakaway friction sideways"),
        ("friction.axes.coulomb", "coulomb", None, None, "C", "Coulomb friction"),
        ("friction.direction.coulomb[1]", "coulomb", None, None, "Cy", "Coulomb friction sideways"),
        ("friction.direction.viscous", "viscous", None, None, "B", "viscous friction along travel"),
        ("friction.direction.yaw_coulomb", "coulomb", 2, None, "C yaw", "Coulomb friction turning"),
        ("friction.wheels.coulomb[0]", "coulomb", None, 0, "C of wheel 1", "Coulomb friction of wheel 1"),
        ("friction.wheels.viscous", "viscous", None, None, "B at the wheels", "viscous friction at the wheels"),
        (
            "friction.wheels.coulomb_backward",
            "coulomb",
            None,
            None,
            "coulomb_backward at the wheels",
            "Coulomb friction backward at the wheels",
        ),
        ("motor.torque_constant_Nm_A", "", None, None, TORQUE, "torque constant"),
        ("motor.gear_ratio[2]", "", None, 2, "motor.gear_ratio[2]", "gear ratio of motor 3"),
        ("body.mass_kg", "", None, None, "body.mass_kg", "mass"),
    ],
)
def test_what_a_key_says(text, level, axis, wheel, symbol, words):
    key = Key.parse(text)
    assert (key.level, key.axis, key.wheel, key.symbol, key.words) == (level, axis, wheel, symbol, words)


def test_names_that_stand_for_several(axebot, four_wheel):
    disc = first_guess("disc", axebot.wheels, 1.5)
    assert expand("friction", axebot) == friction_keys(axebot) == BOX
    assert (
        expand("friction", disc)
        == friction_keys(disc)
        == (
            "friction.direction.coulomb[0]",
            "friction.direction.coulomb[1]",
            "friction.direction.viscous",
            "friction.direction.yaw_coulomb",
            "friction.direction.yaw_viscous",
        )
    )
    assert expand("friction.axes.coulomb", axebot) == BOX[3:]
    assert expand("friction.axes.breakaway", axebot) == tuple(f"friction.axes.breakaway[{axis}]" for axis in range(3))
    assert expand(RESISTANCE, axebot) == (RESISTANCE,)
    unequal = four_wheel.replace(motor=four_wheel.motor.replace(resistance=(1.6, 1.7, 1.8, 1.9)))
    assert expand(RESISTANCE, unequal) == tuple(f"{RESISTANCE}[{wheel}]" for wheel in range(4))
    assert expand(BOX[0], axebot) == (BOX[0],)
    assert expand("latency.twist", axebot) == ("latency.twist",)


def test_the_gains_that_a_loop_has(axebot):
    assert gain_keys(axebot) == ()
    one = axebot.replace(drive=Drive(kind="speed", kp=2.0, rate=100.0))
    assert gain_keys(one) == ("drive.kp_V_s_rad",)
    each = axebot.replace(drive=Drive(kind="speed", kp=(2.0, 0.0, 2.1), ki=5.0, rate=100.0))
    assert gain_keys(each) == ("drive.kp_V_s_rad[0]", "drive.kp_V_s_rad[2]", "drive.ki_V_rad")


def test_what_is_no_key_has_no_unit():
    assert find_key("latency.twist") is None
    assert unit("latency.twist") == unit("roller") == ""
    assert find_key("body.mass_kg") == Key("body.mass_kg")


@pytest.mark.parametrize("count", [3, 4, 6])
def test_what_is_known_of_a_list_goes_to_its_entries(axebot, count):
    """For any number of wheels, and so that its file says it again."""
    wheels = Wheels(azimuth_deg=tuple(360.0 / count * k for k in range(count)), robot_radius=0.1, wheel_radius=0.035)
    sheet, found = Prior(std=0.05, source="data sheet"), Prior(std=0.01, source="found")
    robot = axebot.replace(wheels=wheels, motor=axebot.motor.replace(resistance=(1.69,) * count))
    robot = robot.replace(priors={RESISTANCE: sheet, "body.mass_kg": sheet})
    robot = with_priors(robot, {f"{RESISTANCE}[1]": found})
    entries = {f"{RESISTANCE}[{wheel}]": found if wheel == 1 else sheet for wheel in range(count)}
    assert robot.priors == {"body.mass_kg": sheet, **entries}
    assert parse_robot(robot_to_toml(robot)) == robot
