"""The model predictive controller in C: loops over small matrices, as a program of 8 kB must be.

code: the numbers of one controller, and these files around them. model.c: a step of the robot, made linear. solver.c:
the program of a step. step.c: what a step is made of. Unrolled, as the kernels of control/mpc are, they would take
three times the room: so they stand here a second time, as loops, and tests hold every step to the controller of Python.
"""
