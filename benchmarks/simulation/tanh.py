"""The rival: scipy's solve_ivp with sgn v smoothed to tanh(v/eps), the way most people write it.

Same robot, same voltages, twist only (omnidyn's time includes pose, currents and wheel speeds).
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

from omnidyn.model.dynamics import state_space
from omnidyn.model.robot import Robot


def run_tanh(
    robot: Robot,
    voltage: np.ndarray,
    dt: float,
    eps: float,
    rtol: float,
    max_step: float = np.inf,
    method: str = "LSODA",
) -> np.ndarray:
    """Twist at every sample, the start included. Shape (n + 1, 3)."""
    system = state_space(robot)
    rate, coulomb = -np.diag(system.A), -np.diag(system.K)
    drive, last = voltage @ system.B.T, len(voltage) - 1

    def slope(t: float, twist: np.ndarray) -> np.ndarray:
        return -rate * twist + drive[min(int(t / dt), last)] - coulomb * np.tanh(twist / eps)

    t = np.arange(len(voltage) + 1) * dt
    result = solve_ivp(slope, (0.0, t[-1]), np.zeros(3), method, t, rtol=rtol, atol=1e-9, max_step=max_step)
    return result.y.T
