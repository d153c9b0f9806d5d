"""What may be missing from the model, or stand wrong in the robot file: each tried by simulating the log anew.

So a candidate needs no derivative, and may be a law that has none where it is off. It is tried at one size, or at
several where none is small (a limit, a time). A new law comes in here with one entry: laws.py has those of the robot.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.document import short
from omnidyn.errors import OmnidynError
from omnidyn.identification.output_error.prepare import LOOP
from omnidyn.identification.output_error.problem.nuisances import LATENCY, PUSH, TILT
from omnidyn.identification.structure.motion import Motion, in_the_room
from omnidyn.identification.structure.workbench import Workbench, scaled
from omnidyn.model.actuation import DEAD_BAND, FADE, GAIN, Driver
from omnidyn.model.dynamics import drive_wrench
from omnidyn.model.keys import EMF, TORQUE, in_words
from omnidyn.model.layout import N_AXES
from omnidyn.model.robot import Robot

LEAST = -0.9  # relative change of a number that is above 0: what goes further is no explanation
STEP = 0.02  # relative change that a smooth number is tried with
CHANGE = "change"  # friction that is another one from some time of the log on
WHEN = np.linspace(0.1, 0.9, 9)  # shares of the run at which it may change


@dataclass(frozen=True)
class Fitted:
    """A candidate that was fitted: in words, how many numbers it took, number -> (before, with it)."""

    words: str
    numbers: int
    changes: Mapping[str, tuple[float, float]]


@dataclass(frozen=True, eq=False)
class Trial:
    """What a change by 1 would change in the log, of each piece (C, rows, K), K numbers. at: where it is tried, such as
    the level of a limit. fitted: of one that was, and is shown whole by its one column."""

    shown: list[FloatArray]
    at: float = 0.0
    fitted: Fitted | None = None


@dataclass(frozen=True, eq=False)
class Candidate:
    """key: of the robot file, a nuisance, or CHANGE. trials: one or more. told: its fitted change and where it was
    tried, in words. least: a change below it makes no sense. offered: whether a robot file or a fit can hold it. late:
    whether it has an engine of its own, and is asked only where something is left out."""

    key: str
    trials: Callable[[Workbench], list[Trial]]
    told: Callable[[float, float], str]
    least: float = -np.inf
    offered: bool = True
    late: bool = False

    def tried(self, bench: Workbench) -> list[Trial]:
        """Its trials; none where the engine cannot simulate them."""
        try:
            return self.trials(bench)
        except OmnidynError:
            return []


def as_it_is(words: str) -> Callable[[float, float], str]:
    """Words that no value belongs to."""
    return lambda _change, _at: words


def numbers(bench: Workbench) -> Iterator[Candidate]:
    """Numbers of the robot file that may be others: masses, radii, motors, one by one and all together."""
    for key in ("body.mass_kg", "body.inertia_kg_m2", "wheels.robot_radius_m"):
        yield from _number(bench.robot, key)
    for name in ("wheels.wheel_radius_m", "motor.resistance_ohm", TORQUE):
        beside = EMF if name == TORQUE else ""
        yield from _number(bench.robot, name, beside)
        for i in range(bench.robot.wheels.count):
            yield from _number(bench.robot, f"{name}[{i}]", f"{beside}[{i}]" if beside else "")


def _number(robot: Robot, key: str, beside: str = "") -> Iterator[Candidate]:
    """A number, of all wheels where the key is that of a list, and another one that follows it."""
    changed = scaled(robot, key, 1.0 + STEP)
    if changed is None:
        return
    if beside:
        changed = scaled(changed, beside, 1.0 + STEP) or changed

    def trials(bench: Workbench) -> list[Trial]:
        return [Trial([own / STEP for own in bench.change(changed)])]

    yield Candidate(key, trials, lambda change, _: f"{in_words(key)} {short(100.0 * change, '+.2g')} %", LEAST)


def of_the_log(bench: Workbench) -> Iterator[Candidate]:
    """What a log does to a right model: nuisances that are not fitted, and a change on the way."""
    if bench.kind != LOOP:
        yield Candidate(GAIN, _driver(GAIN, Driver(gain=1.0 + STEP), STEP), lambda by, _: f"gain {1.0 + by:.3g}")
        yield Candidate(
            FADE, _driver(FADE, Driver(fade=STEP), STEP), lambda by, _: f"a voltage that fades by {100.0 * by:.2g} %"
        )
        yield Candidate(
            DEAD_BAND, _driver(DEAD_BAND, Driver(dead_band=0.1), 0.1), lambda by, _: f"dead band {by:.2g} V", 0.0
        )
    yield Candidate(TILT, _by(in_the_room), as_it_is("a force that stays in the room, as of a floor that is not level"))
    yield Candidate(PUSH, _by(_on_the_body), as_it_is("a constant push in the body, as of a brush that drags"))
    for channel in dict.fromkeys(name for name, _ in bench.problem.columns):
        words = channel.replace("_", " ")
        yield Candidate(
            f"{LATENCY}.{channel}", _late(channel), lambda by, _, words=words: f"{words} late by {1e3 * by:.3g} ms"
        )
    for words, force in (("friction", _friction), ("mass", _inertia), ("supply", _drive)):
        yield Candidate(
            CHANGE, _later(force),
            lambda by, at, words=words: f"{_about(bench.robot, words, by)} {_when(bench, at)}",
        )  # fmt: skip


def _driver(name: str, driver: Driver, size: float) -> Callable[[Workbench], list[Trial]]:
    assert getattr(driver, name) != getattr(Driver(), name)
    return lambda bench: [Trial([own / size for own in bench.change(driver=driver)])]


def _by(force: Callable[[Motion], FloatArray]) -> Callable[[Workbench], list[Trial]]:
    return lambda bench: [Trial(bench.by_force(force))]


def _on_the_body(motion: Motion) -> FloatArray:
    """A constant push along each axis. Shape (n, 3, 3)."""
    return np.tile(np.eye(N_AXES), (len(motion.t), 1, 1))


def _late(channel: str) -> Callable[[Workbench], list[Trial]]:
    """A delay of a channel: it shows what was earlier."""

    def trials(bench: Workbench) -> list[Trial]:
        shown = []
        for motion in bench.motions:
            level = motion.shown(motion.twist[:, None, :])
            own = np.array([name == channel for name, _ in motion.piece.record.columns])
            shown.append(np.where(own[:, None, None], -np.gradient(level, motion.t, axis=1), 0.0))
        return [Trial(shown)]

    return trials


def _later(force: Callable[[Motion], FloatArray]) -> Callable[[Workbench], list[Trial]]:
    """Forces that begin at some time of the log, at several times."""

    def trials(bench: Workbench) -> list[Trial]:
        every = [*WHEN.tolist(), *bench.moments]
        shown = bench.by_forces([lambda m, when=when: force(m) * (m.share >= when)[:, None, None] for when in every])
        return [Trial(own, when) for own, when in zip(shown, every, strict=True)]

    return trials


def _when(bench: Workbench, share: float) -> str:
    """A moment of the logs, in seconds where all of them are as long."""
    spans = [piece.record.span for piece in bench.problem.pieces]
    seconds = f", at {short(share * max(spans), '.3g')} s" if max(spans) < 1.02 * min(spans) else ""
    return f"{100.0 * share:.0f} % into the log{seconds}"


def _about(robot: Robot, words: str, change: float) -> str:
    """The levels of a mass or a supply: rough, for to first order a large change is not what it is."""
    first = float(robot.body.mass)
    if words == "mass":
        return f"{words} that changes from {first:.3g} to about {max(first + change, 0.0):.2g} kg"
    by = f" by about {short(100.0 * change, '+.2g')} %" if words == "supply" else ""
    return f"{words} that changes{by}"


def _friction(motion: Motion) -> FloatArray:
    speed = motion.twist[:, None, :]
    return -np.concatenate([np.eye(N_AXES) * np.sign(speed), np.eye(N_AXES) * speed], axis=1)


def _inertia(motion: Motion) -> FloatArray:
    """Of a mass that is added to the body, and of its inertia."""
    pace = np.zeros_like(motion.twist)
    pace[:-1] = np.diff(motion.twist, axis=0) / np.diff(motion.t)[:, None]
    flat, turn = pace * [1.0, 1.0, 0.0], pace * [0.0, 0.0, 1.0]
    return -np.stack([flat, turn], axis=1)


def _drive(motion: Motion) -> FloatArray:
    """Of voltages that are all larger by a share: what the motors push with, without the back-EMF."""
    at_rest = drive_wrench(motion.robot, np.zeros_like(motion.twist), motion.voltage)
    return at_rest[:, None, :]
