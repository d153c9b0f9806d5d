"""To the minimum: solver, steps (bends, edges and order of numbers), first_point, loop (firmware loops), progress."""
