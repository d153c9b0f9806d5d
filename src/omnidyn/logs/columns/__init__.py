"""Which column of a file is which component of a log.

names (what a name says), mapping (given, or saved), guess (found), with guess_time, guess_unit and guessed beside it;
frame_of (a twist of the room, a marker at an angle).
"""
