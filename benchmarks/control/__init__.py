"""Closed loops: control_plants on the models here; control_chain, control_mismatch, control_casadi and tune on the plants
of benchmarks/control_real.
"""
