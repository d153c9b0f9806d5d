"""Wheels that slip, event by event: modes of what holds and slides, DOP853 between events. No code of the engine.

a = (v', s'), of the body and of the rims, under forces F and elements e of dry friction along d_e with multipliers r_e:

    M a = F - sum_e d_e r_e,    d_e . a = 0 and -back_e <= r_e <= hold_e at rest,    r_e = sign C_e(d_e . (v, s)) moving

Elements are the axes, the friction of the wheels, and their contacts: d = s - g . v, level mu N. The mass of the body
is that of its centre, M = T^T diag(m, m, I) T. What gives way is told by least squares within bounds, its levels those
that hold; what it says moves slides from then on, and the question is asked again. Friction along the direction of
travel is a pair of multipliers within an ellipse; in motion it is C^2 v/|C v|. What bends there is a force with a
pair of states (bristles.py).
"""

import numpy as np
from scipy.integrate import solve_ivp

from omnidyn.model.wheels import per_wheel
from tests.reference.bristles import BENDS, plane_rate, rate_of
from tests.reference.modes_plant import FALLS
from tests.reference.slip_holds import Ellipse, least, room

EDGE = 1e-9  # [N, m/s^2] by which what holds and what drives must differ, for a draw to count
TINY = 1e-13  # [m/s] at which what was let go begins to move
STOPPED, STARTS = 1e-10, 1e-9  # [m/s] at which a body that slides along an ellipse is at rest, and at which it begins
CREEPS, LONGEST = 1e-7, 1e-3  # [m/s] and [s]: see Slip._creeping
MOVES = 1e-7  # [m/s^2] of an acceleration that is no rounding of the bounded least squares


def falling(law, speed, slide, hold, inverse):
    """The level at a speed; inverse: 1/v_s."""
    return slide + (hold - slide) * FALLS[law.stribeck_shape](abs(speed) * inverse, law.stribeck_exponent)


class Element:
    """One place of dry friction: levels (2,) forward and backward; of what bends, a force with a state."""

    def __init__(self, law, d, slide, hold, fall, bristle=None):
        self.law, self.d, self.slide, self.hold, self.fall, self.bristle = law, d, slide, hold, fall, bristle

    def moving(self, speed, sign):
        """Level while it slides to one side."""
        side = 0 if sign > 0 else 1
        if self.fall == 0.0:
            return self.slide[side]
        return falling(self.law, speed, self.slide[side], self.hold[side], self.fall)

    def bends(self, speed, z):
        """(force, z') of a bristle."""
        stiffness, damping, fades = self.bristle
        g, law = self.moving(speed, speed), self.law
        power = law.dahl_exponent if law.law == "dahl" else 1.0
        rate = rate_of(speed, stiffness * z / g, power, law.elastic_share if law.law == "elastoplastic" else None)
        return stiffness * z + damping * np.exp(-((speed * fades) ** 2)) * rate, rate


