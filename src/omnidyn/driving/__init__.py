"""From a plan to a robot that drives it, and a log of what it did.

program (what is to be driven, leg by leg: words, pictures and commands come from its rows), program_file (as `plan`
writes it), connection (the protocol between a program and a robot), dead_man (which command acts: the robot's side),
clock (time, real or simulated), guard (when to stop; odometry: where it is), recording (what was sent and measured, as
a log), drive (the door), record (the result), resume (what is left after a stop), simulated (a robot that may
misbehave), tabled (wheels that do not turn as asked), wire (lines of text), senders (lines over standard output, UDP
or a serial port).
"""
