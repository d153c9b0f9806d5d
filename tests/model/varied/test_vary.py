"""Variations of a robot: what each kind changes, what is known of the numbers afterwards, and what is refused."""

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import InputError
from omnidyn.model.first_guess import guessed, rests_on, with_gear
from omnidyn.model.friction import AxesFriction, Friction
from omnidyn.model.robot_file import load_robot, parse_robot, robot_to_toml
from omnidyn.model.surroundings import Floor
from omnidyn.model.variations import Battery, Payload, Surface
from omnidyn.model.vary import vary_as

TABLES = """
[variations.payload.2kg]
mass_kg = { value = 2.0, std = 0.3, origin = "measured" }
inertia_kg_m2 = 0.01

[variations.payload.basket]
mass_kg = 1.0
offset_m = [0.1, 0.0]

[variations.floor.carpet.friction.axes]
viscous = [1.5, 1.6, 0.02]
coulomb = [{ value = 3.0, std = 0.2 }, 2.0, 0.12]

[variations.floor.ice.friction.direction]
coulomb = [0.1, 0.1]

[variations.tilt.ramp]
tilt_deg = 2.0
downhill_deg = 90.0

[variations.tilt.none]

[variations.battery.low]
supply_V = 4.5
"""
PLAIN = robot_to_toml(load_robot("axebot")).replace("mass_kg = 1.5", "mass_kg = { value = 1.5, std = 0.4 }")
ROBOT = parse_robot(PLAIN + TABLES)


def test_the_file_comes_back_to_the_last_bit():
    assert parse_robot(robot_to_toml(ROBOT)) == ROBOT
    assert ROBOT.variations.names == {
        "payload": ("2kg", "basket"),
        "floor": ("carpet", "ice"),
        "tilt": ("ramp", "none"),
        "battery": ("low",),
    }
    assert "can be varied by floor: carpet, ice" in ROBOT.document().to_text()


def test_a_robot_without_any_writes_none():
    assert "variations" not in robot_to_toml(load_robot("axebot"))
    assert "variations" not in load_robot("axebot").document().data


def test_a_payload_adds_mass_and_inertia():
    varied = omnidyn.vary_robot(ROBOT, payload="2kg")
    assert varied.body == ROBOT.body.replace(mass=3.5, inertia=0.035)
    assert varied.priors["body.mass_kg"].std == pytest.approx(0.5)  # 0.3 and 0.4
    assert varied.name == "axebot with payload 2kg"
    assert varied.motor == ROBOT.motor
    assert varied.friction == ROBOT.friction


def test_a_heavier_robot_is_slower_by_its_mass():
    u = np.tile([0.0, 4.0, -4.0], (5, 1))
    plain, heavy = (
        omnidyn.simulate(each, u, 1e-3).twist[-1, 0] for each in (ROBOT, omnidyn.vary_robot(ROBOT, payload="2kg"))
    )
    assert plain / heavy == pytest.approx(3.5 / 1.5, rel=0.03)


def test_a_floor_takes_the_place_of_the_friction_that_floors_have():
    carpet, ice = (omnidyn.vary_robot(ROBOT, floor=name) for name in ("carpet", "ice"))
    assert carpet.friction.axes == AxesFriction(viscous=(1.5, 1.6, 0.02), coulomb=(3.0, 2.0, 0.12))
    assert carpet.priors["friction.axes.coulomb[0]"].std == 0.2
    assert not any(ice.friction.axes.coulomb)
    assert ice.friction.direction.coulomb == (0.1, 0.1)
    bearings = ROBOT.replace(friction=ROBOT.friction.replace(wheels=ROBOT.friction.wheels.replace(coulomb=0.3)))
    assert omnidyn.vary_robot(bearings, floor="carpet").friction.wheels == bearings.friction.wheels


