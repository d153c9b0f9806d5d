"""Friction from points at constant speed.

The paper's way: points, line (with its band), steady_state, axis_lines. With all axes at once: operating_points,
shapes, shape_fit, choice, lack_of_fit (does any offered shape fit?), moment and moment_by_shape
(a change inside a run), study, and what it says: study_parts, study_statements,
study_table; of steady_state, line_statements. settling: whether a log has a transient at all.
"""
