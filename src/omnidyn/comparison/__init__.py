"""A model beside a log: compare is the door, result the answer.

replay (a free run, begun by start), traces, metrics (lag, whiteness, difference of two models), verdict, threshold;
compare makes bands too (how far the model may be off). Beside it stand drift (fits of one robot, compared) and align
(two logs of one motion, put on one clock).
model_bands: what the std of the robot file may explain.
lag: how late a signal is.
whiteness: whether errors are noise without memory.
nearer_model: which of two models is nearer to the robot.
errors_from_start: errors without what the start was off by.
"""
