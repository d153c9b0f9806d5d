"""ROS 2.

ros2_control: the files for omni_wheel_drive_controller, with the URDF whose joints turn as that controller has it.
node: a node that drives the robot, as text.
"""
