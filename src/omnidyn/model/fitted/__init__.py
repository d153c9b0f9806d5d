"""What a fit leaves in a robot file beside its numbers.

correlation (which numbers are off together), log_effects (what the logs did beside the robot).
"""
