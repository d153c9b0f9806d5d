"""Exact motion with winding inductance, against integrators and exponentials that know none of its formulas."""

import math
from collections import Counter
from dataclasses import dataclass, field
from itertools import product

import mpmath as mp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from omnidyn.errors import InputError
from omnidyn.model.friction import AxesFriction, Friction
from omnidyn.model.robot import Robot
from omnidyn.simulation.exact.exact_march import ExactMarch
from omnidyn.simulation.exact.inductance import axis_laws, current_gain, simulate_exact_inductance
from omnidyn.simulation.exact.inductance_step import AxisLaw, response
from tests.support.robots import TABLE_3, random_program, random_robot, robot_of, with_breakaway

INDUCTANCES = (1.1e-4, 2e-3, 2e-2)
RATIOS = (1.0, 1.3)
STEPS = (1e-3, 5e-3, 50e-3)
TOLERANCE = 1e-12  # m/s, rad/s, m, rad
ZERO = np.zeros(3)


def dynamic(robot: Robot, inductance: float) -> Robot:
    """The robot with its windings' inductance [H] kept."""
    motor = robot.motor.model_copy(update={"inductance": inductance, "electrical": "dynamic"})
    return robot.model_copy(update={"motor": motor})


def table_3(inductance: float, ratio: float) -> Robot:
    """The paper's robot, breakaway = ratio * coulomb."""
    return dynamic(robot_of(with_breakaway(TABLE_3, ratio)), inductance)


def one_step(robot, state, h, parts=1):
    """(twist, pose, current) after h [s] in equal parts from a state (twist, current, voltage)."""
    twist, current, voltage = state
    rows = np.tile(voltage, (parts, 1))
    return [x[-1] for x in simulate_exact_inductance(robot, rows, np.full(parts, h / parts), twist, ZERO, current)]


# --- a reference: twist, n currents and pose by DOP853, mode by mode ------------------------------------------------


