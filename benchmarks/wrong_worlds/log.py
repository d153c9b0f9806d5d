"""Case: a world, the world that its file describes, and how it is logged; `logged` makes the Run of a seed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from benchmarks.wrong_worlds.world import BOX, ELLIPSE, STEP, WHEELS, World, drive
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import parse_robot
from omnidyn.run import Run

SECONDS = 30.0  # of a log, unless its setup says otherwise
SPEEDS, TWIST, AR, COUNTS, FILTERED, TICKS = "speeds", "twist", "ar", "counts", "filtered", "ticks"
NOISE, TICK = 0.4, 2.0 * np.pi / 600.0  # [rad/s], [rad]
FINE = 4  # samples of a filter in a row
APART = 0.6  # [s] between two moves that must not meet


@dataclass(frozen=True)
class Setup:
    """How a log is made. rate [Hz]; seconds: its length.

    sensor: what is logged, and its noise; memory: correlation of it, row to row.
    mix: share of the second direction in moves along two; apart: whether the robot stops between moves; turns: whether
    it turns only to and fro, where false; forward: whether moves along two are along x first. latency [s]. jitter: of
    when a row was measured, a share of a row. smoothing [s] of a first-order filter. missed: share of rows. period [s]
    of a driver that takes its command so often only.
    """

    rate: float = 100.0
    seconds: float = SECONDS
    sensor: str = SPEEDS
    memory: float = 0.0
    mix: float = 1.0
    apart: bool = False
    turns: bool = True
    forward: bool = False
    latency: float = 0.0
    jitter: float = 0.0
    smoothing: float = 0.0
    missed: float = 0.0
    period: float = 0.0


@dataclass(frozen=True)
class Case:
    """world: the truth. told: what the robot file says, friction apart, which starts elsewhere."""

    world: World
    told: World
    setup: Setup = field(default_factory=Setup)
    step: float = STEP

    def world_but(self, **changed: object) -> Case:
        """With another truth."""
        return replace(self, world=replace(self.world, **changed))  # type: ignore[arg-type]

    def both_but(self, **changed: object) -> Case:
        """With another robot, which its file knows of."""
        return replace(self.world_but(**changed), told=replace(self.told, **changed))  # type: ignore[arg-type]

    def setup_but(self, **changed: object) -> Case:
        """Logged otherwise."""
        return replace(self, setup=replace(self.setup, **changed))  # type: ignore[arg-type]


def clean(case: Case) -> Case:
    """The right world of a wrong case: what its file says, driven the same, and logged without faults."""
    setup = replace(case.setup, latency=0.0, jitter=0.0, smoothing=0.0, missed=0.0, period=0.0)
    return replace(case, world=case.told, setup=setup)


def right_case(seed: int) -> Case:
    """A right world: its numbers, its row rate, its sensor and its law come from the seed."""
    rng = np.random.default_rng([seed, 1])
    near: Callable[[float], float] = lambda value: float(value * np.exp(rng.uniform(-0.15, 0.15)))  # noqa: E731
    base, ohm, torque = World(), near(2.2), near(0.0105)
    world = World(
        mass=near(base.mass),
        inertia=near(base.inertia),
        resistance=(ohm,) * 3,
        torque_constant=(torque,) * 3,
        coulomb=(near(3.9), near(3.9), near(0.2)),
        viscous=(near(1.2), near(1.2), near(0.012)),
        frame=seed % 3 == 2,
    )
    sensor = (SPEEDS, SPEEDS, TWIST, AR, COUNTS)[seed % 5]
    return Case(world, world, Setup(100.0 if seed // 2 % 2 else 50.0, SECONDS, sensor, 0.8 if sensor == AR else 0.0))


def robot_of(told: World) -> Robot:
    """The robot as its file has it; friction a guess, 30 % off."""
    wheel, motor = ", ".join(map(str, told.wheel_radius)), "motor"
    text = f"""schema = 1
