"""Derivatives of a run with respect to numbers of the robot file, by the implicit function theorem.

derivatives is the door. Then directions (what is derived by), stage (one implicit step), events (stops, reversals,
releases), sample (a run between its rows), march (a run), loop (through the firmware's speed loop); late_sample (a run
as a log shows it).
"""
