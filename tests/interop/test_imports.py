"""Robots from URDF and MuJoCo files, ours and others': what was written comes back, the rest is marked as a guess."""

import numpy as np
import pytest

import omnidyn
from omnidyn.cli import main
from omnidyn.errors import InputError, OmnidynError
from omnidyn.export.bodies.mjcf import mjcf
from omnidyn.export.bodies.urdf import urdf
from omnidyn.interop.mjcf import robot_of_mjcf
from omnidyn.interop.urdf import robot_of_urdf
from tests.support.exported import exact_robot

ROBOT = omnidyn.load_robot("axebot")
BESIDE = ROBOT.replace(name="beside", body=ROBOT.body.replace(centre=(0.03, -0.02)))


def pairs():
    return [(urdf, robot_of_urdf), (mjcf, robot_of_mjcf)]


@pytest.mark.parametrize("kind", [0, 1], ids=["urdf", "mjcf"])
@pytest.mark.parametrize(
    "robot", [ROBOT, BESIDE, *(exact_robot(seed) for seed in range(8))], ids=lambda robot: robot.name
)
def test_what_was_written_comes_back(kind, robot):
    if kind:
        pytest.importorskip("mujoco")
    write, read = pairs()[kind]
    again = read(write(robot).text, "file", robot)
    assert again.body.mass == pytest.approx(robot.body.mass, rel=1e-9)
    assert again.body.inertia == pytest.approx(robot.body.inertia, rel=1e-9)
    np.testing.assert_allclose(again.body.centre, robot.body.centre, atol=1e-10)
    assert (again.body.centre == (0.0, 0.0)) == (robot.body.centre == (0.0, 0.0))
    np.testing.assert_allclose(again.wheels.wrench_matrix, robot.wheels.wrench_matrix, atol=1e-9)
    np.testing.assert_allclose(again.wheels.radii, robot.wheels.radii, rtol=1e-9)
    assert again.motor == robot.motor
    for key in ("body.mass_kg", "body.inertia_kg_m2", "wheels.azimuth_deg", "wheels.wheel_radius_m"):
        assert again.priors[key].origin == "imported"
        assert again.priors[key].source == "imported from file"
    assert "wheel1" in again.source


MECANUM = omnidyn.load_robot("mecanum")


@pytest.mark.parametrize("kind", [0, 1], ids=["urdf", "mjcf"])
@pytest.mark.parametrize("wheelbase", [None, 0.15, 0.3])
@pytest.mark.parametrize("turned", [0.0, 90.0])
def test_mecanum_wheels_come_back(kind, wheelbase, turned):
    """A body whose x points forward, or aside: parallel axles are those of mecanum wheels, rollers in an X."""
    if kind:
        pytest.importorskip("mujoco")
    write, read = pairs()[kind]
    azimuths = tuple(angle + turned for angle in MECANUM.wheels.azimuth_deg)
    robot = MECANUM.replace(wheels=MECANUM.wheels.replace(azimuth_deg=azimuths, wheelbase=wheelbase))
    again = read(write(robot).text, "file", robot)
    np.testing.assert_allclose(again.wheels.wrench_matrix, robot.wheels.wrench_matrix, atol=1e-9)
    np.testing.assert_allclose(again.wheels.places, robot.replace(wheels=again.wheels).wheels.places, atol=1e-12)
    assert again.wheels.wheelbase == pytest.approx(wheelbase or 0.2)
    assert again.body.mass == pytest.approx(robot.body.mass, rel=1e-9)
    assert again.body.inertia == pytest.approx(robot.body.inertia, rel=1e-9)
    assert again.priors["wheels.roller_angle_deg"].origin == "guess"
    assert again.priors["wheels.wheelbase_m"].origin == "imported"


def test_a_robot_on_parallel_axles_is_said_to_be_taken_as_mecanum(tmp_path, capsys):
    """One that turns by skidding looks the same: whoever reads it learns what was taken for granted."""
    path = tmp_path / "skid.urdf"
    path.write_text(urdf(MECANUM).text, "utf-8")
    assert main(["import", "urdf", str(path), "-o", str(tmp_path / "robot.toml")]) == 0
    said = capsys.readouterr()
    for words in (said.err, " ".join(said.out.split()), omnidyn.load_robot(tmp_path / "robot.toml").source):
        assert "taken as mecanum wheels" in words
        assert "by skidding" in words
    assert "warning" in said.err
    path.write_text(urdf(ROBOT).text, "utf-8")
    assert main(["import", "urdf", str(path)]) == 0
    assert "warning" not in capsys.readouterr().err


