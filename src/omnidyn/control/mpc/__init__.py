"""Model predictive control of one robot in microseconds: a quadratic program, stage by stage, solved to its optimum.

Read in this order: model (the numbers of a robot), columns (of the tables), stages and program (of one step), with
linear_motion (about which motion), riccati (one solve), interior_point and active_set (to the optimum), solve (both),
limits (optional ones), observer, settings, preview (the path ahead), memory (arrays), loop (one step of the
controller), batch (of many robots), controller. small: vectors of 3 in registers.
"""
