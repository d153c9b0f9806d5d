"""urdf and sdf: read back by parsers that share nothing with us: masses, inertias, places, limits, senses of joints."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

import omnidyn
from omnidyn.export.bodies.sdf import sdf
from omnidyn.export.bodies.urdf import urdf
from tests.support.mixed_robots import random_robot, with_centre, with_spin

ROBOT = omnidyn.load_robot("axebot")


def numbers(text):
    return np.array([float(each) for each in (text or "").split()])


def from_urdf(text):
    """[(mass, (ixx, iyy, izz))] of the links, base first; [(xyz, yaw, axis, limits, dynamics)] of the joints."""
    root = ET.fromstring(text)
    links, joints = [], []
    for link in root.iter("link"):
        inertia = link.find("inertial/inertia").attrib
        links.append(
            (float(link.find("inertial/mass").get("value")), [float(inertia[k]) for k in ("ixx", "iyy", "izz")])
        )
    for joint in root.findall("joint"):
        origin, limit, eased = joint.find("origin"), joint.find("limit").attrib, joint.find("dynamics").attrib
        joints.append(
            (
                numbers(origin.get("xyz")),
                numbers(origin.get("rpy"))[2],
                numbers(joint.find("axis").get("xyz")),
                (float(limit["effort"]), float(limit["velocity"])),
                (float(eased["damping"]), float(eased["friction"])),
            )
        )
    return links, joints


def from_sdf(text):
    """The same of an SDFormat model."""
    model = ET.fromstring(text).find("model")
    links, joints, where = [], [], {}
    for link in model.findall("link"):
        inertia = link.find("inertial/inertia")
        links.append(
            (float(link.find("inertial/mass").text), [float(inertia.find(k).text) for k in ("ixx", "iyy", "izz")])
        )
        where[link.get("name")] = numbers(link.findtext("pose"))
    for joint in model.findall("joint"):
        pose, axis = where[joint.findtext("child")], joint.find("axis")
        joints.append(
            (
                pose[:3],
                pose[5],
                numbers(axis.findtext("xyz")),
                (float(axis.findtext("limit/effort")), float(axis.findtext("limit/velocity"))),
                (float(axis.findtext("dynamics/damping")), float(axis.findtext("dynamics/friction"))),
            )
        )
    return links, joints


KINDS = [(urdf, from_urdf), (sdf, from_sdf)]


def base_centre(text):
    """Where the base balances, by either format."""
    base = next(ET.fromstring(text).iter("link")).find("inertial")
    origin = base.find("origin")
    return numbers(base.findtext("pose") if origin is None else origin.get("xyz"))[:2] if len(base) > 2 else np.zeros(2)


@pytest.mark.parametrize("write, read", KINDS, ids=["urdf", "sdf"])
@pytest.mark.parametrize("seed", range(30))
def test_thirty_robots_weigh_what_they_weigh(write, read, seed):
    """Mass, centre of mass, and inertia about that, of all parts together."""
    robot = random_robot(seed) if seed % 2 else with_spin(random_robot(seed), seed)
    robot = with_centre(robot, seed) if seed % 3 else robot
    text = write(robot).text
    links, joints = read(text)
    assert len(joints) == robot.wheels.count == len(links) - 1
    places = np.array([base_centre(text), *(place[:2] for place, *_ in joints)])
    masses = np.array([mass for mass, _ in links])
    assert masses.sum() == pytest.approx(robot.body.mass, rel=1e-12)
    np.testing.assert_allclose(masses @ places / masses.sum(), robot.body.centre, atol=1e-12)
    turning = sum(about[2] for _, about in links) + masses @ np.sum((places - robot.body.centre) ** 2, axis=1)
    assert turning == pytest.approx(robot.body.inertia, rel=1e-11)
    for mass, about in links:
        assert mass > 0.0
        assert 2.0 * max(about) < sum(about)  # the triangle inequality


@pytest.mark.parametrize("write", [urdf, sdf])
def test_products_of_inertia_are_zero(write):
    """The axes of every part are its principal ones."""
    root = ET.fromstring(write(ROBOT).text)
    products = ("ixy", "ixz", "iyz")
    found = [each.get(name) or each.findtext(name) for each in root.iter("inertia") for name in products]
    assert len(found) == 3 * 4
    assert all(float(each) == 0.0 for each in found)


@pytest.mark.parametrize("write, read", KINDS, ids=["urdf", "sdf"])
def test_all_joints_forward_turn_the_robot_counter_clockwise(write, read):
    """A wheel that turns about its axis at w moves its centre by w x r: along the rows of G, as the model says."""
    _, joints = read(write(ROBOT).text)
    for k, (place, yaw, axis, _, _) in enumerate(joints):
        turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
        rolls = np.cross(turn @ axis, [0.0, 0.0, 1.0])
        np.testing.assert_allclose(rolls[:2], ROBOT.wheels.wrench_matrix[:2, k], atol=1e-12)
        np.testing.assert_allclose(np.cross(place, rolls)[2], 0.1, atol=1e-12)


@pytest.mark.parametrize("write, read", KINDS, ids=["urdf", "sdf"])
def test_limits_and_friction_of_joints(write, read):
    friction = ROBOT.friction.replace(wheels={"coulomb": (1.0, 2.0, 3.0), "viscous": 0.5})
    robot = ROBOT.replace(friction=friction, motor=ROBOT.motor.replace(current_limit=2.0))
    _, joints = read(write(robot).text)
    for k, (_, _, _, (effort, speed), (damping, dry)) in enumerate(joints):
        assert effort == pytest.approx(19 * 0.0059 * 2.0, rel=1e-12)
        assert speed == pytest.approx(6.0 / (0.0059 * 19), rel=1e-12)
        assert damping == pytest.approx(0.5 * 0.035**2, rel=1e-12)
        assert dry == pytest.approx((k + 1) * 0.035, rel=1e-12)


def test_mujoco_reads_the_urdf():
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(urdf(ROBOT).text)
    assert model.njnt == 3
    assert [model.joint(k).name for k in range(3)] == ["wheel1_joint", "wheel2_joint", "wheel3_joint"]


@pytest.mark.parametrize("write", [urdf, sdf])
@pytest.mark.parametrize("name", ['<&"x">', "a--b", "速度", "-->", "'", "--"])
def test_whatever_the_robot_is_called(write, name):
    text = write(ROBOT.replace(name=name)).text
    ET.fromstring(text)
    assert all(words in text for words in write(ROBOT).missing)


def from_python_sdformat(text):
    """The same by python-sdformat, a parser of its own that knows every element of the format."""
    pysdf = pytest.importorskip("pysdf")
    model = pysdf.SDF.from_xml(text).model
    links, joints, where = [], [], {}
    for link in model.links:
        about = link.inertial.inertia
        links.append((float(link.inertial.mass), [float(about.ixx), float(about.iyy), float(about.izz)]))
        where[link.name] = numbers(link.pose.text)
    for joint in model.joints:
        pose, axis = where[joint.child], joint.axis
        joints.append(
            (
                pose[:3],
                pose[5],
                numbers(axis.xyz.text),
                (float(axis.limit.effort), float(axis.limit.velocity)),
                (float(axis.dynamics.damping), float(axis.dynamics.friction)),
            )
        )
    return links, joints, _unknown(model)


def _unknown(element):
    """Elements that the format does not have, here and below."""
    below = [each for child in element.children if hasattr(child, "children") for each in _unknown(child)]
    return [*element.unknown_elements, *below] if hasattr(element, "unknown_elements") else below


@pytest.mark.parametrize("seed", range(30))
def test_a_parser_of_sdf_reads_thirty_robots_and_knows_every_element(seed):
    text = sdf(with_spin(random_robot(seed), seed) if seed % 2 else with_centre(random_robot(seed), seed)).text
    links, joints, unknown = from_python_sdformat(text)
    assert unknown == []
    bad = text.replace("<damping>", "<dampness>").replace("</damping>", "</dampness>")
    assert len(_unknown(pytest.importorskip("pysdf").SDF.from_xml(bad).model)) == len(joints)
    for one, other in zip(from_sdf(text), (links, joints), strict=True):
        assert len(one) == len(other)
        for mine, theirs in zip(one, other, strict=True):
            for a, b in zip(mine, theirs, strict=True):
                np.testing.assert_array_equal(a, b)
