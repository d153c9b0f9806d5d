"""Order and sign of columns: wheels, motor_columns, by orders (the choice among them) and turned (the angle
between two velocities), floor, pose_frame (the frame of the pose); frames of twist and pose against each other:
twist_frame; signs of the twist against the voltages: against_drive.
"""
