"""The paper's law in 50 digits, from the physical parameters: the truth that tests and benchmarks compare with.

Nothing of omnidyn is used. Source: eqs (4)-(12) with L = 0, the back-EMF of the motor shaft (EVIDENCE.md, section 1)
and friction set-valued at rest. Forces are put together in mpmath, with trigonometry of degrees. Then each axis

    v' = -a v + g - c sgn v,   g held over a step

is solved from event to event by exp and log, where omnidyn's exact step has neither:

    v(t) = w + (v0 - w) e^(-a t),  w = (g - s c)/a;    v = 0 at t* = log((v0 - w)/(-w))/a
    its integral: w t + (v0 - w)(1 - e^(-a t))/a

The steps run in `decimal`, which is compiled and correctly rounded; `mpmath_numbers` runs the same steps in mpmath.
The position is an integral without closed form: 16 Gauss nodes on short pieces between events, all starting from
50-digit speeds and headings, in double precision; a test compares it with mpmath's own adaptive quadrature.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from decimal import Decimal, localcontext
from typing import Any

import mpmath as mp
import numpy as np

DIGITS = 50
EDGE = 1e-12  # a decision nearer than this to its edge may fall either way in double precision


@dataclass(frozen=True)
class Physical:
    """Numbers of a robot, SI units; breakaway of all three axes is given."""

    mass: float
    inertia: float
    robot_radius: float
    wheel_radius: float
    resistance: float
    torque_constant: float
    emf_constant: float
    gear_ratio: float
    azimuth_deg: tuple[float, ...]
    viscous: tuple[float, float, float]
    coulomb: tuple[float, float, float]
    breakaway: tuple[float, float, float]


@dataclass(frozen=True)
class Axis:
    """v' = -rate v + sum(gain u) - coulomb sgn v, breakaway at rest; all divided by mass or inertia."""

    rate: Any
    coulomb: Any
    breakaway: Any
    gain: list


@dataclass(frozen=True)
class Numbers:
    """An arithmetic: how a float enters, and its exp and log."""

    of: Callable
    exp: Callable
    log: Callable


decimal_numbers = Numbers(Decimal, lambda x: x.exp(), lambda x: x.ln())
mpmath_numbers = Numbers(lambda x: mp.mpf(str(x)) if isinstance(x, Decimal) else mp.mpf(x), mp.exp, mp.log)


@dataclass(frozen=True)
class AxisHistory:
    """One axis over n steps. speed and turned (its integral): n + 1 numbers in 50 digits.

    event [s], before, after: in each step v' = -a v + before until the event, then -a v + after; floats, shape (n,).
    edges: steps whose outcome hangs on a difference below EDGE.
    """

    speed: list
    turned: list
    event: np.ndarray
    before: np.ndarray
    after: np.ndarray
    edges: int


@dataclass(frozen=True)
class Truth:
    """twist and pose in double precision, shape (n + 1, 3) each; edges: see AxisHistory."""

    twist: np.ndarray
    pose: np.ndarray
    edges: int


def wrench_matrix(p: Physical) -> mp.matrix:
    """G of eqs (7)-(9): columns (-sin phi, cos phi, b); sinpi and cospi are exact at multiples of 90 degrees."""
    turns = [mp.mpf(angle) / 180 for angle in p.azimuth_deg]
    rows = [[-mp.sinpi(t) for t in turns], [mp.cospi(t) for t in turns], [mp.mpf(p.robot_radius)] * len(turns)]
    return mp.matrix(rows)


def axes_of(p: Physical) -> list[Axis]:
    """The three axes of a robot, as 50-digit Decimals. Refuses wheels that couple them."""
    with mp.workdps(DIGITS + 10):
        torque, emf, radius = mp.mpf(p.torque_constant), mp.mpf(p.emf_constant), mp.mpf(p.wheel_radius)
        ratio, resistance = mp.mpf(p.gear_ratio), mp.mpf(p.resistance)
        per_volt = ratio * torque / (resistance * radius)  # traction of one wheel, eqs (10) (11)
        braking = per_volt * ratio * emf / radius  # traction lost per m/s of rim speed
        matrix = wrench_matrix(p)
        square = matrix * matrix.T
        axes = []
        for axis, inertia in enumerate((p.mass, p.mass, p.inertia)):
            others = [abs(square[axis, other]) for other in range(3) if other != axis]
            if max(others) > mp.mpf(10) ** -40:
                raise ValueError(f"axis {axis} is coupled to another one: {p.azimuth_deg}")
            rate = (braking * square[axis, axis] + mp.mpf(p.viscous[axis])) / mp.mpf(inertia)
            gain = [per_volt * matrix[axis, wheel] / mp.mpf(inertia) for wheel in range(len(p.azimuth_deg))]
            coulomb, breakaway = (mp.mpf(level[axis]) / mp.mpf(inertia) for level in (p.coulomb, p.breakaway))
            axes.append(Axis(*map(_decimal, (rate, coulomb, breakaway)), [_decimal(entry) for entry in gain]))
    return axes


