"""Output error: the model runs freely under the logged inputs, and its numbers are those whose outputs fit best.

Rooms in the order of a fit: problem/ (what is fitted to what), kernel/ (compiled marches through a log), engines/ (the
model in place of the robot), solve/ (to the minimum), trust/ (how sure), memory/ (errors that are not white), linear/
(rows near the best point). Then prepare (logs and a question made problems, and the engine for them), begin (what each
group begins with), joint (several groups as one problem), written_fit (which of several fits is written), combinations
(of numbers that logs tell together only), conclusion and answer, and fit, which solves and answers.
traded_numbers: numbers that trade with each other.
numbers_of_logs: what of a fit belongs to the robot, what to its logs; sensors_of_logs: what these show of sensors.
moved_axes: which axes moved.
"""
