"""What each sensor shows a fit of a robot, one file per sensor.

observation (the contract), columns (several columns of a record together, their slopes), then twist, wheel_speed,
wheel_angle, current, pose (heading and position); observations has all of them by name.
"""
