"""Means of so many rows of a problem: of what a fit misses, rows 1 ms apart say no more than their means over 20 ms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.identification.output_error.problem.bounded import ROWS, bounded
from omnidyn.identification.output_error.problem.problem import Parts, Piece, Problem
from omnidyn.identification.output_error.problem.record import SHORTEST, Record

LONGEST = 0.02  # [s] of a row that is made of several: most robots answer more slowly
KEPT_ROWS = 3000  # rows of all logs together, which are left at least: as many as `bench wrong_worlds` finds causes in
WHOLE_SHARE = 0.9  # of the rows of an output that must hold a number: others have a rate of their own
ROW_FACTOR = 10  # times as many rows as are looked at, that are simulated for them


@dataclass(frozen=True, eq=False)
class Decimated:
    """problem: with the rows that are kept. whole_problem: with all of them; it is the same one where none is left out.

    rows: of each piece, which rows of its record are kept. Inputs are means over what is between them, outputs over
    what is nearest to each: noise of all rows is averaged, as a fit to all does. Counts are as measured.
    """

    problem: Problem
    whole_problem: Problem
    rows: Sequence[IntArray]

    @classmethod
    def of(cls, problem: Problem) -> Decimated:
        """As few rows as KEPT_ROWS and LONGEST allow; all where that is none, of a speed loop, whose ticks count, and
        where outputs have clocks of their own."""
        records = {id(piece.record): piece.record for piece in problem.pieces}
        time = sum(float(np.ptp(piece.record.t[[piece.first, piece.last]])) for piece in problem.pieces)
        stride_by_record = {key: _stride(record, problem.pieces, time) for key, record in records.items()}
        if max(stride_by_record.values()) == 1:
            return cls(problem, problem, ())
        bounded_problem = bounded(problem, row_limit=ROW_FACTOR * ROWS)
        rows = [_rows(piece, stride_by_record[id(piece.record)]) for piece in bounded_problem.pieces]
        pieces = list[Piece]()
        for key, record in records.items():
            rows_of_record = [
                kept_rows
                for piece, kept_rows in zip(bounded_problem.pieces, rows, strict=True)
                if piece.record is record
            ]
            records[key] = _of_record(record, rows_of_record)
        for piece, piece_rows in zip(bounded_problem.pieces, rows, strict=True):
            record = records[id(piece.record)]
            first, last = np.searchsorted(record.t, piece.record.t[piece_rows[[0, -1]]]).tolist()
            pieces.append(replace(piece, record=record, first=first, last=last))
        return cls(replace(bounded_problem, pieces=tuple(pieces)), bounded_problem, rows)

    def all_rows(self, problem: Problem) -> Problem:
        """The problem to simulate for one that is `problem`, or shorter."""
        if not self.rows:
            return problem
        pieces = [
            replace(piece, last=int(kept_rows[piece_here.last - piece_here.first]))
            for piece, piece_here, kept_rows in zip(self.whole_problem.pieces, problem.pieces, self.rows, strict=True)
        ]
        return replace(self.whole_problem, pieces=tuple(pieces))

    def kept(self, parts: Sequence[Parts]) -> list[Parts]:
        """What an engine shows of `all_rows` in the rows that are kept."""
        if not self.rows:
            return list(parts)
        parts_by_piece = []
        for (residual, slopes, indices), piece, kept_rows in zip(
            parts, self.whole_problem.pieces, self.rows, strict=True
        ):
            rows = kept_rows[kept_rows < piece.first + residual.shape[1]] - piece.first
            counts = np.array(piece.record.ticks) > 0.0
            few_residuals, few_slopes = _nearest(residual, rows), _nearest(slopes, rows)
            few_residuals[counts], few_slopes[counts] = residual[counts][:, rows], slopes[counts][:, rows]
            parts_by_piece.append((few_residuals, few_slopes, indices))
        return parts_by_piece


def _stride(record: Record, pieces: Sequence[Piece], time: float) -> int:
    """Of how many rows of a record one is kept. time [s]: of all pieces."""
    record_pieces = [piece for piece in pieces if piece.record is record]
    measured = np.concatenate([np.isfinite(record.outputs[piece.first : piece.last + 1]) for piece in record_pieces])
    if record.set_point is not None or record.staggered or measured.mean(axis=0).min(initial=1.0) < WHOLE_SHARE:
        return 1
    step = float(
        np.median(np.concatenate([np.diff(record.t[piece.first : piece.last + 1]) for piece in record_pieces]))
    )
    return max(int(1.001 * min(LONGEST, time / KEPT_ROWS) / step), 1)


def _rows(piece: Piece, stride: int) -> IntArray:
    """The rows of a piece that are kept; all of one that is short."""
    rows = np.arange(piece.first, piece.last + 1, stride)
    return rows if len(rows) >= SHORTEST else np.arange(piece.first, piece.last + 1)


def _of_record(record: Record, rows_by_piece: Sequence[IntArray]) -> Record:
    """A record of the rows that some pieces keep, and its ends, which say how much of it has gone by."""
    rows = np.unique(np.concatenate([*rows_by_piece, [0, len(record.t) - 1]]))
    pieces = [
        (int(np.searchsorted(rows, own_rows[0])), int(np.searchsorted(rows, own_rows[-1])))
        for own_rows in rows_by_piece
    ]
    voltage, outputs, counts = record.voltage[rows], record.outputs[rows], np.array(record.ticks) > 0.0
    for piece_rows, (first, last) in zip(rows_by_piece, pieces, strict=True):
        voltage[first:last] = _means(record, piece_rows)
        means = _nearest(record.outputs[piece_rows[0] : piece_rows[-1] + 1].T, piece_rows - piece_rows[0]).T
        outputs[first : last + 1, ~counts] = means[:, ~counts]
    run = record.run
    if run is not None:
        run = run.replace(t=run.t[rows], **{name: values[rows] for name, values in run.channels.items()})
    return replace(record, t=record.t[rows], voltage=voltage, outputs=outputs, pieces=tuple(pieces), run=run)


def _means(record: Record, rows: IntArray) -> FloatArray:
    """The mean voltage between some rows, each held until the next. Shape (n - 1, W)."""
    inner_rows = slice(int(rows[0]), int(rows[-1]))
    step = np.diff(record.t[inner_rows.start : inner_rows.stop + 1])[:, None]
    voltage_sums = np.add.reduceat(record.voltage[inner_rows] * step, rows[:-1] - rows[0])
    return voltage_sums / np.diff(record.t[rows])[:, None]


def _nearest(values: FloatArray, rows: IntArray) -> FloatArray:
    """Means of the numbers among values (C, n, ...) that are nearest to each of some rows (K,). Shape (C, K, ...)."""
    first = np.concatenate([[0], (rows[:-1] + rows[1:] + 1) // 2])
    mask = np.isfinite(values)
    value_sums = np.add.reduceat(np.where(mask, values, 0.0), first, axis=1)
    count = np.add.reduceat(mask.astype(float), first, axis=1)
    return np.where(count > 0.0, value_sums / np.maximum(count, 1.0), np.nan)
