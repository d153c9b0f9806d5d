"""Which column of a file is which component of a log.

names (what a name says), mapping (given, or saved), guess (found), with guess_time, guess_unit and guessed beside it.
"""
