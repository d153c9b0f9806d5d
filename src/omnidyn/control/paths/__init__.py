"""Where a robot should be when. Read in this order: motion (the contract: Path, Motion), curve (closed curves and what
the heading does on them), polyline (rows joined by straight lines, from a file or a Run), goal (one pose), path (by
name), adapter (paths of one's own), ahead (what a step asks a path for, looked up).
"""
