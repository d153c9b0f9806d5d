"""How far the body gets in one step of the exact formula, and how that changes with what goes into the step.

    d = integral over the step of R(theta(t)) (v_x(t), v_y(t)) dt,   theta the angle turned since its start

in the body frame at the start of the step, by the quadrature of exact_march.py. What an argument changes:

    d d = integral of R(theta) (d v_x, d v_y) + R'(theta) (v_x, v_y) d theta

with the partial derivatives of speed and angle at every node from slopes.py. The instants of stops and
reversals move too, but the speed is 0 there on both sides: they add nothing of their own.
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part
from omnidyn.simulation.exact.exact_march import NODES, WEIGHTS, next_cut, rotated, turning
from omnidyn.simulation.exact.slopes import hold_slopes, step_slopes, travel_slopes
from omnidyn.simulation.exact.step import pieces as pieces_of

X, Y = 0, 1  # rows of `place`
VALUE, BY_SPEED, BY_DRIVE, BY_COULOMB, BY_RATE, PLACE_SIZE = 0, 1, 4, 7, 10, 13  # its columns: 3 each, one per axis
EVENT, BEFORE, AFTER = 0, 1, 2  # rows of `pieces`
_NODES, _WEIGHTS = tuple(NODES.tolist()), tuple(WEIGHTS.tolist())


@part
def put_displacement(place, pieces, speed, drive, law, dt):
    """Fill `place` (2, PLACE_SIZE): d [m] and its partial derivatives by speed, drive, coulomb and rate of each axis.

    pieces (3, 3): room to work in. speed, drive (3,): at the start of the step. law (3, 3): rate, coulomb, breakaway of
    the axes. dt [s]. Units as in `exact_step`, those of yaw in rad.
    """
    for k in range(PLACE_SIZE):
        place[X, k] = place[Y, k] = 0.0
    moving = False
    for axis in range(3):
        rate, phi = law[0, axis], -math.expm1(-law[0, axis] * dt) / law[0, axis]
        event, before, after = pieces_of(speed[axis], drive[axis], law[1, axis], law[2, axis], rate, phi, dt)
        pieces[EVENT, axis], pieces[BEFORE, axis], pieces[AFTER, axis] = event, before, after
        moving |= (speed[axis] != 0.0) | (before != 0.0)
    if not moving:
        return
    phi, dphi, _, _ = hold_slopes(law[0, 2], dt)
    end = step_slopes(speed[2], drive[2], law[1, 2], law[2, 2], law[0, 2], phi, dphi)[0]
    spin = turning(speed[2], end, pieces[BEFORE, 2], pieces[AFTER, 2], law[0, 2])
    time = 0.0
    while time < dt:
        stop = next_cut(time, dt, pieces[EVENT], law[0], spin)
        for node in range(len(_NODES)):
            add_node(place, speed, drive, law, time + (stop - time) * _NODES[node], (stop - time) * _WEIGHTS[node])
        time = stop


@part
def add_node(place, speed, drive, law, t, weight):
    """Add to `place` what one node at time t [s] of the step says; weight [s]."""
    phi, dphi, psi, dpsi = hold_slopes(law[0, 2], t)
    turned, by_speed, by_drive, by_coulomb, by_rate = travel_slopes(
        speed[2], drive[2], law[1, 2], law[2, 2], law[0, 2], t, phi, dphi, psi, dpsi
    )
    cos, sin = weight * math.cos(turned), weight * math.sin(turned)
    vx = vy = 0.0
    for axis in range(2):
        phi, dphi, _, _ = hold_slopes(law[0, axis], t)
        v, kv, kg, kc, ka = step_slopes(speed[axis], drive[axis], law[1, axis], law[2, axis], law[0, axis], phi, dphi)
        along, sideways = (cos, sin) if axis == 0 else (-sin, cos)
        vx, vy = (v, vy) if axis == 0 else (vx, v)
        for row, direction in ((X, along), (Y, sideways)):
            place[row, VALUE] += direction * v
            place[row, BY_SPEED + axis] += direction * kv
            place[row, BY_DRIVE + axis] += direction * kg
            place[row, BY_COULOMB + axis] += direction * kc
            place[row, BY_RATE + axis] += direction * ka
    for row, direction in ((X, -(sin * vx + cos * vy)), (Y, cos * vx - sin * vy)):
        place[row, BY_SPEED + 2] += direction * by_speed
        place[row, BY_DRIVE + 2] += direction * by_drive
        place[row, BY_COULOMB + 2] += direction * by_coulomb
        place[row, BY_RATE + 2] += direction * by_rate


@part
def change_of(place, row, dv, dg, d_coulomb, d_rate, i):
    """What parameter i changes of coordinate `row`: all arrays (3, P), slopes of the arguments of the step."""
    total = 0.0
    for axis in range(3):
        total += (
            place[row, BY_SPEED + axis] * dv[axis, i]
            + place[row, BY_DRIVE + axis] * dg[axis, i]
            + place[row, BY_COULOMB + axis] * d_coulomb[axis, i]
            + place[row, BY_RATE + axis] * d_rate[axis, i]
        )
    return total


@part
def move_on(s, ds, place, dv, dg, d_coulomb, d_rate):
    """Add a step to the path s (5,), ds (5, P): rows 0 to 2 integrals of the twist, 3 and 4 the displacement.

    The displacement is in the body frame where the path began; before rows 0 to 2 have moved on.
    """
    dx, dy = rotated(s[2], place[X, VALUE], place[Y, VALUE])
    cos, sin = rotated(s[2], 1.0, 0.0)
    s[3] += dx
    s[4] += dy
    for i in range(ds.shape[1]):
        east = change_of(place, X, dv, dg, d_coulomb, d_rate, i)
        north = change_of(place, Y, dv, dg, d_coulomb, d_rate, i)
        ds[3, i] += cos * east - sin * north - dy * ds[2, i]
        ds[4, i] += sin * east + cos * north + dx * ds[2, i]