name = "wrong"
[body]
mass_kg = {told.mass}
inertia_kg_m2 = {told.inertia}
rotating_frame = {str(told.frame).lower()}
[wheels]
azimuth_deg = {list(told.azimuth)}
robot_radius_m = {told.robot_radius}
wheel_radius_m = [{wheel}]
[{motor}]
resistance_ohm = {list(told.resistance)}
torque_constant_Nm_A = {list(told.torque_constant)}
emf_constant_Vs_rad = {list(told.torque_constant)}
gear_ratio = {told.gear_ratio}
voltage_limit_V = {told.voltage_limit}
"""
    return parse_robot(text + friction_of(told, 1.3))


def friction_of(told: World, factor: float = 1.0) -> str:
    """The table of friction, every number times a factor."""
    c, b = [factor * each for each in told.coulomb], [factor * each for each in told.viscous]
    if told.shape == BOX:
        return f"[friction.axes]\nviscous = {b}\ncoulomb = {c}\n"
    if told.shape == WHEELS:
        return f"[friction.wheels]\ncoulomb = {factor * told.rim[0]}\nviscous = {factor * told.rim[1]}\n"
    return f"[friction.direction]\ncoulomb = {c[:2]}\nviscous = {b[0]}\nyaw_coulomb = {c[2]}\nyaw_viscous = {b[2]}\n"


def truths(world: World, shape: str) -> dict[str, float]:
    """Key -> what a friction number is, seen as a shape; one shape through another by its motions along an axis."""
    c, b = world.coulomb, world.viscous
    if shape == WHEELS:
        return {"friction.wheels.coulomb": world.rim[0], "friction.wheels.viscous": world.rim[1]}
    if shape == ELLIPSE:
        table = "friction.direction"
        return {
            f"{table}.coulomb[0]": c[0],
            f"{table}.coulomb[1]": c[1],
            f"{table}.viscous": b[0],
            f"{table}.yaw_coulomb": c[2],
            f"{table}.yaw_viscous": b[2],
        }
    return {
        f"friction.axes.{name}[{a}]": level[a] for name, level in (("viscous", b), ("coulomb", c)) for a in range(3)
    }


def commands(case: Case, rng: np.random.Generator) -> np.ndarray:
    """What a person sends [V]: at rest, then directions and turns at levels of their own, some rest. (rows, n)."""
    told, setup = case.told, case.setup
    G, rows = told.G, round(setup.seconds * setup.rate)
    out = [np.zeros((round(0.5 * setup.rate), G.shape[1]))]
    way = 1.0
    while sum(map(len, out)) < rows:
        kind, angle, level = rng.random(), rng.uniform(-np.pi, np.pi), rng.uniform(0.25, 1.0)
        spin, hold, pauses = rng.normal(), rng.uniform(0.2, 1.5), rng.random() < 0.12
        twist = np.array([np.cos(angle), np.sin(angle), 0.0])
        if kind > 0.75 and setup.turns:
            twist[2] = spin / told.robot_radius
        elif kind > 0.55:
            way, hold = -way, hold if setup.turns else 0.4
            twist = np.array([0.0, 0.0, way if not setup.turns else np.sign(angle)])
        rim = _leaning(twist, setup, told.robot_radius) @ G
        rim = rim / np.abs(rim).max() * 0.85 * told.voltage_limit * (1.0 if not setup.turns and kind > 0.55 else level)
        out.append(np.repeat(rim[None] * (not pauses), round(hold * setup.rate), axis=0))
        if setup.apart:
            out.append(np.zeros((round(APART * setup.rate), G.shape[1])))
    return np.concatenate(out)[:rows]


def _leaning(twist: np.ndarray, setup: Setup, arm: float) -> np.ndarray:
    """A twist whose largest part stays, or that along x, while the others shrink to `mix` of themselves."""
    own = np.abs(twist * [1.0, 1.0, arm])
    main = 0 if setup.forward and own[0] > 0.0 else int(np.argmax(own))
    return np.where(np.arange(3) == main, twist, setup.mix * twist)


def voltages(case: Case, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """(t [s] of the rows, what the log says of the voltage (rows, n))."""
    asked = commands(case, np.random.default_rng([seed, 2]))
    return np.arange(len(asked)) / case.setup.rate, asked


def logged(case: Case, seed: int, noisy: bool = True) -> Run:
    """The log of a seed."""
    t, asked = voltages(case, seed)
    setup, rng = case.setup, np.random.default_rng([seed, 3])
    measured = t + setup.jitter / setup.rate * rng.uniform(-0.5, 0.5, t.size) - setup.latency
    measured = np.maximum.accumulate(np.clip(measured, 0.0, None))
    since = t if setup.period == 0.0 else np.maximum.accumulate(np.ceil(t / setup.period - 1e-9) * setup.period)
    speed, path = _sampled(case, since, asked, measured)
    radii = np.array(case.told.wheel_radius)
    channels: dict[str, Any]
    if setup.sensor == TWIST:
        sensed = speed * radii @ np.linalg.pinv(case.told.G)
        own = NOISE * radii[0] * np.array([1.0, 1.0, 1.0 / case.told.robot_radius])
        channels = {"twist": sensed + noisy * own * rng.normal(size=sensed.shape)}
    elif setup.sensor in (COUNTS, TICKS) and noisy:
        # Ends of rows, counted: what a controller has as a speed is the difference of two counts.
        turned = np.floor(path / TICK + rng.uniform(size=path.shape[1]))
        steps = np.diff(turned, axis=0, prepend=turned[:1]) * TICK * setup.rate
        channels = {"wheel_speed": steps} if setup.sensor == COUNTS else {"wheel_angle": turned * TICK}
    else:
        channels = {"wheel_speed": speed + noisy * NOISE * _noise(setup, speed.shape, rng)}
    kept = _kept(setup.missed, t.size, rng)
    return Run(t[kept], voltage=asked[kept], **{name: values[kept] for name, values in channels.items()})


def _sampled(case: Case, since: np.ndarray, asked: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(wheel speeds, wheel angles) at times, (rows, n) each; the speeds through the filter of the setup."""
    setup = case.setup
    if setup.smoothing == 0.0:
        motion = drive(case.world, since, asked, at, case.step)
        return motion.wheel_speed, motion.path @ case.world.G / np.array(case.world.wheel_radius)
    pitch = 1.0 / (FINE * setup.rate)
    fine = np.arange(FINE * (len(at) - 1) + 1) * pitch
    motion = drive(case.world, since, asked, fine, case.step)
    left, state = np.exp(-pitch / setup.smoothing), np.zeros(motion.wheel_speed.shape[1])
    out = np.zeros(motion.wheel_speed.shape)
    for k, own in enumerate(motion.wheel_speed):
        state = left * state + (1.0 - left) * own
        out[k] = state
    angle = motion.path @ case.world.G / np.array(case.world.wheel_radius)
    return out[::FINE], angle[::FINE]


def _noise(setup: Setup, shape: tuple[int, ...], rng: np.random.Generator) -> np.ndarray:
    """Noise of unit size: white, with a memory, or the mean of five rows."""
    white = rng.normal(size=(shape[0] + 4, *shape[1:]))
    if setup.sensor == FILTERED:
        return sum(white[k : k + shape[0]] for k in range(5)) / np.sqrt(5.0)
    if setup.memory == 0.0:
        return white[:-4]
    out, share = white[:-4].copy(), np.sqrt(1.0 - setup.memory**2)
    for k in range(1, len(out)):
        out[k] = setup.memory * out[k - 1] + share * out[k]
    return out


def _kept(missed: float, rows: int, rng: np.random.Generator) -> np.ndarray:
    """Rows that were not lost: holes of 3 to 12 rows, from a second on."""
    kept = np.ones(rows, dtype=bool)
    starts = np.flatnonzero(rng.random(rows) < missed / 7.5)
    for start in starts[starts > 100]:
        kept[start : start + rng.integers(3, 13)] = False
    return kept
