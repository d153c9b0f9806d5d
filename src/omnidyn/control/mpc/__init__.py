"""Model predictive control of one robot in microseconds: a quadratic program, stage by stage, solved to its optimum.

Read in this order: model (the numbers of a robot), stages and program (of one step), riccati (one solve),
interior_point (to the optimum, by an active set where that does), observer, settings, loop (one step of the
controller), controller. small: vectors of 3 in registers.
"""
