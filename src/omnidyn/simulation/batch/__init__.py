"""Many robots at once: as a struct of arrays, in blocks that processors step as one.

parameters: the numbers of many robots, and blocks of them. exact: the step of a block by the exact formula.
"""
