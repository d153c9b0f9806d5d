"""The robot: what it is, what acts on it, where it stands still.

Read in this order: value (what every part is), wheels, motor (and what drives it), friction/ (one file per place where
it acts), surroundings (its floor, and what it can be varied by), robot, keys (the names of its numbers), robot_file and
presets/, first_guess (a robot from a few numbers), actuation (what reaches its motors), log_effects (what a fit writes
beside its numbers). Then its mechanics: mass, frames, dynamics, inverse (voltages for a motion), sliding (all friction
in one formula), deadzone; layout names the numbers that stick_slip/ works in, the inclusion that sticks exactly. Last
what is known of its numbers, known/, and robots under other loads and on other floors, vary.
correlation: the table [correlation].
drive: what commands the motors.
robot_table: the numbers of a robot as a table.
variations: loads, floors, slopes, batteries by name.
"""
