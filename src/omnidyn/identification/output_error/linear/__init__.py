"""A fit near its best point, in rows made white: what the fit itself asks of it before it answers.

rows.py (rows, their noise made white; random_effects.py: a part of known variance), driven_motion.py (how a small force
shows), workbench.py (the log simulated anew), blocks.py (nuisances that held-out blocks reject), free_run.py (how free
runs predict such blocks), sensitivity.py (what fixed numbers and rounded inputs move the fitted ones by).
rounding_noise: what an encoder rounds off.
rounded_inputs: what rounded inputs move.
missing_inputs: inputs of rows that are missing.
input_steps: the steps in which inputs are written.
"""
