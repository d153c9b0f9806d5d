"""One motor by output error: its whole log as a free run, the wheels off the ground or on.

    w' = g u - a w - c sgn w,   u held from row to row:   the exact step of a body axis, with w for the speed
    slope k = a/g [V s/rad]     dead_band c/g [V]         lag 1/a [s]

The motor stands in for the yaw axis of the exact engine, so that its speed and the angle it turned are both outputs,
and stops, reversals, latencies and intervals are those of every other fit. With duty in place of voltage the units of
slope and dead band are 1 s/rad and 1.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.identification.estimate import finite_or_none
from omnidyn.identification.motors.bend import Bend, bend
from omnidyn.identification.motors.engine import BAND, INNER, LAG, SLOPE, MotorEngine
from omnidyn.identification.motors.log import (
    CURVE,
    HOLD,
    INPUTS,
    MEAN,
    begin,
    motor_problem,
    motor_records,
)
from omnidyn.identification.output_error.answer import Nuisance
from omnidyn.identification.output_error.conclusion import intervals
from omnidyn.identification.output_error.engines.exact import ExactEngine
from omnidyn.identification.output_error.fit import degrees
from omnidyn.identification.output_error.problem.nuisances import LATENCY
from omnidyn.identification.output_error.problem.problem import Point
from omnidyn.identification.output_error.solve.solver import Solution, Solver, State
from omnidyn.identification.output_error.trust.uncertainty import RISE, SANDWICH, Trust, trust
from omnidyn.identification.question import GAUSS, STUDENT
from omnidyn.logs.resolved import unresolved_rows
from omnidyn.run import Run

FloatArray = NDArray[np.float64]

AUTO = "auto"
WORDS = {HOLD: "held from row to row", MEAN: "the mean of two rows", CURVE: "a curve through the rows"}
LAGS = (0.005, 0.05, 0.5)  # [s] the search begins at each, and the best end counts
LATENCIES = {"wheel_speed": "wheel_speed", "wheel_angle": "heading"}  # channel -> its name in the engine


@dataclass(frozen=True, eq=False)
class MotorFit:
    """What whole logs say of one motor. value, std, ci95: slope [V s/rad], dead_band [V], lag [s] (with a duty: s/rad
    and 1). nuisances: latencies [s]. noise: of the speed [rad/s] and of the angle [rad]. rmse: of the speed [rad/s],
    over the logs fitted. correlation: of the numbers in the order of `names`. at_bound, unidentifiable: names.
    left_out: rows whose speed does not count, because the log does not resolve the input there. doubts: in words.
    """

    motor: int
    unit: str
    between: str
    value: Mapping[str, float]
    std: Mapping[str, float]
    ci95: Mapping[str, tuple[float, float]]
    nuisances: Mapping[str, Nuisance]
    noise: Mapping[str, float]
    rmse: float
    names: tuple[str, ...]
    correlation: FloatArray
    at_bound: tuple[str, ...]
    unidentifiable: tuple[str, ...]
    covariance: str
    converged: bool
    source: str
    left_out: int = 0
    doubts: tuple[str, ...] = ()

    @property
    def dead_band_seen(self) -> bool:
        """Whether the interval of the dead band lies above 0."""
        return BAND in self.ci95 and BAND not in self.unidentifiable and self.ci95[BAND][0] > 0.0

    def statement(self) -> str:
        """The fit in a sentence."""
        spread = f" +- {self.std[SLOPE]:.2g} {self.unit} s/rad" if SLOPE not in self.unidentifiable else (
            f" {self.unit} s/rad if there is this dead band"
        )  # fmt: skip
        words = f"motor {self.motor + 1}: slope {self.value[SLOPE]:.5g}{spread}, "
        words += f"lag {self.value[LAG] * 1e3:.3g} ms"
        if self.nuisances:
            words += "".join(
                f", {name.partition('.')[2]} late by {each.value * 1e3:.3g} +- {each.std * 1e3:.2g} ms"
                for name, each in self.nuisances.items()
            )
        if self.left_out:
            words += f" ({self.left_out} rows left out: their input changes too much from row to row)"
        if BAND not in self.value:
            return f"{words}, no dead band asked for"
        low, high = self.ci95[BAND]
        if BAND in self.unidentifiable:
            return f"{words}, dead band not identifiable here: slope and dead band cannot be told apart"
        band = f"dead band {self.value[BAND]:.3g} +- {self.std[BAND]:.2g} {self.unit}, 95 % [{low:.3g}, {high:.3g}]"
        return f"{words}, {band}{'' if self.dead_band_seen else ': none is seen'}"

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        numbers = {name: {"value": self.value[name], **_known(self.std[name], self.ci95[name])} for name in self.value}
        late = {name: {"value": n.value, **_known(n.std, n.ci95), "unit": n.unit} for name, n in self.nuisances.items()}
        return {
            "motor": self.motor + 1, "unit": self.unit, "between": self.between, "parameters": numbers,
            "nuisances": late,
            "noise": dict(self.noise), "rmse_rad_s": self.rmse, "dead_band_seen": self.dead_band_seen,
            "at_bound": list(self.at_bound), "unidentifiable": list(self.unidentifiable), "covariance": self.covariance,
            "converged": self.converged, "left_out": self.left_out, "doubts": list(self.doubts),
            "data": self.source,
        }  # fmt: skip


def _known(std: float, ci95: tuple[float, float]) -> dict[str, Any]:
    return {"std": finite_or_none(std), "ci95": [finite_or_none(bound) for bound in ci95]}


def fit_motor(
    runs: Run | Sequence[Run], motor: int = 0, *, dead_band: bool = True, kind: str = "", between: str = AUTO,
    latency: bool = False, angle: bool = False, loss: str = GAUSS, covariance: str = "auto",
    watch: Callable[[State], None] | None = None,
) -> MotorFit:  # fmt: skip
    """Fit slope, dead band and lag of one motor to whole logs by output error.

    motor: its number from 0. dead_band: False leaves Coulomb friction out. kind: "voltage" or "duty"; "" takes the
    first that is there. between: "hold": the input of a row holds to the next; "mean": the mean of both rows applies,
    where inputs are sampled as the speeds are; "curve": a smooth curve through the rows, a line where the input jumps;
    "auto": whichever fits best. Intervals span all ways but those that fit clearly worse, and that of a dead band
    that is seen also what is left of it where a smooth bend of the line is fitted too, if one is needed.
    latency: fit how late speed and angle are [s]; a lag and a latency are told apart only by how the speed sets off.
    angle: the angle is an output too, beside the speed; what the log does not resolve of the input adds up in it, and
    then looks like friction.
    Raises InputError for a run without the channels, InsufficientDataError where the motor says nothing.
    """
    if between not in (AUTO, *WORDS):
        expected = f"{AUTO}, {', '.join(WORDS)}"
        raise InputError("no such way", got=between, expected=expected, where="between")
    if loss not in (GAUSS, STUDENT):
        raise InputError("unknown loss", got=loss, expected=f"{GAUSS} or {STUDENT}", where="loss")
    every = [runs] if isinstance(runs, Run) else list(runs)
    found: dict[str, tuple[Solution, Solver, str]] = {}
    for way in WORDS:
        records, unit = motor_records(every, motor, kind, way, angle)
        problem = motor_problem(records, dead_band, latency)
        solver = Solver(problem, MotorEngine(problem), degrees(loss))
        ends = [solver.minimise(begin(problem, records, lag), watch=watch) for lag in LAGS]
        found[way] = min(ends, key=lambda end: end.state.objective), solver, unit
    cost = {way: end.state.objective for way, (end, _, _) in found.items()}
    chosen = between if between != AUTO else min(cost, key=lambda way: cost[way])
    known = {way: trust(solver, end, _colour(covariance, way)) for way, (end, solver, _) in found.items()}
    answers = {way: _answer(solver, end, known[way], motor, unit, way) for way, (end, solver, unit) in found.items()}
    inputs = [getattr(run, _kind(found[chosen][2]))[:, motor] for run in every]
    fit = replace(answers[chosen], left_out=sum(int(unresolved_rows(u).sum()) for u in inputs))
    rise = RISE * max(known[chosen].widening, 1.0) ** 2  # coloured residuals make every likelihood too steep
    rivals = [way for way in cost if way != chosen and 2.0 * (cost[way] - cost[chosen]) <= rise]
    for way in rivals:
        fit = _with_rival(fit, answers[way])
    return _with_bend(fit, bend(found[chosen][1], found[chosen][0].state)) if fit.dead_band_seen else fit


def _colour(covariance: str, way: str) -> str:
    """Rows of a refined log have no measured neighbours, so that auto would not see whether these resemble."""
    return SANDWICH if (covariance, way) == ("auto", CURVE) else covariance


def _kind(unit: str) -> str:
    return next(name for name, own in INPUTS.items() if own == unit)


def _with_bend(fit: MotorFit, bent: Bend | None) -> MotorFit:
    """The fit with an interval of the dead band that holds the one with a smooth bend of the line fitted too."""
    if bent is None or not bent.needed:
        return fit
    low, high = fit.ci95[BAND]
    std = float(np.hypot(max(fit.std[BAND], bent.std), fit.value[BAND] - bent.value))
    words = (
        f"the line of speed over input bends: with a smooth bend fitted too (error {bent.left:.3g} of that without), "
        f"the dead band is {bent.value:.3g} +- {bent.std:.2g} {fit.unit}: the interval spans both"
    )
    return replace(
        fit, std={**fit.std, BAND: std},
        ci95={**fit.ci95, BAND: (min(low, bent.ci95[0]), max(high, bent.ci95[1]))}, doubts=(*fit.doubts, words),
    )  # fmt: skip


def _with_rival(fit: MotorFit, rival: MotorFit) -> MotorFit:
    """The fit with intervals that hold those of another way of reading the input, which fits as well or better.

    What the input did between its rows is not in the log: one more number that is fitted or assumed, with a few values.
    Its 95 % region by likelihood holds all ways that fit worse by no more than RISE, so the intervals do too; the
    difference of the values joins the variance.
    """
    shared = [name for name in fit.value if name in rival.value]
    std = {name: float(np.hypot(fit.std[name], fit.value[name] - rival.value[name])) for name in shared}
    ci95 = {
        name: (min(fit.ci95[name][0], rival.ci95[name][0]), max(fit.ci95[name][1], rival.ci95[name][1]))
        for name in shared
    }
    verb = "better" if rival.rmse < 0.99 * fit.rmse else "as well"
    words = (
        f"the logs are met {verb} where the input is {WORDS[rival.between]} (error {rival.rmse:.3g} rad/s, "
        f"{fit.rmse:.3g} where it is {WORDS[fit.between]}): the intervals span both"
    )
    return replace(fit, std={**fit.std, **std}, ci95={**fit.ci95, **ci95}, doubts=(*fit.doubts, words))


def _answer(solver: Solver, solution: Solution, known: Trust, motor: int, unit: str, between: str) -> MotorFit:
    problem, values = solver.problem, solution.state.point.values
    if known.unseen[0]:
        raise InsufficientDataError(
            "the logs say nothing about this motor", got=f"motor {motor + 1}", expected="motion"
        )
    std, ci95 = intervals(problem, values, known)
    blind = {name for name, b in zip(problem.names, known.blind, strict=True) if b}
    for name, value, number in zip(problem.names, values, problem.parameters, strict=False):
        if name == INNER + BAND and (value >= 0.99 * number.high or std[name] > number.high):
            blind |= {name}
            std[name], ci95[name] = float("nan"), (number.low, number.high)
    own, names = problem.robot_count, tuple(name.removeprefix(INNER) for name in problem.names)
    std = {name.removeprefix(INNER): each for name, each in std.items()}
    ci95 = {name.removeprefix(INNER): each for name, each in ci95.items()}
    noise = {column[0]: float(s) for column, s in zip(problem.columns, np.sqrt(solution.state.variance), strict=True)}
    back = {engine: channel for channel, engine in LATENCIES.items()}
    size = np.where(np.isfinite(known.std) & (known.std > 0.0), known.std, 1.0)
    covariance = np.where(np.isfinite(known.covariance), known.covariance, 0.0)
    sources = list(dict.fromkeys(piece.record.source for piece in problem.pieces))
    return MotorFit(
        motor=motor, unit=unit, between=between,
        value={name: float(v) for name, v in zip(names[:own], values, strict=False)},
        std={name: std[name] for name in names[:own]}, ci95={name: ci95[name] for name in names[:own]},
        nuisances={
            f"{LATENCY}.{back[name.partition('.')[2]]}": Nuisance(float(v), std[name], ci95[name], "s")
            for name, v in zip(names[own:], values[own:], strict=True)
        },
        noise={back[name]: s for name, s in noise.items()},
        rmse=motor_rmse(MotorEngine(problem), solution.state.point),
        names=names, correlation=covariance / np.outer(size, size),
        at_bound=tuple(name for name, held in zip(names, known.held, strict=True) if held),
        unidentifiable=tuple(name for name in names if {name, INNER + name} & blind),
        covariance=known.kind, converged=solution.converged,
        source=sources[0] if len(sources) == 1 else f"{sources[0]} and {len(sources) - 1} more logs",
    )  # fmt: skip


def motor_rmse(engine: ExactEngine, point: Point) -> float:
    """Root mean square of the error of the speed over all rows [rad/s]; NaN where no speed is an output."""
    squares, count = 0.0, 0
    for piece, (predicted, _) in zip(engine.problem.pieces, engine.outputs(point), strict=True):
        names = [name for name, _ in piece.record.columns]
        if "wheel_speed" in names:
            c = names.index("wheel_speed")
            error = (predicted - piece.record.outputs)[piece.first : piece.last + 1, c]
            squares, count = squares + float(np.nansum(error**2)), count + int(np.isfinite(error).sum())
    return float(np.sqrt(squares / count)) if count else float("nan")
