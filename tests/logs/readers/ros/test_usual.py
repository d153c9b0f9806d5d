"""What the less usual of the usual messages say: Imu, poses, /tf; and who gives what where several could."""

import numpy as np
import pytest

from omnidyn.logs.read_log import recorded_log
from omnidyn.logs.readers.ros.usual import heading_of, wheel_numbers

pytest.importorskip("rosbags")
pytest.importorskip("mcap")
from tests.support.bags import BagMaker, write_mcap
from tests.support.codes import said


class Maker(BagMaker):
    """With the messages that the others do not need."""

    def turn(self, heading, roll=0.0):
        """A quaternion of a yaw behind a roll."""
        s, c, p, q = np.sin(heading / 2), np.cos(heading / 2), np.sin(roll / 2), np.cos(roll / 2)
        return self.make("geometry_msgs/msg/Quaternion", c * p, s * p, s * q, c * q)

    def pose(self, x, y, heading):
        return self.make("geometry_msgs/msg/Pose", self.make("geometry_msgs/msg/Point", x, y, 0.0), self.turn(heading))

    def imu(self, t, omega, topic="/imu/data"):
        none = np.zeros(9)
        message = self.make(
            "sensor_msgs/msg/Imu",
            self.header(t),
            self.turn(0.0),
            none,
            self.vector(0.1, 0.2, omega),
            none,
            self.vector(0.0, 0.0, 9.81),
            none,
        )
        self.add(topic, "sensor_msgs/msg/Imu", t, message)

    def tf(self, t, *frames, topic="/tf"):
        """frames: (parent, child, x, y, heading) each."""
        transforms = [
            self.make(
                "geometry_msgs/msg/TransformStamped",
                self.header(t, parent),
                child,
                self.make("geometry_msgs/msg/Transform", self.vector(x, y, 0.0), self.turn(heading)),
            )
            for parent, child, x, y, heading in frames
        ]
        self.add(topic, "tf2_msgs/msg/TFMessage", t, self.make("tf2_msgs/msg/TFMessage", transforms))

    def pose_stamped(self, t, x, y, heading, topic="/mocap/pose"):
        message = self.make("geometry_msgs/msg/PoseStamped", self.header(t), self.pose(x, y, heading))
        self.add(topic, "geometry_msgs/msg/PoseStamped", t, message)


def test_a_gyroscope_gives_the_turn_rate_where_no_odometry_does(tmp_path):
    maker = Maker()
    for k in range(10):
        maker.imu(0.01 * k, 0.5 * k)
        maker.joints(0.01 * k, ["wheel_1", "wheel_2"], [], [1.0 * k, 2.0])
    log = recorded_log(write_mcap(maker, tmp_path / "a.mcap"))
    assert np.array_equal(log.channels["twist"][:, 2], 0.5 * np.arange(10))
    for k in range(10):
        maker.odometry(0.01 * k, (0, 0, 0), (1.0, 0.0, 7.0))
    log = recorded_log(write_mcap(maker, tmp_path / "b.mcap"))
    assert (log.channels["twist"][:, 2] == 7.0).all()
    assert any("omega of /imu/data are not taken: /odom gives them" in note for note in said(log.notes))


def test_a_transform_gives_the_pose_where_nothing_else_does(tmp_path):
    maker = Maker()
    for k in range(10):
        maker.tf(0.05 * k, ("base_link", "laser", 9.0, 9.0, 1.0), ("map", "odom", 5.0, 5.0, 1.0))
        maker.tf(0.05 * k + 0.01, ("robot1/odom", "robot1/base_link", 0.1 * k, -0.1 * k, 0.9 * k))
    log = recorded_log(write_mcap(maker, tmp_path / "a.mcap"))
    np.testing.assert_allclose(log.channels["pose"], np.arange(10)[:, None] * [0.1, -0.1, 0.9], rtol=2e-15, atol=1e-15)
    for k in range(10):
        maker.pose_stamped(0.05 * k, 1.0, 2.0, 0.0)
    log = recorded_log(write_mcap(maker, tmp_path / "b.mcap"))
    known = np.isfinite(log.channels["pose"][:, 0])
    assert np.array_equal(log.channels["pose"][known], np.tile([1.0, 2.0, 0.0], (10, 1)))


@pytest.mark.parametrize("stamped", [False, True])
def test_a_twist_is_a_command_where_its_topic_says_so(tmp_path, stamped):
    maker = BagMaker()
    for k in range(10):
        maker.twist(0.1 * k, (0.1 * k, 0.0, 0.0), "/robot1/cmd_vel", stamped)
        maker.twist(0.1 * k, (0.2 * k, 0.0, 0.0), "/robot1/vision/velocity", stamped)
    log = recorded_log(write_mcap(maker, tmp_path / "a.mcap"))
    for channel, size in (("twist_command", 0.1), ("twist", 0.2)):
        values = log.channels[channel][:, 0]
        assert np.array_equal(values[np.isfinite(values)], size * np.arange(10))


def test_a_heading_is_that_of_a_robot_that_leans():
    maker = Maker()
    turns = [maker.turn(heading, roll=0.2) for heading in np.linspace(-2.0, 9.0, 50)]
    parts = (np.array([getattr(turn, axis) for turn in turns]) for axis in "xyzw")
    np.testing.assert_allclose(heading_of(*parts), np.linspace(-2.0, 9.0, 50), atol=1e-14)
    assert np.isnan(heading_of(*np.zeros((4, 1)))).all()


@pytest.mark.parametrize(
    ("joints", "numbers"),
    [
        (["wheel_1_joint", "wheel_2_joint"], [1, 2]),
        (["wheel0", "wheel1", "wheel2"], [1, 2, 3]),
        (["joint3", "joint1", "joint2"], [3, 1, 2]),
        (["arm_1", "wheel_2", "wheel_1"], [None, 2, 1]),
        (["front_left_wheel", "front_right_wheel"], []),
        (["wheel_1", "wheel_1_caster"], []),
        (["wheel_3", "wheel_5"], []),
    ],
)
def test_names_of_joints_count_the_wheels_or_do_not(joints, numbers):
    assert wheel_numbers(joints) == {j: n for j, n in zip(joints, numbers, strict=False) if n is not None}
