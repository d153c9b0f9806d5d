"""The model in place of the robot: engine (the contract), exact, implicit, speed_loop, kinds (which of them has what a
fit asks for); valley (where motors are guesses). driver: the driver of a problem. row_sums: what simulated rows add up
to."""
