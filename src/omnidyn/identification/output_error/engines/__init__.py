"""The model in place of the robot: exact, implicit, speed_loop; sums and actuation are shared."""
