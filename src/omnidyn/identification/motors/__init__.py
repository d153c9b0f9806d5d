"""A motor on a bench, or the motors of a robot off the ground.

In integral form: drive_windows, drive_line, drive_table. By output error: log, input, engine, fit, bend, run, choice.
"""
