"""The whole plant by DOP853, mode by mode: what tests and benchmarks of the implicit engine compare with.

Only parameter values and the wrench matrix of omnidyn are used. With rim speeds s_i = g_i . nu, K = l K_t / r
[N/A] and E = l K_v / r [V s/m]:

    M nu' = sum g_i f_i + m omega (v_y, -v_x, 0) + friction,   M = diag(m, m, I) + sum (J l^2 + J_w)/r^2 g_i g_i^T
    settled currents   i = clip(soft(u - E s, V_d) / R, +-i_max)
    dynamic currents   L i' = u - E s - R i - V_d sgn i, and i' = 0 while pushed outward at +-i_max
    gear               f = eta K i (i s > 0), K i / eta (i s < 0)
                         = K i m - K |i| q sgn s,   m = (1/eta + eta)/2, q = (1/eta - eta)/2

so that the gear is a dry friction of level K |i| q at the wheel. A friction element (axis x, axis y, yaw,
each wheel: scalar; the ellipse: plane) slides at its coulomb level or holds up to its breakaway level. A mode
is the set of elements that hold, the sign of each that slides, and the regime of each current. Within it the
motion is a smooth ODE in the null space of the directions that hold, and no unknown force is needed.

Which elements hold is decided by the accelerations that minimise

    1/2 a M a - F . a + sum over elements at rest of level |d . a|        level: breakaway

What moves then slides at its coulomb level, and the rest is asked again with those levels, until nothing more
moves. What holds does so as long as the force it must balance lies in the Minkowski sum of its sets. That is
a zonotope, or a zonotope plus an ellipse, and `Gauge` knows how far its edge is, without tolerance:
multipliers need not be unique.

A mode ends where a speed or a current becomes 0, a load reaches the edge of what holds, or a current meets or
leaves its limit; the instant is found on the dense output, then polished on a step that ends there.

What it cannot express, or only so: (1) Bristles and slipping wheels are not here. (2) The ellipse
is singular at rest: it stops where its speed is below `NEARLY_STOPPED`, and starts 1e-9 s after its release
(after 1e-3 of the time its load needs to double where it is released without a jump); both cost below 1e-11
m/s. (3) A tie, a decision nearer than about 1e-9 to its edge, is decided one way; `Truth.margin` tells, and
random robots are redrawn. (4) With breakaway above coulomb and several elements at rest the law itself is not
unique; the rule above is the choice made here. (5) A dip below an edge between nine samples of one step is
looked for by its minimum, not proved absent. tests/reference/modes_stepper.py, a Moreau stepper that knows no
modes, watches over all of it by step refinement.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq, minimize_scalar

from tests.reference.modes_friction import Decision, Gauge, Tie, closure, decide, directions, null, span
from tests.reference.modes_plant import FALLS, Plant, plant_of, to_centre

RTOL, ATOL = 1e-12, 1e-13
NOISE = 1e-12  # an event function nearer to 0 than this has not said anything yet
NEARLY_STOPPED = 1e-11  # [m/s] an ellipse slower than this is at rest
SAMPLES = np.linspace(0.0, 1.0, 9)[1:]
LINEAR, PLUS, MINUS, ZERO, TOP, BOTTOM, OPEN = "linear", "+", "-", "0", "top", "bottom", "open"
SIGN = {LINEAR: 0.0, PLUS: 1.0, MINUS: -1.0, ZERO: 0.0, TOP: 1.0, BOTTOM: -1.0, OPEN: 0.0}


class Mode:
    """The smooth ODE of one mode and its event functions, positive inside it. State: twist, pose, currents,
    energy."""

    def __init__(self, plant: Plant, u, regime, stuck, ellipse_stuck, sigma, energy=False):
        p = self.plant = plant
        self.u, self.regime, self.stuck, self.ellipse_stuck, self.sigma = (
            u,
            regime,
            stuck,
            ellipse_stuck,
            sigma,
        )
        self.energy, n = energy, p.wheels
        self.ellipse_slides = p.hold_ellipse is not None and not ellipse_stuck
        self.sign = np.array([SIGN[r] for r in regime])
        wheel_sigma = np.zeros(n)
        for e, k in enumerate(p.wheel):
            if k >= 0:
                wheel_sigma[k] = sigma[e]
        self.FI = p.G * (p.K * (p.middle - wheel_sigma * p.dry * self.sign))
        self.i0, self.i1 = np.zeros(n), np.zeros(n)  # settled current i0 + i1 * rim speed
        for k, r in enumerate(regime):
            if r in (LINEAR, PLUS, MINUS):
                self.i0[k], self.i1[k] = (u[k] - p.drop[k] * SIGN[r]) / p.R[k], -p.E[k] / p.R[k]
            elif r in (TOP, BOTTOM):
                self.i0[k] = SIGN[r] * p.limit[k]
        level = np.where(sigma > 0, p.slide[:, 0], p.slide[:, 1])
        self.f0 = -p.direction.T @ (level * sigma)
        self.FA = -p.viscous.copy()
        if not p.dynamic:
            self.f0 = self.f0 + self.FI @ self.i0
            self.FA = self.FA + (self.FI * self.i1) @ p.G.T
        self.gauge = Gauge(p.direction[sorted(stuck)], p.hold_ellipse if ellipse_stuck else None)
        N = null(self.gauge.basis)
        self.N = N
        self.W = N @ np.linalg.solve(N.T @ p.M @ N, N.T) if N.shape[1] else np.zeros((3, 3))
        self.flows = np.array([r in (LINEAR, PLUS, MINUS) for r in regime], dtype=float)
        self.size = 6 + (n if p.dynamic else 0) + (1 if energy else 0)
        self._make_rows()

    def _make_rows(self):
        p, n = self.plant, self.plant.wheels
        rows, const, what = [], [], []

        def add(kind, index, target, twist=None, current=None, value=0.0):
            row = np.zeros(self.size)
            if twist is not None:
                row[:3] = twist
            if current is not None:
                row[6 + index] = current
            rows.append(row)
            const.append(value)
            what.append((kind, index, target))

        for e, s in enumerate(self.sigma):
            if s != 0.0:
                add("stops", e, None, twist=s * p.direction[e])
        for k in range(n):
            r, back, u = self.regime[k], p.E[k] * p.G[:, k], self.u[k]
            top = p.drop[k] + p.R[k] * p.limit[k]
            finite = math.isfinite(p.limit[k])
            if r == OPEN:
                continue
            if p.dynamic:
                if r in (PLUS, MINUS):
                    add("current", k, ZERO, current=SIGN[r])
                if finite and r in (PLUS, LINEAR):
                    add("current", k, TOP, current=-1.0, value=p.limit[k])
                if finite and r in (MINUS, LINEAR):
                    add("current", k, BOTTOM, current=1.0, value=p.limit[k])
                if r == ZERO and p.drop[k] > 0:
                    add("current", k, PLUS, twist=back, value=p.drop[k] - u)
                    add("current", k, MINUS, twist=-back, value=p.drop[k] + u)
            else:
                if r == PLUS:
                    add("current", k, ZERO if p.drop[k] > 0 else MINUS, twist=-back, value=u - p.drop[k])
                if r == MINUS:
                    add("current", k, ZERO if p.drop[k] > 0 else PLUS, twist=back, value=-u - p.drop[k])
                if r == ZERO and p.drop[k] > 0:
                    add("current", k, PLUS, twist=back, value=p.drop[k] - u)
                    add("current", k, MINUS, twist=-back, value=p.drop[k] + u)
                if finite and r in (PLUS, LINEAR):
                    add("current", k, TOP, twist=back, value=top - u)
                if finite and r in (MINUS, LINEAR):
                    add("current", k, BOTTOM, twist=-back, value=top + u)
            plain = PLUS if p.drop[k] > 0 or p.eta[k] < 1 else LINEAR
            if r == TOP:
                add("current", k, plain, twist=-back, value=u - top)
            if r == BOTTOM:
                add("current", k, MINUS if plain == PLUS else LINEAR, twist=back, value=-u - top)
        self.rows, self.const, self.what = np.array(rows).reshape(-1, self.size), np.array(const), what
        if self.ellipse_slides:
            self.what = [*self.what, ("ellipse stops", 0, None)]
        if self.gauge.rank:
            self.what = [*self.what, ("gives way", 0, None)]

    def currents(self, z):
        """[A]; z (size,) or (size, k)."""
        if self.plant.dynamic:
            return z[6 : 6 + self.plant.wheels]
        s = self.plant.G.T @ z[:3]
        return self.i0 + self.i1 * s if s.ndim == 1 else self.i0[:, None] + self.i1[:, None] * s

    def force(self, z):
        """All forces but those of what holds; z (size,) or (size, k)."""
        p, v = self.plant, z[:3]
        f = self.FA @ v + (self.f0 if z.ndim == 1 else self.f0[:, None])
        if p.dynamic:
            f += self.FI @ z[6 : 6 + p.wheels]
        if p.turning:
            f[0] += p.mass[0] * v[2] * v[1]
            f[1] -= p.mass[0] * v[2] * v[0]
        for e in np.flatnonzero(np.isfinite(p.stribeck) & (self.sigma != 0.0)):
            speed, side = np.maximum(self.sigma[e] * (p.direction[e] @ v), 0.0), 0 if self.sigma[e] > 0 else 1
            left = FALLS[p.shapes[e]](speed / p.stribeck[e], p.exponent[e])
            more = (p.hold[e, side] - p.slide[e, side]) * left
            f -= np.multiply.outer(p.direction[e] * self.sigma[e], more)
        if self.ellipse_slides:
            fallen = FALLS[p.shape_ellipse](np.hypot(v[0], v[1]) / p.stribeck_ellipse, p.exponent_ellipse)
            if not math.isfinite(p.stribeck_ellipse):
                fallen = 0.0 * fallen
            cx = p.slide_ellipse[0] + (p.hold_ellipse[0] - p.slide_ellipse[0]) * fallen
            cy = p.slide_ellipse[1] + (p.hold_ellipse[1] - p.slide_ellipse[1]) * fallen
            size = np.hypot(cx * v[0], cy * v[1]) + 1e-300
            f[0] -= cx * cx * v[0] / size
            f[1] -= cy * cy * v[1] / size
        return f

    def rate(self, t, z):
        """dz/dt."""
        p = self.plant
        out = np.zeros(len(z))
        out[:3] = self.W @ self.force(z)
        cos, sin = math.cos(z[5]), math.sin(z[5])
        out[3], out[4], out[5] = cos * z[0] - sin * z[1], sin * z[0] + cos * z[1], z[2]
        if p.dynamic:
            i = z[6 : 6 + p.wheels]
            out[6 : 6 + p.wheels] = self.flows * (self.u - p.E * (z[:3] @ p.G) - p.R * i - p.drop * self.sign) / p.L
        if self.energy:
            out[-1] = self._power(z)
        return out

    def _power(self, z):
        """Terminal power less all losses, from the law and not from the mode's signs."""
        p, v, i = self.plant, z[:3], self.currents(z)
        s = p.G.T @ v
        limited = np.array([r in (TOP, BOTTOM) for r in self.regime])
        terminal = np.where(limited, p.R * i + p.E * s + p.drop * np.sign(i), self.u)
        shaft = p.K * i * s
        power = terminal @ i - (p.R * i) @ i - p.drop @ np.abs(i) - ((p.E - p.K) * s) @ i
        power -= np.where(shaft > 0, (1 - p.eta) * shaft, (1 - 1 / p.eta) * shaft).sum()
        speed = p.direction @ v
        power -= v @ p.viscous @ v
        power -= p.slide[:, 0] @ np.maximum(speed, 0) + p.slide[:, 1] @ np.maximum(-speed, 0)
        if p.slide_ellipse is not None:
            power -= np.hypot(*(p.slide_ellipse * v[:2]))
        return power

    def gear_level(self, i):
        """What the gear adds to the level of each scalar element [N]; i (wheels,) or (wheels, k)."""
        p = self.plant
        out = np.zeros((len(p.wheel), *i.shape[1:]))
        for e, k in enumerate(p.wheel):
            if k >= 0:
                out[e] = p.K[k] * p.dry[k] * np.abs(i[k])
        return out

    def load(self, z):
        """1 - gauge of what holds; z (size, k)."""
        p, stuck = self.plant, sorted(self.stuck)
        f = self.force(z)
        held = f - p.M @ (self.W @ f)
        extra = self.gear_level(self.currents(z))[stuck]
        return 1.0 - self.gauge(held, p.hold[stuck, 0, None] + extra, p.hold[stuck, 1, None] + extra)

    def events(self, z):
        """Event functions, positive inside the mode. z (size, k) -> (events, k)."""
        parts = [self.rows @ z + self.const[:, None]]
        if self.ellipse_slides:
            parts.append((np.hypot(z[0], z[1]) - NEARLY_STOPPED)[None])
        if self.gauge.rank:
            parts.append(self.load(z)[None])
        return np.vstack(parts)

    def project(self, z):
        """The state with the twist in the space of motions this mode allows."""
        z = z.copy()
        z[:3] = self.N @ (self.N.T @ z[:3]) + 0.0 if self.gauge.rank else z[:3]
        return z