@dataclass
class Reference:
    """Integrates M v' = G l K_t i/r - B v - C s and L i' = u - R i - K_v l G^T v/r; s is fixed between events.

    scipy finds an event, Newton on fresh integrations places it. Turning points of the speeds end a piece too, so
    that no speed dips through 0 unseen. seen: stops, releases, dips (stopped, and on in the old direction).
    margin: the nearest to its edge that a decision came: a grazing minimum, or a stop with f at breakaway.
    """

    robot: Robot
    seen: Counter = field(default_factory=Counter)
    margin: float = math.inf

    def __post_init__(self):
        r, m = self.robot, self.robot.motor
        mass = np.array([r.body.mass, r.body.mass, r.body.inertia])
        matrix, per_rim = r.wheels.wrench_matrix, m.gear_ratio / r.wheels.wheel_radius
        self.n = 3 + r.wheels.count
        viscous, self.coulomb, self.breakaway = (level / mass for level in r.friction.axes.levels)
        self.push = matrix * (m.torque_constant * per_rim) / mass[:, None]
        self.matrix = np.zeros((self.n, self.n))
        self.matrix[:3, :3], self.matrix[:3, 3:] = -np.diag(viscous), self.push
        self.matrix[3:, :3] = -matrix.T * (m.emf_constant * per_rim / m.inductance)
        self.matrix[3:, 3:] = -np.eye(r.wheels.count) * m.resistance / m.inductance

    def step(self, z, u, h):
        """State (twist, currents, pose) after a step h under voltages u."""
        before, stopped, t = z[:3].copy(), np.zeros(3, bool), 0.0
        f = self.force(z)
        mode = np.where(z[:3] != 0.0, np.sign(z[:3]), np.sign(f) * (np.abs(f) > self.breakaway))
        rising = (z[:3] == 0.0) | (mode * self.rate_of(mode, u)(0.0, z)[:3] > 0.0)
        while True:
            span, z, axis, kind = self.advance(z, mode, rising, u, h - t)
            t += span
            if kind == "end":
                break
            f = self.force(z)[axis]
            if kind == "stop":
                z[axis], stopped[axis] = 0.0, True
                mode[axis] = np.sign(f) if abs(f) > self.breakaway[axis] else 0.0
                self.margin = min(self.margin, abs(abs(f) - self.breakaway[axis]))
            elif kind == "release":
                mode[axis] = np.sign(f)
            else:
                self.margin = min(self.margin, abs(z[axis]))
            rising[axis] = not rising[axis] if kind == "turn" else True
            self.seen[kind] += kind != "turn"
        self.seen["dip"] += int(np.sum(stopped & (before * z[:3] > 0.0)))
        return z

    def force(self, z):
        """Acceleration that the currents give, or their derivative. Shape (3,)."""
        return self.push @ z[3 : self.n]

    def rate_of(self, mode, u):
        matrix = self.matrix * np.concatenate([mode != 0.0, np.ones(self.n - 3)])[:, None]
        constant = np.concatenate([-self.coulomb * mode, np.asarray(u) / self.robot.motor.inductance])

        def rate(_, z):
            cos, sin = math.cos(z[-1]), math.sin(z[-1])
            return np.concatenate(
                [matrix @ z[: self.n] + constant, [cos * z[0] - sin * z[1], sin * z[0] + cos * z[1], z[2]]]
            )

        return rate

    def watches(self, z, mode, rising, rate):
        """(axis, kind, function, direction) of all that can end this piece."""
        growth, found = self.force(rate(0.0, z)), []
        for j, s in enumerate(mode):
            if s == 0.0:
                side = np.sign(growth[j])
                level = self.breakaway[j]
                found.append((j, "release", lambda t, y, j=j, s=side, S=level: s * self.force(y)[j] - S, 1))
                continue
            if not rising[j]:
                found.append((j, "stop", lambda t, y, j=j, s=s: s * y[j], -1))
            noise = 1e-12 * (1.0 + self.coulomb[j]) * rising[j]  # at release with S = c it rises from exactly 0
            turns = lambda t, y, j=j, s=s, e=noise: s * rate(t, y)[j] + e  # noqa: E731
            found.append((j, "turn", turns, -1 if rising[j] else 1))
        for _, _, function, direction in found:
            function.terminal, function.direction = True, direction
        return found

    def advance(self, z, mode, rising, u, h):
        """(time, state, axis, kind) of the first event within h, or of the end."""
        rate = self.rate_of(mode, u)
        watches, finest = self.watches(z, mode, rising, rate), h / 10
        while True:
            found = integrate(rate, z, h, events=[function for _, _, function, _ in watches], max_step=finest)
            t, end = found.t[-1], found.y[:, -1]
            if found.status == 0:
                return t, end, 0, "end"
            axis, kind, function, _ = watches[next(i for i, times in enumerate(found.t_events) if len(times))]
            if np.all((mode * end[:3] > -1e-14) | ((np.arange(3) == axis) & (kind == "stop"))):
                break
            h, finest = t, t / 7  # a speed fell through 0 and came back within one step of DOP853: end it in between
        if kind == "turn":
            return t, end, axis, kind
        for _ in range(3):
            slope = rate(0.0, end)[axis] if kind == "stop" else self.force(rate(0.0, end))[axis]
            t = max(t - function(0.0, end) / (slope * (mode[axis] or np.sign(slope))), 0.0)
            end = integrate(rate, z, t).y[:, -1] if t > 0.0 else z.copy()
        return t, end, axis, kind


def integrate(rate, z, h, **options):
    return solve_ivp(rate, (0.0, h), z, "DOP853", rtol=3e-14, atol=1e-16, **options)


def reference_run(robot, voltage, dt, twist, current):
    """(twists, poses, currents, Reference) of a robot that starts at the origin."""
    reference = Reference(robot)
    rows = [np.concatenate([twist, current, ZERO])]
    for u, h in zip(voltage, dt, strict=True):
        rows.append(reference.step(rows[-1].copy(), u, h))
    rows = np.array(rows)
    return rows[:, :3], rows[:, -3:], rows[:, 3:-3], reference


# --- states in which something happens ------------------------------------------------------------------------------


