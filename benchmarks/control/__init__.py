"""Closed loops: control and control_plants on the models here; control_chain, control_mismatch, control_casadi, tune on
the plants of benchmarks/control_real; mpc with mpc_c (exported), mpc_peers (other solvers), araujo (an MPC of others).
"""