def test_a_battery_is_what_duties_are_shares_of_and_the_most_a_motor_gets():
    duty = ROBOT.replace(drive=ROBOT.drive.replace(kind="duty", supply=12.0))
    low = omnidyn.vary_robot(duty, battery="low")
    assert low.drive.supply == 4.5
    assert low.motor.voltage_limit == 4.5
    run = omnidyn.simulate(low, duty=np.full((3, 3), 0.5), dt=0.01)
    assert (run.voltage == 2.25).all()
    full = omnidyn.vary_robot(duty, battery=Battery(supply=12.0))
    assert full.motor.voltage_limit == 6.0


def test_several_at_once_and_one_after_the_other_are_the_same_robot():
    both = vary_as(ROBOT, "payload=2kg, tilt=ramp")
    assert both.floor == Floor(tilt=2.0, downhill=90.0)
    one = omnidyn.vary_robot(omnidyn.vary_robot(ROBOT, payload="2kg"), tilt="ramp")
    assert one.replace(name=both.name) == both
    assert parse_robot(robot_to_toml(both)) == both
    assert both.variations.names == {"floor": ("carpet", "ice"), "battery": ("low",)}
    assert vary_as(ROBOT, "") is ROBOT


def test_by_value():
    robot = load_robot("axebot")
    surface = Surface(friction=Friction(axes=AxesFriction(viscous=(1.0, 1.0, 0.01), coulomb=(0.5, 0.5, 0.05))))
    varied = omnidyn.vary_robot(robot, payload=Payload(mass=0.5), floor=surface, tilt=Floor(tilt=1.0))
    assert (varied.body.mass, varied.friction.axes.coulomb[0], varied.floor.tilt) == (2.0, 0.5, 1.0)
    assert varied.name == "axebot with payload, floor, tilt"


@pytest.mark.parametrize(
    "text, says",
    [
        ("payload=2k", r"payload: no payload of this name; got 2k; did you mean 2kg\?"),
        ("tilt=x", r"no tilt of this name; got x; known names: ramp, none"),
        ("paylod=2kg", r"no such kind of variation; got paylod; did you mean payload\?"),
        ("payload", r"not a variation; got payload; expected kind=name, such as payload=2kg"),
        ("payload=", r"not a variation"),
        ("tilt=ramp,tilt=none", r"asked for twice; got tilt=ramp, tilt=none; expected one"),
    ],
)
def test_what_is_not_there_is_refused_with_what_is_near(text, says):
    with pytest.raises(InputError, match=says):
        vary_as(ROBOT, text)


def test_a_robot_that_knows_none_says_which_table_is_missing():
    with pytest.raises(
        InputError, match=r"axebot knows no floor by name; got carpet; expected \[variations.floor.carpet\]"
    ):
        omnidyn.vary_robot(load_robot("axebot"), floor="carpet")


def test_a_load_beside_the_middle_is_a_body_of_two_points():
    """Against the sums over three point masses: two of the body, one of the load."""
    robot = ROBOT.replace(body=ROBOT.body.replace(mass=2.0, inertia=2.0 * 0.09**2, centre=(0.01, 0.02)))
    loaded = omnidyn.vary_robot(robot, payload=Payload(mass=0.5, offset=(-0.03, 0.06), inertia=0.001))
    places = np.array([[0.01, 0.02 + 0.09], [0.01, 0.02 - 0.09], [-0.03, 0.06]])
    masses = np.array([1.0, 1.0, 0.5])
    centre = masses @ places / masses.sum()
    inertia = masses @ ((places - centre) ** 2).sum(axis=1) + 0.001
    assert loaded.body.mass == 2.5
    np.testing.assert_allclose(loaded.body.centre, centre, rtol=1e-14)
    assert loaded.body.inertia == pytest.approx(inertia, rel=1e-14)
    half = Payload(mass=0.25, offset=(-0.03, 0.06), inertia=0.0005)
    twice = omnidyn.vary_robot(omnidyn.vary_robot(robot, payload=half), payload=half)
    np.testing.assert_allclose(twice.body.centre, centre, rtol=1e-14)
    assert twice.body.inertia == pytest.approx(inertia, rel=1e-14)