def draw_axis(random, law, h):
    """(v, f, g) of one axis that dips, is released, reverses, or does anything, within a step h."""
    _, c, top, _, lag = law
    kind, short = random.integers(4), min(h, 1.0 / lag)
    if kind == 0:  # f comes back to c at `back`; by then v would have lost `drop`
        g, back = random.uniform(1.5, 15) * top, random.uniform(0.05, 0.6) * short
        f = g - (g - c) * math.exp(lag * back)
        drop = (c - g) * back - (g - f) * math.expm1(-lag * back) / lag
        return random.uniform(0.05, 0.95) * drop, f, g
    if kind == 1:
        g = random.uniform(1.1, 10) * top
        return 0.0, max(g - (g - top) * math.exp(lag * random.uniform(0.0, 1.2) * min(h, 3.0 / lag)), -0.99 * top), g
    if kind == 2:
        return 10 ** random.uniform(-4, 0), random.uniform(-5, 1) * c, random.uniform(-15, 1) * c
    return random.normal(0, 1), random.normal(0, 5) * c, random.normal(0, 8) * c


def draw_state(random, robot, h):
    """(twist, current, voltage) of three wheels; each axis is drawn for itself, in either direction."""
    drawn = [random.choice([-1.0, 1.0]) * np.array(draw_axis(random, law, h)) for law in axis_laws(robot)]
    v, f, g = np.transpose(drawn)
    gain = current_gain(robot)
    return v, np.linalg.solve(gain, f), np.linalg.solve(gain / robot.motor.resistance, g)


CASES = pytest.mark.parametrize("inductance, ratio, h", list(product(INDUCTANCES, RATIOS, STEPS)))


# --- tests ------------------------------------------------------------------------------------------------------------


SWINGING = [(0.1, 1.3, 0.05), (0.1, 1.0, 0.9), (0.5, 1.3, 2.0)]  # complex roots; the last two turn more than once