@dataclass
class Truth:
    """n + 1 samples: the start and the end of each row.

    t [s] (n + 1,); twist and pose (n + 1, 3); current (n + 1, wheels): at the end of a row under the voltage
    of that row, sample 0 under the first row's. stuck (n + 1, 4 + wheels): x, y, yaw, x and y together, each
    wheel. events: mode changes; margin: nearest decision to its edge, relative; steps: of DOP853; energy:
    residual [J] (n + 1,); log: (time, event, index, to what).
    """

    t: np.ndarray
    twist: np.ndarray
    pose: np.ndarray
    current: np.ndarray
    stuck: np.ndarray
    events: int
    margin: float
    steps: int
    energy: np.ndarray | None = None
    log: list = field(default_factory=list)


class Integrator:
    """One run. Local time in each row."""

    def __init__(self, plant: Plant, energy=False, rtol=RTOL, atol=ATOL):
        self.plant, self.energy, self.rtol, self.atol = plant, energy, rtol, atol
        self.events, self.steps, self.margin, self.log = 0, 0, math.inf, []
        self.now = 0.0
        self.rested = np.full(len(plant.direction), -math.inf)  # when each element was last known to be at 0
        self.ellipse_rested = -math.inf

    def start(self, twist, pose, current, u, coast):
        p = self.plant
        n = p.wheels if p.dynamic else 0
        self.z = np.concatenate([twist, pose, current if p.dynamic else np.zeros(0), np.zeros(1 if self.energy else 0)])
        assert len(self.z) == 6 + n + (1 if self.energy else 0)
        speed = p.direction @ self.z[:3]
        self.sigma = np.where(np.abs(speed) < NOISE, 0.0, np.sign(speed))
        slow = p.hold_ellipse is not None and np.hypot(*self.z[:2]) < NEARLY_STOPPED
        self.stuck, self.ellipse_stuck = closure(p, np.flatnonzero(self.sigma == 0.0), slow)
        self.regime = [None] * p.wheels
        self.set_regimes(u, coast)

    def set_regimes(self, u, coast):
        """The regime of each current at the start of a row."""
        p, z = self.plant, self.z
        w = u - p.E * (p.G.T @ z[:3])
        for k in range(p.wheels):
            signed = p.drop[k] > 0 or p.eta[k] < 1
            top = p.drop[k] + p.R[k] * p.limit[k]
            if coast[k]:
                regime = OPEN
                if p.dynamic:
                    z[6 + k] = 0.0
            elif p.dynamic:
                i = z[6 + k]
                if abs(i) >= p.limit[k] * (1 - 1e-13) and np.sign(i) * w[k] > top:
                    regime = TOP if i > 0 else BOTTOM
                    z[6 + k] = np.sign(i) * p.limit[k]
                elif not signed:
                    regime = LINEAR
                elif i != 0.0:
                    regime = PLUS if i > 0 else MINUS
                else:
                    regime = self._from_zero(k, w[k])
            elif abs(w[k]) > top:
                regime = TOP if w[k] > 0 else BOTTOM
            else:
                regime = self._from_zero(k, w[k]) if signed else LINEAR
            if p.drop[k] > 0 and regime != OPEN and (not p.dynamic or z[6 + k] == 0.0):
                self.margin = min(self.margin, abs(abs(w[k]) - p.drop[k]))
            self.regime[k] = regime

    def _from_zero(self, k, w):
        drop = self.plant.drop[k]
        if w > drop:
            return PLUS
        if w < -drop:
            return MINUS
        return ZERO

    def mode(self, u) -> Mode:
        """The mode of the present sets. A wheel without drop that just starts under no voltage brakes
        itself."""
        p, regime = self.plant, list(self.regime)
        for e, k in enumerate(p.wheel):
            if k >= 0 and regime[k] == ZERO and p.drop[k] == 0 and self.sigma[e] != 0:
                regime[k] = MINUS if self.sigma[e] > 0 else PLUS
        self.regime = regime
        return Mode(p, u, list(regime), self.stuck, self.ellipse_stuck, self.sigma.copy(), self.energy)

    def settle(self, u, at_rest, ellipse_at_rest, z=None, edge=True) -> Decision:
        """Decides anew who holds, at the state z, and takes it over."""
        p = self.plant
        z = self.z if z is None else z
        at_rest, flat = closure(p, at_rest, ellipse_at_rest)
        sigma = self.sigma.copy()
        sigma[sorted(at_rest)] = 0.0
        slides = Mode(p, u, self.regime, frozenset(), flat, sigma, self.energy)
        for e in at_rest:
            self.rested[e] = self.now
        if flat:
            self.ellipse_rested = self.now
        i = slides.currents(z)
        result = decide(p, slides.force(z), at_rest, flat, sigma, slides.gear_level(i))
        self.stuck, self.ellipse_stuck, self.sigma = result.stuck, result.ellipse_stuck, result.sigma
        if edge:
            self.margin = min(self.margin, result.margin)
        return result

    def recent(self):
        """Elements that were at 0 at this same instant."""
        close = 1e-11
        return set(np.flatnonzero(self.now - self.rested < close)), self.now - self.ellipse_rested < close

    def row(self, u, coast, h, origin):
        """One row of held voltage."""
        self.set_regimes(u, coast)
        self.now = origin
        t, quick = 0.0, 0
        was_flat = self.ellipse_stuck
        result = self.settle(u, self.stuck, self.ellipse_stuck)
        if was_flat and not self.ellipse_stuck:
            t = self.launch(u, t, h, result)
        while t < h:
            mode = self.mode(u)
            self.z = mode.project(self.z)
            begun = t
            t, event = self.advance(mode, t, h)
            self.now = origin + t
            if event is None:
                break
            quick = quick + 1 if t - begun < 1e-12 else 0
            if quick > 12:
                raise Tie(f"events do not end at t = {self.now}: {event}")
            self.events += 1
            self.log.append((self.now, *event))
            t = self.handle(mode, event, u, t, h)
        self.z = self.mode(u).project(self.z)

    def handle(self, mode, event, u, t, h):
        """The next mode. Returns the time from which it holds."""
        kind, index, target = event
        if kind == "current":
            self.change_regime(index, target, u)
            return t
        again, flat = self.recent()
        was_flat = self.ellipse_stuck
        if kind == "gives way":
            return self.give_way(mode, u, t, h, self.stuck | again, self.ellipse_stuck or flat)
        at_rest = self.stuck | again | ({index} if kind == "stops" else set())
        flat = self.ellipse_stuck or flat or kind == "ellipse stops"
        closed, closed_flat = closure(self.plant, at_rest, flat)
        basis = span(directions(self.plant, closed, closed_flat))
        self.z[:3] -= basis @ (basis.T @ self.z[:3])
        result = self.settle(u, at_rest, flat)
        if (was_flat or closed_flat) and self.plant.hold_ellipse is not None and not self.ellipse_stuck:
            return self.launch(u, t, h, result)
        return t

    def change_regime(self, k, target, u):
        p = self.plant
        if p.dynamic and target == ZERO:
            self.z[6 + k] = 0.0
            w = u[k] - p.E[k] * (p.G[:, k] @ self.z[:3])
            if p.drop[k] > 0:  # without a drop a current that fades away may cross 0 by rounding
                self.margin = min(self.margin, abs(abs(w) - p.drop[k]))
            target = self._from_zero(k, w)
        elif p.dynamic and target in (TOP, BOTTOM):
            self.z[6 + k] = SIGN[target] * p.limit[k]
        self.regime[k] = target

    def give_way(self, mode, u, t, h, at_rest, flat):
        """A load reached the edge: who moves is asked a moment later, when it is beyond the edge by 1e-5."""
        z, rate, moment = self.z, mode.rate(t, self.z), 1e-7
        near = mode.load(np.stack([z, z + moment * rate], axis=1))
        grows = float(near[0] - near[1]) / moment
        if not grows > 1e-6:
            raise Tie(f"a load touches its edge without passing it at t = {self.now}")
        before = (self.stuck, self.ellipse_stuck, self.sigma)
        result = self.settle(u, at_rest, flat, z + min(1e-5 / grows, 1e-4) * rate, edge=False)
        if self.plant.hold_ellipse is None or self.ellipse_stuck or not flat:
            return t
        if np.hypot(*result.acceleration[:2]) > 1e-2 * (self.plant.slide_ellipse / self.plant.mass[0]).max():
            return self.launch(u, t, h, result)
        # Released without a jump, v' = w (t - t*): the old motion, and w wait^2 / 2 on top of it.
        self.stuck, self.ellipse_stuck, self.sigma = before
        slow = math.sqrt(20 * NEARLY_STOPPED * self.plant.mass[0] / self.plant.slide_ellipse.min() / grows)
        wait = min(max(1e-3 / grows, 5 * slow), 1e-4, (h - t) / 2)
        z = self.step_to(mode, t, z, t + wait)
        result = self.settle(u, at_rest, flat, z, edge=False)
        z[:3] += (result.acceleration - mode.rate(t, z)[:3]) * wait / 2
        self.z = z
        return t + wait

    def launch(self, u, t, h, result):
        """An ellipse that starts: 1e-9 s along its acceleration, where its direction is defined."""
        speed = np.hypot(*result.acceleration[:2])
        wait = min(max(1e-9, 10 * NEARLY_STOPPED / speed), (h - t) / 2)
        mode = self.mode(u)
        rate = mode.rate(t, self.z)
        rate[:3] = result.acceleration
        self.z = self.z + wait * rate
        return t + wait

    def advance(self, mode, t, h):
        """Integrates a mode until the row ends or it does. Returns (time, event or None)."""
        z = self.z
        if mode.gauge.rank == 3 and not self.plant.dynamic:
            return h, None  # at rest under held voltages: nothing changes
        solver = DOP853(mode.rate, t, z, h, rtol=self.rtol, atol=self.atol, max_step=5e-3)
        last = mode.events(z[:, None])[:, 0]
        trusted = last > NOISE
        begin = t
        while solver.status == "running":
            t0, z0 = solver.t, solver.y.copy()
            message = solver.step()
            self.steps += 1
            if solver.status == "failed":
                raise Tie(f"DOP853: {message} at t = {self.now + t0 - begin}")
            dense = solver.dense_output()
            times = t0 + (solver.t - t0) * SAMPLES
            states = dense(times)
            states[:, -1] = solver.y
            values = mode.events(states)
            found = self._first(mode, dense, t0, last, times, values, trusted)
            if found is not None:
                return self._stop_at(mode, t0, z0, *found)
            last = values[:, -1]
            trusted = trusted | (values.max(axis=1) > NOISE)
        self.z = solver.y.copy()
        return h, None

    def _first(self, mode, dense, t0, last, times, values, trusted):
        """(instant, event number) of the first event in the step, or None."""
        grid = np.concatenate([[t0], times])
        table = np.concatenate([last[:, None], values], axis=1)
        best = None

        def value(t, e):
            return float(mode.events(dense(t)[:, None])[e, 0])

        for e in range(len(table)):
            g = table[e]
            below = np.flatnonzero(g[1:] < (0.0 if trusted[e] else -NOISE))
            stop = below[0] + 1 if len(below) else len(g)
            dips = [
                k
                for k in range(1, min(stop, len(g) - 1))
                if g[k] <= g[k - 1] and g[k] < g[k + 1] and 0 < g[k] < 0.5 * max(g[k - 1] - g[k], g[k + 1] - g[k])
            ]
            for k in dips:
                low = minimize_scalar(
                    value,
                    bounds=(grid[k - 1], grid[k + 1]),
                    args=(e,),
                    method="bounded",
                    options={"xatol": 1e-12},
                )
                if low.fun > 0 and mode.what[e][0] != "ellipse stops":
                    self.margin = min(self.margin, float(low.fun)) if trusted[e] else self.margin
                if low.fun < 0:
                    root = brentq(value, grid[k - 1], low.x, args=(e,), xtol=1e-16)
                    best = min(best, (root, e)) if best else (root, e)
                    break
            if stop < len(g) and (best is None or grid[stop - 1] <= best[0]):
                root = grid[stop - 1]
                if value(root, e) > 0:
                    root = brentq(value, root, grid[stop], args=(e,), xtol=1e-16)
                best = min(best, (root, e)) if best else (root, e)
        return best

    def step_to(self, mode, t, z, end):
        """The state of a mode at `end`, in one step if it is accurate enough."""
        if end - t <= 1e-14:
            return z.copy()
        solver = DOP853(mode.rate, t, z, end, rtol=self.rtol, atol=self.atol, first_step=end - t)
        while solver.status == "running":
            solver.step()
        return solver.y.copy()

    def _stop_at(self, mode, t0, z0, instant, e):
        """The state at an event: a step that ends there, and one Newton correction of the instant."""
        z = self.step_to(mode, t0, z0, instant)
        rate, tiny = mode.rate(instant, z), 1e-8
        value = mode.events(np.stack([z, z + tiny * rate], axis=1))[e]
        slope = (value[1] - value[0]) / tiny
        correction = -value[0] / slope if slope < 0 else 0.0
        if abs(correction) > 1e-9:
            correction = 0.0
        self.z = z + correction * rate
        return instant + correction, mode.what[e]


