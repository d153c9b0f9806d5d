"""Stops, reversals and releases under Coulomb friction: when a step holds one, and what it does to derivatives.

Where an element reverses, at g . v = 0, its instant moves with a parameter by dt = -(g . dv)/(g . f-), so that

    dv+ = dv- + (f- - f+) dt,    f-, f+ the accelerations before and after

Per axis that is dv+ = dv- f+/f-; along the direction of travel g is the line on which v passes 0. What stops stays, so
that its derivative is 0. What is released begins with an acceleration of 0 where levels hold no more than they slide
with: there is no jump.
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.simulation.coulomb.law import BACKWARD, BOX, DAMPING, FORWARD, MASS, PLAIN, TRAVEL, TURNING
from omnidyn.simulation.coulomb.stage import level, solve_stage

TURN_LIMIT = 0.5  # tangent of the angle by which a direction of travel may turn in one step
INSTANT = 1e-6  # [s] a stage so long gives accelerations
YAW_SHARE = 0.1  # tolerances are in m/s; 10 times as much in rad/s


@part
def drive(axis, x, force, law):
    """What drives an axis at these velocities, friction left out [N, N, N m]."""
    row = DAMPING + 3 * axis
    total = force[axis] - law[row] * x[0] - law[row + 1] * x[1] - law[row + 2] * x[2]
    if axis == 0:
        return total + law[TURNING] * x[2] * x[1]
    return total - law[TURNING] * x[2] * x[0] if axis == 1 else total


@part
def holds(axis, x, force, law, kind):
    """Whether friction holds an axis that is at rest; along the direction of travel both at once."""
    if axis < 2 and kind != BOX:
        return math.hypot(drive(0, x, force, law) / law[TRAVEL], drive(1, x, force, law) / law[TRAVEL + 1]) <= 1.0
    push = drive(axis, x, force, law)
    return -law[BACKWARD + axis] <= push <= law[FORWARD + axis]


@part
def _fast(x, force, law, kind):
    """A bound of the acceleration at work [m/s^2], with yaw as tolerances count it."""
    most = 0.0
    for axis in range(3):
        if axis < 2 and kind != BOX:
            friction = law[TRAVEL + axis]
        else:
            friction = max(law[FORWARD + axis], law[BACKWARD + axis])
        share = YAW_SHARE if axis == 2 else 1.0
        most = max(most, share * (abs(drive(axis, x, force, law)) + friction) / law[MASS + 4 * axis])
    return most


@part
def astray(x, force, law, kind, h):
    """A bound of how far an event inside a step of length h can lead astray [m/s]."""
    return 2.0 * h * _fast(x, force, law, kind)


@part
def _turns(x, y):
    """Whether a direction of travel turns far, or back, between two velocities."""
    cross, dot = x[0] * y[1] - x[1] * y[0], x[0] * y[0] + x[1] * y[1]
    return dot <= 0.0 or abs(cross) > TURN_LIMIT * dot


@part
def happens(x, ends, force, law, kind):
    """Whether something stops, reverses or is released between x and any of the ends of stages, rows of `ends`."""
    if kind != BOX:
        rests = x[0] == 0.0 and x[1] == 0.0
        held = rests and holds(0, x, force, law, kind)
        for row in range(len(ends)):
            if held and (ends[row, 0] != 0.0 or ends[row, 1] != 0.0):
                return True
            if not rests and _turns(x, ends[row]):
                return True
    for axis in range(0 if kind == BOX else 2, 3):
        if law[FORWARD + axis] == 0.0 and law[BACKWARD + axis] == 0.0:
            continue
        held = x[axis] == 0.0 and holds(axis, x, force, law, kind)
        for row in range(len(ends)):
            if held and ends[row, axis] != 0.0:
                return True
            if x[axis] != 0.0 and x[axis] * ends[row, axis] <= 0.0:
                return True
    return False


@part
def _leap_along(x, end, force, law, kind, d, spare, slides):
    """Derivatives d, in place, past the passage of v through 0 along its line."""
    size = math.hypot(x[0], x[1])
    ux, uy = x[0] / size, x[1] / size
    nx, ny = law[TRAVEL] * ux, law[TRAVEL + 1] * uy  # friction
    if kind != PLAIN:
        rho = math.hypot(nx, ny)
        nx, ny = law[TRAVEL] * nx / rho, law[TRAVEL + 1] * ny / rho
    ax, ay = (drive(0, x, force, law) - nx) / law[MASS], (drive(1, x, force, law) - ny) / law[MASS + 4]
    for axis in range(3):
        spare[axis] = end[axis]
    solve_stage(INSTANT, end, force, law, kind, 0.0, spare, slides)
    bx, by, speed = (spare[0] - end[0]) / INSTANT, (spare[1] - end[1]) / INSTANT, ux * ax + uy * ay
    for k in range(d.shape[1] if speed != 0.0 else 0):
        shift = -(ux * d[0, k] + uy * d[1, k]) / speed
        d[0, k] += (ax - bx) * shift
        d[1, k] += (ay - by) * shift


@part
def leap(x, end, force, law, kind, d, slides, spare, spare_slides):
    """Derivatives d, in place, past what happens between x and the end of a short stage, whose `slides` become those of
    the next moment. Returns whether the plane is at rest at the end for an instant only: it then keeps its d."""
    for axis in range(0 if kind == BOX else 2, 3):
        sign = math.copysign(1.0, x[axis])
        ahead, behind = level(law, axis, sign), level(law, axis, -sign)
        if x[axis] == 0.0 or x[axis] * end[axis] > 0.0 or ahead + behind == 0.0:
            continue
        if end[axis] == 0.0 and holds(axis, end, force, law, kind):
            continue
        before, after = drive(axis, x, force, law) - sign * ahead, drive(axis, end, force, law) + sign * behind
        slides[axis] = -sign
        for k in range(d.shape[1] if before != 0.0 else 0):
            d[axis, k] *= after / before
    if kind == BOX or (x[0] == 0.0 and x[1] == 0.0) or x[0] * end[0] + x[1] * end[1] > 0.0:
        return False
    rests = end[0] == 0.0 and end[1] == 0.0
    if rests and holds(0, end, force, law, kind):
        return False
    _leap_along(x, end, force, law, kind, d, spare, spare_slides)
    return rests
