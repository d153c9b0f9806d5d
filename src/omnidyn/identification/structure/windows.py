"""Windows: short stretches of rows, all as long, in which a log shows the noise of a column without the model.

held: the same command for long enough that the robot has settled, while it moves; busy: all else in which it moves;
resting: it stands. again: the same commands as at other times, for long enough before and in them.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.clocks import usual_step
from omnidyn.identification.output_error.linear.driven_motion import DrivenMotion
from omnidyn.identification.output_error.linear.rows import TINY, FitRows
from omnidyn.identification.output_error.problem.problem import Piece
from omnidyn.logs.plateaus import COMMANDS, command_changes
from omnidyn.statistics import stretches

FORGETTING_CONSTANTS, SETTLING_CONSTANTS = (
    5.0,
    3.0,
)  # time constants after which nothing is left of a start, and what is left is modelled
LEAST_ROWS = 12  # rows of a window
COMMAND_TOLERANCE = 1e-3  # of the largest command: commands that differ by less are the same
STEP_TOLERANCE = 0.2  # of a row: rows that are longer or shorter are not as long
MOVING_SHARE = 0.5  # of the rows of a window in which it moves
ENDLESS_ROWS = 10**9  # rows
MIX = np.uint64(0x9E3779B97F4A7C15)  # odd, so that no power of it is 0 in 64 bits
Found = tuple[int, int, int, Hashable]  # piece, column in it, first known row, group


@dataclass(frozen=True, eq=False)
class ResidualWindows:
    """values (m, L): residuals in m windows; groups (m,): those of one command, or of one set of repeats."""

    values: FloatArray
    groups: IntArray

    def __add__(self, windows: ResidualWindows) -> ResidualWindows:
        """Both, the groups apart."""
        groups = np.concatenate([self.groups, windows.groups + self.groups.max(initial=-1) + 1])
        return ResidualWindows(np.concatenate([self.values, windows.values]), groups)

    @classmethod
    def of(cls, rows: FitRows, places: Sequence[Found], length: int) -> ResidualWindows:
        """Of (piece, column in it, first known row, group)."""
        names = {name: i for i, name in enumerate(dict.fromkeys(name for *_, name in places))}
        values = [rows.residual[k][j][rows.masks[k][j]][first : first + length] for k, j, first, _ in places]
        return cls(np.array(values).reshape(-1, length), np.array([names[name] for *_, name in places], dtype=int))

    @property
    def several(self) -> int:
        """How many groups there are."""
        return len(np.unique(self.groups))


@dataclass(frozen=True, eq=False)
class Shown:
    """The windows of one column. step [s]: of its rows. repeat_windows: those with repeats, by sets."""

    step: float
    held_windows: ResidualWindows
    busy: ResidualWindows
    resting: ResidualWindows
    repeat_windows: ResidualWindows
    row_gap: int  # rows that repeats are from each other, at least


@dataclass(frozen=True, eq=False)
class _Set:
    """Stretches of `length` rows with the same commands: pieces (m,), rows (m,) that they begin at there; row_gap: rows
    from one to the next, at least."""

    pieces: IntArray
    rows: IntArray
    length: int
    row_gap: int


@dataclass(frozen=True, eq=False)
class _Column:
    """A column in a piece, by its known rows: k, j; rows (n,) of the piece; joined (n,): whether the row before is
    known, too; moves, resting_rows (n,); time_since_change (n,) [s] the last change of command, 0 where none comes in
    steps; hold_numbers (n,): which hold, by its command; step [s]."""

    k: int
    j: int
    rows: IntArray
    joined: BoolArray
    moves: BoolArray
    resting_rows: BoolArray
    time_since_change: FloatArray
    hold_numbers: IntArray
    step: float

    def whole(self, row: int, length: int) -> int | None:
        """The index of a row from which on so many are known, and in most of which it moves; None where not."""
        first_index = int(np.searchsorted(self.rows, row))
        stretch_rows = self.rows[first_index : first_index + length]
        return (
            first_index
            if len(stretch_rows) == length
            and stretch_rows[0] == row
            and stretch_rows[-1] == row + length - 1
            and (self.moves[first_index : first_index + length].mean() >= MOVING_SHARE)
            else None
        )

    def runs(self, mask: BoolArray, by_hold: bool = False) -> list[tuple[int, int]]:
        """Stretches of joined rows in which a mask holds, (first, behind the last); each within one hold."""
        cut = ~self.joined
        if by_hold:
            cut = cut | (np.diff(self.hold_numbers, prepend=self.hold_numbers[:1]) != 0)
        joined_runs = []
        for a, b in stretches(mask).tolist():
            edges = [a, *(np.flatnonzero(cut[a + 1 : b]) + a + 1).tolist(), b]
            joined_runs += [(x, y) for x, y in pairwise(edges) if y - x >= LEAST_ROWS]
        return joined_runs


def slowest(motions: Sequence[DrivenMotion]) -> float:
    """The slowest time constant of the fitted robot [s], in the median of rows."""
    decay_rates = np.concatenate([np.abs(np.linalg.eigvals(motion.decay)).max(axis=1) for motion in motions])
    steps, decays = np.concatenate([np.diff(motion.t) for motion in motions]), (decay_rates > 0.0) & (decay_rates < 1.0)
    return float(np.median(-steps[decays] / np.log(decay_rates[decays]))) if decays.any() else np.inf


def shown(rows: FitRows, motions: Sequence[DrivenMotion]) -> list[Shown]:
    """The windows of each column of the problem."""
    constant = slowest(motions)
    commands = _commands(rows.pieces)
    holds_by_piece = [_holds(piece, command) for piece, command in zip(rows.pieces, commands, strict=True)]
    repeats = _repeats(rows.pieces, commands, FORGETTING_CONSTANTS * constant)
    return [
        _of_column(rows, motions, c, SETTLING_CONSTANTS * constant, repeats, holds_by_piece)
        for c in range(len(rows.problem.columns))
    ]


def _of_column(
    rows: FitRows,
    motions: Sequence[DrivenMotion],
    c: int,
    settling_time: float,
    repeats: Sequence[_Set],
    holds_by_piece: Sequence[tuple[FloatArray, IntArray]],
) -> Shown:
    parts = [
        _column(rows, motions[k], k, columns.index(c), settling_time, *holds_by_piece[k])
        for k, columns in enumerate(rows.column)
        if c in columns and rows.masks[k][columns.index(c)].sum() >= LEAST_ROWS
    ]
    step = float(np.median([part.step for part in parts])) if parts else 1.0
    still_runs = [part.runs((part.time_since_change >= settling_time) & part.moves, by_hold=True) for part in parts]
    lengths = [b - a for runs in still_runs for a, b in runs]
    length = max(LEAST_ROWS, int(min(settling_time / step, float(np.median(lengths)) if lengths else 1e3)))
    held_windows, busy_windows, rest_windows = list[Found](), list[Found](), list[Found]()
    for part, part_runs in zip(parts, still_runs, strict=True):
        used_rows = np.zeros(len(part.rows), dtype=bool)
        for a, b in part_runs:
            for first in range(b - length, a - 1, -length):
                held_windows.append((part.k, part.j, first, int(part.hold_numbers[first])))
                used_rows[first : first + length] = True
        for mask, windows in ((part.moves & ~used_rows, busy_windows), (part.resting_rows, rest_windows)):
            for a, b in part.runs(mask):
                windows += [(part.k, part.j, first, (part.k, first)) for first in range(a, b - length + 1, length)]
    repeat_windows, row_gap = _again(parts, repeats, length)
    return Shown(
        step,
        *(
            ResidualWindows.of(rows, places, length)
            for places in (held_windows, busy_windows, rest_windows, repeat_windows)
        ),
        row_gap=row_gap,
    )


def _column(
    rows: FitRows,
    motion: DrivenMotion,
    k: int,
    j: int,
    settling_time: float,
    time_since_change: FloatArray,
    hold_numbers: IntArray,
) -> _Column:
    known_rows, row_numbers = np.flatnonzero(rows.masks[k][j]), np.arange(len(motion.t))
    still_rows = (motion.twist == 0.0).all(axis=1)
    last_moving_rows = np.maximum.accumulate(np.where(still_rows, 0, row_numbers))
    resting_rows = still_rows & (motion.t - motion.t[last_moving_rows] >= settling_time)
    moves, step = rows.moves[k][j] & ~still_rows, usual_step(motion.t[known_rows])
    return _Column(
        k,
        j,
        known_rows,
        rows.steps[k][j] == 1,
        moves[known_rows],
        resting_rows[known_rows],
        time_since_change[known_rows],
        hold_numbers[known_rows],
        step,
    )


def _again(parts: Sequence[_Column], repeats: Sequence[_Set], length: int) -> tuple[list[Found], int]:
    """(windows of what came again: piece, column in it, first known row, set; rows that they are apart, at least)."""
    part_by_piece, places, row_gap = {part.k: part for part in parts}, [], ENDLESS_ROWS
    for number, repeat in enumerate(repeats):
        for first in range(0, repeat.length - length + 1, length):
            repeat_places = [
                (k, part_by_piece[k].j, first_index, (number, first))
                for k, row in zip(repeat.pieces.tolist(), repeat.rows.tolist(), strict=True)
                if k in part_by_piece and (first_index := part_by_piece[k].whole(row + first, length)) is not None
            ]
            if len(repeat_places) > 1:
                places += repeat_places
                row_gap = min(row_gap, repeat.row_gap)
    return places, row_gap


def _commands(pieces: Sequence[Piece]) -> list[FloatArray]:
    """What is commanded in the rows of each piece, in steps of COMMAND_TOLERANCE of the largest command, (rows,
    any)."""
    commands_by_piece = []
    for piece in pieces:
        record, rows = piece.record, slice(piece.first, piece.last + 1)
        channels = record.run.channels if record.run is not None else {}
        command = next((channels[name] for name in COMMANDS if name in channels), None)
        if command is None or not np.isfinite(command[piece.first : piece.last]).all():
            command = record.voltage if record.set_point is None else record.set_point
        commands_by_piece.append(np.nan_to_num(command[rows]))
    top = max(float(np.abs(commands).max()) for commands in commands_by_piece)
    return [np.round(commands / (COMMAND_TOLERANCE * max(top, TINY))) for commands in commands_by_piece]


def _holds(piece: Piece, commands: FloatArray) -> tuple[FloatArray, IntArray]:
    """(time since the last change of command [s], 0 where none comes in steps, a number of the command) of each row."""
    t, row_numbers = piece.record.t[piece.first : piece.last + 1], np.arange(len(commands))
    changes = command_changes(piece.record.run) if piece.record.run is not None else None
    if changes is None:
        return np.zeros(len(t)), np.zeros(len(t), dtype=int)
    change_mask = changes[piece.first : piece.last + 1] | (row_numbers == 0)
    hold_starts = np.maximum.accumulate(np.where(change_mask, row_numbers, 0))
    _, hold_numbers = np.unique(commands[hold_starts], axis=0, return_inverse=True)
    return t - t[hold_starts], hold_numbers.reshape(-1)


def _repeats(pieces: Sequence[Piece], commands: Sequence[FloatArray], memory_time: float) -> list[_Set]:
    """Stretches of rows whose commands, and those of the time before them in which a robot forgets, came again.

    A row is known by all commands of that time and by the rows since the last change. Commands become random numbers,
    those of a time a sum of such, each times a power of an odd one: two that differ have the same in one of 2^64.
    """
    steps = [np.diff(piece.record.t[piece.first : piece.last + 1]) for piece in pieces]
    usual_time = float(np.median(np.concatenate(steps)))
    if not memory_time / usual_time < max(map(len, steps)):
        return []
    memory_rows = int(np.ceil(memory_time / usual_time))
    if len({command.shape[1] for command in commands}) > 1:
        return []
    _, command_numbers = np.unique(np.concatenate(commands), axis=0, return_inverse=True)
    random = np.random.default_rng(0).integers(0, 2**63, size=int(command_numbers.max()) + 1, dtype=np.uint64)
    power = MIX ** np.arange(memory_rows + 1, dtype=np.uint64)
    starts = np.cumsum([0, *map(len, commands)])
    keys = np.arange(starts[-1], dtype=np.uint64)  # of a row of which not enough is known: its own
    for step, start, end in zip(steps, starts, starts[1:], strict=False):
        if end - start <= memory_rows:
            continue
        piece_numbers = command_numbers.reshape(-1)[start:end]
        change_mask = np.diff(piece_numbers, prepend=-1) != 0
        row_numbers = np.arange(end - start)
        rows_since_change = (
            row_numbers[:-1] - np.maximum.accumulate(np.where(change_mask, row_numbers, 0))[:-1]
        )  # of the command that led to a row
        past_hash = sliding_window_view(random[piece_numbers[:-1]], memory_rows) @ power[:memory_rows]
        uneven = np.cumsum([0, *(np.abs(step / usual_time - 1.0) > STEP_TOLERANCE)])
        same_steps = uneven[memory_rows:] == uneven[: end - start - memory_rows]
        keys[start + memory_rows : end][same_steps] = (
            past_hash + rows_since_change[memory_rows - 1 :].astype(np.uint64) * power[memory_rows]
        )[same_steps]
    return _joined(keys, starts)


def _joined(keys: NDArray[np.uint64], starts: IntArray) -> list[_Set]:
    """Rows of one key in stretches whose rows all come again at the same places."""
    _, key_numbers = np.unique(keys, return_inverse=True)
    order = np.argsort(key_numbers, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(key_numbers[order])) + 1)
    joined_groups: list[tuple[IntArray, int]] = []
    for group in sorted((group for group in groups if len(group) > 1), key=lambda joined_group: int(joined_group[0])):
        if (
            joined_groups
            and len(joined_groups[-1][0]) == len(group)
            and (joined_groups[-1][0] + joined_groups[-1][1] == group).all()
        ):
            joined_groups[-1] = (joined_groups[-1][0], joined_groups[-1][1] + 1)
        else:
            joined_groups.append((group, 1))
    pieces = [np.searchsorted(starts, group, side="right") - 1 for group, _ in joined_groups]
    return [
        _Set(piece, group - starts[piece], length, int(np.diff(group).min()))
        for piece, (group, length) in zip(pieces, joined_groups, strict=True)
        if length >= LEAST_ROWS
    ]
