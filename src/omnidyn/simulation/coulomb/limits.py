"""Motors whose current meets its limit, or that coast: each adds to the law what it does at the moment.

A motor gives g clip(P u - K s, T bound), s = g . v the speed of its rim, T the force per ampere, the bound 0 while it
coasts. Free, it is damping K g g' and a force; at its bound a force alone. A step is made as its motors are at its
start: one in which a motor changes is cut near the instant at which it does, until what that leads astray is below the
tolerance. Nothing jumps there: the derivatives go on.
"""

from __future__ import annotations

from omnidyn.compiled.kernel import part
from omnidyn.simulation.coulomb.events import YAW_SHARE
from omnidyn.simulation.coulomb.law import DAMPING, EMF, MASS, PUSH, THRUST


@part
def _asked(law, w, x, volts):
    """The force that a motor gives without a bound."""
    wheel = law.wheel[w]
    return wheel[PUSH] * volts[w] - wheel[EMF] * (wheel[0] * x[0] + wheel[1] * x[1] + wheel[2] * x[2])


@part
def _side(law, w, x, volts, bound):
    """0 where a motor is free, else the sign of the force that its bound leaves of it; 1 where that is none."""
    force, most = _asked(law, w, x, volts), law.wheel[w, THRUST] * bound[w]
    if force > most or bound[w] == 0.0:
        return 1.0
    return -1.0 if force < -most else 0.0


@part
def put_in_force(law, x, volts, dvolts, bound, push, dpush, force, dforce):
    """The law and the force of the motors as they are at x, with derivatives: into law.value, law.change, law.side,
    force (3,) and dforce (3, K)."""
    for a in range(3):
        force[a] = push[a]
        for k in range(dforce.shape[1]):
            dforce[a, k] = dpush[a, k]
    for j in range(9):
        law.value[DAMPING + j] = law.bare[j]
        for k in range(law.change.shape[1]):
            law.change[DAMPING + j, k] = law.dbare[j, k]
    for w in range(len(law.wheel)):
        law.side[w] = _side(law, w, x, volts, bound)
        if law.side[w] == 0.0:
            _free(law, w, volts, dvolts, force, dforce)
        elif bound[w] > 0.0:
            _bounded(law, w, bound, force, dforce)


@part
def _free(law, w, volts, dvolts, force, dforce):
    wheel = law.wheel[w]
    for a in range(3):
        force[a] += wheel[PUSH] * volts[w] * wheel[a]
        for b in range(3):
            law.value[DAMPING + 3 * a + b] += wheel[EMF] * wheel[a] * wheel[b]
        for k in range(dforce.shape[1]):
            dforce[a, k] += wheel[PUSH] * dvolts[w, k] * wheel[a]
        for k in range(law.change.shape[1]):
            by = law.dwheel[k, w]
            dforce[a, k] += (by[PUSH] * wheel[a] + wheel[PUSH] * by[a]) * volts[w]
            for b in range(3):
                law.change[DAMPING + 3 * a + b, k] += by[EMF] * wheel[a] * wheel[b] + wheel[EMF] * (
                    by[a] * wheel[b] + wheel[a] * by[b]
                )


@part
def _bounded(law, w, bound, force, dforce):
    wheel, amps = law.wheel[w], law.side[w] * bound[w]
    for a in range(3):
        force[a] += wheel[THRUST] * amps * wheel[a]
        for k in range(law.change.shape[1]):
            by = law.dwheel[k, w]
            dforce[a, k] += (by[THRUST] * wheel[a] + wheel[THRUST] * by[a]) * amps
            dforce[a, k] += law.side[w] * wheel[THRUST] * law.dlimit[k, w] * wheel[a]


@part
def led_astray(law, x, ends, volts, bound, h):
    """(how far a step of length h leads astray by motors that change within it [m/s], 0 where none does; at which share
    of it the first of them changes)."""
    total, first = 0.0, 1.0
    for w in range(len(law.wheel)):
        wheel, most, side = law.wheel[w], 0.0, law.side[w]
        for stage in range(len(ends)):
            now = _side(law, w, ends[stage], volts, bound)
            if now == law.side[w]:
                continue
            change = 0.0
            for a in range(3):
                change += wheel[a] * (ends[stage, a] - x[a])
            most = max(most, abs(change))
            side = side if side != 0.0 else now
        if most > 0.0:
            share = YAW_SHARE * abs(wheel[2]) / law.value[MASS + 8]
            for a in range(2):
                share = max(share, abs(wheel[a]) / law.value[MASS + 4 * a])
            total += h * wheel[EMF] * most * share
            begin, end = _asked(law, w, x, volts), _asked(law, w, ends[2], volts)
            if begin != end:
                first = min(first, max(0.0, (side * wheel[THRUST] * bound[w] - begin) / (end - begin)))
    return total, first
