"""Motion under dry friction, rest included, solved to the last bit: one monotone inclusion in three unknowns.

plant (the constants of a robot; layout.py names them), forces (what acts at a speed), active_set (what is stuck,
Newton's step within it, and whether what is stuck can hold), inclusion (the solver), release (what gives way), band
(Karnopp), step_bound (how long a step may be).
"""