@pytest.mark.parametrize("name", ["axebot", "mecanum", "four-wheel"])
def test_a_wheel_of_which_nothing_is_known_comes_back_as_such(name):
    """The file of a format that asks for masses of wheels holds placeholders: they are no inertia."""
    robot = omnidyn.load_robot(name)
    again = robot_of_urdf(urdf(robot).text)
    assert not robot.wheels.wheel_inertia
    assert again.wheels.wheel_inertia == 0.0
    assert "wheels.inertia_kg_m2" not in again.priors
    heavy = robot.replace(wheels=robot.wheels.replace(wheel_inertia=1e-5))
    assert robot_of_urdf(urdf(heavy).text).wheels.wheel_inertia == pytest.approx(1e-5)


@pytest.mark.parametrize("turns", [False, True])
def test_the_turning_frame_is_that_of_the_robot_that_it_is_like(turns):
    other = ROBOT.replace(body=ROBOT.body.replace(rotating_frame=turns))
    assert robot_of_urdf(urdf(ROBOT).text, other=other).body.rotating_frame is turns
    assert robot_of_urdf(urdf(ROBOT).text).body.rotating_frame is True


def test_without_another_robot_the_rest_is_a_guess():
    robot = robot_of_urdf(urdf(ROBOT).text)
    assert robot.priors["motor.resistance_ohm"].origin == "guess"
    assert robot.priors["body.mass_kg"].origin == "imported"
    assert omnidyn.interop.import_robot is not None


OTHER = """<?xml version="1.0" encoding="UTF-8"?>
<robot name="kiwi">
  <link name="base_footprint"/>
  <link name="base"><inertial><mass value="4"/><inertia ixx="0.1" iyy="0.1" izz="0.06"/></inertial></link>
  <link name="arm"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01"/></inertial></link>
  <joint name="up" type="fixed"><parent link="base_footprint"/><child link="base"/><origin xyz="0 0 0.05"/></joint>
  <joint name="stand" type="fixed"><parent link="base"/><child link="arm"/></joint>
  {wheels}
</robot>"""
WHEEL = """<link name="{name}"><inertial><mass value="0.2"/><inertia ixx="1e-4" iyy="1e-4" izz="2e-4"/></inertial>
  <collision><geometry><cylinder radius="0.04" length="0.02"/></geometry></collision></link>
  <joint name="{name}_joint" type="continuous"><parent link="base"/><child link="{name}"/>
  <origin xyz="{x} {y} 0" rpy="0 1.5707963267948966 {yaw}"/><axis xyz="0 0 1"/></joint>"""


def kiwi(name="wheel{}"):
    angles = np.radians([90.0, 210.0, 330.0])
    return OTHER.format(
        wheels="".join(
            WHEEL.format(name=name.format(k), x=0.15 * np.cos(a), y=0.15 * np.sin(a), yaw=a)
            for k, a in enumerate(angles)
        )
    )


@pytest.mark.parametrize("name", ["wheel{}", "rad_{}"])
def test_a_urdf_of_somebody_else(name):
    """Axles along z of links that are turned, as SolidWorks writes them; parts on fixed joints count."""
    robot = robot_of_urdf(kiwi(name))
    assert robot.name == "kiwi"
    assert robot.body.mass == pytest.approx(5.6)
    assert robot.body.inertia == pytest.approx(0.06 + 0.01 + 3 * (1e-4 + 0.2 * 0.15**2), rel=1e-6)
    np.testing.assert_allclose(robot.wheels.azimuth_deg, [90.0, -150.0, -30.0], atol=1e-9)
    assert robot.wheels.robot_radius == pytest.approx(0.15)
    assert robot.wheels.wheel_radius == 0.04
    assert robot.wheels.wheel_inertia == pytest.approx(2e-4)


def test_an_arm_that_reaches_out_moves_the_centre_of_mass():
    """An arm of 1 kg, 60 mm in front and 20 mm to the left, on a robot of 5.6 kg; angles to three digits do not."""
    text = kiwi().replace('link="arm"/>', 'link="arm"/><origin xyz="0.06 0.02 0.1"/>')
    robot = robot_of_urdf(text)
    np.testing.assert_allclose(robot.body.centre, [0.06 / 5.6, 0.02 / 5.6], rtol=1e-9)
    apart = 1.0 * 4.6 / 5.6 * (0.06**2 + 0.02**2)
    assert robot.body.inertia == pytest.approx(0.06 + 0.01 + 3 * (1e-4 + 0.2 * 0.15**2) + apart, rel=1e-6)
    np.testing.assert_allclose(robot.wheels.azimuth_deg, [90.0, -150.0, -30.0], atol=1e-6)
    assert robot.wheels.robot_radius == pytest.approx(0.15)
    assert robot.priors["body.centre_m"].origin == "imported"
    rounded = kiwi().replace("3.66519142918809", "3.665")
    assert rounded != kiwi()
    assert robot_of_urdf(rounded).body.centre == (0.0, 0.0)


