"""ROS 2.

ros2_control: the files for the controllers of drive_controller, with the URDF whose joints turn as those have it.
node: a node that drives the robot, as text. package: what makes a folder one that colcon builds.
"""
