"""A force that stays in the room, in the march of a fit: turned into the body once a row, as in the row's middle.

Second order in the length of a row; its derivatives are those of just that, the heading's included.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.compiled.kernel import part


class Room(NamedTuple):
    """A constant force in the room, of which a robot that turns feels now this, now that. at_...: index, or -1."""

    force: FloatArray  # (2,) along x and y of the room [N]
    per_force: FloatArray  # (3,) acceleration of the axes per force
    d_per_force: FloatArray  # (3, P)
    start_heading: float  # heading at the start of the piece [rad]
    at_force: IntArray  # (2,)
    at_facing: int


@part
def add_pull(g, dg, room, v, s, dv, ds, dt):
    """Add to the drive of the axes the pull of the room, as it is in the middle of a step of dt."""
    angle = room.start_heading + s[2] + 0.5 * dt * v[2]
    cos, sin = math.cos(angle), math.sin(angle)
    for axis in range(2):
        east, north = (cos, sin) if axis == 0 else (-sin, cos)
        pull = east * room.force[0] + north * room.force[1]
        turn = room.per_force[axis] * (north * room.force[0] - east * room.force[1])  # by the heading
        g[axis] += room.per_force[axis] * pull
        for i in range(dg.shape[1]):
            dg[axis, i] += room.d_per_force[axis, i] * pull - turn * (ds[2, i] + 0.5 * dt * dv[2, i])
        if room.at_force[0] >= 0:
            dg[axis, room.at_force[0]] += room.per_force[axis] * east
        if room.at_force[1] >= 0:
            dg[axis, room.at_force[1]] += room.per_force[axis] * north
        if room.at_facing >= 0:
            dg[axis, room.at_facing] -= turn
