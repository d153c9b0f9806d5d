"""ROS 2.

ros2_control: the files for the controllers of drive_controller, with the URDF whose joints turn as those have it.
odometry_covariance: how far its odometry is off. node: a node that drives the robot, as text; path_node: by a
controller. package: what makes a folder one that colcon builds.
"""
