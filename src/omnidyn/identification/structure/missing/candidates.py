"""What may be missing from the model, or stand wrong in the robot file: each tried by simulating the log anew.

So a candidate needs no derivative, and may be a law that has none where it is off. It is tried at one size, or at
several where none is small (a limit, a time). A new law comes in here with one entry: laws.py has those of the robot.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import OmnidynError
from omnidyn.identification.lack_of_fit import CHANGE, ONE_LOG
from omnidyn.identification.output_error.linear.driven_motion import DrivenMotion, in_the_room
from omnidyn.identification.output_error.linear.workbench import Workbench, scaled
from omnidyn.identification.output_error.problem.nuisances import LATENCY, PUSH, TILT
from omnidyn.identification.output_error.problem.record import Record
from omnidyn.model.actuation import DEAD_BAND, FADE, GAIN, Driver
from omnidyn.model.dynamics import drive_wrench
from omnidyn.model.keys import EMF, TORQUE
from omnidyn.model.layout import N_AXES
from omnidyn.model.robot import Robot
from omnidyn.statement import NOTE, Statement

LEAST_CHANGE = -0.9  # relative change of a number that is above 0: what goes further is no explanation
STEP = 0.02  # relative change that a smooth number is tried with
CHANGE_SHARES = np.linspace(0.1, 0.9, 9)  # shares of the run at which it may change
MOST_LOGS = 12  # of which each is tried as the one that differs


@dataclass(frozen=True)
class FittedCandidate:
    """A candidate that was fitted: what it is, how many numbers it took, number -> (before, with it)."""

    cause: Statement
    numbers: int
    changes: Mapping[str, tuple[float, float]]


@dataclass(frozen=True, eq=False)
class Trial:
    """What a change by 1 would change in the log, of each piece (C, rows, K), K numbers. at: where it is tried, such as
    the level of a limit. fitted: of one that was, and is shown whole by its one column."""

    columns_by_piece: list[FloatArray]
    at: float = 0.0
    fitted: FittedCandidate | None = None


@dataclass(frozen=True, eq=False)
class Candidate:
    """key: of the robot file, a nuisance, or CHANGE. trials: one or more. cause: what it is, of its fitted change and
    where it was tried. least_change: a change below it makes no sense. is_offered: whether a robot file or a fit can
    hold it.
    is_late: whether it has an engine of its own, and is asked only where something is left out."""

    key: str
    trials: Callable[[Workbench], list[Trial]]
    cause: Callable[[float, float], Statement]
    least_change: float = -np.inf
    is_offered: bool = True
    is_late: bool = False

    def tried(self, bench: Workbench) -> list[Trial]:
        """Its trials; none where the engine cannot simulate them."""
        try:
            return self.trials(bench)
        except OmnidynError:
            return []


def cause(code: str, subject: str = "") -> Statement:
    """What may be missing from a model."""
    return Statement(code, NOTE, subject)


def as_it_is(code: str, subject: str = "") -> Callable[[float, float], Statement]:
    """A cause that no value belongs to."""
    return lambda _change, _at: cause(code, subject)


def sized(code: str, subject: str, **numbers: Callable[[float, float], Any]) -> Callable[[float, float], Statement]:
    """A cause with numbers, each of the fitted change and where it was tried."""
    return lambda change, place: Statement(
        code, NOTE, subject, {name: value_of(change, place) for name, value_of in numbers.items()}
    )


def numbers(bench: Workbench) -> Iterator[Candidate]:
    """Numbers of the robot file that may be others: masses, radii, motors, one by one and all together."""
    for key in ("body.mass_kg", "body.inertia_kg_m2", "wheels.robot_radius_m"):
        yield from _number(bench.robot, key)
    for name in ("wheels.wheel_radius_m", "motor.resistance_ohm", TORQUE):
        tied_key = EMF if name == TORQUE else ""
        yield from _number(bench.robot, name, tied_key)
        for i in range(bench.robot.wheels.count):
            yield from _number(bench.robot, f"{name}[{i}]", f"{tied_key}[{i}]" if tied_key else "")


def _number(robot: Robot, key: str, tied_key: str = "") -> Iterator[Candidate]:
    """A number, of all wheels where the key is that of a list, and another one that follows it."""
    new_robot = scaled(robot, key, 1.0 + STEP)
    if new_robot is None:
        return
    if tied_key:
        new_robot = scaled(new_robot, tied_key, 1.0 + STEP) or new_robot

    def trials(bench: Workbench) -> list[Trial]:
        return [Trial([columns / STEP for columns in bench.change(new_robot)])]

    yield Candidate(key, trials, sized("number_off", key, change=lambda change, _: change), LEAST_CHANGE)


def of_the_log(bench: Workbench) -> Iterator[Candidate]:
    """What a log does to a right model: nuisances that are not fitted, a change on the way, one log unlike others."""
    if not bench.kind.has_loop:
        gain, fade, band = Driver(gain=1.0 + STEP), Driver(fade=STEP), Driver(dead_band=0.1)
        yield Candidate(GAIN, _driver(GAIN, gain, STEP), sized("gain", "", gain=lambda change, _: 1.0 + change))
        yield Candidate(
            FADE, _driver(FADE, fade, STEP), sized("fading_voltage", "", percent=lambda change, _: 100.0 * change)
        )
        yield Candidate(
            DEAD_BAND, _driver(DEAD_BAND, band, 0.1), sized("dead_band", "", value=lambda change, _: change), 0.0
        )
    yield Candidate(TILT, _by(in_the_room), as_it_is("force_in_the_room"))
    yield Candidate(PUSH, _by(_on_the_body), as_it_is("push_on_the_body"))
    for channel in dict.fromkeys(name for name, _ in bench.problem.columns):
        late_cause = sized("late_channel", channel, late=lambda change, _: change)
        yield Candidate(f"{LATENCY}.{channel}", _late(channel), late_cause)
    mass, time_of = float(bench.robot.body.mass), partial(_seconds, bench)
    for subject, force in (("friction", _friction), ("mass", _inertia), ("supply", _drive)):
        cause_of_change = sized(
            "change_on_the_way",
            subject,
            by=lambda change, _: change,
            before=lambda *_: mass,
            after=lambda change, _: max(mass + change, 0.0),
            share=lambda _, share: share,
            at=lambda _, share: time_of(share),
        )
        yield Candidate(CHANGE, _later(force), cause_of_change)
    yield from _unlike_others(bench, mass)


def _unlike_others(bench: Workbench, mass: float) -> Iterator[Candidate]:
    """One of several logs, unlike the others. Of two logs it is the second: what differs in the first says the same."""
    records = list({id(piece.record): piece.record for piece in bench.problem.pieces}.values())
    names = [record.source or f"log {k + 1}" for k, record in enumerate(records)]
    if not 1 < len(records) <= MOST_LOGS:
        return
    first = int(len(records) == 2)
    for subject, force, whole in (
        ("mass", _inertia, mass),
        ("friction", _dry_friction, np.inf),
        ("supply", _drive, 1.0),
    ):
        cause_in_log = sized(
            "differs_in_one_log",
            subject,
            share=lambda change, _, whole=whole: max(change / whole, -1.0),
            log=lambda _, place: names[first + int(place)],
            other=lambda *_: names[0] if len(names) == 2 else "",
        )
        yield Candidate(ONE_LOG[subject], _in_one_log(force, records[first:]), cause_in_log)


def _driver(name: str, driver: Driver, size: float) -> Callable[[Workbench], list[Trial]]:
    assert getattr(driver, name) != getattr(Driver(), name)
    return lambda bench: [Trial([columns / size for columns in bench.change(driver=driver)])]


def _by(force: Callable[[DrivenMotion], FloatArray]) -> Callable[[Workbench], list[Trial]]:
    return lambda bench: [Trial(bench.by_force(force))]


def _on_the_body(motion: DrivenMotion) -> FloatArray:
    """A constant push along each axis. Shape (n, 3, 3)."""
    return np.tile(np.eye(N_AXES), (len(motion.t), 1, 1))


def _late(channel: str) -> Callable[[Workbench], list[Trial]]:
    """A delay of a channel: it shows what was earlier."""

    def trials(bench: Workbench) -> list[Trial]:
        columns_by_piece = []
        for motion in bench.motions:
            level = motion.shown(motion.twist[:, None, :])
            is_channel = np.array([name == channel for name, _ in motion.piece.record.columns])
            columns_by_piece.append(np.where(is_channel[:, None, None], -np.gradient(level, motion.t, axis=1), 0.0))
        return [Trial(columns_by_piece)]

    return trials


def _later(force: Callable[[DrivenMotion], FloatArray]) -> Callable[[Workbench], list[Trial]]:
    """Forces that begin at some time of the log, at several times."""

    def trials(bench: Workbench) -> list[Trial]:
        shares = [*CHANGE_SHARES.tolist(), *bench.moments]
        columns_by_share = bench.by_forces(
            [lambda m, start_share=share: force(m) * (m.share >= start_share)[:, None, None] for share in shares]
        )
        return [Trial(columns, start_share) for columns, start_share in zip(columns_by_share, shares, strict=True)]

    return trials


def _in_one_log(
    force: Callable[[DrivenMotion], FloatArray], records: Sequence[Record]
) -> Callable[[Workbench], list[Trial]]:
    """Forces in one log alone, in each of some. at: which of them."""

    def trials(bench: Workbench) -> list[Trial]:
        columns_by_log = bench.by_forces(
            [lambda m, record=record: force(m) * (m.piece.record is record) for record in records]
        )
        return [Trial(columns, float(k)) for k, columns in enumerate(columns_by_log)]

    return trials


def _seconds(bench: Workbench, share: float) -> float | None:
    """A moment of the logs [s]; None where they are not as long as each other."""
    spans = [piece.record.span for piece in bench.problem.pieces]
    return share * max(spans) if max(spans) < 1.02 * min(spans) else None


def _friction(motion: DrivenMotion) -> FloatArray:
    speed = motion.twist[:, None, :]
    return -np.concatenate([np.eye(N_AXES) * np.sign(speed), np.eye(N_AXES) * speed], axis=1)


def _dry_friction(motion: DrivenMotion) -> FloatArray:
    """Its level on each axis, which is what another floor changes: viscous friction stands in for a supply."""
    return _friction(motion)[:, :N_AXES]


def _inertia(motion: DrivenMotion) -> FloatArray:
    """Of a mass that is added to the body, and of its inertia."""
    return -np.stack([motion.pace * [1.0, 1.0, 0.0], motion.pace * [0.0, 0.0, 1.0]], axis=1)


def _drive(motion: DrivenMotion) -> FloatArray:
    """Of voltages that are all larger by a share: what the motors push with, without the back-EMF."""
    stall_wrench = drive_wrench(motion.robot, np.zeros_like(motion.twist), motion.voltage)
    return stall_wrench[:, None, :]
