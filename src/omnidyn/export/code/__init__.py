"""The exact step and controllers as C, from the very functions that Python runs: no formula is written a second time.

sources: the functions of the package as syntax trees. expressions, translate:
a kernel as C99. step_c: the step of one robot, state in, state out. c_model: that step as a folder for firmware.
fmu: the same as a co-simulation FMU. trace: a function of arrays as C99. c_controller: so, a controller.
"""
