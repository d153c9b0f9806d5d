"""Friction from points at constant speed.

points, operating_points: points of a table, or of the steady windows of logs. shapes: the shapes of friction and how
one is fitted. levels: their fit as an Estimate. choice: which shape predicts best. line, steady_state: the paper's line
on each axis, with its band. lack_of_fit: does any offered shape fit? moment: a change inside a run. study, study_table:
all of it for the groups of some logs, and what it says.
"""
