"""import urdf: wheels that are meshes, whose radius is asked for; rims, rollers and casters."""

import pytest

from omnidyn.errors import InputError
from omnidyn.interop.urdf import robot_of_urdf
from tests.support.cases import case
from tests.support.mesh_robot import ROUND, urdf_joint, urdf_link, urdf_robot


def directions(made):
    return sorted(round(azimuth % 360.0, 6) for azimuth in made.wheels.azimuth_deg)


@pytest.mark.parametrize("names", ["wheel_{}", "rim{}", "drive_whl_{}", "Wheel{}_link"])
@pytest.mark.parametrize("rollers", [0, 2])
def test_a_mesh_takes_its_radius_from_the_option(names, rollers):
    text = urdf_robot((60, 180, 300), names, rollers=rollers)
    made = robot_of_urdf(text, wheel_radius=0.05)
    assert directions(made) == [60.0, 180.0, 300.0]
    assert made.wheels.wheel_radius == 0.05
    assert made.wheels.robot_radius == pytest.approx(0.1)
    with pytest.raises(InputError, match=r"no radius of these wheels: they are meshes; got .*1.*; expected a cylinder"):
        robot_of_urdf(text)


def test_casters_rollers_and_arms_are_no_wheels():
    arm = urdf_link("elbow", ROUND) + urdf_joint("elbow_joint", "base_link", "elbow", 0.3, 0.05, "0 1 0")
    caster = urdf_link("caster_wheel", ROUND) + urdf_joint(
        "caster_wheel_joint", "base_link", "caster_wheel", 0.5, 0.05, "0 1 0"
    )
    made = robot_of_urdf(urdf_robot((45, 135, 225, 315), shape=ROUND, more=arm + caster))
    assert directions(made) == [45.0, 135.0, 225.0, 315.0]
    assert made.wheels.wheel_radius == 0.03


def test_round_parts_without_a_name_are_wheels_but_meshes_are_not():
    other = urdf_robot((60, 180, 300), "part_{}", ROUND)
    assert directions(robot_of_urdf(other)) == [60.0, 180.0, 300.0]
    with pytest.raises(InputError, match="cannot tell the wheels; got 0 found"):
        robot_of_urdf(urdf_robot((60, 180, 300), "part_{}"))


def test_the_case():
    text = case("logs/urdf_mesh/meshbot.urdf").read_text()
    made = robot_of_urdf(text, wheel_radius=0.05)
    assert directions(made) == [60.0, 180.0, 300.0]
    assert made.body.mass == pytest.approx(2.8)
    with pytest.raises(InputError, match="no radius of these wheels"):
        robot_of_urdf(text)
