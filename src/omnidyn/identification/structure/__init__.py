"""Is the model right? What a fit leaves out, what would mend it, what cannot be told apart, what each number rests on,
and which are not the same throughout the logs.

Read in this order: linear.py (a fit in rows near its best point, noise made white), motion.py (how a small
force shows), disturbances.py (forces that no model of ours has), misfit.py (whether residuals hold them), tails.py
(wild samples), workbench.py (the log simulated anew), missing/ (what would explain them), rests_on.py, blocks.py (a fit
in parts of its logs) and shifts.py (which numbers differ between them), diagnosis.py (all of it), ladder/ (one remedy
at a time). earned.py is asked earlier, by the fit itself: which automatic nuisances only soak up a part of the log.
"""
