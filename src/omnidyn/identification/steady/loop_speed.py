"""How fast a robot follows its firmware's speed loop, beside how often its log has a row.

A loop that settles within a row shows no transient: whole logs then say no more than their steady stretches do.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from omnidyn.findings.needs import turns_known
from omnidyn.model.dynamics import state_space
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import wheel_speed
from omnidyn.run import Run

SETTLING_CONSTANTS = 2.0  # time constants: what is left of a transient then is a seventh


def settling_time(robot: Robot) -> float:
    """Slowest time constant [s] of the robot within its speed loop, linear; inf where it does not settle.

        v' = A v - B (kp S v + ki S z),   z' = v,   S twist = speeds of the wheels

    A, B of `state_space`: sliding, below the voltage limit. At least a period of the loop.
    """
    system, turn_matrix = state_space(robot), wheel_speed(robot.wheels, np.eye(3)).T
    kp, ki = (np.reshape(gain, (-1, 1)) * turn_matrix for gain in (robot.drive.kp, robot.drive.ki))
    matrix = system.A - system.B @ kp
    if np.any(robot.drive.ki):
        matrix = np.block([[matrix, -system.B @ ki], [np.eye(3), np.zeros((3, 3))]])
    slowest = float(-np.linalg.eigvals(matrix).real.max())
    return max(1.0 / slowest, 1.0 / (robot.drive.rate or np.inf)) if slowest > 0.0 else np.inf


def why_no_transient(runs: Sequence[Run], robot: Robot) -> str:
    """Why logs of set speeds are not worth fitting whole, in words; "" where they are.

    They are where the loop is seen settling, and where a current or a speed is missing: then the steady state does not
    tell either.
    """
    if any(run.current is None or not turns_known(run) for run in runs):
        return ""
    settled_time = SETTLING_CONSTANTS * settling_time(robot)
    row = min(run.step for run in runs)
    if settled_time > row:
        return ""
    return (
        f"the speed loop of {robot.name} settles in {1e3 * settled_time:.0f} ms, a row comes every {1e3 * row:.0f} ms: "
        "no transient is seen, so that whole logs say no more than their steady stretches, and take longer to fit"
    )
