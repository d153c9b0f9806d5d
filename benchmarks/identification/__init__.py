"""From logs to a robot, on logs of simulators.

    identify            output error; its parts: identify_draws, identify_cost, identify_peers, on logs of identify_log
    identify_ellipse, identify_loop, outputs, coloured, forces, groups, floors    the same under other conditions
    steady_shapes, group_shapes                                                   friction at constant speed, its shapes
    selection, ladder, laws_ladder, laws_identified                               which model
    studies             intervals and false alarms over many draws
    ordinary (with ordinary_robots, ordinary_sysid)                        what it costs

Robots and worlds of their own: benchmarks/wrong_worlds, ten_robots, twins, blind.
"""
