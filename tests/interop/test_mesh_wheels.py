"""import urdf: wheels that are meshes, whose radius is asked for; rims, rollers and casters."""

import math

import pytest

from omnidyn.errors import InputError
from omnidyn.interop.urdf import robot_of_urdf
from omnidyn.model.robot_file import load_robot
from tests.support.cases import case

MESH = '<visual><geometry><mesh filename="package://bot/wheel.stl"/></geometry></visual>'
ROUND = '<collision><geometry><cylinder radius="0.03" length="0.02"/></geometry></collision>'


def link(name, shape, mass=0.1):
    inertia = '<inertia ixx="1e-5" iyy="1e-5" izz="2e-5" ixy="0" ixz="0" iyz="0"/>'
    return f'<link name="{name}"><inertial><mass value="{mass}"/>{inertia}</inertial>{shape}</link>'


def joint(name, parent, child, angle, far, axis="1 0 0", kind="continuous"):
    x, y = far * math.cos(angle), far * math.sin(angle)
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><axis xyz="{axis}"/>'
        f'<origin xyz="{x!r} {y!r} 0.03" rpy="0 0 {angle!r}"/></joint>'
    )


def robot(degrees, names="wheel_{}", shape=MESH, rollers=0, more=""):
    parts = [link("base_link", "", 2.5)]
    for k, degree in enumerate(degrees):
        name = names.format(k + 1)
        parts += [link(name, shape), joint(f"{name}_joint", "base_link", name, math.radians(degree), 0.1)]
        for r in range(rollers):
            parts += [link(f"{name}_r{r}", ROUND, 0.001), joint(f"{name}_j{r}", name, f"{name}_r{r}", 0.1, 0.03)]
    return f'<robot name="bot">{"".join(parts)}{more}</robot>'


def directions(made):
    return sorted(round(azimuth % 360.0, 6) for azimuth in made.wheels.azimuth_deg)


@pytest.mark.parametrize("names", ["wheel_{}", "rim{}", "drive_whl_{}", "Wheel{}_link"])
@pytest.mark.parametrize("rollers", [0, 2])
def test_a_mesh_takes_its_radius_from_the_option(names, rollers):
    text = robot((60, 180, 300), names, rollers=rollers)
    made = robot_of_urdf(text, wheel_radius=0.05)
    assert directions(made) == [60.0, 180.0, 300.0]
    assert made.wheels.wheel_radius == 0.05
    assert made.wheels.robot_radius == pytest.approx(0.1)
    with pytest.raises(InputError, match=r"no radius of these wheels: they are meshes; got .*1.*; expected a cylinder"):
        robot_of_urdf(text)


def test_casters_rollers_and_arms_are_no_wheels():
    arm = link("elbow", ROUND) + joint("elbow_joint", "base_link", "elbow", 0.3, 0.05, "0 1 0")
    caster = link("caster_wheel", ROUND) + joint("caster_wheel_joint", "base_link", "caster_wheel", 0.5, 0.05, "0 1 0")
    made = robot_of_urdf(robot((45, 135, 225, 315), shape=ROUND, more=arm + caster))
    assert directions(made) == [45.0, 135.0, 225.0, 315.0]
    assert made.wheels.wheel_radius == 0.03


def test_round_parts_without_a_name_are_wheels_but_meshes_are_not():
    other = robot((60, 180, 300), "part_{}", ROUND)
    assert directions(robot_of_urdf(other)) == [60.0, 180.0, 300.0]
    with pytest.raises(InputError, match="cannot tell the wheels; got 0 found"):
        robot_of_urdf(robot((60, 180, 300), "part_{}"))


def test_the_command_asks_for_the_radius_and_its_remedy_works(call, here):
    (here / "bot.urdf").write_text(robot((60, 180, 300)))
    code, _, err = call("import", "urdf", "bot.urdf", "-o", "bot.toml")
    assert code == 3
    assert "give it, such as --wheel-radius 0.05" in err
    assert call("import", "urdf", "bot.urdf", "-o", "bot.toml", "--wheel-radius", "0.05")[0] == 0
    assert load_robot(here / "bot.toml").wheels.wheel_radius == 0.05
    code, _, err = call("import", "urdf", "bot.urdf", "--wheel-radius", "50")
    assert code == 3
    assert "say --wheel-radius 0.05 if that is meant" in err
    code, _, err = call("import", "json", "bot.urdf", "--wheel-radius", "0.05")
    assert code == 3
    assert "json holds the radius of its wheels" in err


def test_the_case():
    text = case("logs/urdf_mesh/meshbot.urdf").read_text()
    made = robot_of_urdf(text, wheel_radius=0.05)
    assert directions(made) == [60.0, 180.0, 300.0]
    assert made.body.mass == pytest.approx(2.8)
    with pytest.raises(InputError, match="no radius of these wheels"):
        robot_of_urdf(text)