@pytest.mark.parametrize("inductance, ratio, h", [*product(INDUCTANCES, RATIOS, STEPS), *SWINGING])
@pytest.mark.some(7)
def test_meets_dop853_with_stops_dips_and_releases_inside_the_step(inductance, ratio, h):
    robot, random = table_3(inductance, ratio), np.random.default_rng(int(1e6 * inductance + 10 * ratio + 1e4 * h))
    seen, worst = Counter(), np.zeros(3)
    while min(seen["stop"], seen["dip"], seen["release"]) < 10:
        twist, current, voltage = draw_state(random, robot, h)
        *want, reference = reference_run(robot, voltage[None], [h], twist, current)
        if reference.margin < 1e-9:
            continue
        got = one_step(robot, (twist, current, voltage), h)
        worst = np.maximum(worst, [np.abs(a - b[-1]).max() for a, b in zip(got, want, strict=True)])
        assert np.array_equal(got[0] == 0.0, want[0][-1] == 0.0)  # rest is exact, and nothing else is 0
        seen += reference.seen
    print(f"L {inductance:g} S/c {ratio} h {h}: m/s {worst[0]:.1e}, m {worst[1]:.1e}, A {worst[2]:.1e}, {dict(seen)}")
    assert worst[0] <= TOLERANCE
    assert worst[1] <= TOLERANCE
    assert worst[2] <= 20 * TOLERANCE  # of currents of up to 100 A, by DOP853 at its limit


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.some(2)
def test_meets_dop853_over_programs_of_random_robots(seed):
    physical = random_robot(seed)
    robot, random = dynamic(robot_of(physical), (2e-3, 2e-2)[seed % 2]), np.random.default_rng(seed)
    voltage = random_program(seed, 6000, robot.wheels.count)[:: 6000 // 40]
    dt = 10 ** random.uniform(-3, -1.3, len(voltage))
    start = random.normal(0, 0.3, 3), random.normal(0, 1, robot.wheels.count)
    twists, poses, currents, reference = reference_run(robot, voltage, dt, *start)
    got = simulate_exact_inductance(robot, voltage, dt, start[0], ZERO, start[1])
    assert reference.margin > 1e-9
    assert sum(reference.seen.values()) >= 8
    assert np.abs(got[0] - twists).max() <= TOLERANCE
    assert np.abs(got[1] - poses).max() <= TOLERANCE
    assert np.abs(got[2] - currents).max() <= 20 * TOLERANCE
    assert np.array_equal(got[0] == 0.0, twists == 0.0)


def exponential(law, t, v, f, g, s):
    """(v, f, integral of v) at t by a 40-digit matrix exponential of the system with its constants as states."""
    b, c, _, k, n = map(mp.mpf, map(float, law))
    system = mp.matrix([[-b, 1, 0, -s * c], [-n * k, -n, 0, n * mp.mpf(float(g))], [1, 0, 0, 0], [0, 0, 0, 0]])
    return mp.expm(system * mp.mpf(float(t))) * mp.matrix([mp.mpf(float(v)), mp.mpf(float(f)), 0, 1])


@CASES
@pytest.mark.some(6)
def test_meets_matrix_exponentials_where_nothing_happens(inductance, ratio, h):
    robot, random, laws = table_3(inductance, ratio), np.random.default_rng(6), axis_laws(table_3(inductance, ratio))
    gain = current_gain(robot)
    for _ in range(5):
        s, v = random.choice([-1.0, 1.0], 3), random.uniform(4, 6, 3)
        f, g = random.uniform(5, 20, 3), random.uniform(10, 50, 3)
        state = s * v, np.linalg.solve(gain, s * f), np.linalg.solve(gain / robot.motor.resistance, s * g)
        twist, pose, current = one_step(robot, state, h)
        with mp.workdps(60):
            want = [exponential(law, h, *z, 1.0) for law, *z in zip(laws, v, f, g, strict=True)]
        assert np.abs(s * twist - [float(w[0]) for w in want]).max() <= 2e-14
        assert np.abs(s * (gain @ current) - [float(w[1]) for w in want]).max() <= 5e-13
        assert abs(s[2] * pose[2] - float(want[2][2])) <= 2e-15


def laws_of_all_kinds():
    """Random rates over nine decades; swinging, double, nearly double and stiff ones."""
    random = np.random.default_rng(7)
    for _ in range(60):
        b, k, lag = 10 ** random.uniform(-3, 2), 10 ** random.uniform(-3, 3), 10 ** random.uniform(-3, 6)
        yield AxisLaw(b, 0.0, 0.0, k, lag), 10 ** random.uniform(-6, 1)
    for offset in (0.0, 1e-15, 1e-9, -1e-9, 1e-4, -1e-4, 0.3, -0.3):
        for t in (1e-4, 0.01, 0.1, 1.0, 10.0):
            b, lag = 2.0, 50.0
            yield AxisLaw(b, 0.0, 0.0, (lag - b) ** 2 / (4 * lag) * (1 + offset), lag), t


def test_response_in_every_regime():
    for law, t in laws_of_all_kinds():
        got = response(t, law)
        with mp.workdps(50):
            b, _, _, k, n = map(mp.mpf, law)
            mean, root = -(b + n) / 2, mp.sqrt(((n - b) / 2) ** 2 - n * k + mp.mpf(10) ** -40)
            slow, fast, t_ = mean + root, mean - root, mp.mpf(t)
            kick = (mp.exp(slow * t_) - mp.exp(fast * t_)) / (slow - fast)
            phi = n * (mp.expm1(slow * t_) / slow - mp.expm1(fast * t_) / fast) / (slow - fast)
            total = [(mp.expm1(x * t_) / x - t_) / x for x in (slow, fast)]
            want = [mp.re(x) for x in (kick, phi, n * (total[0] - total[1]) / (slow - fast))]
        # kick passes through 0 in a swing, and decays to nothing: it is measured by what it can be.
        size = [min(t, 1.0 / float(abs(fast))), float(want[1]), float(want[2])]
        turns = 1.0 + abs(float(mp.im(root))) * t
        for value, exact, scale in zip(got, want, size, strict=True):
            assert abs(value - float(exact)) <= 4e-14 * turns * abs(scale) + 1e-300, (law, t)


@CASES
@pytest.mark.some(6)
def test_a_step_is_the_sum_of_its_parts(inductance, ratio, h):
    robot, random = table_3(inductance, ratio), np.random.default_rng(8)
    for _ in range(100):
        state = draw_state(random, robot, h)
        whole = one_step(robot, state, h)
        for parts in (2, 7):
            for got, want in zip(one_step(robot, state, h, parts), whole, strict=True):
                assert np.abs(got - want).max() <= 1e-13


def test_mirrored_inputs_give_mirrored_motion_bit_by_bit():
    robot, random = table_3(2e-2, 1.3), np.random.default_rng(9)
    for _ in range(200):
        state = draw_state(random, robot, 0.03)
        twist, pose, current = one_step(robot, state, 0.03)
        mirrored = one_step(robot, [-x for x in state], 0.03)
        assert np.array_equal(twist, -mirrored[0])
        assert pose[2] == -mirrored[1][2]
        assert np.array_equal(current, -mirrored[2])


@pytest.mark.parametrize("share", [0.5, 0.95])
@pytest.mark.parametrize("inductance", INDUCTANCES)
def test_held_below_breakaway_it_rests_exactly(inductance, share):
    robot = table_3(inductance, 1.3)
    voltage = np.linalg.solve(current_gain(robot) / robot.motor.resistance, share * axis_laws(robot)[:, 2])
    rows = np.tile(voltage, (60_000, 1))
    pose = np.array([1.0, -2.0, 0.5])
    twists, poses, currents = simulate_exact_inductance(robot, rows, np.full(60_000, 1e-3), ZERO, pose, ZERO)
    assert not twists.any()
    assert np.array_equal(poses, np.tile(pose, (60_001, 1)))
    assert np.allclose(currents[-1], voltage / robot.motor.resistance, rtol=1e-14)


def test_inductance_to_zero_meets_the_quasi_static_engine():
    voltage, dt = random_program(3, 2000, 3), np.full(2000, 1e-3)
    twists, poses = ExactMarch(robot_of(with_breakaway(TABLE_3, 1.0))).run(voltage, dt, ZERO, ZERO)
    errors = []
    for inductance in (1e-6, 1e-7, 1e-8, 1e-12):
        got = simulate_exact_inductance(table_3(inductance, 1.0), voltage, dt, ZERO, ZERO, ZERO)
        errors.append([np.abs(got[0] - twists).max(), np.abs(got[1] - poses).max()])
    slopes = np.log10(np.array(errors[:2]) / np.array(errors[1:3]))
    assert np.all(np.abs(slopes - 1.0) < 0.01), slopes  # of first order in L, as it must be
    assert np.max(errors[-1]) < 2e-10


def test_currents_that_drive_no_axis_settle_by_themselves(four_wheel):
    robot = dynamic(four_wheel, 2e-3)
    against = np.array([1.0, -1.0, 1.0, -1.0])  # 90 degrees apart, these four cancel on every axis
    start, voltage, dt = 0.7 * against, 3.0 * against, np.array([1e-3, 5e-3, 0.05, 2e-4])
    twists, poses, currents = simulate_exact_inductance(robot, np.tile(voltage, (4, 1)), dt, ZERO, ZERO, start)
    end, rate = 3.0 / robot.motor.resistance, robot.motor.resistance / robot.motor.inductance
    t = np.concatenate([[0.0], np.cumsum(dt)])
    want = (end + (0.7 - end) * np.exp(-rate * t))[:, None] * against
    assert not twists.any()
    assert not poses.any()
    assert np.abs(currents - want).max() <= 1e-15


def test_four_wheels_move_as_the_same_motors_without_internal_currents(four_wheel):
    robot, random = dynamic(four_wheel, 2e-3), np.random.default_rng(10)
    against = np.array([1.0, -1.0, 1.0, -1.0])
    voltage, dt = random.uniform(-6, 6, (300, 4)), np.full(300, 2e-3)
    plain = simulate_exact_inductance(robot, voltage, dt, ZERO, ZERO, np.zeros(4))
    tense = simulate_exact_inductance(robot, voltage + against, dt, ZERO, ZERO, 2.0 * against)
    assert np.abs(plain[0] - tense[0]).max() <= 1e-13
    assert np.abs((tense[2] - plain[2])[-1] - against / robot.motor.resistance).max() <= 1e-13


def sticking_and_slipping(resistance, inductance):
    """A robot whose windings ring, breakaway twice coulomb, and a voltage that drives it along x at 2.05 coulomb."""
    robot = table_3(inductance, 2.0)
    motor = robot.motor.model_copy(update={"resistance": resistance})
    axes = AxesFriction(viscous=(0.0, 0.0, 0.0), coulomb=(2.2, 1.5, 0.099), breakaway=(4.4, 3.0, 0.198))
    robot = robot.model_copy(update={"motor": motor, "friction": Friction(axes=axes)})
    return robot, np.linalg.solve(current_gain(robot) / resistance, [2.05 * 2.2 / 1.5, 0.0, 0.0])


def test_stick_and_slip_inside_one_step():
    robot, voltage = sticking_and_slipping(0.2, 0.1)
    *want, reference = reference_run(robot, voltage[None], [12.3], ZERO, ZERO)
    got = one_step(robot, (ZERO, ZERO, voltage), 12.3)
    assert reference.seen["release"] >= 5
    assert reference.seen["stop"] >= 5
    for a, b in zip(got, want, strict=True):
        assert np.abs(a - b[-1]).max() <= 1e-11
    swings = one_step(robot, (ZERO, ZERO, voltage), 12.3, 1000)  # the same, most steps without an event
    assert np.abs(got[0] - swings[0]).max() <= 1e-12
    assert np.abs(got[1] - swings[1]).max() <= 1e-12


def test_refuses_a_step_that_chatters_or_turns_too_far():
    robot, voltage = sticking_and_slipping(0.01, 1e-4)
    with pytest.raises(InputError, match="sticks and slips too often in one step"):
        one_step(robot, (ZERO, ZERO, voltage), 3600.0)
    with pytest.raises(InputError, match="turns the robot too far"):
        one_step(table_3(2e-3, 1.0), (np.array([0.0, 0.0, 1e6]), ZERO, ZERO), 1.0)


def test_steady_turning_keeps_its_heading_and_circle():
    robot = table_3(2e-3, 1.0)
    b, c, _, k, _ = axis_laws(robot).T
    speed = np.array([0.5, 0.0, 3.0])
    f = np.where(speed > 0.0, b * speed + c, 0.0)
    gain = current_gain(robot)
    voltage = np.linalg.solve(gain / robot.motor.resistance, f + k * speed)
    count, dt = 100_000, 1e-3
    twists, poses, _ = simulate_exact_inductance(
        robot, np.tile(voltage, (count, 1)), np.full(count, dt), speed, ZERO, np.linalg.solve(gain, f)
    )
    turned = speed[2] * count * dt
    assert np.abs(twists - speed).max() <= 1e-13
    assert abs(poses[-1, 2] - turned) <= 1e-11
    circle = speed[0] / speed[2] * np.array([math.sin(turned), 1.0 - math.cos(turned)])
    assert np.abs(poses[-1, :2] - circle).max() <= 1e-11


def test_steps_equal_but_for_rounding_are_no_worse():
    """dt from the differences of large times, as logs have: against each step by itself."""
    robot, voltage = table_3(1.1e-4, 1.0), random_program(4, 300, 3)
    dt = np.diff(1e5 + np.arange(301) * 1e-3)
    assert 2 <= len(np.unique(dt)) <= 20
    twists, poses, currents = simulate_exact_inductance(robot, voltage, dt, ZERO, ZERO, ZERO)
    for k in range(300):
        alone = simulate_exact_inductance(robot, voltage[k : k + 1], dt[k : k + 1], twists[k], poses[k], currents[k])
        assert np.abs(alone[1][1] - poses[k + 1]).max() <= 1e-15
        assert np.abs(alone[0][1] - twists[k + 1]).max() <= 1e-15


def test_equal_steps_straight_on_and_then_in_a_spin():
    robot = table_3(2e-3, 1.0)
    voltage = np.array([[0.0, 3.0, -3.0], [0.0, 3.0, -3.0], [6.0, 6.0, 2.0], [6.0, 6.0, 2.0], [6.0, 6.0, 2.0]])
    start = np.array([0.3, 0.0, 0.0]), ZERO, ZERO
    twists, poses, _ = simulate_exact_inductance(robot, voltage, np.full(5, 3.0), *start)
    _, fine, _ = simulate_exact_inductance(robot, np.repeat(voltage, 3000, axis=0), np.full(15_000, 1e-3), *start)
    assert abs(twists[2, 2]) == 0.0
    assert abs(twists[-1, 2]) * 3.0 > 20.0
    assert np.abs(fine[::3000] - poses).max() <= 1e-11


def test_long_steps_of_a_fast_turning_robot():
    robot = table_3(1.1e-4, 1.0)
    state = np.array([1.0, -0.5, 40.0]), np.array([1.0, -2.0, 0.5]), np.array([6.0, 5.0, 6.0])
    whole, parts = one_step(robot, state, 3.0), one_step(robot, state, 3.0, 3000)
    for a, b in zip(whole, parts, strict=True):
        assert np.abs(a - b).max() <= 1e-11
