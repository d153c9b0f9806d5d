"""What drives the robot: a path to follow in, one output per wheel and time step out.

Read in this order: controller (the one contract, a numbered list), paths/ (where to be when), demand (what a path
asks of a robot), feedforward (the inverse model: volts for a motion; as a few numbers: table), speed_loop (body
velocity in, volts out; its gains: pole_placement), pid (pose in, volts out; for many robots pid_batch), mpc/ (the
same, looking ahead), policy (a network). drawn: paths drawn by hand, smoothed. What they know of the robot and its
loop: instruments, readings (what these show), without_slip, pose_estimator, filtered_twist, pose_gate, swing.
controllers: all of them by name. closed_loop (a controller and a simulated robot, step by step; under what:
circumstances; its result: tracking; margins beside it), tune (gains from such runs, some with pushes), first_runs
(whatever the compiler is needed for).
"""
