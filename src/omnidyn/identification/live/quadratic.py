"""What rows tell of the numbers, near a point: the likelihood of a fit as a quadratic, which adds up.

    sum of r^2 of a column at z + d  =  sum r^2 - 2 d' J'r + d' J'J d,        r the (whitened) residuals, J their slopes

J'r and J'J are those of the fit's own engine; the states at the starts of the pieces are eliminated, as the fit does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.engines.engine import FitEngine, Weighting
from omnidyn.identification.output_error.problem.problem import Column, PieceSums, Point, Problem
from omnidyn.identification.output_error.solve.normal_equations import of_states
from omnidyn.identification.output_error.solve.solver import Normal, Solver, State
from omnidyn.model.layout import N_AXES


@dataclass(frozen=True, eq=False)
class Quadratic:
    """columns, values (P,): of which outputs, and the point. number, square (C,): of rows, and their sum of squares.

    gradient (C, P), information (C, P, P): J'r and J'J.
    """

    columns: tuple[Column, ...]
    values: FloatArray
    number: FloatArray
    square: FloatArray
    gradient: FloatArray
    information: FloatArray

    @classmethod
    def empty(cls, columns: Sequence[Column], values: FloatArray) -> Quadratic:
        """That of no rows."""
        width, count = len(columns), len(values)
        number, square = np.zeros((2, width))
        return cls(tuple(columns), values, number, square, np.zeros((width, count)), np.zeros((width, count, count)))

    @classmethod
    def of(cls, solver: Solver[Problem], state: State, columns: Sequence[Column]) -> Quadratic:
        """That of a state of a fit, of these columns; others that it has are left out."""
        normal, count = Normal(solver, state), len(solver.problem.parameters)
        total = cls.empty(columns, state.point.values)
        places = [columns.index(column) if column in columns else -1 for column in solver.problem.columns]
        for sums, (gradient, information) in zip(state.sums, normal.pieces, strict=True):
            lift = np.eye(sums.grad.shape[1])[:, :count]
            shift = np.zeros(len(lift))
            if len(gradient) > count:  # the states follow the parameters
                lift[count:] = -of_states(information[count:, count:], information[count:, :count]) / normal.scale
                shift[count:] = of_states(information[count:, count:], gradient[count:])
            for c, column in enumerate(sums.columns):
                if (k := places[column]) < 0:
                    continue
                moved_gradient = sums.grad[c] - sums.info[c] @ shift
                total.number[k] += sums.number[c]
                total.square[k] += max(sums.square[c] - shift @ (sums.grad[c] + moved_gradient), 0.0)
                total.gradient[k] += lift.T @ moved_gradient
                total.information[k] += lift.T @ sums.info[c] @ lift
        return total

    def at(self, values: FloatArray) -> Quadratic:
        """The same about another point."""
        change = values - self.values
        gradient = self.gradient - self.information @ change
        square = np.maximum(self.square - (self.gradient + gradient) @ change, 0.0)
        return replace(self, values=values, square=square, gradient=gradient)

    def plus(self, other: Quadratic) -> Quadratic:
        """Both together, about the point of this one."""
        other = other.at(self.values)
        return replace(
            self,
            number=self.number + other.number,
            square=self.square + other.square,
            gradient=self.gradient + other.gradient,
            information=self.information + other.information,
        )


class QuadraticEngine(FitEngine[Problem]):
    """What a quadratic shows at any point: nothing is simulated."""

    def __init__(self, problem: Problem, quadratic: Quadratic):
        piece = replace(problem.pieces[-1], start_std=None)
        self.problem, self.quadratic = replace(problem, pieces=(piece,)), quadratic

    def sums(self, point: Point, weighting: Weighting) -> list[PieceSums]:
        """What all rows add up to; no scores of blocks."""
        here = self.quadratic.at(point.values)
        width, count = len(here.columns), len(here.values)
        room = count + N_AXES
        gradient, information = np.zeros((width, room)), np.zeros((width, room, room))
        gradient[:, :count], information[:, :count, :count] = here.gradient, here.information
        places = np.array([self.problem.columns.index(column) for column in here.columns])
        zeros = np.zeros(width)
        return [
            PieceSums(
                places, here.number, here.square, zeros, zeros, gradient, information, np.zeros((1, room)),
                np.zeros((1, width)), None,
            )
        ]  # fmt: skip


def summing_solver(problem: Problem, quadratic: Quadratic) -> Solver[Problem]:
    """The fit's solver on a quadratic in the place of rows."""
    engine = QuadraticEngine(problem, quadratic)
    return Solver(engine.problem, engine, counts_ticks=False)


def put(solver: Solver[Problem], quadratic: Quadratic) -> None:
    """Let a `summing_solver` go on with another quadratic."""
    assert isinstance(solver.engine, QuadraticEngine)
    solver.engine.quadratic = quadratic
