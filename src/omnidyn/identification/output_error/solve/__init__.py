"""To the minimum: solver (on normal_equations), by_steps (coarse, then fine), steps (bends, edges and order of
numbers), first_point, loop (firmware loops), progress. latency_edges: latencies across which no descent gets.
curvature: what Gauss-Newton does not see."""
