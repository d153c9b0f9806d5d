"""Pictures; each function returns a `Picture`.

Of the paper: paper_pictures, robot. Of logs: raw_log, overlay, path. Of a drive to come: plan, drive. Of a fit:
residuals, friction_speed, shapes, motor_lines, dead_zone_map. Of closed
loops: tracking, moving (a GIF). Of campaigns: campaign. channels is shared.
dead_zone_section: the section on the dead zone.
paper_dead_zone: Fig. 5.
paper_friction: Fig. 3.
paper_steps: Fig. 4.
paper_reconciliation: what would reconcile Tables 1 and 3.
paper_traces: Fig. 2.
correlations: which fitted numbers move together.
"""