def _decimal(x: mp.mpf) -> Decimal:
    return Decimal(mp.nstr(x, DIGITS + 8, strip_zeros=False))


def axis_history(axis: Axis, voltage, dt, start: float = 0.0, numbers: Numbers = decimal_numbers) -> AxisHistory:
    """One axis, from event to event. `voltage` (n, wheels) [V] and `dt` (n,) [s] are taken as the floats they are."""
    of, exp, log = numbers.of, numbers.exp, numbers.log
    a, c, held, gain = of(axis.rate), of(axis.coulomb), of(axis.breakaway), [of(x) for x in axis.gain]
    zero, one, edge = of(0), of(1), of(EDGE)
    lengths = {h: (of(h), exp(-a * of(h))) for h in set(dt)}
    speed, turned, event, before, after, edges = [of(start)], [zero], [], [], [], 0
    for row, step in zip(voltage, dt, strict=True):
        h, decay = lengths[step]
        v, t, f1, f2, angle = speed[-1], h, zero, zero, zero
        g = sum((k * of(u) for k, u in zip(gain, row, strict=True)), zero)
        s = (v > 0) - (v < 0) if v != 0 else (g > 0) - (g < 0)
        edges += v == 0 and abs(abs(g) - held) < edge * held
        if v != 0 or abs(g) > held:
            f1 = g - s * c
            w = f1 / a
            end = w + (v - w) * decay
            edges += 0 < abs(end) < edge or (held > c and 0 < abs(v) < edge and c < s * g <= held)
            if s * end >= 0:
                angle = w * h + (v - w) * (one - decay) / a
                v = end
            else:
                t = log((v - w) / -w) / a
                angle = w * t + (v - w) * (one - (-w) / (v - w)) / a
                edges += abs(abs(g) - held) < edge * held
                v = zero
                if s * g < -held:
                    f2 = g + s * c
                    w, rest = f2 / a, h - t
                    gone = one - exp(-a * rest)
                    v = w * gone
                    angle += w * rest - w * gone / a
        speed.append(v)
        turned.append(turned[-1] + angle)
        for record, value in ((event, t), (before, f1), (after, f2)):
            record.append(float(value))
    return AxisHistory(speed, turned, np.array(event), np.array(before), np.array(after), int(edges))


def reference(p: Physical, voltage: np.ndarray, dt: Sequence[float], twist=(0.0, 0.0, 0.0)) -> Truth:
    """Twist and pose of a robot from a start at the origin, correct to the last bit of a double (position: 1e-13 m)."""
    rows, steps = [tuple(map(float, row)) for row in voltage], [float(h) for h in dt]
    with localcontext() as context:
        context.prec = DIGITS
        axes = axes_of(p)
        histories = [axis_history(axis, rows, steps, v) for axis, v in zip(axes, twist, strict=True)]
        speeds = np.array([[float(v) for v in history.speed] for history in histories]).T
        heading = np.array([float(angle) for angle in histories[2].turned])
        full_turn = _two_pi()
        wrapped = np.array([float(angle % full_turn) for angle in histories[2].turned])
        moves = displacements(histories, [float(axis.rate) for axis in axes], speeds, np.array(steps))
        cos, sin = np.cos(wrapped[:-1]), np.sin(wrapped[:-1])
        x = _running_sum(cos * moves[:, 0] - sin * moves[:, 1])
        y = _running_sum(sin * moves[:, 0] + cos * moves[:, 1])
    edges = sum(history.edges for history in histories)
    return Truth(speeds, np.stack([x, y, heading], axis=1), edges)


def _two_pi() -> Decimal:
    with mp.workdps(DIGITS + 10):
        return _decimal(2 * mp.pi)


