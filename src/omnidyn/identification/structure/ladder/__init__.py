"""The ladder, climb.py: from a fit to the robot that leaves least out; models.py: what it fits, group by group;
held_out.py: how a step predicts what it was not fitted to."""
