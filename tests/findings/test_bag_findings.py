"""What a bag shows about itself: a gyroscope in deg/s, messages without a number."""

import shutil
import subprocess
import sys

import numpy as np
import pytest

from omnidyn.findings.check import check
from omnidyn.logs.read_log import LogOptions, recorded_log
from tests.findings.redundant import ROBOT, driven
from tests.support.bags import BagMaker, write_mcap
from tests.support.cases import case


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """Joint states, an IMU in deg/s, and odometry whose quaternions are 0 and whose velocities are NaN."""
    pytest.importorskip("rosbags")
    maker, folder = BagMaker(), tmp_path_factory.mktemp("bag")
    t, _, twist, wheels, place, _, _ = driven(20.0)
    none = np.zeros(36)
    for k, now in enumerate(t):
        names = [f"wheel_{j}_joint" for j in (1, 2, 3)]
        joints = maker.make("sensor_msgs/msg/JointState", maker.header(now), names, np.zeros(0), wheels[k], np.zeros(0))
        maker.add("/joint_states", "sensor_msgs/msg/JointState", now, joints)
        turn = maker.vector(0.0, 0.0, float(np.degrees(twist[k, 2])))
        still = maker.make("geometry_msgs/msg/Quaternion", 0.0, 0.0, 0.0, 0.0)
        unknown = np.full(9, -1.0)
        imu = maker.make(
            "sensor_msgs/msg/Imu",
            maker.header(now),
            still,
            unknown,
            turn,
            unknown,
            maker.vector(0.0, 0.0, 9.8),
            unknown,
        )
        maker.add("/imu/data", "sensor_msgs/msg/Imu", now, imu)
        point = maker.make("geometry_msgs/msg/Point", place[k].real, place[k].imag, 0.0)
        pose = maker.make(
            "geometry_msgs/msg/PoseWithCovariance", maker.make("geometry_msgs/msg/Pose", point, still), none
        )
        lost = maker.vector(np.nan, np.nan, np.nan)
        speed = maker.make(
            "geometry_msgs/msg/TwistWithCovariance", maker.make("geometry_msgs/msg/Twist", lost, lost), none
        )
        maker.add(
            "/odom",
            "nav_msgs/msg/Odometry",
            now,
            maker.make("nav_msgs/msg/Odometry", maker.header(now), "base_link", pose, speed),
        )
    return write_mcap(maker, folder / "log.mcap")


def test_a_gyroscope_in_degrees_is_asked_about_and_the_remedy_works(bag):
    verdict = check(recorded_log(bag, ROBOT), ROBOT)
    assert [finding.code for finding in verdict.findings if finding.severity != "note"] == []
    doubts = [str(finding) for finding in verdict.of("not_taken")]
    (gyroscope,) = [words for words in doubts if "/imu/data/omega" in words]
    assert "no turn rate of a robot in rad/s" in gyroscope
    for options in (LogOptions(assume={"omega": "deg/s"}), LogOptions(overrides=("omega=/imu/data/omega:deg/s",))):
        log = recorded_log(bag, ROBOT, options)
        assert np.nanmax(np.abs(log.channels["twist"][:, 2])) < 1.0
        assert [finding.code for finding in check(log, ROBOT).findings if finding.severity != "note"] == []
    # Who insists on rad/s is told by the wheels.
    (finding,) = check(recorded_log(bag, ROBOT, LogOptions(assume={"omega": "rad/s"})), ROBOT).of("unit")
    assert finding.subject == "omega"


def test_messages_without_a_number_are_named(bag):
    doubts = [finding for finding in check(recorded_log(bag)).of("not_taken") if "/odom" in str(finding)]
    assert [finding.numbers["doubt"].columns for finding in doubts] == [("/odom/heading",), ("/odom/vx", "/odom/vy")]
    assert "quaternion of zeros" in str(doubts[0])
    assert [finding.numbers["doubt"].code for finding in doubts] == ["no_heading_number", "no_number"]
    assert doubts[1].remedy_text == "look at what fills in these messages"


# Bag of the case -> what is said above a note, with a robot; each has one cause.
CAUSES = {
    "ok": [],
    "stagger": [],
    "world_twist": [("twist_frame", "vx vy")],
    "world_twist_nowheels": [("twist_frame", "vx vy")],
    "zero_quaternion": [],
    "nan_odom": [],
    "gyro_deg": [],
    "rpm": [("unit", "w1 w2 w3")],
    "left_handed": [("inverted", "vy omega y heading")],
    "roller_slip": [("axis_ratio", "y")],
}


@pytest.mark.long
def test_each_bag_of_the_cases_has_one_cause(tmp_path):
    pytest.importorskip("rosbags")
    for name in ("make.py", "body.py"):
        shutil.copy(case("logs/staggered_topics") / name, tmp_path)
    subprocess.run([sys.executable, "make.py"], cwd=tmp_path, check=True)
    found = {}
    for name in CAUSES:
        findings = check(recorded_log(tmp_path / name, ROBOT), ROBOT).findings
        found[name] = [(finding.code, finding.subject) for finding in findings if finding.severity != "note"]
    assert found == CAUSES
