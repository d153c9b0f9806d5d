"""A motor on a bench, or the motors of a robot off the ground: slope, dead band, lag and inertia of each.

log, between: what a log tells of the motors, and their input between its rows. estimate: what every fit returns.
windows, line: windows in integral form, and the line through them. edge, rest, start: the instant at which a motor sets
off, where it rests, and what each direction shows by itself. static: points of steady speed, of a table or of slow
rows. engine, problem, fit, bend: whole logs as free runs. free_run, choice: runs of a fitted motor, and the way that
best predicts logs left out. study: identify_motors, all motors by one of the two ways. into_robot: its numbers in a
robot file.
"""
