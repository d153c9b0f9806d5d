"""The ladder, climb.py: from a fit to the robot that leaves least out; models.py: what it fits, group by group;
slip_budget.py: how many fits of wheels that slip; robust_step.py: a loss that bears outliers; held_out.py: how a
step predicts what it was not fitted to."""
