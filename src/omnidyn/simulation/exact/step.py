"""THE formula: one body axis, one held voltage, one step. One scalar source for Python, SIMD threads and GPU.

    dv/dt = -a v + g - c sgn v,   g held over h,   sgn set-valued at 0, breakaway S >= c        eqs (4)-(6), (13)

All divided by mass or inertia. Seen in the direction of motion: x = |v|, q = +-g; phi = (1 - e^(-a h))/a.

    x = 0 and q <= S                      stays at rest: exactly 0
    x1 = x + phi (q - c - a x) >= 0       keeps its direction: x1; and so it does for q >= c, whatever rounding says
    else q >= -S                          stops inside the step and stays: exactly 0
    else                                  reverses: x1 = (q + c) (phi - e x/(c - q)),  e = e^(-a h) = 1 - a phi

In the last line the time of the crossing, t* = log(1 + a x/(c - q))/a, has cancelled out: no exp, no log per step.
`course` alone tells these apart, for the step, for its path (here) and for what an argument changes (slopes.py).

The style compiles well everywhere: conditional expressions, & and |, a typed `zero` instead of a literal (a literal
makes float32 code compute in float64), no early return, no divisor that can be 0 in any lane, taken or not.
"""

from __future__ import annotations

import math

from omnidyn.compiled.kernel import part


@part
def course(speed, drive, coulomb, breakaway, rate, phi, zero):
    """(whether seen mirrored, x, q, x1 of a slide, whether it rests, crosses 0, and goes on beyond). See `exact_step`.

    What crosses 0 and does not go on has stopped. What rests may seem to cross, too.
    """
    at_rest = speed == zero
    mirrored = (speed < zero) | (at_rest & (drive < zero))
    x = abs(speed)
    q = -drive if mirrored else drive
    slid = x + phi * (q - coulomb - rate * x)
    crosses = (slid < zero) & (q < coulomb)
    return mirrored, x, q, slid, at_rest & (q <= breakaway), crosses, (slid < zero) & (q < -breakaway)


@part
def exact_step(speed, drive, coulomb, breakaway, rate, phi, zero):
    """Speed after a step. All arguments are numbers of one floating type; `zero` is 0 in that type.

    speed v [m/s]; drive g [m/s^2]; coulomb c and breakaway S >= c >= 0 [m/s^2]; rate a > 0 [1/s]; phi [s].
    For yaw read rad for m. Source: closed form of eqs (4)-(6), written out above.
    """
    mirrored, x, q, slid, rests, _, reverses = course(speed, drive, coulomb, breakaway, rate, phi, zero)
    divisor = coulomb - q if reverses else coulomb + breakaway + phi  # never 0, in either lane
    reversed_ = (q + coulomb) * (phi - (x - phi * rate * x) / divisor)
    result = reversed_ if reverses else (slid if slid > zero else zero)  # what crosses 0 and stays has slid < 0
    result = zero if rests else result
    return zero - result if mirrored else result  # rest is 0, never -0


@part
def held(rate, dt):
    """phi [s] of a voltage held for dt [s]: (1 - e^(-a dt))/a; expm1 keeps every digit of a short step."""
    return -math.expm1(-rate * dt) / rate


@part
def crossing_time(x, q, coulomb, rate, dt):
    """t* [s] of a step of length dt that crosses 0."""
    return min(dt, math.log1p(rate * x / (coulomb - q)) / rate)


@part
def pieces(speed, drive, coulomb, breakaway, rate, phi, dt):
    """A step as two pieces of constant friction: (time of the event, or dt; f before it; f after it).

    Within a piece dv/dt = -a v + f. The event is the instant v reaches 0; f = 0 with v = 0 means rest.
    Same arguments as `exact_step`; dt [s].
    """
    mirrored, x, q, _, rests, crosses, reverses = course(speed, drive, coulomb, breakaway, rate, phi, 0.0)
    if rests:
        return dt, 0.0, 0.0
    before = -(q - coulomb) if mirrored else q - coulomb
    if not crosses:
        return dt, before, 0.0
    after = q + coulomb if reverses else 0.0
    return crossing_time(x, q, coulomb, rate, dt), before, (-after if mirrored else after)


@part
def speed_within(t, speed, event, before, after, rate):
    """Speed at time t [s] inside a step that starts at `speed`; the other arguments from `pieces`."""
    if t <= event:
        return speed - math.expm1(-rate * t) * (before / rate - speed)
    return -math.expm1(-rate * (t - event)) * after / rate


@part
def turned_within(t, speed, now, event, before, after, rate):
    """Integral of the speed from the start of the step to t, `now` the speed at t: (v0 - v + f t)/a, piece by piece.

    For yaw it is the angle turned [rad].
    """
    if t <= event:
        return (speed - now + before * t) / rate
    return (speed + before * event - now + after * (t - event)) / rate
