"""Pictures, one file each; each function returns a `Picture`.

Of the paper, all together in paper_pictures: robot, traces, friction, steps, dead_zone, reconcile. Of logs: raw_log,
overlay, path. Of a fit: residuals, correlation, friction_speed, shapes, motor_lines, dead_zone_map. channels is shared.
"""
