"""Order and sign of columns: wheels (and motors), by orders (the choice among them, and the angle
between two velocities), floor (and the frame of the pose); frames of twist and pose against each other: twist_frame;
signs of the twist against the voltages: against_drive.
"""
