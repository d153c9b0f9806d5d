"""Environments for learning: many robots with one task each, stepped in blocks. No package but NumPy and numba.

draws: random numbers as hashes. pool: robots as rows of numbers, drawn beforehand. layout: what a step works on.
block_motion: a block of robots over one step. task: reward, end and observation of a block. step: the kernels.
environments: the object with reset and step. `omnidyn.interop.gymnasium` makes a VectorEnv of it.
"""
