"""ROS 2. covariance: how far odometry from wheels is off, from logs or from what is known of the radii.

ros2_control: the files for omni_wheel_drive_controller, with the URDF whose joints turn as that controller has it.
node: a node that drives the robot, as text.
"""
