"""To the minimum: solver, first_point, loop (firmware loops), difference, progress."""
