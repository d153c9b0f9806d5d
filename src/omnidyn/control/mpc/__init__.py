"""Model predictive control of one robot in microseconds: a quadratic program, stage by stage, solved to its optimum.

Read in this order: layout (the tables), model (the numbers of a robot), stages (the program of one step), riccati (one
solve), active_set, interior_point, solve (to the optimum), observer, loop (one step of the controller), controller.
"""
