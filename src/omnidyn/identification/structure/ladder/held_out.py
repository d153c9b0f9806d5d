"""How well a fitted model predicts blocks of the log that it was not fitted to, beside another model of the same log.

Both are seen in the same rows, made white by the same memory: so their squared errors are of one kind. What a fit to
the other blocks would be is one linear step away from the fit to all.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.identification.output_error.linear.blocks import Blocks
from omnidyn.identification.output_error.linear.rows import Linear, Rows
from omnidyn.identification.output_error.memory.autoregression import AutoRegression
from omnidyn.identification.output_error.problem.decimated import Decimated
from omnidyn.identification.output_error.problem.problem import Parts, Point, bounded
from omnidyn.identification.output_error.solve.solver import Solution
from omnidyn.identification.structure.tails import as_counted

Shows = Callable[[Point], list[Parts]]
Memories = Sequence[AutoRegression] | Mapping[str, Sequence[AutoRegression]]
FAR = 1.5  # times what a fit to all leaves of a block, from which the error by a fit to all others is simulated
SHARES = (1.0, 0.5, 0.25, 0.125)  # of a step that are tried
CLEAR = 1.0  # standard errors of its gain by which a step must pay


@dataclass(frozen=True, eq=False)
class Errors:
    """Of a model. held_out (B,): the squared error of each block by a fit to all others; left: of all, by the fit to
    all; rows: how many there are. numbers: how many are fitted."""

    held_out: FloatArray
    left: float
    rows: int
    numbers: int

    @property
    def size(self) -> float:
        """Root mean square of the held-out error."""
        return float(np.sqrt(max(self.held_out.sum(), 0.0) / max(self.rows, 1)))

    def bic(self, tried: int = 1) -> float:
        """n log(S/n) + k log n, and 2 log of the number of models that it is the best of."""
        n = max(self.rows, 2)
        return float(n * np.log(max(self.left, 1e-300) / n) + self.numbers * np.log(n) + 2.0 * np.log(max(tried, 1)))

    def gain(self, before: Errors) -> tuple[float, float]:
        """(share of the squared held-out error of another model that this one takes away, its standard error)."""
        change = (before.held_out - self.held_out) / max(float(before.held_out.sum()), 1e-300)
        return float(change.sum()), float(change.std(ddof=1) * np.sqrt(len(change)))


def errors(solution: Solution, memory: Memories, margins: Sequence[FloatArray], more: int = 0) -> Errors:
    """The errors of a fit. memory: of each column, of each group where there are any; margins: of each piece, see
    `margins_of`; more: numbers that are fitted beside its parameters. One that a bound holds was fitted, too: it is no
    gain of the model without it.

    Of groups a tenth of each is held out at a time: no number that a group has for itself is without a log.
    """
    engine = solution.solver.engine
    if not isinstance(memory, Mapping) or not engine.members:
        memory = next(iter(memory.values())) if isinstance(memory, Mapping) else memory
        blocks, seen = _blocks(solution, memory, margins)
    else:
        parts, seen, told = list[tuple[Blocks, IntArray]](), 0, set[int]()
        for member in engine.members:
            own = [margins[k] for k in member.places]
            found, rows = _blocks(
                member.alone(solution),
                memory[member.name],
                own,
                [k for k, at in enumerate(member.at.tolist()) if at in told],
            )
            parts.append((found, member.at))
            seen, told = seen + rows, told | {*member.at.tolist()}
        blocks = _Together(parts, len(solution.solver.problem.parameters))
    known = np.arange(1, 1 + blocks.count)
    return Errors(blocks.predicted(known), blocks.left(known), seen, blocks.count + more)


def _blocks(
    solution: Solution, memory: Sequence[AutoRegression], margins: Sequence[FloatArray], told: Container[int] = ()
) -> tuple[Blocks, int]:
    """(blocks of one group, how many rows they have). told: parameters whose priors another group has already."""
    whole, point = solution.solver.problem, solution.state.point
    pieces = [replace(piece, margin=margin) for piece, margin in zip(whole.pieces, margins, strict=True)]
    few = Decimated.of(replace(whole, pieces=tuple(pieces)))
    problem = bounded(few.problem)
    engine = solution.solver.engine.on(few.all_rows(problem))
    shows: Shows = lambda at: as_counted(solution, problem, few.kept(engine.residuals(at)))  # noqa: E731
    bare = [replace(p, prior=None) if k in told else p for k, p in enumerate(problem.parameters)]
    rows = Rows.of(replace(problem, parameters=tuple(bare)), point, shows(point))
    slopes = [np.where(solution.held, 0.0, slope) for slope in rows.slopes]  # what a bound holds, holds in every block
    linear = Linear(replace(rows, slopes=slopes), memory)
    nothing = [np.zeros((*residual.shape, 0)) for residual in rows.residual]
    return _AsTheyAre(linear, nothing, shows), int(sum(there.sum() for there in rows.there))


class _AsTheyAre(Blocks):
    """The blocks of a fit, and what its engine shows at a point: what one to all others predicts can be simulated."""

    def __init__(self, linear: Linear, shown: Sequence[FloatArray], shows: Shows):
        super().__init__(linear, shown)
        self.linear, self.shows = linear, shows

    def predicted(self, at: IntArray) -> FloatArray:
        """The squared error of each block by a fit to all others, simulated where a linear step says far more than the
        fit to all leaves there: it follows numbers that hardly anything but this block tells to where no slope holds,
        and a fit would not."""
        values, inside = self.held_out(at), self.fitted(self.total, at)
        for b, own in enumerate(self.matrix):
            left = own[0, 0] - 2.0 * inside @ own[at, 0] + inside @ own[np.ix_(at, at)] @ inside
            if values[b] > FAR * left:
                values[b] = self._simulated(self.fitted(self.total - own, at) / self.size[at], b)
        return values

    def _simulated(self, step: FloatArray, b: int) -> float:
        """The squared error of a block, the numbers as far along a step (P,) as the other blocks gain by it."""
        before, after, mine = self._square(0.0 * step), np.zeros(0), self.block[b]
        for share in (*SHARES, 0.0):
            after = self._square(share * step)
            if np.delete(after, mine).sum() <= np.delete(before, mine).sum():
                break
        return float(after[mine].sum())

    def _square(self, step: FloatArray) -> FloatArray:
        """The squared errors (N,) of all rows and priors where the numbers that the solver sees are a step away."""
        rows = self.linear.rows
        values = [
            min(max(p.outer(p.inner(value) + by), p.low), p.high)
            for p, value, by in zip(rows.problem.parameters, rows.point.values.tolist(), step.tolist(), strict=True)
        ]
        point = replace(rows.point, values=np.array(values))
        shown = Rows.of(rows.problem, point, self.shows(point))
        moved = replace(rows, point=point, residual=shown.residual)
        return replace(self.linear, rows=moved).whole()[0] ** 2


class _Together(Blocks):
    """The blocks of several groups as those of one fit: their scalar products add up, each where its parameters stand
    among all. parts: blocks of a group, and where its parameters stand (P of the group,)."""

    def __init__(self, parts: Sequence[tuple[Blocks, IntArray]], count: int):
        self.count, self.rows = count, sum(part.rows for part, _ in parts)
        self.matrix = np.zeros((len(parts[0][0].matrix), 1 + count, 1 + count))
        self.total = np.zeros((1 + count, 1 + count))
        for part, at in parts:
            where, size = np.concatenate([[0], 1 + at]), np.outer(part.size, part.size)
            self.matrix[:, where[:, None], where] += part.matrix * size
            self.total[where[:, None], where] += part.total * size
        self.size = np.sqrt(np.diag(self.total))
        self.size[0] = 1.0
        self.size[self.size == 0.0] = 1.0
        self.matrix /= np.outer(self.size, self.size)
        self.total /= np.outer(self.size, self.size)
