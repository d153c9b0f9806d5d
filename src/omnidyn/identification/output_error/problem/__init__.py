"""What is fitted to what.

parameters and primitives (from them to numbers of the step), friction_laws (of which numbers need care), record (a
log), observation/ (what each sensor shows of a robot), outputs (channels, those computed from others too), differences
(of counts, added up), heading (where the robot faces), starts (where friction begins), nuisances (what the log does),
driving_voltages (which bound a dead band), problem (all of it), bounded (the rows that are looked at), decimated (their
means).
karnopp: Karnopp's band in a fit.
bristles: where the damping of bristles starts.
redundant_channels: channels computed from others.
"""
