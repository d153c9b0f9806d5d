"""Many robots at once: as a struct of arrays, in blocks that processors step as one.

batch is the door: simulate_batch and Batch, which give the values of result; sample draws robots. engine_kind says
which engine moves a robot; blocks holds those that move in blocks, singles the others, threads who works on them.
parameters: the numbers of many robots, and blocks of them. exact: the step of a block by the exact formula. Kernels for
rows of volts: block_march for twist alone, fast and pose for poses too, implicit for friction in a turning frame,
limited for limits and coasting, loops for the loop of a firmware.
"""
