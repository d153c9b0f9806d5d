"""Robots as systems of python-control: the linear part of eqs (13) (14), and the nonlinear model with its friction."""

from __future__ import annotations

from typing import Any

import numpy as np

from omnidyn.errors import MissingExtraError
from omnidyn.model.actuation import clip_voltage, reaching
from omnidyn.model.dynamics import StateSpace, acceleration, state_space
from omnidyn.model.frames import body_to_world
from omnidyn.model.robot import Robot

STATES = ("vx", "vy", "omega")
POSES = ("x", "y", "heading")


def linear_system(system: StateSpace | Robot) -> Any:
    """x' = A x + B u, y = C x as a control.StateSpace: inputs u1, ... [V], states and outputs vx, vy, omega.

    Dry friction has no place in it: K sgn(x) is left out. Raises MissingExtraError where python-control is missing.
    """
    control = _control()
    model = state_space(system) if isinstance(system, Robot) else system
    inputs = [f"u{k + 1}" for k in range(model.B.shape[1])]
    return control.ss(model.A, model.B, model.C, model.D, inputs=inputs, states=list(STATES), outputs=list(STATES))


def nonlinear_system(robot: Robot) -> Any:
    """The whole model as a control.NonlinearIOSystem: inputs u1, ... [V], states vx, vy, omega, x, y, heading.

    Volts are kept within their limits; currents have settled. Its derivative is that of `acceleration`, which jumps
    where an axis stops: a solver of smooth equations steps across 0 and never rests quite; `simulate` does.
    Raises MissingExtraError where python-control is missing.
    """
    control = _control()
    count = robot.wheels.count

    def update(t: float, x: np.ndarray, u: np.ndarray, parameters: object) -> np.ndarray:
        volts = reaching(robot, clip_voltage(robot.motor, np.asarray(u, dtype=float)[:count]))
        velocity = body_to_world(x[5]) @ x[:3]
        return np.concatenate([acceleration(robot, x[:3], volts), velocity])

    names = [*STATES, *POSES]
    return control.nlsys(
        update, None, inputs=[f"u{k + 1}" for k in range(count)], states=names, outputs=names, name="robot"
    )


def _control() -> Any:
    try:
        import control  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise MissingExtraError("systems of python-control need it", remedy='pip install "omnidyn[control]"') from None
    return control
