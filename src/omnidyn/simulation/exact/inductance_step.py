"""One body axis with winding inductance: its motion in closed form between events, and the events.

    v' = -b v + f - c sgn v          f [m/s^2]: what the motor currents give, divided by mass       eqs (4)-(10)
    f' = (R/L) (g - k v - f)         g: f at standstill with settled currents, k: back-EMF rate     eq (11)

sgn is set-valued at 0: an axis at rest stays while |f| <= S, the breakaway level, S >= c. While the direction s of
friction does not change the system is linear, and with a = b + k, n = R/L, M = [[-b, 1], [-n k, -n]]

    v(t) = v0 + phi (g - s c - a v0) + kick (f0 - b v0 - s c)
    f(t) = f0 + phi (b g - a f0 + k s c) + n kick (g - k v0 - f0)
    integral of v = v0 t + sum (g - s c - a v0) + (phi/n) (f0 - b v0 - s c)

    kick'' = tr M kick' - det M kick,  kick(0) = 0,  kick'(0) = 1;   phi = n * integral of kick;   sum = integral of phi

which is e^(M t) by Cayley-Hamilton, written so that nothing cancels however slow or short; for L -> 0 kick vanishes,
phi becomes (1 - e^(-a t))/a and the first line the step of step.py. For yaw read rad for m.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from omnidyn.compiled.kernel import part

TERMS = 22  # of a power series in a number of size <= 1: 1/22! is below the last bit
ROOT_STEPS = 200  # Newton takes about 5; bisection, its fallback, at most some 60
LAST_BIT = 2.0**-52
LAST_DIGIT = 1e-18  # a term of a power series, relative to its first, that changes nothing more


class AxisLaw(NamedTuple):
    """The numbers of one axis, divided by mass or inertia: b [1/s], c, S [m/s^2], k [1/s], and n = R/L [1/s]."""

    viscous: float
    coulomb: float
    breakaway: float
    emf: float
    lag: float


@part
def law_of(laws, axis):
    """Row `axis` of the table of laws."""
    return AxisLaw(laws[axis, 0], laws[axis, 1], laws[axis, 2], laws[axis, 3], laws[axis, 4])


@part
def roots(law):
    """tr M/2, and (tr M/2)^2 - det M: negative where the axis swings, e^(M t) = e^(mean t) (...)."""
    half = 0.5 * (law.lag - law.viscous)
    return -0.5 * (law.lag + law.viscous), half * half - law.lag * law.emf


@part
def response(t, law):
    """(kick [s], phi [s], sum [s^2]) of the closed form above, at time t [s]."""
    mean, square = roots(law)
    product = law.lag * (law.viscous + law.emf)
    size, apart = max(-2.0 * mean, math.sqrt(product)) * t, square > 0.25 * mean * mean
    if size < (0.1 if apart else 1.0):
        return _short_response(t, mean, product, law.lag)
    if apart:
        return _response_of_two_rates(t, mean, math.sqrt(square), product, law.lag)
    return _response_of_a_swing(t, mean, square, law.viscous + law.emf, law.lag)


@part
def _short_response(t, mean, product, lag):
    """Power series of kick in t, from its differential equation, and its two integrals."""
    before, term = 0.0, t
    kick = single = double = 0.0
    for n in range(1, TERMS):
        kick += term
        single += term / (n + 1)
        double += term / ((n + 1) * (n + 2))
        if abs(term) < LAST_DIGIT * t:
            break
        before, term = term, (2.0 * mean * t * term - product * t * t * before / n) / (n + 1)
    return kick, lag * t * single, lag * t * t * double


@part
def _response_of_two_rates(t, mean, root, product, lag):
    """Real roots of M well apart: divided differences of e^(x t) and its integrals between them."""
    fast = mean - root
    slow = product / fast  # from the product of the roots: mean + root would cancel
    gone_fast, gone_slow = math.expm1(fast * t), math.expm1(slow * t)
    kick = (gone_slow - gone_fast) / (2.0 * root)
    phi = lag * (gone_slow / slow - gone_fast / fast) / (2.0 * root)
    total = lag * t * t * (_second_order(slow * t, gone_slow) - _second_order(fast * t, gone_fast)) / (2.0 * root)
    return kick, phi, total


@part
def _second_order(z, decayed):
    """(e^z - 1 - z)/z^2, where `decayed` = e^z - 1."""
    if abs(z) > 0.5:
        return (decayed - z) / (z * z)
    term, total = 0.5, 0.0
    for n in range(3, TERMS):
        total += term
        term *= z / n
        if abs(term) < LAST_DIGIT:
            break
    return total


@part
def _response_of_a_swing(t, mean, square, rate, lag):
    """Complex, double or nearly double roots of M, t not short: no difference of them is divided by."""
    x = square * t * t
    if abs(x) < 1.0:
        even, odd, decay = 1.0, 1.0, math.exp(mean * t)  # cosh sqrt x, sinh(sqrt x)/sqrt x
        up, side = 1.0, 1.0
        for n in range(1, TERMS // 2):
            up *= x / ((2 * n - 1) * (2 * n))
            side *= x / ((2 * n) * (2 * n + 1))
            even += up
            odd += side
        even, kick = decay * even, decay * odd * t
    elif x > 0.0:
        root = math.sqrt(square)
        slow, fast = math.exp((mean + root) * t), math.exp((mean - root) * t)
        even, kick = 0.5 * (slow + fast), 0.5 * (slow - fast) / root
    else:
        root, decay = math.sqrt(-square), math.exp(mean * t)
        even, kick = decay * math.cos(root * t), decay * math.sin(root * t) / root
    phi = (1.0 - even + mean * kick) / rate
    return kick, phi, (t - kick + 2.0 * mean * phi / lag) / rate


@part
def forces(v, f, g, s, law):
    """(g - s c - a v, f - b v - s c): the pull towards the end speed and the acceleration, both [m/s^2]."""
    friction = s * law.coulomb
    return g - friction - (law.viscous + law.emf) * v, f - friction - law.viscous * v


@part
def slid(v, f, g, s, law, kick, phi):
    """(v, f) after a slide in which friction keeps the direction s; kick and phi from `response`."""
    pull, acceleration = forces(v, f, g, s, law)
    settling = law.viscous * g - (law.viscous + law.emf) * f + law.emf * s * law.coulomb
    return (
        v + phi * pull + kick * acceleration,
        f + phi * settling + law.lag * kick * (g - law.emf * v - f),
    )


@part
def slid_for(t, v, f, g, s, law):
    """`slid`, for a time t [s]."""
    kick, phi, _ = response(t, law)
    return slid(v, f, g, s, law, kick, phi)


@part
def settled(f, g, decayed):
    """f of an axis at rest: g + (f - g) e^(-n t), where `decayed` = 1 - e^(-n t)."""
    return f + decayed * (g - f)


@part
def top_and_bottom(v, f, g, law):
    """Times [s] of the first maximum (0: none) and the first minimum (inf: none) of a speed v >= 0, friction along -v.

    v' = e^(mean t) (v0' cosh w t + (f0' + half v0') sinh w t / w), half = (n - b)/2, is 0 where tanh(w t) / w is
    -v0'/(f0' + half v0'). The first minimum is the lowest: any later one is damped more.
    """
    _, acceleration = forces(v, f, g, 1.0, law)
    growth = law.lag * (g - law.emf * v - f)
    rising = (acceleration > 0.0) | ((acceleration == 0.0) & (growth > 0.0))
    half = 0.5 * (law.lag - law.viscous)
    _, square = roots(law)
    if square >= 0.0:
        root = math.sqrt(square)
        below = growth + (half + root) * acceleration
        ratio = -acceleration / below if below != 0.0 else 0.0
        turn = math.inf
        if ratio > 0.0:
            turn = math.log1p(2.0 * root * ratio) / (2.0 * root) if root > 0.0 else ratio
        return (turn, math.inf) if rising else (0.0, turn)
    root = math.sqrt(-square)
    turn = math.atan2(-root * acceleration, growth + half * acceleration) / root
    turn = turn if turn > 0.0 else turn + math.pi / root
    return (turn, turn + math.pi / root) if rising else (0.0, turn)


@part
def half_period(law):
    """Between turning points of v [s]; inf where the axis does not swing."""
    _, square = roots(law)
    return math.pi / math.sqrt(-square) if square < 0.0 else math.inf


@part
def stop(v, f, g, law, low, high):
    """(time [s], f) at which a speed v > 0 that falls from `low` to `high` is 0: Newton, kept inside its bracket."""
    t, f_now = high, f
    for _ in range(ROOT_STEPS):
        v_now, f_now = slid_for(t, v, f, g, 1.0, law)
        if v_now > 0.0:
            low = t
        else:
            high = t
        _, acceleration = forces(v_now, f_now, g, 1.0, law)
        newton = v_now / acceleration if acceleration < 0.0 else math.inf
        if (abs(newton) <= LAST_BIT * t) | (high - low <= LAST_BIT * high):
            break
        t = t - newton if low < t - newton < high else 0.5 * (low + high)
    return t, f_now


@part
def segment(v, f, g, remaining, law):
    """The next stretch without an event, at most `remaining` long: (its length [s], direction s, v and f at its end).

    s is the direction of friction, 0 at rest. The stretch ends, before `remaining`, where the axis stops (v = 0,
    whatever it does then) or is released (f = +-S), which for a robot at rest is a logarithm away.
    """
    s = math.copysign(1.0, v) if v != 0.0 else (math.copysign(1.0, f) if abs(f) > law.breakaway else 0.0)
    if s == 0.0:
        s = math.copysign(1.0, g)
        level, wait = s * law.breakaway, math.inf
        if abs(g) > law.breakaway:
            wait = math.log1p((level - f) / (g - level)) / law.lag
        if wait >= remaining:
            return remaining, 0.0, 0.0, settled(f, g, -math.expm1(-law.lag * remaining))
        if wait > 0.0:
            return wait, 0.0, 0.0, level
    x, p, q = s * v, s * f, s * g  # seen in the direction of motion
    top, bottom = top_and_bottom(x, p, q, law)
    end = min(remaining, bottom)
    x1, p1 = slid_for(end, x, p, q, 1.0, law)
    if x1 < 0.0:
        end, p1 = stop(x, p, q, law, top if top < end else 0.0, end)
        return end, s, 0.0, s * p1
    if end < remaining:
        x1, p1 = slid_for(remaining, x, p, q, 1.0, law)
    return remaining, s, (s * x1 if x1 > 0.0 else 0.0), s * p1