def _turned(place, heading):
    """A place of the body, along the axes of the room."""
    cos, sin = math.cos(heading), math.sin(heading)
    return cos * place[0] - sin * place[1], sin * place[0] + cos * place[1]


def reference(
    robot,
    voltage,
    dt,
    twist=(0.0, 0.0, 0.0),
    pose=(0.0, 0.0, 0.0),
    current=None,
    open_circuit=None,
    energy=False,
    rtol=RTOL,
    atol=ATOL,
) -> Truth:
    """The run of a robot under held voltages [V], `voltage` (n, wheels), `dt` number or (n,) [s].

    `current` [A]: at the start, dynamic electrics only. `open_circuit` (n, wheels): motors that carry no
    current. energy: also integrates terminal power less all losses; Truth.energy is what is missing to the
    energy stored.
    """
    p = plant_of(robot)
    voltage = np.clip(np.asarray(voltage, dtype=float), -p.volts, p.volts)
    dt = np.broadcast_to(np.asarray(dt, dtype=float), (len(voltage),))
    coast = np.zeros(voltage.shape, dtype=bool) if open_circuit is None else np.asarray(open_circuit, dtype=bool)
    run = Integrator(p, energy, rtol, atol)
    start = np.zeros(p.wheels) if current is None else np.asarray(current, dtype=float)
    there, off = to_centre(robot), np.asarray(robot.body.centre)
    back = np.linalg.inv(there)
    place = np.add(pose, [*_turned(off, pose[2]), 0.0])
    run.start(there @ np.asarray(twist, dtype=float), place, start, voltage[0], coast[0])
    t = np.concatenate([[0.0], np.cumsum(dt)])
    out = {name: [] for name in ("twist", "pose", "current", "stuck", "energy")}

    def keep(u):
        mode = run.mode(u)
        z = run.z
        rest = mode.N
        held = [*back, *p.G.T]
        flags = [bool(np.abs(d @ rest).max(initial=0.0) < 1e-9) for d in held]
        out["twist"].append(np.where(flags[:3], 0.0, back @ z[:3]))
        out["pose"].append(z[3:6] - [*_turned(off, z[5]), 0.0])
        out["current"].append(mode.currents(z).copy())
        out["stuck"].append([*flags[:3], flags[0] and flags[1], *flags[3:]])
        stored = 0.5 * z[:3] @ p.M @ z[:3]
        if p.dynamic:
            stored += 0.5 * (p.L * z[6 : 6 + p.wheels]) @ z[6 : 6 + p.wheels]
        out["energy"].append(stored - (z[-1] if energy else 0.0))

    keep(voltage[0])
    for k, (u, h) in enumerate(zip(voltage, dt, strict=True)):
        run.row(u, coast[k], h, t[k])
        keep(u)
    missing = np.array(out["energy"])
    return Truth(
        t,
        np.array(out["twist"]),
        np.array(out["pose"]),
        np.array(out["current"]),
        np.array(out["stuck"]),
        run.events,
        float(run.margin),
        run.steps,
        missing - missing[0] if energy else None,
        run.log,
    )
