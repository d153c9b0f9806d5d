"""Output error: the model runs freely under the logged inputs, and its numbers are those whose outputs fit best.

Rooms in the order of a fit: problem/ (what is fitted to what), kernel/ (compiled marches through a log), engines/ (the
model in place of the robot), solve/ (to the minimum), trust/ (how sure). Then conclusion and answer, fit (one group of
logs), group_problem and group_fit (several), best_so_far (an interrupted one), inputs (whether logs allow it).
"""
