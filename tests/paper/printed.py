"""The paper's numbers and printed equations, typed a second time and by hand: the outside source of these tests.

As transcribed in EVIDENCE.md, section 1, and peers/ident/seed_table1.py. Axes in the order v, v_n, w.
"""

import numpy as np

M, I_N, B, R_WHEEL, GEAR, R_A, L_A, K_T = 1.5, 0.025, 0.1, 0.035, 19.0, 1.69, 0.00011, 0.0059
VISCOUS, COULOMB = np.array([0.94, 0.96, 0.01]), np.array([2.2, 1.5, 0.099])

SPEED = {"x": [0, 0.37, 0.74, 1.08], "y": [0, 0.42, 0.75, 1.08], "yaw": [0, 5.84, 8.04, 10.02]}
FORCE = {"x": [2.25, 2.48, 2.79, 3.28], "y": [1.47, 1.97, 2.33, 2.49], "yaw": [0.10, 0.14, 0.18, 0.21]}
LEVEL = {"x": [1.2, 2, 3, 4], "y": [1.5, 3, 4, 5], "yaw": [0.25, 1.5, 2, 2.5]}
PATTERN = {"x": [0, 1, -1], "y": [-1, 0.5, 0.5], "yaw": [1, 1, 1]}
AXES = ("x", "y", "yaw")


def eq_3(sign_of_wheel_1):
    """Eq (3): twist = this @ wheel speeds. Printed with +1 for wheel 1 in row v_n; right with -1."""
    root = np.sqrt(3.0)
    return (R_WHEEL / 3.0) * np.array([[0, root, -root], [2 * sign_of_wheel_1, 1, 1], [1 / B, 1 / B, 1 / B]])


def eqs_7_to_9():
    """Wrench = this @ tractions, delta = 30 degrees."""
    cos, sin = np.cos(np.pi / 6), np.sin(np.pi / 6)
    return np.array([[0, cos, -cos], [-1, sin, sin], [B, B, B]])


def eq_13(power_of_gear_in_emf=1):
    """A, B, K of (13), written out with the numbers of Table 3; power 0 is what the printed (11) would give."""
    mass = np.array([M, M, I_N])
    emf = GEAR * K_T * GEAR**power_of_gear_in_emf * K_T / (R_A * R_WHEEL**2)
    a = -(emf * np.array([1.5, 1.5, 3 * B**2]) + VISCOUS) / mass
    root = np.sqrt(3.0)
    rows = np.array([[0, root / 2, -root / 2], [-1, 0.5, 0.5], [B, B, B]])
    return np.diag(a), GEAR * K_T / (R_A * R_WHEEL) * rows / mass[:, None], np.diag(-COULOMB / mass)


def settled(volts, coulomb=COULOMB):
    """Speeds at which (13) settles from rest under one row of voltages, by hand: (|F| - C) / damping."""
    a, b, _ = eq_13()
    mass = np.array([M, M, I_N])
    force = mass * (b @ np.asarray(volts, dtype=float))
    return np.sign(force) * np.maximum(np.abs(force) - coulomb, 0.0) / (-mass * np.diag(a))
