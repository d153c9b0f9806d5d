"""A dear engine near a point, by a cheap one: what that is off by at the point is put right, once.

The implicit engine with a step a row is three times as fast as with a tolerance, and what it is off by hardly changes
on the way of some standard errors. Residuals and slopes are exact at the point itself. Its kinks are not where those of
the dear engine are, which must have the last word.
"""

from __future__ import annotations

import numpy as np

from omnidyn.identification.output_error.engines.implicit import ImplicitEngine
from omnidyn.identification.output_error.engines.slipping import implicit_engine
from omnidyn.identification.output_error.memory.whitened import OfRows
from omnidyn.identification.output_error.problem.problem import Parts, Point, Problem
from omnidyn.identification.output_error.solve.solver import RowEngine


class NearEngine(OfRows):
    """Shows what `dear` would show near a point, by `cheap`: engines of the same problem."""

    def __init__(self, dear: RowEngine[Problem], cheap: RowEngine[Problem], point: Point):
        self.problem, self._cheap = dear.problem, cheap
        both = zip(dear.residuals(point), cheap.residuals(point), strict=True)
        self._off = [(np.nan_to_num(a[0] - b[0]), np.nan_to_num(a[1] - b[1])) for a, b in both]

    def on(self, problem: Problem) -> NearEngine:
        """Raises NotImplementedError: it knows its own pieces only."""
        raise NotImplementedError

    def residuals(self, point: Point) -> list[Parts]:
        """Residuals and slopes of every piece, see engines/sums.py."""
        parts = zip(self._cheap.residuals(point), self._off, strict=True)
        return [(residual + off, slopes + more, at) for (residual, slopes, at), (off, more) in parts]


def near(engine: RowEngine[Problem], point: Point) -> RowEngine[Problem]:
    """An engine for a few steps from a point: by a step a row where one with a tolerance simulates, else itself."""
    if not isinstance(engine, ImplicitEngine) or engine.tol is None:
        return engine
    return NearEngine(engine, implicit_engine(engine.problem), point)
