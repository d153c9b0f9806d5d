"""What a plan is: a program of moves, and how well each number of the robot will be known after it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.document import Document, Points, Table, percent_cell, plain
from omnidyn.identification.output_error.trust.cures import Blind
from omnidyn.identification.planning.aims import NEXT, PlanAim
from omnidyn.identification.planning.limits import PlanLimits, strain
from omnidyn.identification.planning.moves import PlannedMove
from omnidyn.identification.planning.recorded import driven
from omnidyn.model.drive import DUTY, SPEED
from omnidyn.model.keys import in_words
from omnidyn.model.robot import Robot
from omnidyn.run import Run
from omnidyn.shown import FIGURE, Displayable, make
from omnidyn.statement import NOTE, WARNING, Statement, as_verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

UNITS = {DUTY: DUTY, SPEED: "rad/s"}  # kind of drive -> unit of its input; else V
CHANNELS = {"V": "voltage", DUTY: "duty", "rad/s": "wheel_speed_command"}  # of a Run
FINEST_SHARE = 0.005  # half an interval, of the number: below, what the model leaves out decides, not the sensors
OPEN_SHARE = 0.5  # half an interval, of the number: what is wider is not learnt


@dataclass(frozen=True)
class Predicted:
    """value: of a number now. half, worst: of its 95 % interval, as a share of the value: in the middle of the robots
    drawn, and in the worst of them. before: the same until now, of a plan for the next drive after a fit."""

    value: float
    half: float
    worst: float
    before: float = math.inf

    @property
    def is_learnt(self) -> bool:
        """Whether the plan tells it."""
        return self.half < OPEN_SHARE


@dataclass(frozen=True, eq=False)
class Plan(Displayable):
    """A program of moves, and what it will tell.

    robot: it is made for. dt [s]: of a row. share (rows, wheels), held_out (rows, wheels): the input of the program and
    of a second one to judge the fit by, as shares of the largest input; `limit` is that, in `unit`: V, duty or rad/s.
    moves: (start [s], move) of the program. area [m], reach [m]: the room, and how far it goes along x and y at most,
    of all robots drawn. predicted: key -> what will be known. noise: channel -> std of what is recorded, of
    wheel_angle the step of a count [rad]. robots: how many were drawn. blind: what no log of these channels shows, and
    what would. aim: what it is to tell best; apart: of two explanations, number -> half its 95 % interval, as a share
    of it, of a nuisance in its unit. tried: moves; left_out: why -> of how many; limits: of current, heat, traction.
    """

    robot: Robot
    dt: float
    share: FloatArray
    held_out: FloatArray
    unit: str
    limit: FloatArray
    moves: tuple[tuple[float, PlannedMove], ...]
    area: tuple[float, float]
    reach: tuple[float, float]
    predicted: Mapping[str, Predicted]
    noise: Mapping[str, FloatArray]
    robots: int
    blind: tuple[Blind, ...] = ()
    aim: PlanAim = field(default_factory=PlanAim)
    apart: Mapping[str, float] = field(default_factory=dict)
    tried: int = 0
    left_out: Mapping[str, int] = field(default_factory=dict)
    limits: PlanLimits = field(default_factory=PlanLimits)

    @property
    def seconds(self) -> float:
        """Of both programs [s]."""
        return (len(self.share) + len(self.held_out)) * self.dt

    def commands(self, held_out: bool = False) -> Run:
        """The program, or the one to judge by: time and input of each row, as `read_commands` takes them."""
        share = self.held_out if held_out else self.share
        t, values = np.asarray(self.dt * np.arange(len(share)), dtype=float), share * self.limit
        channel: dict[str, Any] = {CHANNELS[self.unit]: values}
        return Run(t=t, source="planned", **channel)

    def drive(self) -> Run:
        """What the robot of the file does under the program."""
        return driven(self.robot, self.share, self.dt)

    @property
    def learnt(self) -> tuple[str, ...]:
        """The numbers that it tells."""
        return tuple(name for name, number in self.predicted.items() if number.is_learnt)

    @property
    def verdict(self) -> Statement:
        """How well its numbers will be known."""
        learnt = {name: self.predicted[name].half for name in self.learnt}
        widest = max(learnt, key=lambda name: learnt[name], default="")
        missing = tuple(name for name in self.predicted if name not in learnt)
        numbers = {
            "count": len(self.predicted),
            "missing": missing,
            "widest": widest,
            "share": learnt.get(widest),
            "seconds": self.seconds,
        }
        if self.aim.criterion == NEXT:
            counted = [name for name in self.predicted if name in self.aim.keys] or list(self.predicted)
            widest = max(counted, key=lambda name: self.predicted[name].half)
            before = max(counted, key=lambda name: self.predicted[name].before)
            numbers |= {"widest": widest, "share": self.predicted[widest].half}
            numbers |= {"before": before, "known": self.predicted[before].before}
            return Statement("planned_next", NOTE, self.robot.name, numbers)
        return Statement("planned", WARNING if missing else NOTE, self.robot.name, numbers)

    def statements(self) -> list[Statement]:
        """Where it goes, what is asked of who drives it, and where it promises more than models hold."""
        fine = {name: number.half for name, number in self.predicted.items() if number.half < FINEST_SHARE}
        numbers = {"finest": min(fine.values(), default=0.0), "count": len(fine), "limit": FINEST_SHARE}
        too_fine = [Statement("plan_finer_than_models", WARNING, numbers=numbers)] if fine else []
        return [
            Statement(
                "plan_stays_inside", NOTE, numbers={"reach": self.reach, "area": self.area, "robots": self.robots}
            ),
            *self._told_apart(),
            self._strain(),
            Statement("plan_records", NOTE, numbers={"noise": self.noise, "rate": 1.0 / self.dt}),
            *too_fine,
            Statement("plan_begins", NOTE, numbers={"held_out": len(self.held_out) * self.dt}),
            *(one.statement() for one in self.blind),
        ]

    def _told_apart(self) -> list[Statement]:
        """From what size on two explanations are told apart."""
        numbers = {"explanations": self.aim.names, "sizes": self.apart}
        return [Statement("plan_tells_apart", NOTE, numbers=numbers)] if self.apart else []

    def _strain(self) -> Statement:
        """What it asks of battery, motors and wheels, and which moves were left out for what."""
        rolling = self.robot.replace(wheels=self.robot.wheels.replace(traction_mu=None))
        most = strain(rolling, driven(rolling, self.share, self.dt), self.dt)
        heat = most.energy / (len(self.share) * self.dt)
        numbers = {"current": most.current, "heat": heat, "traction": most.traction}
        numbers |= {"tried": self.tried, "left_out": self.left_out, "limits": self.limits._asdict()}
        return Statement("plan_asks", NOTE, numbers=numbers)

    def document(self) -> Document:
        """What it says."""
        is_next = self.aim.criterion == NEXT
        numbers = [
            (
                in_words(name),
                name,
                f"{number.value:.4g}",
                *([percent_cell(number.before)] if is_next else []),
                percent_cell(number.half),
                percent_cell(number.worst),
            )
            for name, number in self.predicted.items()
        ]
        moves = [
            (f"{start:.1f}", move.direction, move.shape, f"{100.0 * move.level:.0f}", f"{move.seconds:g}")
            for start, move in self.moves
        ]
        parts = [
            Points(self.statements()),
            Table(
                ("number", "key", "now", *(["before +- %"] if is_next else []), "95 % +- %", "worst %"),
                numbers,
                "<<>>>>" if is_next else "<<>>>",
                name="numbers",
            ),
            Table(("starts s", "direction", "input", "of the largest %", "lasts s"), moves, "><<>>", name="moves"),
        ]
        return Document(parts, as_verdict(self.verdict) | self.to_dict(), verdict=self.verdict)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, but for the rows of the programs."""
        return plain(
            {
                "robot": self.robot.name,
                "seconds": self.seconds,
                "row_s": self.dt,
                "unit": self.unit,
                "area_m": self.area,
                "reach_m": self.reach,
                "noise": {channel: std.tolist() for channel, std in self.noise.items()},
                "predicted": {name: vars(number) for name, number in self.predicted.items()},
                "aim": ",".join(self.aim.names) or self.aim.criterion,
                "apart": self.apart,
                "tried": self.tried,
                "left_out": self.left_out,
                "moves": [{"start_s": start, **vars(move)} for start, move in self.moves],
            }
        )

    def plot(self) -> Figure:
        """The inputs, and where the robot goes in its room, as a matplotlib Figure."""
        return make(FIGURE, self)
