"""A fit near its best point, in rows made white: what the fit itself asks of it before it answers.

rows.py (rows, their noise made white; random_effects.py: a part of known variance), driven_motion.py (how a small force
shows), workbench.py (the log simulated anew), blocks.py (nuisances that held-out blocks reject), free_run.py (how free
runs predict such blocks), sensitivity.py (what fixed numbers and rounded inputs move the fitted ones by).
"""