@pytest.mark.parametrize(
    "text, words",
    [
        ("", "not valid XML"),
        ("<robot", "not valid XML"),
        ("<sdf/>", "not a URDF file; got <sdf>"),
        ('<!DOCTYPE a [<!ENTITY b "c">]><robot/>', "declares entities"),
        ("<robot/>", "not a tree; got 0 links"),
        ('<robot><link name="a"/></robot>', "nothing in it has a mass"),
        (kiwi().replace('value="4"', 'value="nan"'), "cannot use this value; got nan"),
        (kiwi().replace('value="4"', 'value="1e999"'), "cannot use this value"),
        (kiwi().replace('value="4"', ""), "cannot use this value"),
        (kiwi().replace('link="base_footprint"', 'link="wheel0"'), "not a tree"),
        (kiwi().replace("0 1.5707963267948966", "0 0"), "cannot tell the wheels; got 0 found"),
        (
            kiwi().replace('rpy="0 1.5707963267948966 ', 'rpy="0 1.5707963267948966 0" x="'),
            "does not point to the centre",
        ),
        (kiwi().replace('value="4"', 'value="-4"'), "mass"),
    ],
)
def test_bad_urdf_files_are_refused_in_words(text, words):
    with pytest.raises(InputError, match=words):
        robot_of_urdf(text)


MODEL = """<mujoco model="m"><worldbody><body name="base"><freejoint/><geom type="box" size="0.1 0.1 0.02" mass="3"/>
{}</body></worldbody></mujoco>"""


def model_wheels(names="wheel"):
    text = ""
    for k, angle in enumerate(np.radians([60.0, 180.0, 300.0])):
        x, y = np.cos(angle), np.sin(angle)
        text += (
            f'<body name="{names}{k}" pos="{0.1 * x} {0.1 * y} 0"><joint type="hinge" axis="{x} {y} 0"/>'
            f'<geom type="cylinder" size="0.03 0.01" zaxis="{x} {y} 0" mass="0.1"/></body>'
        )
    return MODEL.format(text)


def test_a_mujoco_model_of_somebody_else():
    pytest.importorskip("mujoco")
    robot = robot_of_mjcf(model_wheels())
    assert robot.body.mass == pytest.approx(3.3)
    np.testing.assert_allclose(robot.wheels.azimuth_deg, [60.0, 180.0, -60.0], atol=1e-9)
    assert robot.wheels.wheel_inertia == pytest.approx(0.5 * 0.1 * 0.03**2)
    flat = 3 * (0.2**2 + 0.2**2) / 12
    assert robot.body.inertia == pytest.approx(flat + 3 * (0.1 * (0.03**2 / 4 + 0.02**2 / 12) + 0.1 * 0.1**2), rel=1e-6)


@pytest.mark.parametrize(
    "text, words",
    [
        ("<robot/>", "not a MuJoCo model"),
        ("<mujoco><worldbody><nothing/></worldbody></mujoco>", "this element is not read; got <nothing>"),
        ("<mujoco><worldbody><body pos='a'/></worldbody></mujoco>", "MuJoCo does not compile it"),
        ('<mujoco><include file="/etc/hosts"/></mujoco>', "takes from other files; got /etc/hosts"),
        (model_wheels("part"), "cannot tell the wheels"),
        ("<mujoco/>", "nothing in it has a mass"),
    ],
)
def test_bad_models_are_refused_in_words(text, words):
    pytest.importorskip("mujoco")
    with pytest.raises(InputError, match=words):
        robot_of_mjcf(text)


def test_whatever_is_in_the_file_ends_in_words():
    """A URDF with pieces torn out: a robot, or an error of ours."""
    text, rng = kiwi(), np.random.default_rng(0)
    for _ in range(200):
        first, last = sorted(rng.integers(0, len(text), 2))
        torn = text[:first] + text[min(last, first + 40) :]
        try:
            robot_of_urdf(torn)
        except OmnidynError:
            continue
