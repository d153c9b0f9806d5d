"""Pictures; each function returns a `Picture`.

Of the paper: paper_pictures, robot. Of logs: raw_log, overlay, path. Of a fit: residuals, friction_speed, shapes,
motor_lines, dead_zone_map. Of closed loops: tracking, moving (a GIF). Of campaigns: campaign. channels is shared.
"""