def test_loads_that_balance_each_other_are_one_in_the_middle():
    one = omnidyn.vary_robot(
        omnidyn.vary_robot(ROBOT, payload=Payload(mass=1.0, offset=(0.05, 0.0))),
        payload=Payload(mass=1.0, offset=(-0.05, 0.0)),
    )
    both = omnidyn.vary_robot(ROBOT, payload=Payload(mass=2.0, inertia=2.0 * 0.05**2))
    np.testing.assert_allclose(one.body.centre, (0.0, 0.0), atol=1e-17)
    assert one.body.inertia == pytest.approx(both.body.inertia, rel=1e-14)


def test_what_is_known_of_the_offset_is_known_of_the_centre():
    text = robot_to_toml(load_robot("axebot")) + (
        "[variations.payload.box]\nmass_kg = 1.5\noffset_m = [{ value = 0.04, std = 0.01 }, 0.02]\n"
    )
    loaded = omnidyn.vary_robot(parse_robot(text), payload="box")
    assert loaded.body.centre == pytest.approx((0.02, 0.01))
    assert loaded.priors["body.centre_m[0]"].std == pytest.approx(0.005)
    assert "body.centre_m[1]" not in loaded.priors
    again = parse_robot(robot_to_toml(loaded))
    assert again.body == loaded.body
    assert again.priors["body.centre_m[0]"] == loaded.priors["body.centre_m[0]"]


def test_a_load_that_tips_the_robot_over_is_refused():
    words = r"payload: \[body\] centre_m lies 0.18.* m from the centre .* beyond all of them \(0.1 m\)"
    with pytest.raises(InputError, match=words):
        omnidyn.vary_robot(ROBOT, payload=Payload(mass=10.0, offset=(0.21, 0.0)))


def test_something_else_is_refused():
    with pytest.raises(InputError, match=r"not a variation; got 3; expected a name, or Payload"):
        omnidyn.vary_robot(ROBOT, payload=3)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    "table, says",
    [
        ("[variations.payload.x]\nmas_kg = 1.0", r"\[variations.payload.x\] mas_kg: unknown key.*did you mean mass_kg"),
        ("[variations.payload.x]\nmass_kg = -1.0", r"mass_kg: cannot use this value"),
        ("[variations.loads.x]\nmass_kg = 1.0", r"unknown key.*got loads"),
        ("[variations.floor.x]", r"a key is missing; expected friction"),
        ("[variations.floor.x.friction]", r"a floor without friction"),
        ('[variations.tilt."a=b"]\ntilt_deg = 1.0', r"not a name that can be asked for"),
        ("[variations.floor.x.friction.axes]\nviscos = [1.0, 1.0, 1.0]", r"did you mean viscous"),
        ("[floor]\ntilt_deg = 46.0", r"less than or equal to 45"),
    ],
)
def test_a_file_that_says_it_wrong_is_refused_by_its_key(table, says):
    with pytest.raises(InputError, match=says):
        parse_robot(PLAIN + "\n" + table)


def test_what_is_known_of_a_variation_is_in_no_one_s_way():
    """A std or a guess in its table is of no number of the robot itself."""
    guess = TABLES.replace('origin = "measured"', 'origin = "guess"')
    robot = parse_robot(PLAIN + guess)
    assert guessed(robot) == guessed(load_robot("axebot"))
    assert rests_on(robot, at_rest=True) == []
    axes = robot.friction.axes
    t = np.arange(600) * 0.02
    volts = np.sin(t)[:, None] * [3.0, -3.0, 0.0] + np.cos(0.7 * t)[:, None] * [1.0, 1.0, 2.5]
    run = omnidyn.simulate(robot, volts[:-1], 0.02)
    found = omnidyn.identify(run, robot, omnidyn.OutputError(free=("friction",))).estimate
    assert found.value["friction.axes.coulomb[0]"] == pytest.approx(axes.coulomb[0], rel=0.01)
    assert "variations.payload.2kg.mass_kg" in with_gear(found.robot, 20.0, "weighed").priors
