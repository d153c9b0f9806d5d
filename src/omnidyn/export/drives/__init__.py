"""A program to drive, as files that a robot runs by itself: `omnidyn drive PLAN --to KIND -o OUT`.

kinds: which there are. rows: the program as a few straight pieces, and what its legs turn the wheels by. python_core,
java_core, c_core: one class that walks them and stops, in three languages. arduino, ros2_drive, ftc, frc: what stands
around it. page: to print.
"""
