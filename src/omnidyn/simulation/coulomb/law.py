"""The numbers of a robot whose friction has constant levels, on the body axes or along the direction of travel.

    M v' = P u + push - D v + m omega (v_y, -v_x, 0) - f(v)

v = (v_x, v_y, omega); M diagonal; D: viscous friction and back-EMF; P: force per volt at rest; m: the mass where the
body frame turns. f: C sgn(v) per axis, or along the direction of travel (model/friction/direction.py).
"""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.model.layout import N_AXES, Plant

MASS, DAMPING, TURNING, FORWARD, BACKWARD, TRAVEL = 0, 9, 18, 19, 22, 25  # places in a law
SIZE = 27
EMF, PUSH, THRUST = 3, 4, 5  # places in a wheel, behind its rim: per m/s, per volt, per ampere [N s/m, N/V, N/A]
WHEEL = 6
ROUNDING = 1e-12  # of the axes that it couples, a number that is not there
BOX, ELLIPSE, PLAIN = 0, 1, 2  # where friction acts in the plane: per axis, along the direction of travel


def is_coulomb(plants: Plant) -> BoolArray:
    """Whether this room knows robots, apart from `couples`: constant levels that hold no more than they slide with,
    currents that settle at once. Shape (*batch,), as of the plants."""
    body, element = plants
    motors, axes = element[..., N_AXES:], element[..., :N_AXES]
    stays = (body["laws"] == 0.0) & (body["bristles"] == 0.0) & (body["gathers"] == 0.0) & (body["off"] == 0.0)
    settles = (motors["inductance"] == 0.0) & (motors["drop"] == 0.0) & (motors["efficiency"] == 1.0)
    free = (motors["active"] == 0.0) & (motors["breakaway"] == 0.0).all(axis=-1)
    one_level = (axes["breakaway"] == axes["coulomb"]).all(axis=(-2, -1))
    one_level &= (body["breakaway"] == body["coulomb"]).all(axis=-1)
    both = (body["active"] != 0.0) & (axes["breakaway"][..., :2, :] > 0.0).any(axis=(-2, -1))
    return stays & one_level & ~both & (settles & free).all(axis=-1) & ~body["room"].any(axis=-1)


def couples(plant: Plant) -> bool:
    """Whether the mass of a robot couples its axes: then a stop may release another axis, which nobody here sees."""
    return bool(laws_of(plant)[MASS:DAMPING].reshape(N_AXES, N_AXES)[~np.eye(N_AXES, dtype=bool)].any())


def kind_of(plants: Plant) -> IntArray:
    """BOX, ELLIPSE or PLAIN. Shape (*batch,)."""
    body = plants.body
    return np.where(body["active"] == 0.0, BOX, np.where(body["plain"] != 0.0, PLAIN, ELLIPSE))


def laws_of(plants: Plant, emf: bool = True) -> FloatArray:
    """The numbers of robots, M and D by rows; yaw in rad/s. emf: whether D has that of the motors. (*batch, SIZE)."""
    body, element = plants
    units = np.ones((*body.shape, N_AXES))
    units[..., 2] = body["length"]
    motors, g = element[..., N_AXES:], element["g"]
    damping = element["viscous"].copy()
    damping[..., N_AXES:] += emf * motors["thrust"] * motors["emf"] / motors["resistance"]
    square = units[..., :, None] * units[..., None, :]
    damped = np.zeros((*body.shape, N_AXES, N_AXES))
    for e in range(element.shape[-1]):  # in this order: what mirrors cancels to the last bit
        damped += g[..., e, :, None] * g[..., e, None, :] * damping[..., e, None, None]
    mass = body["mass"][..., None, None] * np.eye(N_AXES) + body["spin"]
    law = np.zeros((*body.shape, SIZE))
    law[..., MASS:DAMPING] = _without_rounding(mass * square).reshape(*body.shape, 9)
    law[..., DAMPING:TURNING] = _without_rounding(damped * square).reshape(*body.shape, 9)
    law[..., TURNING] = body["turning"] * body["length"]
    law[..., FORWARD:BACKWARD] = element["coulomb"][..., :N_AXES, 0] * units
    law[..., BACKWARD:TRAVEL] = element["coulomb"][..., :N_AXES, 1] * units
    law[..., TRAVEL:] = body["coulomb"]
    return law


def _without_rounding(matrix: FloatArray) -> FloatArray:
    """A symmetric matrix whose couplings are 0 where they are rounding. Shape (*batch, 3, 3)."""
    size = np.sqrt(np.abs(np.diagonal(matrix, axis1=-2, axis2=-1)))
    return np.where(np.abs(matrix) <= ROUNDING * size[..., :, None] * size[..., None, :], 0.0, matrix)


def rims_of(plants: Plant) -> FloatArray:
    """Speed of the rims of the wheels by the twist [m/s by m/s, m/s, rad/s]. Shape (*batch, wheels, 3)."""
    rims = plants.element["g"][..., N_AXES:, :].copy()
    rims[..., 2] *= plants.body["length"][..., None]
    return rims


def wheels_of(plants: Plant) -> FloatArray:
    """What each wheel does, see WHEEL. Shape (*batch, wheels, WHEEL)."""
    motors = plants.element[..., N_AXES:]
    push = motors["thrust"] / motors["resistance"]
    numbers = np.stack([push * motors["emf"], push, motors["thrust"]], axis=-1)
    return np.concatenate([rims_of(plants), numbers], axis=-1)


def drives_of(plants: Plant) -> FloatArray:
    """P [N/V, N/V, N m/V]. Shape (*batch, 3, wheels)."""
    motors = plants.element[..., N_AXES:]
    return np.swapaxes(rims_of(plants), -1, -2) * (motors["thrust"] / motors["resistance"])[..., None, :]
