"""A motor on a bench, or the motors of a robot off the ground: slope, dead band, lag and inertia of each.

log: what a log says of the motors, and their input between its rows. estimate: what every fit returns. windows: windows
in integral form and the line through them. rest: where a motor rests, and the instant at which it sets off. start: what
each direction shows by itself, of rows or of points of steady speed. window_fit: what those give. problem, fit: whole
logs as free runs. steady_curve: whether the steady speed is a line. held_out: which numbers a free run needs. choice:
free runs of a fitted motor, and the options that best predict logs left out. study: study_motors, all motors by one of
the two methods. into_robot: its numbers in a robot file.
"""
