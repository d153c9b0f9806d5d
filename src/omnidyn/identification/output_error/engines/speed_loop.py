"""The engine of a fit for logs of set speeds: derivatives through the firmware's loop, any robot.

As implicit.py, but the loop makes the voltage, and what it remembers is known at rest only: there every log begins,
and before its first row the robot has rested. Of the nuisances it knows latencies.
"""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import UnsupportedError
from omnidyn.identification.output_error.engines.driver import LATENCY_PREFIX
from omnidyn.identification.output_error.engines.implicit import ImplicitEngine, through_the_end, travel_of
from omnidyn.identification.output_error.problem.observation.observation import Shown
from omnidyn.identification.output_error.problem.observation.observations import OBSERVATIONS
from omnidyn.identification.output_error.problem.problem import Parts, Piece, Problem
from omnidyn.model.motor import DYNAMIC
from omnidyn.model.robot import Robot
from omnidyn.simulation.sensitivity.late_sample import Direction, LateSample, looped_samples

STEADY_CHANGE = 1e-10  # [m/s, A, V] a run that changes less from tick to tick stays as it is until the next command
SLOW_LOOP = 0.5  # periods in a row, beyond which a current is seen between its ticks
SLOPE_LIMIT = 1e8  # a loop that swings has derivatives that grow without bound: they are cut, for they mean nothing


class LoopEngine(ImplicitEngine):
    """Residuals and sensitivities of a problem through the speed loop. tol [m/s]: None is a step a tick.

    Raises UnsupportedError for nuisances other than latencies.
    """

    has_loop = True

    @classmethod
    def of(cls, problem: Problem, tol: float | None = None) -> LoopEngine:
        """The engine of a problem. tol [m/s]: None for a step a tick."""
        return cls(problem, tol)

    def __init__(self, problem: Problem, tol: float | None = None):
        other_names = [
            p.name for p in problem.parameters[problem.robot_count :] if not p.name.startswith(LATENCY_PREFIX)
        ]
        if other_names:
            raise UnsupportedError(
                "a log of set speeds has no voltage that could be changed on its way",
                got=", ".join(other_names),
                expected="latency",
                where="nuisances",
            )
        super().__init__(problem, tol)

    def _piece(
        self,
        robot: Robot,
        moved: list[Direction],
        scales: list[float],
        piece: Piece,
        state: FloatArray,
        values: FloatArray,
    ) -> Parts:
        with np.errstate(over="ignore"):
            residual, slopes, indices = super()._piece(robot, moved, scales, piece, state, values)
        return residual, np.clip(np.nan_to_num(slopes), -SLOPE_LIMIT, SLOPE_LIMIT), indices

    def _run(
        self,
        robot: Robot,
        moved: list[Direction],
        scales: list[float],
        piece: Piece,
        state: FloatArray,
        values: FloatArray,
        latencies: list[float],
    ) -> tuple[list[LateSample], list[int], FloatArray]:
        """As of any run; where currents jump from tick to tick, a look a period after theirs is the last one."""
        count, (t, set_point) = self.problem.robot_count, _driven(piece)
        current_index = self.problem.where(f"{LATENCY_PREFIX}current")
        earlier_times = (
            [float(values[current_index]) - self._period] if current_index >= 0 and self._jumps(piece) else []
        )
        samples = looped_samples(
            robot,
            t,
            set_point,
            moved,
            [*latencies, *earlier_times],
            self.tol,
            travel_of(piece.record.columns),
            STEADY_CHANGE,
        )
        return samples, list(range(count)), 1.0 / np.array(scales[:count])

    def _shown(self, samples: list[LateSample], number: int, name: str, start_heading: float) -> Shown:
        """As of any run; a current that jumps from tick to tick changes by what it does within a period."""
        value, pace, channel_slopes = super()._shown(samples, number, name, start_heading)
        if OBSERVATIONS[name].has_volts and samples[-1].late < samples[number].late:
            pace = (super()._shown(samples, -1, name, start_heading)[0] - value) / self._period
        return value, pace, channel_slopes

    @property
    def _period(self) -> float:
        return 1.0 / (self.problem.robot.drive.rate or np.inf)

    def _jumps(self, piece: Piece) -> bool:
        """Whether a log does not see what a current does between two ticks."""
        return self._period < SLOW_LOOP * piece.step or self.problem.robot.motor.electrical == DYNAMIC


def _driven(piece: Piece) -> tuple[FloatArray, FloatArray]:
    """(times (rows,) [s], set points (rows, n) [rad/s]) of a piece."""
    assert piece.record.set_point is not None
    rows = slice(piece.first, piece.last + 1)
    return piece.record.t[rows], through_the_end(piece.record.set_point[rows])
