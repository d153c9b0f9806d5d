"""Derivatives of a run with respect to numbers of the robot file, by the implicit function theorem.

late_sample is the door: a run as a log shows it; derivatives gives those of a run by its rows. Then directions (what is
derived by), stage (one implicit step), events (stops, reversals, releases), sample (a run between its rows),
derivative_march (a run, also through the firmware's speed loop); slipping (the same of wheels that slip, by
differences). Of robots under Coulomb friction ../coulomb gives all of it in one pass.
"""
