"""A simulator that shares no code with omnidyn: modes of stick and slip, events by bisection, RK4 between them.

A robot here is a `World`: plain numbers. With rim speeds s = G' v (v the body twist), wheel i pushes with
f_i = a_i (u_i - e_i s_i), cut where its current meets its limit, a = l K_t/(R r), e = l K_v/r:

    (D + G J G') v' = G f - viscous - dry + m w (v_y, -v_x, 0)

D = diag(m, m, I), J = diag((J_rotor l^2 + J_wheel)/r^2). Dry friction: a box (each body axis for itself) or an
ellipse of the direction of travel plus yaw. What sticks keeps its speed at exactly 0 as long as the force that holds
it there is within its level; the instant at which something sticks or lets go is found by halving the step down to
SHORTEST. In the plane friction turns with the motion: what is slower than CREEP and can be held is at rest.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numba
import numpy as np

STEP, SHORTEST = 1e-3, 1e-6  # [s]
CREEP = 3e-5  # [m/s] below it the plane rests where friction can hold it: an ellipse turns ever faster as it stops
BOX, ELLIPSE = 0, 1


@dataclass(frozen=True)
class World:
    """The truth. azimuth, roller [degree], radii [m], per wheel; coulomb, viscous (3,) along x, y and about yaw."""

    azimuth: tuple[float, ...]
    wheel_radius: tuple[float, ...]
    robot_radius: tuple[float, ...]
    mass: float
    inertia: float
    resistance: float
    torque_constant: float
    gear_ratio: float
    voltage_limit: float
    coulomb: tuple[float, float, float]
    viscous: tuple[float, float, float]
    shape: int = ELLIPSE
    roller: tuple[float, ...] = ()
    rotor_inertia: float = 0.0
    current_limit: float = np.inf
    loop: tuple[float, float, float] = (0.0, 0.0, 0.0)  # kp [V s/rad], ki [V/rad], rate [Hz], on wheel speeds
    G: np.ndarray = field(init=False, compare=False)
    M: np.ndarray = field(init=False, compare=False)

    def __post_init__(self) -> None:
        # Where the wheel pushes: across its arm, turned by the roller's angle; what rolls freely is the roller.
        phi, alpha = np.radians(self.azimuth), np.radians(self.roller or (0.0,) * len(self.azimuth))
        b = np.array(self.robot_radius)
        G = np.stack([-np.sin(phi) - np.tan(alpha) * np.cos(phi), np.cos(phi) - np.tan(alpha) * np.sin(phi), b])
        object.__setattr__(self, "G", G)
        own = self.rotor_inertia * self.gear_ratio**2 / np.array(self.wheel_radius) ** 2
        object.__setattr__(self, "M", np.diag([self.mass, self.mass, self.inertia]) + (G * own) @ G.T)

    @property
    def push(self) -> np.ndarray:
        """Force at the rim per volt [N/V], per wheel."""
        return self.gear_ratio * self.torque_constant / (self.resistance * np.array(self.wheel_radius))

    @property
    def emf(self) -> np.ndarray:
        """Back-EMF per rim speed [V s/m], per wheel; K_v = K_t."""
        return self.gear_ratio * self.torque_constant / np.array(self.wheel_radius)


@dataclass(frozen=True)
class Motion:
    """What happened at the n + 1 row times: twist, path (integral of the twist), pose; n voltages from there on."""

    t: np.ndarray
    twist: np.ndarray
    path: np.ndarray
    pose: np.ndarray
    voltage: np.ndarray


def drive(world: World, command: np.ndarray, dt: float, looped: bool = False, step: float = STEP) -> Motion:
    """From rest under commands (n, wheels) held for dt each: volts, or wheel speeds [rad/s] of the firmware's loop.

    step [s]: the longest of RK4."""
    n = len(command)
    states, volts = np.zeros((n + 1, 9)), np.zeros(command.shape)
    kp, ki, rate = world.loop
    inverse = np.linalg.inv(world.M)
    _run(
        np.ascontiguousarray(command, dtype=float),
        dt,
        step,
        world.G,
        world.M,
        inverse,
        world.mass,
        world.push,
        world.emf,
        world.resistance,
        world.current_limit,
        np.array(world.coulomb),
        np.array(world.viscous),
        world.shape,
        looped,
        kp,
        ki,
        rate or 1.0,
        world.voltage_limit,
        np.array(world.wheel_radius),
        states,
        volts,
    )
    return Motion(np.arange(n + 1) * dt, states[:, :3], states[:, 3:6], states[:, 6:], volts)


def currents(world: World, twist: np.ndarray, voltage: np.ndarray) -> np.ndarray:
    """Motor currents [A] at twists (n, 3) under voltages (n, wheels)."""
    return np.clip(
        (voltage - world.emf * (twist @ world.G)) / world.resistance, -world.current_limit, world.current_limit
    )


@numba.njit(cache=True)
def _applied(v, u, G, mass, push, emf, resistance, limit, viscous, out):
    """All forces but dry friction, into out (3,)."""
    out[0] = -viscous[0] * v[0] + mass * v[2] * v[1]
    out[1] = -viscous[1] * v[1] - mass * v[2] * v[0]
    out[2] = -viscous[2] * v[2]
    for i in range(G.shape[1]):
        s = G[0, i] * v[0] + G[1, i] * v[1] + G[2, i] * v[2]
        amps = min(max((u[i] - emf[i] * s) / resistance, -limit), limit)
        f = push[i] * resistance * amps
        for a in range(3):
            out[a] += G[a, i] * f


@numba.njit(cache=True)
def _rate(v, stuck, sign, u, G, M, Minv, mass, push, emf, resistance, limit, coulomb, viscous, shape, force, out):
    """Acceleration into out, with what is stuck held; the force that holds it into `force`."""
    _applied(v, u, G, mass, push, emf, resistance, limit, viscous, force)
    if shape == ELLIPSE and not stuck[0]:
        size = np.sqrt((coulomb[0] * v[0]) ** 2 + (coulomb[1] * v[1]) ** 2)
        if size > 0.0:
            force[0] -= coulomb[0] ** 2 * v[0] / size
            force[1] -= coulomb[1] ** 2 * v[1] / size
        else:  # only just let go: against the push itself
            load = np.sqrt((force[0] / coulomb[0]) ** 2 + (force[1] / coulomb[1]) ** 2)
            if load > 0.0:
                force[0] -= force[0] / load
                force[1] -= force[1] / load
    elif shape == BOX:
        for a in range(2):
            if not stuck[a]:
                force[a] -= sign[a] * coulomb[a]
    if not stuck[2]:
        force[2] -= sign[2] * coulomb[2]
    free = [a for a in range(3) if not stuck[a]]
    out[:] = 0.0
    if len(free) == 3:
        for a in range(3):
            out[a] = Minv[a, 0] * force[0] + Minv[a, 1] * force[1] + Minv[a, 2] * force[2]
    elif len(free) > 0:
        k = len(free)
        own, right = np.zeros((k, k)), np.zeros(k)
        for i in range(k):
            right[i] = force[free[i]]
            for j in range(k):
                own[i, j] = M[free[i], free[j]]
        found = np.linalg.solve(own, right)
        for i in range(k):
            out[free[i]] = found[i]
    for a in range(3):
        if stuck[a]:
            force[a] -= M[a, 0] * out[0] + M[a, 1] * out[1] + M[a, 2] * out[2]


@numba.njit(cache=True)
def _slope(y, stuck, sign, args, force, out):
    u, G, M, Minv, mass, push, emf, resistance, limit, coulomb, viscous, shape = args
    _rate(
        y[:3], stuck, sign, u, G, M, Minv, mass, push, emf, resistance, limit, coulomb, viscous, shape, force, out[:3]
    )
    c, s = np.cos(y[8]), np.sin(y[8])
    out[3], out[4], out[5] = y[0], y[1], y[2]
    out[6], out[7], out[8] = c * y[0] - s * y[1], s * y[0] + c * y[1], y[2]


@numba.njit(cache=True)
def _rk4(y, h, stuck, sign, args, force):
    k1, k2, k3, k4 = np.zeros(9), np.zeros(9), np.zeros(9), np.zeros(9)
    _slope(y, stuck, sign, args, force, k1)
    _slope(y + 0.5 * h * k1, stuck, sign, args, force, k2)
    _slope(y + 0.5 * h * k2, stuck, sign, args, force, k3)
    _slope(y + h * k3, stuck, sign, args, force, k4)
    return y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


@numba.njit(cache=True)
def _overload(force, stuck, coulomb, shape):
    """By how much what is stuck is loaded beyond its level: (plane, x, y, yaw); above 0 it lets go."""
    plane = x = y = yaw = -1.0
    if shape == ELLIPSE and stuck[0]:
        plane = np.sqrt((force[0] / coulomb[0]) ** 2 + (force[1] / coulomb[1]) ** 2) - 1.0
    if shape == BOX and stuck[0]:
        x = abs(force[0]) - coulomb[0]
    if shape == BOX and stuck[1]:
        y = abs(force[1]) - coulomb[1]
    if stuck[2]:
        yaw = abs(force[2]) - coulomb[2]
    return plane, x, y, yaw


@numba.njit(cache=True)
def _release(y, stuck, sign, args, force, out):
    """Let go of what is loaded beyond its level, one after another."""
    coulomb, shape = args[9], args[11]
    for _ in range(4):
        _slope(y, stuck, sign, args, force, out)
        loads = _overload(force, stuck, coulomb, shape)
        most = max(loads[0], max(loads[1], max(loads[2], loads[3])))
        if most <= 0.0:
            return
        if loads[0] == most:
            stuck[0] = stuck[1] = False
        elif loads[1] == most:
            stuck[0], sign[0] = False, np.sign(force[0])
        elif loads[2] == most:
            stuck[1], sign[1] = False, np.sign(force[1])
        else:
            stuck[2], sign[2] = False, np.sign(force[2])


@numba.njit(cache=True)
def _stops(y0, y1, stuck, sign, shape):
    """Which of (plane, x, y, yaw) comes to rest between two states: an axis whose speed leaves its sign."""
    plane = x = y = False
    if shape == ELLIPSE:
        if not stuck[0] and (y0[0] != 0.0 or y0[1] != 0.0):
            plane = y0[0] * y1[0] + y0[1] * y1[1] <= 0.0
    else:
        x = not stuck[0] and y1[0] * sign[0] < 0.0
        y = not stuck[1] and y1[1] * sign[1] < 0.0
    return plane, x, y, not stuck[2] and y1[2] * sign[2] < 0.0


@numba.njit(cache=True)
def _settles(y, stuck, sign, args, force, out):
    """Whether the plane creeps, and rests if it is held. An ellipse only."""
    if args[11] != ELLIPSE or stuck[0] or not 0.0 < np.hypot(y[0], y[1]) < CREEP:
        return False
    rest, held = y.copy(), stuck.copy()
    rest[0] = rest[1] = 0.0
    held[0] = held[1] = True
    _slope(rest, held, sign, args, force, out)
    return _overload(force, held, args[9], args[11])[0] < 0.0


@numba.njit(cache=True)
def _advance(y, span, step, stuck, sign, args, force):
    """Over a span of constant voltage."""
    coulomb, shape, scrap = args[9], args[11], np.zeros(9)
    left = span
    h = min(step, span)
    _release(y, stuck, sign, args, force, scrap)
    while left > 1e-12:
        h = min(min(h, step), left)
        z = _rk4(y, h, stuck, sign, args, force)
        stops = _stops(y, z, stuck, sign, shape)
        happens = stops[0] or stops[1] or stops[2] or stops[3]
        _slope(z, stuck, sign, args, force, scrap)
        loads = _overload(force, stuck, coulomb, shape)
        happens = happens or max(loads[0], max(loads[1], max(loads[2], loads[3]))) > 0.0
        slow = shape == ELLIPSE and not stuck[0] and np.hypot(z[0], z[1]) < 8.0 * h  # it turns fast where it is slow
        if (happens or (slow and h > 2e-5)) and h > SHORTEST:
            h = 0.5 * h
            continue
        y[:] = z
        left -= h
        settles = _settles(y, stuck, sign, args, force, scrap)
        if happens or settles:
            if stops[0] or settles:
                y[0] = y[1] = 0.0
                stuck[0] = stuck[1] = True
            for a in range(2):
                if stops[1 + a]:
                    y[a], stuck[a] = 0.0, True
            if stops[3]:
                y[2], stuck[2] = 0.0, True
            _release(y, stuck, sign, args, force, scrap)
        h = 2.0 * h


@numba.njit(cache=True)
def _run(
    command,
    dt,
    step,
    G,
    M,
    Minv,
    mass,
    push,
    emf,
    resistance,
    limit,
    coulomb,
    viscous,
    shape,
    looped,
    kp,
    ki,
    rate,
    voltage_limit,
    radius,
    states,
    volts,
):
    count = G.shape[1]
    y, force, u = np.zeros(9), np.zeros(3), np.zeros(count)
    stuck, sign, total = np.array([True, True, True]), np.zeros(3), np.zeros(count)
    ticks = 0
    for n in range(len(command)):
        if not looped:
            u[:] = command[n]
        now, end, first = n * dt, (n + 1) * dt, True
        while now < end - 1e-12:
            until = end
            if looped:
                if now >= ticks / rate - 1e-12:
                    ticks += 1
                    for i in range(count):
                        speed = (G[0, i] * y[0] + G[1, i] * y[1] + G[2, i] * y[2]) / radius[i]
                        error = command[n, i] - speed
                        more = total[i] + ki * error / rate  # [V]; not where that pushes further into the limit
                        if abs(kp * error + more) <= voltage_limit or (kp * error + more) * error < 0.0:
                            total[i] = more
                        u[i] = min(max(kp * error + total[i], -voltage_limit), voltage_limit)
                until = min(end, ticks / rate)
            if first:  # a current that is logged with the row is driven by this voltage
                volts[n], first = u, False
            args = (u, G, M, Minv, mass, push, emf, resistance, limit, coulomb, viscous, shape)
            _advance(y, until - now, step, stuck, sign, args, force)
            now = until
            if now == end or abs(now - end) < 1e-12:
                break
        states[n + 1] = y
