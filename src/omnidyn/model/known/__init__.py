"""What is known of a robot's numbers, and what follows from that.

told (what its file says of them: std, correlations, guesses, levels of breakaway), uncertainty (draws of
robots that may be meant), dead_zone (the dead zone with its interval, in words).
breakaway_levels: levels of breakaway by their keys.
"""
