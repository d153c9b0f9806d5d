"""urdf and sdf: read back by parsers that share nothing with us: masses, inertias, places, limits, senses of joints."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

import omnidyn
from omnidyn.export.bodies.sdf import sdf
from omnidyn.export.bodies.urdf import urdf
from omnidyn.model.wheels import wheel_speed
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


@pytest.mark.parametrize("name", ["axebot", "mecanum", "robotino", "lekiwi", "four-wheel"])
@pytest.mark.parametrize("height", [None, 0.4])
def test_mujoco_reads_the_urdf_and_nothing_touches_but_the_wheels_the_floor(name, height):
    """What collides is in it: base and wheels stand clear of each other, and the wheels alone reach the floor."""
    mujoco, robot = pytest.importorskip("mujoco"), omnidyn.load_robot(name)
    joints = [f"wheel{k + 1}" for k in range(robot.wheels.count)]
    spec = mujoco.MjSpec.from_string(urdf(robot, height, joints).text)
    floor = -float(robot.wheels.radii.max()) + 1e-4
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[5, 5, 1], pos=[0, 0, floor], name="floor")
    model = spec.compile()
    assert [model.joint(k).name for k in range(model.njnt)] == joints
    assert model.ngeom == 2 + robot.wheels.count
    model.body_weldid[:] = np.arange(model.nbody)  # else the base, which stands still, would not be tested
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    touching = {tuple(sorted(contact.geom)) for contact in data.contact}
    (plane,) = (k for k in range(model.ngeom) if model.geom_type[k] == mujoco.mjtGeom.mjGEOM_PLANE)
    wheels = {k for k in range(model.ngeom) if model.body(model.geom_bodyid[k]).name.startswith("wheel")}
    assert touching == {tuple(sorted((plane, wheel))) for wheel in wheels}


def rolling(robot):
    """By how much each wheel of its SDF slips at the floor in a twist: along fdir1, and across it [m/s].

    Of the file: places, axes, radii and directions. Of the model: how fast each wheel turns for that twist.
    """
    model = ET.fromstring(sdf(robot).text).find("model")
    twist = np.array([0.4, -0.7, 2.0])
    links = {link.get("name"): link for link in model.findall("link")}
    for joint, speed in zip(model.findall("joint"), wheel_speed(robot.wheels, twist), strict=True):
        link = links[joint.findtext("child")]
        pose, friction = numbers(link.findtext("pose")), link.find("collision/surface/friction/ode")
        cos, sin = np.cos(pose[5]), np.sin(pose[5])
        axle = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]]) @ numbers(joint.findtext("axis/xyz"))
        radius = float(link.findtext("collision/geometry/cylinder/radius"))
        hub = np.array([twist[0] - twist[2] * pose[1], twist[1] + twist[2] * pose[0], 0.0])
        slip = hub + np.cross(speed * axle, [0.0, 0.0, -radius])
        along = numbers(friction.findtext("fdir1"))
        assert friction.find("fdir1").get("{http://gazebosim.org/schema}expressed_in") == "base_link"
        assert float(friction.findtext("mu2")) == 0.0
        assert float(friction.findtext("mu")) > 0.0
        yield slip @ along, slip @ np.cross([0.0, 0.0, 1.0], along)


@pytest.mark.parametrize("name", ["axebot", "mecanum", "four-wheel", "lekiwi"])
@pytest.mark.parametrize("wheelbase", [None, 0.15])
def test_wheels_of_the_sdf_roll_sideways(name, wheelbase):
    """Whatever the twist, the floor slips across fdir1 alone, where there is no friction: a closed form."""
    robot = omnidyn.load_robot(name)
    if name == "mecanum":
        robot = robot.replace(wheels=robot.wheels.replace(wheelbase=wheelbase))
        places = {tuple(np.sign(place[:2])) for place, *_ in from_sdf(sdf(robot).text)[1]}
        assert places == {(1, 1), (1, -1), (-1, 1), (-1, -1)}
        assert any("wheelbase is a guess" in words for words in sdf(robot).missing) == (wheelbase is None)
    slips = np.array(list(rolling(robot)))
    np.testing.assert_allclose(slips[:, 0], 0.0, atol=1e-12)
    assert (np.abs(slips[:, 1]) > 0.01).all()


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
