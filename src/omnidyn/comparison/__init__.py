"""A model beside a log: compare is the door, result the answer.

replay (a free run, begun by start), traces, metrics (lag, whiteness, difference of two models), verdict, threshold;
compare makes bands too (how far the model may be off). Beside it stand drift (fits of one robot, compared) and align
(two logs of one motion, put on one clock).
"""