def _running_sum(terms: np.ndarray) -> np.ndarray:
    """0, t0, t0 + t1, ...: each rounded once."""
    total, sums = Decimal(0), [0.0]
    for term in terms.tolist():
        total += Decimal(term)
        sums.append(float(total))
    return np.array(sums)


def displacements(histories: list[AxisHistory], rate, speeds: np.ndarray, dt: np.ndarray) -> np.ndarray:
    """Displacement in each step, in the body frame at its start [m]. Shape (n, 2). All steps at once."""
    n = len(dt)
    cuts = np.sort(np.stack([np.zeros(n), *(np.minimum(h.event, dt) for h in histories), dt], axis=1), axis=1)
    step = np.repeat(np.arange(n), 4)
    left, length = cuts[:, :-1].ravel(), np.diff(cuts, axis=1).ravel()
    fastest = np.maximum(max(rate), np.maximum(np.abs(speeds[:-1, 2]), np.abs(speeds[1:, 2])))
    parts = np.ceil(fastest[step] * length).astype(int)  # each shorter than 1/fastest; none where length is 0
    which = np.repeat(np.arange(len(parts)), parts)
    within = np.arange(len(which)) - np.repeat(np.cumsum(parts) - parts, parts)
    length, left, step = length[which] / parts[which], left[which] + within * length[which] / parts[which], step[which]
    nodes, weights = np.polynomial.legendre.leggauss(16)
    t = left[:, None] + length[:, None] * (nodes + 1) / 2
    vx, vy, _ = (
        _within(h, a, speeds[:-1, j], t, step)[0] for j, (h, a) in enumerate(zip(histories, rate, strict=True))
    )
    angle = _within(histories[2], rate[2], speeds[:-1, 2], t, step)[1]
    weight = length[:, None] * weights / 2
    x, y = (weight * (np.cos(angle) * vx - np.sin(angle) * vy), weight * (np.sin(angle) * vx + np.cos(angle) * vy))
    return np.stack([np.bincount(step, part.sum(axis=1), minlength=n) for part in (x, y)], axis=1)


def _within(history: AxisHistory, a: float, start: np.ndarray, t: np.ndarray, step: np.ndarray):
    """(speed, its integral) at times t [s] inside the given steps. Shape of t."""
    event, before, after, v = (x[step][:, None] for x in (history.event, history.before, history.after, start))
    first, second = np.minimum(t, event), np.maximum(t - event, 0.0)
    gone, gone_after = -np.expm1(-a * first) / a, -np.expm1(-a * second) / a
    late = t > event
    speed = np.where(late, after * gone_after, v + (before - a * v) * gone)
    turned = before / a * first + (v - before / a) * gone + after / a * (second - gone_after)
    return speed, turned


def position_by_quadrature(p: Physical, row, h: float, twist) -> tuple[float, float]:
    """Displacement of one step by mpmath's adaptive quadrature in 30 digits. Slow: it watches over `displacements`."""
    with mp.workdps(30):
        axes = axes_of(p)
        histories = [axis_history(axis, [row], [h], v, mpmath_numbers) for axis, v in zip(axes, twist, strict=True)]

        def at(t):
            out = []
            for axis, history, v in zip(axes, histories, twist, strict=True):
                a, event = mpmath_numbers.of(axis.rate), mp.mpf(history.event[0])
                w, w2 = mp.mpf(history.before[0]) / a, mp.mpf(history.after[0]) / a
                first = min(t, event)
                speed = w + (mp.mpf(v) - w) * mp.exp(-a * t) if t <= event else w2 * (1 - mp.exp(-a * (t - event)))
                angle = w * first + (mp.mpf(v) - w) * (1 - mp.exp(-a * first)) / a
                if t > event:
                    angle += w2 * (t - event) - speed / a
                out.append((speed, angle))
            return out

        def world(t, axis):
            (vx, _), (vy, _), (_, angle) = at(t)
            cos, sin = mp.cos(angle), mp.sin(angle)
            return cos * vx - sin * vy if axis == 0 else sin * vx + cos * vy

        cuts = sorted({mp.mpf(0), mp.mpf(h), *(mp.mpf(min(x.event[0], h)) for x in histories)})
        return tuple(float(mp.quad(lambda t, axis=axis: world(t, axis), cuts)) for axis in (0, 1))


def largest_error(got: np.ndarray, truth: np.ndarray) -> float:
    """max |got - truth|; NaN counts as infinite."""
    error = np.abs(got - truth).max()
    return math.inf if math.isnan(error) else float(error)
