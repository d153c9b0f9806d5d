"""Derivatives of a run with respect to numbers of the robot file, by the implicit function theorem.

directions (what is derived by what; the door), stage (one implicit step), events (stops, reversals, releases), march
(a run), loop (through the firmware's speed loop), sample and late_sample (a run as a log shows it).
"""
