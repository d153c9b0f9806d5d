"""A fit in blocks of its logs: what each alone says of the numbers, to first order around the fit of all.

Scalar products of [e, J, Z] of every piece, block by block and output by output; e: residuals made white, J: slopes
by the parameters, Z: by the start of the piece. A part of the logs is some of the blocks: theirs are added, each
output over the noise that it has in this part, and the start is taken out, in each part anew, as if it were fitted
alone. What rounded inputs show is a part of the errors: rows are white beside it, too (random_effects.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.identification.output_error.linear.rows import EIGEN_TOLERANCE, Linear
from omnidyn.identification.output_error.problem.record import Record

BLOCKS = 40  # of each log, the same share of its time each
PRIOR_ROWS = 50.0  # rows that the noise of an output in a part is worth beforehand: that of all logs


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
        rows, blocks = linear.rows, cls([], [], [], [], np.zeros(0, dtype=int), [], np.zeros(0))
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
                    rows_of_block = x[(block == b) & (column == c)]
                    products[b, c], number[b, c] = rows_of_block.T @ rows_of_block, len(rows_of_block)
            start_information = piece.start_prior(rows.point.states[k])[1]
            information = np.zeros(x.shape[1] - 1 - count)
            free_states = np.flatnonzero(piece.free)[: len(information)]
            information[: len(free_states)] = np.append(start_information, np.zeros(len(piece.free)))[free_states]
            blocks.products.append(products)
            blocks.number.append(number)
            blocks.column.append(np.array(rows.column[k]))
            blocks.start.append(np.diag(information))
            log.append(places.setdefault(id(piece.record), len(places)))
            if len(places) > len(blocks.records):
                blocks.records.append(piece.record)
        return cls(blocks.products, blocks.number, blocks.column, blocks.start, np.array(log), blocks.records, size)

    def part(self, mask: BoolArray) -> FloatArray:
        """Scalar products [e, J] (1 + P, 1 + P) of the blocks `mask` (pieces, B), their starts taken out."""
        count = len(self.size)
        noise, total = self._noise(mask), np.zeros((1 + count, 1 + count))
        for k, piece_mask in enumerate(mask):
            if piece_mask.any():
                x = np.einsum("bcij,c->ij", self.products[k][piece_mask], 1.0 / noise[self.column[k]])
                first = np.flatnonzero(self.number[k].sum(axis=1))[:1]
                total += _without(x, 1 + count, self.start[k] * bool(piece_mask[first].any()))
        return total

    def scores(self, mask: BoolArray) -> tuple[FloatArray, FloatArray]:
        """(gradients (N, P), information (N, P, P)) of the blocks `mask` (pieces, B), one by one."""
        noise, count = self._noise(mask), len(self.size)
        x = [
            np.einsum("bcij,c->bij", self.products[k][piece_mask], 1.0 / noise[self.column[k]])[
                :, : 1 + count, : 1 + count
            ]
            for k, piece_mask in enumerate(mask)
        ]
        gradients = np.concatenate(x)
        return gradients[:, 1:, 0], gradients[:, 1:, 1:]

    def _noise(self, mask: BoolArray) -> FloatArray:
        """Variance of the white rows of each output in a part. Shape (outputs,)."""
        outputs = 1 + max(int(piece_columns.max(initial=0)) for piece_columns in self.column)
        square, number = np.full(outputs, PRIOR_ROWS), np.full(outputs, PRIOR_ROWS)
        for k, piece_mask in enumerate(mask):
            np.add.at(square, self.column[k], self.products[k][piece_mask][:, :, 0, 0].sum(axis=0))
            np.add.at(number, self.column[k], self.number[k][piece_mask].sum(axis=0))
        return square / number


def _white(linear: Linear, k: int) -> tuple[FloatArray, IntArray, IntArray]:
    """(white [e, J, Z] (N, 1 + P + S), the block of each row (N,), its output (N,)) of a piece."""
    rows, piece = linear.rows, linear.rows.pieces[k]
    columns = np.concatenate([rows.residual[k][:, :, None], rows.slopes[k], rows.start_slopes[k]], axis=2)
    x = linear.with_start(k, columns)
    share = piece.record.share[piece.first : piece.last + 1]
    number = np.minimum((share * BLOCKS).astype(int), BLOCKS - 1)
    mask = rows.masks[k]
    block = np.concatenate([number[row_mask] for row_mask in mask])
    column = np.concatenate([np.full(int(row_mask.sum()), c) for c, row_mask in enumerate(mask)])
    return x, block, column


def _without(x: FloatArray, kept_count: int, known_information: FloatArray) -> FloatArray:
    """Scalar products (n, n) without what the columns after the first `kept_count` explain. known_information: of
    these, beforehand."""
    nuisance_products = x[kept_count:, kept_count:] + known_information
    size = np.sqrt(np.maximum(np.diag(nuisance_products), 0.0))
    positive_rows = size > 0.0
    if not positive_rows.any():
        return x[:kept_count, :kept_count]
    size = size[positive_rows]
    values, vectors = np.linalg.eigh(nuisance_products[np.ix_(positive_rows, positive_rows)] / np.outer(size, size))
    seen_values = values > EIGEN_TOLERANCE * values[-1]
    half = (vectors[:, seen_values] / np.sqrt(values[seen_values])).T @ (
        x[kept_count:, :kept_count][positive_rows] / size[:, None]
    )
    return x[:kept_count, :kept_count] - half.T @ half


def apart(
    parts: Sequence[FloatArray], told_numbers: IntArray, shared: IntArray, prior: FloatArray, pull: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(steps (K, T), their covariance (K T, K T)) of the numbers `told_numbers`, fitted in each of K parts for itself.

    parts: scalar products [e, J] (1 + P, 1 + P) of each. shared: numbers that all parts have in common, with what is
    known of them beforehand: `prior` (P,) of the information, `pull` (P,) of the gradient. A number that a part does
    not tell has an infinite variance there.
    """
    k, t = len(parts), len(told_numbers)
    total_count = k * t + len(shared)
    information, gradient = np.zeros((total_count, total_count)), np.zeros(total_count)
    shared_indices = np.arange(k * t, total_count)
    information[shared_indices, shared_indices], gradient[shared_indices] = prior[shared], pull[shared]
    for i, part in enumerate(parts):
        indices = np.concatenate([np.arange(i * t, (i + 1) * t), shared_indices])
        number_indices = np.concatenate([told_numbers, shared])
        information[np.ix_(indices, indices)] += part[1:, 1:][np.ix_(number_indices, number_indices)]
        gradient[indices] += part[1:, 0][number_indices]
    step, covariance = _solved(information, gradient)
    return step[: k * t].reshape(k, t), covariance[: k * t, : k * t]


def _solved(information: FloatArray, gradient: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(step, covariance), infinite for what has a part in a direction that is not seen."""
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    positive_rows = size > 1e-9 * size.max(initial=0.0)
    size = np.where(positive_rows, size, 1.0)
    values, vectors = np.linalg.eigh(information / np.outer(size, size))
    seen_values = values > 1e-9
    root = vectors[:, seen_values] / np.sqrt(values[seen_values]) / size[:, None]
    lost = ~positive_rows | ((vectors[:, ~seen_values] ** 2).sum(axis=1) > 1e-4)
    covariance = root @ root.T
    covariance[lost, lost] = np.inf
    return root @ (root.T @ gradient), covariance
