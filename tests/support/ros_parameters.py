"""The parameters that controllers of ROS 2 declare, copied from their sources by hand: the outside source of our YAML.

Name -> (type, whether it must be given: it has no default, or one that its validation refuses).
"""

from __future__ import annotations

# ros-controls/ros2_controllers, omni_wheel_drive_controller/src/omni_wheel_drive_controller_parameters.yaml,
# commit 74af21b2e1f6 (2025).
OMNI = {
    "wheel_offset": (float, True),
    "wheel_names": ([str], True),
    "robot_radius": (float, True),
    "wheel_radius": (float, True),
    "tf_frame_prefix_enable": (bool, False),
    "tf_frame_prefix": (str, False),
    "odom_frame_id": (str, False),
    "base_frame_id": (str, False),
    "diagonal_covariance.pose": ([float], False),
    "diagonal_covariance.twist": ([float], False),
    "open_loop": (bool, False),
    "position_feedback": (bool, False),
    "enable_odom_tf": (bool, False),
    "cmd_vel_timeout": (float, False),
}

# ros-controls/ros2_controllers, mecanum_drive_controller/src/mecanum_drive_controller.yaml, commit 87a05940fddd (2024),
# the names of ROS 2 Jazzy and newer.
MECANUM = {
    "reference_timeout": (float, False),
    **{
        f"{place}_wheel_{what}_joint_name": (str, what == "command")
        for place in ("front_left", "front_right", "rear_right", "rear_left")
        for what in ("command", "state")
    },
    "kinematics.base_frame_offset.x": (float, False),
    "kinematics.base_frame_offset.y": (float, False),
    "kinematics.base_frame_offset.theta": (float, False),
    "kinematics.wheels_radius": (float, True),
    "kinematics.sum_of_robot_center_projection_on_X_Y_axis": (float, True),
    "base_frame_id": (str, False),
    "odom_frame_id": (str, False),
    "enable_odom_tf": (bool, False),
    "twist_covariance_diagonal": ([float], False),
    "pose_covariance_diagonal": ([float], False),
}

# ros-navigation/navigation2, nav2_velocity_smoother/src/velocity_smoother.cpp, commit 013f94bd8a33, and
# nav2_util/include/nav2_util/twist_publisher.hpp, commit 108b105b0b0c (2025).
SMOOTHER = {
    "smoothing_frequency": (float, False),
    "feedback": (str, False),
    "scale_velocities": (bool, False),
    "max_velocity": ([float], False),
    "min_velocity": ([float], False),
    "max_accel": ([float], False),
    "max_decel": ([float], False),
    "odom_topic": (str, False),
    "odom_duration": (float, False),
    "deadband_velocity": ([float], False),
    "velocity_timeout": (float, False),
    "use_realtime_priority": (bool, False),
    "enable_stamped_cmd_vel": (bool, False),
}
DECLARED = {
    "omni_wheel_drive_controller": OMNI,
    "mecanum_drive_controller": MECANUM,
    "velocity_smoother": SMOOTHER,
}


def flat(tree: dict, prefix: str = "") -> dict:
    """Parameters by their names with dots, as a node declares them."""
    found = {}
    for name, value in tree.items():
        found |= flat(value, f"{prefix}{name}.") if isinstance(value, dict) else {f"{prefix}{name}": value}
    return found


def check_parameters(node: str, tree: dict) -> None:
    """Every parameter is declared and of its type, and none that must be given is missing.

    ROS 2 takes no integer for a double, and no array of both.
    """
    declared, given = DECLARED[node], flat(tree["ros__parameters"])
    assert set(given) <= set(declared), set(given) - set(declared)
    assert {name for name, (_, needed) in declared.items() if needed} <= set(given)
    for name, value in given.items():
        kind, _ = declared[name]
        if isinstance(kind, list):
            assert value, name
            assert all(type(entry) is kind[0] for entry in value), (name, value)
        else:
            assert type(value) is kind, (name, value)
