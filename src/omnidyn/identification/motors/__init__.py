"""A motor on a bench, or the motors of a robot off the ground: slope, dead band, lag and inertia of each.

log: what a log says of the motors; input_between_rows: and of their input between its rows. estimate: what every fit
returns. windows: windows in integral form and the line through them. steady_windows, rest: where a motor turns steadily
or rests, and starts_and_stops: the instant at which it sets off. start: what each direction shows by itself, of rows;
one_way_line: by a line; points: of points of steady speed. window_fit: what windows give. problem, motor_engine, fit:
whole logs as free runs. bent_line, steady_curve: whether the steady speed is a line. held_out: which numbers a free run
needs. choice: free runs of a fitted motor. study: study_motors, all motors by one of the two methods; motor_verdict:
its first line. into_robot: its numbers in a robot file.
"""