class Slip:
    """A robot; load (n,) of the wheels [N]. A mode has a sign of each element, 0 where it holds; last that of the
    ellipse, 1 in motion or where there is none."""

    def __init__(self, robot, load, shift=None):
        n, motor = robot.wheels.count, robot.motor
        at_rim = motor.gear_ratio / robot.wheels.radii
        self.G, self.n, self.k = robot.wheels.wrench_matrix, n, 3 + n
        spins = motor.rotor_inertia * motor.gear_ratio**2 + per_wheel(robot.wheels.wheel_inertia, n)
        self.kt, self.ke, self.R = at_rim * motor.torque_constant, at_rim * motor.emf_constant, motor.resistance
        self.L = motor.inductance if motor.electrical == "dynamic" else 0.0
        self.eta = per_wheel(motor.gear_efficiency, n)
        way = robot.friction.direction
        self.B = np.add(robot.friction.axes.viscous, (way.viscous, way.viscous, way.yaw_viscous))
        self.b = per_wheel(robot.friction.wheels.viscous, n)
        self.limit = robot.wheels.traction_mu * load
        self.shift = robot.wheels.traction_mu * (np.zeros((n, 2)) if shift is None else shift)
        self.turning = robot.body.mass * robot.body.rotating_frame
        x, y = robot.body.centre
        self.T = np.array([[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]])
        body = self.T.T @ np.diag([robot.body.mass, robot.body.mass, robot.body.inertia]) @ self.T
        self.M = np.zeros((self.k, self.k))
        self.M[:3, :3], self.M[3:, 3:] = body, np.diag(spins / robot.wheels.radii**2)
        self.root = np.linalg.cholesky(np.linalg.inv(self.M)).T  # M^-1 = root^T root
        self._fill(robot.friction)
        self.least = np.inf  # how near to an edge any decision was

    def _fill(self, friction):
        """Elements: dry ones of axes and wheels, then the contacts; what bends; the ellipse."""
        every, unit = [], np.eye(self.k)
        axes, wheels, way, n = friction.axes, friction.wheels, friction.direction, self.n
        for law, count, first in ((axes, 3, 0), (wheels, n, 3)):
            slide, back = (np.broadcast_to(own, count) for own in (law.coulomb, law.backward))
            fore = np.broadcast_to(law.coulomb if law.breakaway is None else law.breakaway, count)
            speed = np.broadcast_to(np.inf if law.stribeck_speed is None else law.stribeck_speed, count)
            for j in range(count):
                hold = np.broadcast_to(law.hold_backward, count)[j]
                bristle = None
                if law.law in BENDS:
                    damping = 0.0 if law.damping is None else np.broadcast_to(law.damping, count)[j]
                    fades = np.broadcast_to(np.inf if law.damping_speed is None else law.damping_speed, count)[j]
                    bristle = np.broadcast_to(law.stiffness, count)[j], damping, 1.0 / fades
                levels = np.array([slide[j], back[j]]), np.array([fore[j], hold])
                if levels[1].any() or (first and self.eta[j] != 1.0):
                    every.append(Element(law, unit[first + j], *levels, 1.0 / speed[j], bristle))
        if way.yaw_coulomb > 0.0:
            hold = way.yaw_coulomb if way.yaw_breakaway is None else way.yaw_breakaway
            fall = 0.0 if way.yaw_stribeck_speed is None else 1.0 / way.yaw_stribeck_speed
            fades, bristle = 1.0 / (way.yaw_damping_speed or np.inf), None
            if way.law in BENDS:
                bristle = way.yaw_stiffness, way.yaw_damping or 0.0, fades
            every.append(Element(way, unit[2], np.full(2, way.yaw_coulomb), np.full(2, hold), fall, bristle))
        self.way, self.E, self.plane = None, np.eye(2, self.k), None
        if any(way.coulomb) and way.law in BENDS:
            self.plane = way
        elif any(way.coulomb):
            self.way = Ellipse(way, 0.0 if way.stribeck_speed is None else 1.0 / way.stribeck_speed)
        self.bristles = [e for e in every if e.bristle]
        self.bent = len(self.bristles) + (2 if self.plane else 0)
        self.dry = [e for e in every if not e.bristle]
        for e in self.dry:
            wheel = np.flatnonzero(e.d[3:])
            e.wheel = int(wheel[0]) if len(wheel) and self.eta[wheel[0]] != 1.0 else -1  # whose gear loses
        contacts = np.hstack([-self.G.T, np.eye(n)])
        self.D = np.array([*(e.d for e in self.dry), *contacts])
        self.m = len(self.D)

    def currents(self, y, u):
        """(i, i') of the motors."""
        if self.L == 0.0:
            return (u - self.ke * y[3 : self.k]) / self.R, np.zeros(self.n)
        i = y[self.k : self.k + self.n]
        return i, (u - self.R * i - self.ke * y[3 : self.k]) / self.L

    def smooth(self, y, u, mode):
        """All forces but of dry elements, that of an ellipse in motion included, and the rates of bristles."""
        v, s = y[:3], y[3 : self.k]
        i, _ = self.currents(y, u)
        gain = self.kt.copy()
        for e, sign in zip(self.dry, mode, strict=False):
            if e.wheel >= 0 and sign != 0:
                gain[e.wheel] *= self.eta[e.wheel] ** np.sign(sign * i[e.wheel])
        c = self.T @ v
        self_turn = self.T.T @ (self.turning * c[2] * np.array([c[1], -c[0], 0.0]))
        force, rates = np.concatenate([self_turn - self.B * v, gain * i - self.b * s]), []
        if self.way is not None and mode[-1] != 0.0:
            force[:2] -= self.way.force(v[:2], falling)
        for e, z in zip(self.bristles, y[self.k + self.n : self.k + self.n + len(self.bristles)], strict=True):
            bent, rate = e.bends(e.d @ y[: self.k], z)
            force -= e.d * bent
            rates.append(rate)
        if self.plane:
            bent, rate = self._bends_along(v[:2], y[self.k + self.n + len(self.bristles) :][:2])
            force[:2] -= bent
            rates.extend(rate)
        return force, self_turn, np.array(rates)

    def _bends_along(self, v, z):
        """(force, z') of the bristle along the direction of travel, pairs."""
        way, speed = self.plane, np.hypot(*v)
        slide, hold = (np.array(own) for own in (way.coulomb, way.breakaway or way.coulomb))
        levels = falling(way, speed, slide, hold, 1.0 / (way.stribeck_speed or np.inf))
        rate = plane_rate(way, v, z, levels)
        fades = np.exp(-((speed / (way.damping_speed or np.inf)) ** 2))
        return way.stiffness * z + (way.damping or 0.0) * fades * rate, rate

    def loss(self, y, u, e):
        """What a gear holds beside its levels, forward and backward."""
        if e.wheel < 0:
            return np.zeros(2)
        i, gain, eta = self.currents(y, u)[0][e.wheel], self.kt[e.wheel], self.eta[e.wheel]
        return np.array([i * gain * (1.0 - eta ** np.sign(i)), i * gain * (eta ** -np.sign(i) - 1.0)])

    def floor(self, w, a, turn):
        """What the floor takes of a wheel under an acceleration, by the forces that it exerts itself."""
        return self.limit[w] + self.shift[w] @ ((self.M[:3, :3] @ a[:3])[:2] - turn[:2])

    def at_rest(self, mode):
        """(numbers of the elements that hold, the directions of all that does: last, where it does, the ellipse)."""
        held = np.flatnonzero(mode[: self.m] == 0)
        return held, np.vstack([self.D[held], self.E]) if mode[-1] == 0.0 else self.D[held]

    def solve(self, y, u, mode):
        """(a, r, smooth forces) in a mode; last in r the pair of the ellipse, where it holds."""
        force, turn, _ = self.smooth(y, u, mode)
        (held, rows), k = self.at_rest(mode), self.k
        matrix, right = np.zeros((k + len(rows),) * 2), np.zeros(k + len(rows))
        matrix[:k, :k], matrix[:k, k:], matrix[k:, :k] = self.M, rows.T, rows
        right[:k] = force
        levels = np.zeros(self.m + 2)
        for e in np.flatnonzero(mode[: self.m]):
            d, sign, w = self.D[e], mode[e], e - len(self.dry)
            if w < 0:
                levels[e] = sign * self.dry[e].moving(d @ y[:k], sign)
                right[:k] -= d * levels[e]
            else:
                right[:k] -= d * sign * (self.limit[w] - self.shift[w] @ turn[:2])
                matrix[:k, :3] += sign * np.outer(d, self.shift[w] @ self.M[:2, :3])
        if np.linalg.matrix_rank(rows) == len(rows):
            x = np.linalg.solve(matrix, right)
        else:
            x = np.linalg.lstsq(matrix, right, rcond=1e-13)[0]
        levels[held] = x[k : k + len(held)]
        levels[self.m :] = x[k + len(held) :] if mode[-1] == 0.0 else 0.0
        return x[:k], levels, turn

    def bounds(self, y, u, a, turn, slides):
        """(forward, backward) of every element at rest; slides: those that have given way."""
        both = np.zeros((self.m, 2))
        for e in range(self.m):
            if e < len(self.dry):
                own = self.dry[e]
                level = own.slide if e in slides and own.fall == 0.0 else own.hold
                both[e] = level + self.loss(y, u, own)
            else:
                both[e] = self.floor(e - len(self.dry), a, turn)
        return both

    def decided(self, y, u, mode, shrink=0.0):
        """(the mode after all that cannot hold has given way, accelerations then). shrink: a share by which levels are
        taken to be less."""
        mode, m = mode.copy(), self.m
        for e in np.flatnonzero(mode[:m]):  # what rests because others do
            mode[e] = 0.0 if self._implied(self.D[[e]], mode) else mode[e]
        if self.way is not None and self._implied(self.E, mode):
            mode[m] = 0.0
        at_rest, rows = self.at_rest(mode)
        slides, a, flat = set(), np.zeros(self.k), mode[m] == 0.0
        if not len(rows):
            return mode, a
        for _ in range(20):
            found = mode.copy()
            for _ in range(200):  # loads depend on the acceleration
                force, turn, _ = self.smooth(y, u, mode)
                for e in np.flatnonzero(mode[:m]):
                    w = e - len(self.dry)
                    level = self.floor(w, a, turn) if w >= 0 else self.dry[e].moving(self.D[e] @ y[: self.k], mode[e])
                    force = force - self.D[e] * mode[e] * level
                both = self.bounds(y, u, a, turn, slides)[at_rest] * (1.0 - shrink) + 1e-15
                levels = self._levels(m in slides) * (1.0 - shrink) if flat else None
                plane = self.root @ self.E.T if flat else None
                r, q = least(self.root @ self.D[at_rest].T, self.root @ force, (-both[:, 1], both[:, 0]), plane, levels)
                before, a = a, np.linalg.solve(self.M, force - self.D[at_rest].T @ r - self.E.T @ q)
                if np.abs(a - before).max() <= 1e-12 * (1.0 + np.abs(a).max()):
                    break
            speeds = self.D[at_rest] @ a
            moves, far = np.abs(speeds) > MOVES, np.hypot(*a[:2]) if flat else 0.0
            if not shrink:
                self.least = min([self.least, *(np.abs(speeds[moves]) - MOVES)])
            found[at_rest[moves]] = np.sign(speeds[moves])
            new = set(at_rest[moves].tolist())
            if far > MOVES:
                found[m], new = 1.0, new | {m}
                self.least = self.least if shrink else min(self.least, far - MOVES)
            if new <= slides:
                break
            slides |= new
        if not shrink:
            self.least = min([self.least, *np.abs(self.margins(self._begun(y, mode, found, a), u, found))])
        return found, a

    def _begun(self, y, before, mode, a, speed=STARTS):
        """The state with a speed along the ellipse where that has just given way: there it has a direction."""
        if self.way is None or before[-1] != 0.0 or mode[-1] == 0.0:
            return y
        y = y.copy()
        y[:2] += speed / np.hypot(*a[:2]) * a[:2]
        rows = self.at_rest(mode)[1]
        y[2 : self.k] -= np.linalg.pinv(rows[:, 2:]) @ (rows @ y[: self.k])  # rims that grip go with it
        return y

    def _implied(self, directions, mode):
        """Whether what is at rest leaves these directions no speed."""
        rows = self.at_rest(mode)[1]
        if not len(rows):
            return False
        return bool(np.abs(directions - np.linalg.lstsq(rows.T, directions.T, rcond=1e-9)[0].T @ rows).max() < 1e-9)

    def _levels(self, slides):
        """Of the ellipse at rest, or as it gives way."""
        return self.way.slide if slides and self.way.fall == 0.0 else self.way.hold

    def margins(self, y, u, mode):
        """How far what holds is from giving way [N]: each, or all together where they share their load."""
        held, rows = self.at_rest(mode)
        if not len(rows):
            return np.zeros(0)
        a, r, turn = self.solve(y, u, mode)
        both, flat = self.bounds(y, u, a, turn, set())[held], mode[-1] == 0.0
        levels = self.way.hold if flat else None
        if np.linalg.matrix_rank(rows) == len(rows):
            each = np.minimum(both[:, 0] - r[held], both[:, 1] + r[held])
            return np.append(each, min(levels) * (1.0 - np.hypot(*(r[self.m :] / levels)))) if flat else each
        load = np.append(r[held], r[self.m :]) if flat else r[held]
        return np.array([room(rows, load, both, levels)])

    def run(self, voltage, dt, twist=(0.0, 0.0, 0.0)):
        """Twist, rim speeds and contacts after each row, shapes (rows + 1, 3), (rows + 1, n), (rows + 1, n); `pose`
        then has the places (x, y, heading), shape (rows + 1, 3), and `current` the currents of windings."""
        y = np.concatenate([twist, self.G.T @ twist, np.zeros(self.n + self.bent + 3)])
        mode = np.sign(self.D @ y[: self.k])
        mode[len(self.dry) :] = 0.0
        mode = np.append(mode, 1.0 if self.way is None or np.hypot(*y[:2]) > 0.0 else 0.0)
        found, marks = [y.copy()], [mode[len(self.dry) : self.m].copy()]
        for u in voltage:
            left = dt
            y, mode = self._going(y, u, mode)
            while left > 1e-13:
                y, mode, took = self._to_event(y, u, mode, left)
                left -= took
            found.append(y.copy())
            marks.append(mode[len(self.dry) : self.m].copy())
        found = np.array(found)
        self.pose, self.current = found[:, -3:], found[:, self.k : self.k + self.n]
        return found[:, :3], found[:, 3 : self.k], np.array(marks)

    def _going(self, y, u, mode, shrink=0.0):
        """(state, mode) after all has given way."""
        found, a = self.decided(y, u, mode, shrink)
        return self._begun(y, mode, found, a), found

    def _creeping(self, y, u, mode, left):
        """(state, mode, time taken) of an ellipse that a rising load has just moved, v' = w t: held for a moment, until
        it would run at CREEPS, and then at v' t/2. Slower it turns too fast for DOP853."""
        took, wait, speed = 0.0, min(1e-5, 0.5 * left), 0.0
        for _ in range(2):
            y, took = self._advance(y, u, mode, wait, []).y[:, -1], took + wait
            found, a = self.decided(y, u, mode, 0.0 if speed else 1e-6)
            speed = 0.5 * np.hypot(*a[:2]) * took
            wait = min(max(took * (np.sqrt(CREEPS / max(speed, 1e-300)) - 1.0), 0.0), LONGEST, 0.5 * (left - took))
        return self._begun(y, mode, found, a, max(speed, STARTS)), found, took

    def _to_event(self, y, u, mode, left):
        (held, rows), moving = self.at_rest(mode), np.flatnonzero(mode[: self.m])
        each = len(rows) and np.linalg.matrix_rank(rows) == len(rows)
        loads = (len(held) + (mode[-1] == 0.0)) if each else min(len(rows), 1)

        def stop(e):
            return lambda t, z: self.D[e] @ z[: self.k] * mode[e] + TINY

        def release(j):
            return lambda t, z: self.margins(z, u, mode)[j]

        events = [stop(e) for e in moving] + [release(j) for j in range(loads)]
        if self.way is not None and mode[-1] != 0.0:
            events.append(lambda t, z: np.hypot(z[0], z[1]) - STOPPED)
        for event in events:
            event.terminal, event.direction = True, -1.0
        out = self._advance(y, u, mode, left, events)
        z, took, mode = out.y[:, -1].copy(), out.t[-1], mode.copy()
        if out.status == 1:
            pushed, shrink = self.solve(z, u, mode)[1], 0.0
            for j in np.flatnonzero([len(times) > 0 for times in out.t_events]):
                if j < len(moving):
                    mode[moving[j]] = 0.0
                elif j == len(moving) + loads:
                    mode[-1] = 0.0
                elif each and j < len(moving) + len(held):
                    mode[held[j - len(moving)]] = np.sign(pushed[held[j - len(moving)]])
                else:
                    shrink = 1e-6
            z = self._still(z, mode)
            if shrink and each and np.array_equal(self._levels(True), self.way.hold):
                z, mode, more = self._creeping(z, u, mode, left - took)
                took += more
            else:
                z, mode = self._going(z, u, mode, shrink)
        return self._still(z, mode), mode, took

    def _advance(self, y, u, mode, time, events):
        """Integrate a mode."""

        def rate(_, z):
            a = self.solve(z, u, mode)[0]
            cos, sin = np.cos(z[-1]), np.sin(z[-1])
            place = [cos * z[0] - sin * z[1], sin * z[0] + cos * z[1], z[2]]
            return np.concatenate([a, self.currents(z, u)[1], self.smooth(z, u, mode)[2], place])

        return solve_ivp(rate, (0.0, time), y, method="DOP853", rtol=1e-10, atol=1e-12, max_step=0.02, events=events)

    def _still(self, z, mode):
        """The state without what is left of the speeds of what rests."""
        rows = self.at_rest(mode)[1]
        z[: self.k] -= np.linalg.pinv(rows) @ (rows @ z[: self.k])
        return z
