"""What drives the robot: a path to follow in, one output per wheel and time step out.

Read in this order: controller (the one contract, a numbered list), path (where to be when), feedforward (the inverse
model: volts for a motion), speed_loop (body velocity in, volts out), pid (pose in, volts out), mpc (the same, looking
ahead), closed_loop (a controller and a simulated robot, step by step), tune (gains from such runs).
"""
