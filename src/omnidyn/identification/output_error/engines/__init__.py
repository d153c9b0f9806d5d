"""The model in place of the robot: engine (the contract), exact, implicit, speed_loop; valley (where motors are
guesses)."""
