"""Steps of robots and controllers as C, from the very functions that Python runs: no formula is written a second time.

sources: the functions of the package as syntax trees. c_types, scope, expressions, translate, program: kernels as C99.
step_c: the exact step of one robot, state in, state out; implicit_c: that of every other robot whose wheels roll.
c_model: that step as a folder for firmware. fmu, fmi2, fmi3: the same as a co-simulation unit.
trace: a function of arrays as C99 (compiled/trace.py traces it). c_controller: so, a controller, of
control_code, late_pose_code and swing_code; mpc_code: the predictive one.
"""
