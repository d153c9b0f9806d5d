"""A fit in blocks of its logs: what each alone says of the numbers, to first order around the fit of all.

Scalar products of [e, J, Z] of every piece, block by block and output by output; e: residuals made white, J: slopes by
the parameters, Z: by the start of the piece. A part of the logs is some of the blocks: theirs are added, each output
over the noise that it has in this part, and the start is taken out, in each part anew, as if it were fitted alone.
What rounded inputs show is a part of the errors: rows are white beside it, too (random_effects.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.identification.output_error.linear.rows import SAME, Linear
from omnidyn.identification.output_error.problem.record import Record

BLOCKS = 40  # of each log, the same share of its time each
FIRM = 50.0  # rows that the noise of an output in a part is worth beforehand: that of all logs


@dataclass(frozen=True, eq=False)
class Blocks:
    """products: of each piece (B, C, n, n), n = 1 + P + S; number: of each piece (B, C) rows. column: of each piece
    (C,), which of the outputs it is. start: of each piece (S, S), what is known of its start. log: of each piece (K,),
    which log it belongs to. size (P,): what the columns of J were divided by."""

    products: list[FloatArray]
    number: list[FloatArray]
    column: list[IntArray]
    start: list[FloatArray]
    log: IntArray
    records: list[Record]
    size: FloatArray

    @classmethod
    def of(cls, linear: Linear) -> Blocks:
        """The blocks of a fit in white rows."""
        rows, found = linear.rows, cls([], [], [], [], np.zeros(0, dtype=int), [], np.zeros(0))
        of_pieces = [_white(linear, k) for k in range(len(rows.pieces))]
        count = len(rows.problem.parameters)
        size = np.sqrt(sum((x[:, 1 : 1 + count] ** 2).sum(axis=0) for x, _, _ in of_pieces))
        size = np.where(size > 0.0, size, 1.0)
        places: dict[int, int] = {}
        log = []
        for k, (piece, (x, block, column)) in enumerate(zip(rows.pieces, of_pieces, strict=True)):
            x[:, 1 : 1 + count] /= size
            products = np.zeros((BLOCKS, len(rows.column[k]), x.shape[1], x.shape[1]))
            number = np.zeros(products.shape[:2])
            for b in np.unique(block).tolist():
                for c in range(products.shape[1]):
                    own = x[(block == b) & (column == c)]
                    products[b, c], number[b, c] = own.T @ own, len(own)
            known = piece.start_prior(rows.point.states[k])[1]
            wide = np.zeros(x.shape[1] - 1 - count)
            held = np.flatnonzero(piece.free)[: len(wide)]
            wide[: len(held)] = np.append(known, np.zeros(len(piece.free)))[held]
            found.products.append(products)
            found.number.append(number)
            found.column.append(np.array(rows.column[k]))
            found.start.append(np.diag(wide))
            log.append(places.setdefault(id(piece.record), len(places)))
            if len(places) > len(found.records):
                found.records.append(piece.record)
        return cls(found.products, found.number, found.column, found.start, np.array(log), found.records, size)

    def part(self, chosen: BoolArray) -> FloatArray:
        """Scalar products [e, J] (1 + P, 1 + P) of the blocks `chosen` (pieces, B), their starts taken out."""
        count = len(self.size)
        noise, total = self._noise(chosen), np.zeros((1 + count, 1 + count))
        for k, own in enumerate(chosen):
            if own.any():
                x = np.einsum("bcij,c->ij", self.products[k][own], 1.0 / noise[self.column[k]])
                first = np.flatnonzero(self.number[k].sum(axis=1))[:1]
                total += _without(x, 1 + count, self.start[k] * bool(own[first].any()))
        return total

    def scores(self, chosen: BoolArray) -> tuple[FloatArray, FloatArray]:
        """(gradients (N, P), information (N, P, P)) of the blocks `chosen` (pieces, B), one by one."""
        noise, count = self._noise(chosen), len(self.size)
        x = [
            np.einsum("bcij,c->bij", self.products[k][own], 1.0 / noise[self.column[k]])[:, : 1 + count, : 1 + count]
            for k, own in enumerate(chosen)
        ]
        every = np.concatenate(x)
        return every[:, 1:, 0], every[:, 1:, 1:]

    def _noise(self, chosen: BoolArray) -> FloatArray:
        """Variance of the white rows of each output in a part. Shape (outputs,)."""
        outputs = 1 + max(int(each.max(initial=0)) for each in self.column)
        square, number = np.full(outputs, FIRM), np.full(outputs, FIRM)
        for k, own in enumerate(chosen):
            np.add.at(square, self.column[k], self.products[k][own][:, :, 0, 0].sum(axis=0))
            np.add.at(number, self.column[k], self.number[k][own].sum(axis=0))
        return square / number


def _white(linear: Linear, k: int) -> tuple[FloatArray, IntArray, IntArray]:
    """(white [e, J, Z] (N, 1 + P + S), the block of each row (N,), its output (N,)) of a piece."""
    rows, piece = linear.rows, linear.rows.pieces[k]
    every = np.concatenate([rows.residual[k][:, :, None], rows.slopes[k], rows.own[k]], axis=2)
    x = linear.with_start(k, every)
    share = piece.record.share[piece.first : piece.last + 1]
    number = np.minimum((share * BLOCKS).astype(int), BLOCKS - 1)
    there = rows.there[k]
    block = np.concatenate([number[own] for own in there])
    column = np.concatenate([np.full(int(own.sum()), c) for c, own in enumerate(there)])
    return x, block, column


def _without(x: FloatArray, kept: int, known: FloatArray) -> FloatArray:
    """Scalar products (n, n) without what the columns after the first `kept` explain. known: of these, beforehand."""
    own = x[kept:, kept:] + known
    size = np.sqrt(np.maximum(np.diag(own), 0.0))
    there = size > 0.0
    if not there.any():
        return x[:kept, :kept]
    size = size[there]
    values, vectors = np.linalg.eigh(own[np.ix_(there, there)] / np.outer(size, size))
    seen = values > SAME * values[-1]
    half = (vectors[:, seen] / np.sqrt(values[seen])).T @ (x[kept:, :kept][there] / size[:, None])
    return x[:kept, :kept] - half.T @ half


def apart(
    parts: Sequence[FloatArray], told: IntArray, shared: IntArray, prior: FloatArray, pull: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(steps (K, T), their covariance (K T, K T)) of the numbers `told`, fitted in each of K parts for itself.

    parts: scalar products [e, J] (1 + P, 1 + P) of each. shared: numbers that all parts have in common, with what is
    known of them beforehand: `prior` (P,) of the information, `pull` (P,) of the gradient. A number that a part does
    not tell has an infinite variance there.
    """
    k, t = len(parts), len(told)
    wide = k * t + len(shared)
    information, gradient = np.zeros((wide, wide)), np.zeros(wide)
    common = np.arange(k * t, wide)
    information[common, common], gradient[common] = prior[shared], pull[shared]
    for i, each in enumerate(parts):
        at = np.concatenate([np.arange(i * t, (i + 1) * t), common])
        own = np.concatenate([told, shared])
        information[np.ix_(at, at)] += each[1:, 1:][np.ix_(own, own)]
        gradient[at] += each[1:, 0][own]
    step, covariance = _solved(information, gradient)
    return step[: k * t].reshape(k, t), covariance[: k * t, : k * t]


def _solved(information: FloatArray, gradient: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(step, covariance), infinite for what has a part in a direction that is not seen."""
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    there = size > 1e-9 * size.max(initial=0.0)
    size = np.where(there, size, 1.0)
    values, vectors = np.linalg.eigh(information / np.outer(size, size))
    seen = values > 1e-9
    root = vectors[:, seen] / np.sqrt(values[seen]) / size[:, None]
    lost = ~there | ((vectors[:, ~seen] ** 2).sum(axis=1) > 1e-4)
    covariance = root @ root.T
    covariance[lost, lost] = np.inf
    return root @ (root.T @ gradient), covariance
