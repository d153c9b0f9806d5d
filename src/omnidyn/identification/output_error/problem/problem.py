"""What is to be fitted: free parameters, the pieces of the logs, and how each piece starts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.identification.output_error.problem.parameters import AT, Parameter, robot_at
from omnidyn.identification.output_error.problem.record import Record
from omnidyn.model.robot import Robot
from omnidyn.sensors import TRAVEL

Column = tuple[str, int]
Parts = tuple[FloatArray, FloatArray, IntArray]  # residuals (C, rows), slopes (C, rows, U), which U among P and states

LEAST_ROWS = 300  # of a piece that is cut
DRIVEN = 0.05  # of the greatest input of a piece: what is less is a rest, of measured volts too


@dataclass(frozen=True, eq=False)
class Piece:
    """Rows first..last of a record. start (3,): the twist there; offset (C,): of outputs that count from the start.

    free: which of these 3 + C numbers are fitted. margin (C,): time after the start before which outputs are not used.
    start_std (3,): how far the twist may be from `start`, None: anywhere. A robot that comes to rest before the first
    row that is used tells next to nothing of its start: without, one such piece in fifty spoils every step.
    """

    record: Record
    first: int
    last: int
    start: FloatArray
    offset: FloatArray
    free: BoolArray
    margin: FloatArray
    start_std: FloatArray | None = None

    @property
    def at_rest(self) -> bool:
        """Whether it is known to begin at rest: what came before its first row is known, too."""
        return not (self.start.any() or self.free[: len(self.start)].any())

    @property
    def step(self) -> float:
        """Usual time between two samples [s]."""
        return self.record.step_of(slice(self.first, self.last + 1))

    @property
    def rest_rows(self) -> int:
        """Rows at its beginning in which nothing drives it."""
        inputs = self.record.voltage if self.record.set_point is None else self.record.set_point
        most = np.abs(inputs[self.first : self.last + 1]).max(axis=1)
        return int(np.argmax(most > DRIVEN * most.max()))

    def start_prior(self, state: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(pull (3,) of what is known of the start, its information (3,)), 0 for what is not free; state (3 + C,)."""
        if self.start_std is None:
            return np.zeros_like(self.start), np.zeros_like(self.start)
        start_information = np.where(self.free[: len(self.start)], self.start_std**-2.0, 0.0)
        return start_information * (self.start - state[: len(self.start)]), start_information


class FitProblem:
    """What the solver needs of a problem, whatever it is that moves: parameters, and the pieces that are fitted to.

    What all pieces have in common is found once: each piece asks for it at each point of a fit.
    """

    parameters: tuple[Parameter, ...]
    pieces: tuple[Piece, ...]

    @cached_property
    def columns(self) -> tuple[Column, ...]:
        """All output columns of all records, each once."""
        return tuple(dict.fromkeys(column for piece in self.pieces for column in piece.record.columns))

    @cached_property
    def travels(self) -> BoolArray:
        """Whether each column counts from an unknown start. Shape (columns,)."""
        return np.array([name in TRAVEL for name, _ in self.columns])

    @cached_property
    def tick(self) -> FloatArray:
        """The largest tick of each column in any record, 0 where it is not counted. Shape (columns,)."""
        largest_ticks = dict.fromkeys(self.columns, 0.0)
        for piece in self.pieces:
            for column, tick in zip(piece.record.columns, piece.record.ticks, strict=True):
                largest_ticks[column] = max(largest_ticks[column], tick)
        return np.array(list(largest_ticks.values()))

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(p.name for p in self.parameters)

    @cached_property
    def _index_by_name(self) -> dict[str, int]:
        return {name: k for k, name in enumerate(self.names)}

    def where(self, name: str) -> int:
        """Index of a parameter by its name, -1 where it is not free."""
        return self._index_by_name.get(name, -1)

    def start(self) -> Point:
        """Where the fit starts."""
        values = np.array([p.value for p in self.parameters])
        return Point(values, tuple(np.concatenate([piece.start, piece.offset]) for piece in self.pieces))


@dataclass(frozen=True, eq=False)
class Problem(FitProblem):
    """robot: where the fit starts. parameters: of the robot file first, then nuisances. pieces: what is fitted to."""

    robot: Robot
    parameters: tuple[Parameter, ...]
    robot_count: int
    pieces: tuple[Piece, ...]

    @property
    def robot_parameters(self) -> tuple[Parameter, ...]:
        """Those of the robot file."""
        return self.parameters[: self.robot_count]

    @property
    def nuisances(self) -> tuple[str, ...]:
        """Names of the others, each once whether groups have their own or not."""
        return tuple(dict.fromkeys(name.partition(AT)[0] for name in self.names[self.robot_count :]))

    def robot_at(self, values: FloatArray) -> Robot:
        """The robot with these values of the parameters, not checked."""
        return robot_at(self.robot, self.robot_parameters, values)

    def shortened(self, rows: int, beyond_rest: bool = False) -> Problem:
        """The same problem on about `rows` rows: the beginnings of some pieces, evenly among all; no row of the others.

        None is so short that it tells nothing: of many pieces few are taken. beyond_rest: a rest at the beginning of a
        piece, which tells no number, is not counted.
        """
        rests = np.array([piece.rest_rows if beyond_rest else 0 for piece in self.pieces])
        lengths = np.array([piece.last - piece.first + 1 for piece in self.pieces]) - rests
        if lengths.sum() <= rows:
            return self
        count = int(np.clip(rows // LEAST_ROWS, 1, len(lengths)))
        chosen_pieces = np.unique(np.linspace(0, len(lengths) - 1, count).round().astype(int))
        share = min(rows / lengths[chosen_pieces].sum(), 1.0)
        pieces = [
            replace(piece, last=piece.first + max(rest + int((length - 1) * share) if k in chosen_pieces else 0, 1))
            for k, (piece, rest, length) in enumerate(zip(self.pieces, rests.tolist(), lengths.tolist(), strict=True))
        ]
        return replace(self, pieces=tuple(pieces))


@dataclass(frozen=True, eq=False)
class Point:
    """values (P,): of the parameters. states: of each piece, shape (3 + C,): start twist, offsets."""

    values: FloatArray
    states: tuple[FloatArray, ...]


@dataclass(frozen=True, eq=False)
class PieceSums:
    """What a kernel adds up over one piece; the last axes are the P parameters, then the 3 + C states of the piece."""

    columns: IntArray  # index of each column among Problem.columns
    number: FloatArray
    square: FloatArray
    loss: FloatArray
    lag: FloatArray
    grad: FloatArray  # (C, P + 3 + C)
    info: FloatArray  # (C, P + 3 + C, P + 3 + C)
    score: FloatArray  # (blocks, P + 3 + C)
    drift: FloatArray  # (blocks, C)
    waves: FloatArray | None = None  # (C, M, 2, P + 3 + C)


def per_column(sums: Sequence[PieceSums], columns: int, name: str) -> FloatArray:
    """One sum, `number`, `square`, `loss` or `lag`, over all pieces. Shape (columns,)."""
    total = np.zeros(columns)
    for piece in sums:
        total[piece.columns] += getattr(piece, name)
    return total
