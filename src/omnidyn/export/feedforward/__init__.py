"""kS, kV, kA: the volts that a motion takes, as FRC and FTC libraries want them.

gains: those of each axis and of each wheel on it, with standard errors; gains_csv: as a table. guessed_gains: what is
said of guesses. wpilib, road_runner: snippets.
"""
