"""The smallest run that needs the derivatives of any friction: for a process that has nothing else to do."""

from __future__ import annotations

import numpy as np

from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.sensitivity.derivatives import derivatives

DT = 0.01  # [s]


def differentiate() -> None:
    """Two rows."""
    robot = load_robot("mecanum")
    derivatives(robot, np.ones((2, robot.wheels.count)), DT, ["body.mass_kg"], tol=None)
