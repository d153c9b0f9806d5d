"""Closed loops: control_plants on the models here; control_chain, control_mismatch, control_casadi and tune on those of
benchmarks/control_real.
"""
