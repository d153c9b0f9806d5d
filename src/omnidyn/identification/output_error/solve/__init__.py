"""To the minimum: solver, first_point, loop (firmware loops), tied (two numbers), progress."""
