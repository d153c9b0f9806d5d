"""Which column of a file is which component of a log.

names (the words of a name), component (what name and unit say), wheel_numbers (which wheel a number means), mapping
(given, or saved), guess (found), with guess_time, guess_unit (and the side of the gear), frame_of (of a twist),
plausible (what numbers can be) and guessed (columns and doubts so far).
guess_side: the side of the gear.
doubts: columns that were not taken.
wheel_places: places of wheels in names.
unnamed_families: numbered columns whose names say no quantity.
wheels_by_motion: wheels told by the motion.
"""
