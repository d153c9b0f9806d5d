"""The numbers of a robot whose friction has constant levels, on the body axes or along the direction of travel.

    M v' = P u + push - D v + m omega (v_y, -v_x, 0) - f(v)

v = (v_x, v_y, omega); M diagonal; D: viscous friction and back-EMF; P: force per volt at rest; m: the mass where the body
frame turns. f: C sgn(v) per axis, or along the direction of travel (model/friction/direction.py).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.model.layout import N_AXES, Plant

MASS, DAMPING, TURNING, FORWARD, BACKWARD, TRAVEL = 0, 9, 18, 19, 22, 25  # places in a law
SIZE = 27
BOX, ELLIPSE, PLAIN = 0, 1, 2  # where friction acts in the plane: per axis, along the direction of travel


def is_coulomb(plant: Plant, couples: bool = False) -> bool:
    """Whether this room knows a robot: constant levels that hold no more than they slide with, currents that settle at
    once and meet no limit, a mass that couples no axes. couples: it may do so, as in a derivative."""
    body, element = plant
    motors = element[N_AXES:]
    off_diagonal = body.spin[~np.eye(N_AXES, dtype=bool)]
    simple_motors = (
        (motors["active"] == 0.0)
        & (motors["breakaway"] == 0.0).all(axis=1)
        & (motors["inductance"] == 0.0)
        & (motors["drop"] == 0.0)
        & (motors["efficiency"] == 1.0)
        & np.isinf(motors["limit"])
    )
    axes_slide = bool((element["breakaway"][:2] > 0.0).any())
    return bool(
        not (body.laws or body.bristles or body.gathers or body.off or body.room.any())
        and (couples or not off_diagonal.any())
        and (element["breakaway"] == element["coulomb"]).all()
        and (body.breakaway == body.coulomb).all()
        and not (body.active and axes_slide)
        and simple_motors.all()
    )


def kind_of(plant: Plant) -> int:
    """BOX, ELLIPSE or PLAIN."""
    if not plant.body.active:
        return BOX
    return PLAIN if plant.body.plain else ELLIPSE


def law_of(plant: Plant) -> FloatArray:
    """The numbers of a robot, M and D by rows; yaw in rad/s. Shape (SIZE,)."""
    body, element = plant
    units = np.array([1.0, 1.0, float(body.length)])
    motors, g = element[N_AXES:], element["g"]
    damping = element["viscous"].copy()
    damping[N_AXES:] += motors["thrust"] * motors["emf"] / motors["resistance"]
    square = np.outer(units, units)
    law = np.zeros(SIZE)
    law[MASS:DAMPING] = ((body.mass * np.eye(N_AXES) + body.spin) * square).ravel()
    law[DAMPING:TURNING] = ((g.T * damping) @ g * square).ravel()
    law[TURNING] = body.turning * body.length
    law[FORWARD:BACKWARD] = element["coulomb"][:N_AXES, 0] * units
    law[BACKWARD:TRAVEL] = element["coulomb"][:N_AXES, 1] * units
    law[TRAVEL:] = body.coulomb
    return law


def drive_of(plant: Plant) -> FloatArray:
    """P [N/V, N/V, N m/V]. Shape (3, wheels)."""
    motors = plant.element[N_AXES:]
    drive = motors["g"].T * (motors["thrust"] / motors["resistance"])
    drive[2] *= plant.body.length
    return drive


def changes(plants: Sequence[Plant], step: float) -> tuple[FloatArray, FloatArray]:
    """Derivatives of the laws (SIZE, K) and of the drives (K, 3, wheels), from plants up (2k) and down (2k + 1)."""
    laws = np.array([law_of(plant) for plant in plants]).reshape(-1, 2, SIZE)
    drives = np.array([drive_of(plant) for plant in plants])
    drives = drives.reshape(len(laws), 2, *drives.shape[1:]) if len(laws) else np.zeros((0, 2, N_AXES, 1))
    half = 2.0 * step
    return np.ascontiguousarray((laws[:, 0] - laws[:, 1]).T / half), (drives[:, 0] - drives[:, 1]) / half
