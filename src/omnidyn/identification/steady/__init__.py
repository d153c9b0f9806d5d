"""Friction from points at constant speed.

points, operating_points: points of a table, or of the steady windows of logs. shapes: the shapes of friction and how
one is fitted. levels: their fit as an Estimate. choice: which shape predicts best. line, steady_state, paper_lines: the
paper's line on each axis, with its band; point_warnings: what is odd about its points. linear_shape, unoffered_parts,
lack_of_fit: does any offered shape fit? moment, moment_by_shape: a change inside a run. loop_speed: how fast a speed
loop settles. sensitivity_to_fixed: what levels rest on. study, study_table, study_statements, group_numbers: all of it
for the groups of some logs, and what it says.
"""
