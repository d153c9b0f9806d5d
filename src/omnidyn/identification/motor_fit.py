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
from omnidyn.identification.drive_windows import CONTEXT_ROWS, unresolved_input
from omnidyn.identification.output_error.answer import Nuisance
from omnidyn.identification.output_error.conclusion import intervals
from omnidyn.identification.output_error.exact_engine import ExactEngine
from omnidyn.identification.output_error.fit import GAUSS, NU, STUDENT
from omnidyn.identification.output_error.nuisances import EARLIEST, LATENCY, LATEST
from omnidyn.identification.output_error.parameters import Parameter
from omnidyn.identification.output_error.primitives import Primitives
from omnidyn.identification.output_error.problem import Piece, Point, Problem
from omnidyn.identification.output_error.record import SHORTEST, Record
from omnidyn.identification.output_error.solver import Solution, Solver, State
from omnidyn.identification.output_error.uncertainty import Trust, trust
from omnidyn.logs.segments import segments
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run

FloatArray = NDArray[np.float64]

SLOPE, BAND, LAG = "slope", "dead_band", "lag"
INNER = "motor."  # in the problem: the engine takes a bare "dead_band" for one of the driver
AXIS = 2  # yaw: the axis whose travel is an output
AUTO, HOLD, MEAN = "auto", "hold", "mean"
INPUTS = {"voltage": "V", "duty": "1"}
LAGS = (0.005, 0.05, 0.5)  # [s] the search begins at each, and the best end counts
SPAN = 1e4
JITTER = 0.6  # of the spread of the input, from row to row: about ten rows a swing; what is faster is not in the log
LATENCIES = {"wheel_speed": "wheel_speed", "wheel_angle": "heading"}  # channel -> its name in the engine


@dataclass(frozen=True, eq=False)
class MotorFit:
    """What whole logs say of one motor. value, std, ci95: slope [V s/rad], dead_band [V], lag [s] (with a duty: s/rad
    and 1). nuisances: latencies [s]. noise: of the speed [rad/s] and of the angle [rad]. rmse: of the speed [rad/s],
    over the logs fitted. correlation: of the numbers in the order of `names`. at_bound, unidentifiable: names.
    left_out: rows whose speed does not count, because the log does not resolve the input there.
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

    @property
    def dead_band_seen(self) -> bool:
        """Whether the interval of the dead band lies above 0."""
        return BAND in self.ci95 and BAND not in self.unidentifiable and self.ci95[BAND][0] > 0.0

    def statement(self) -> str:
        """The fit in a sentence."""
        words = f"motor {self.motor + 1}: slope {self.value[SLOPE]:.5g} +- {self.std[SLOPE]:.2g} {self.unit} s/rad, "
        words += f"lag {self.value[LAG] * 1e3:.3g} ms"
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
        numbers = {
            name: {"value": self.value[name], "std": self.std[name], "ci95": list(self.ci95[name])}
            for name in self.value
        }
        late = {
            name: {"value": n.value, "std": n.std, "ci95": list(n.ci95), "unit": n.unit}
            for name, n in self.nuisances.items()
        }
        return {
            "motor": self.motor + 1, "unit": self.unit, "between": self.between, "parameters": numbers,
            "nuisances": late,
            "noise": dict(self.noise), "rmse_rad_s": self.rmse, "dead_band_seen": self.dead_band_seen,
            "at_bound": list(self.at_bound), "unidentifiable": list(self.unidentifiable), "covariance": self.covariance,
            "converged": self.converged, "left_out": self.left_out, "data": self.source,
        }  # fmt: skip


class MotorMapping:
    """From slope, dead band and lag to the numbers of the exact step: a = 1/lag, g = 1/(slope lag), c = dead_band g."""

    linear = False

    def __init__(self, names: Sequence[str]):
        self.names = tuple(names)

    def at(self, values: FloatArray) -> tuple[Primitives, Primitives]:
        """(primitives, their derivatives by the values); the other two axes rest."""
        slope, lag = float(values[0]), float(values[1])
        band = float(values[2]) if len(values) > 2 else 0.0
        rate, gain = 1.0 / lag, 1.0 / (slope * lag)
        by_rate = np.array([0.0, -rate / lag, 0.0])
        by_gain = np.array([-gain / slope, -gain / lag, 0.0])
        by_level = band * by_gain + np.array([0.0, 0.0, gain])
        none, count = np.zeros((1, AXIS + 1)), len(values)

        def axis(number: float, other: float) -> FloatArray:
            return np.array([other, other, number])

        def slopes(by: FloatArray) -> FloatArray:
            return np.concatenate([np.zeros((AXIS, count)), by[None, :count]])

        now = Primitives(
            axis(rate, 1.0), axis(band * gain, 0.0), axis(band * gain, 0.0), axis(gain, 0.0)[:, None],
            np.array([[0.0, 0.0, 1.0]]), none, np.zeros(1),
        )  # fmt: skip
        derivatives = Primitives(
            slopes(by_rate), slopes(by_level), slopes(by_level), slopes(by_gain)[:, None, :],
            np.zeros((1, AXIS + 1, count)), np.zeros((1, AXIS + 1, count)), np.zeros((1, count)),
        )  # fmt: skip
        return now, derivatives


class MotorEngine(ExactEngine):
    """The exact engine with a motor in place of the robot."""

    def __init__(self, problem: Problem):
        self.problem = problem
        self.mapping = MotorMapping([p.name for p in problem.parameters])  # type: ignore[assignment]
        self._columns = problem.columns
        self._axes_only = False

    def on(self, problem: Problem) -> MotorEngine:
        """The same engine on other pieces."""
        return MotorEngine(problem)


def fit_motor(
    runs: Run | Sequence[Run], motor: int = 0, *, dead_band: bool = True, kind: str = "", between: str = AUTO,
    latency: bool = False, angle: bool = False, loss: str = GAUSS, covariance: str = "auto",
    watch: Callable[[State], None] | None = None,
) -> MotorFit:  # fmt: skip
    """Fit slope, dead band and lag of one motor to whole logs by output error.

    motor: its number from 0. dead_band: False leaves Coulomb friction out. kind: "voltage" or "duty"; "" takes the
    first that is there. between: "hold": the input of a row holds to the next; "mean": the mean of both rows applies,
    where inputs are sampled as the speeds are; "auto": whichever fits better. latency: fit how late speed and angle
    are [s]; a lag and a latency are told apart only by how the speed sets off. angle: the angle is an output too,
    beside the speed; what the log does not resolve of the input adds up in it, and then looks like friction.
    Raises InputError for a run without the channels, InsufficientDataError where the motor says nothing.
    """
    if between not in (AUTO, HOLD, MEAN):
        raise InputError("no such way", got=between, expected=f"{AUTO}, {HOLD} or {MEAN}", where="between")
    if loss not in (GAUSS, STUDENT):
        raise InputError("unknown loss", got=loss, expected=f"{GAUSS} or {STUDENT}", where="loss")
    every = [runs] if isinstance(runs, Run) else list(runs)
    nu = NU if loss == STUDENT else 0.0
    found: list[tuple[Solution, Solver, str, str]] = []
    for way in (HOLD, MEAN) if between == AUTO else (between,):
        records, unit = motor_records(every, motor, kind, way, angle)
        problem = _problem(records, dead_band, latency)
        solver = Solver(problem, MotorEngine(problem), nu)
        ends = [solver.minimise(_begin(problem, records, lag), watch=watch) for lag in LAGS]
        found += [(end, solver, way, unit) for end in ends]
    best, solver, way, unit = min(found, key=lambda each: each[0].state.objective)
    return _answer(solver, best, trust(solver, best, covariance), motor, unit, way)


def motor_records(runs: Sequence[Run], motor: int, kind: str, between: str, angle: bool) -> tuple[list[Record], str]:
    """The runs with one input and the outputs of one motor, and the unit of the input."""
    found = []
    names = [name for name in INPUTS if name == kind or not kind]
    if kind and kind not in INPUTS:
        raise InputError("no such input", got=kind, expected=" or ".join(INPUTS), where="kind")
    if not runs:
        raise InputError("nothing to fit to", got="no runs", expected="one or more", where="runs")
    chosen = next((n for n in names if all(getattr(run, n) is not None for run in runs)), "")
    if not chosen:
        raise InputError("the logs have no input of this motor", got=", ".join(runs[0].channels),
                         expected=" or ".join(names), where=runs[0].source)  # fmt: skip
    for run in runs:
        found.append(_record(run, motor, getattr(run, chosen), between, angle))
    return found, INPUTS[chosen]


def _record(run: Run, motor: int, put_in: FloatArray, between: str, angle: bool) -> Record:
    if motor >= put_in.shape[1]:
        raise InputError("no such motor", got=motor + 1, expected=f"1 to {put_in.shape[1]}", where=run.source)
    outputs: dict[str, FloatArray] = {}
    if run.wheel_speed is not None and np.isfinite(run.wheel_speed[:, motor]).any():
        outputs["wheel_speed"] = run.wheel_speed[:, motor]
    if angle and run.wheel_angle is not None and np.isfinite(run.wheel_angle[:, motor]).any():
        outputs["heading"] = run.wheel_angle[:, motor]
    if not outputs:
        raise InputError("the log has no speed and no angle of this motor", got=", ".join(run.channels),
                         expected="wheel_speed or wheel_angle", where=run.source)  # fmt: skip
    u = put_in[:, motor]
    rough = unresolved_rows(u)
    outputs = {name: np.where(rough, np.nan, column) for name, column in outputs.items()}
    if between == MEAN:
        u = np.append(0.5 * (u[1:] + u[:-1]), u[-1])
    pieces = [
        (s.start + int(a), s.start + int(b) - 1) for s in segments(run.t) for a, b in _stretches(np.isfinite(u[s]))
        if b - a >= SHORTEST
    ]  # fmt: skip
    if not pieces:
        raise InsufficientDataError(
            "no stretch of the log has inputs throughout", got=f"{int(np.isfinite(u).sum())} rows",
            expected=f"{SHORTEST} rows in a row", where=run.source,
        )  # fmt: skip
    return Record(
        run.t, np.ascontiguousarray(np.nan_to_num(u)[:, None]), np.stack([*outputs.values()], axis=1),
        tuple((name, 0) for name in outputs), tuple(pieces), run.source, False, (),
    )  # fmt: skip


def unresolved_rows(u: FloatArray) -> NDArray[np.bool_]:
    """Rows where the input changes too much from row to row to say what the motor got. u and result: shape (rows,)."""
    rough, largest = np.zeros(len(u), dtype=bool), float(np.nanmax(np.abs(u), initial=0.0))
    for first in range(0, len(u), CONTEXT_ROWS):
        window = slice(first, min(first + CONTEXT_ROWS, len(u)))
        rough[window] = unresolved_input(u, window, largest, JITTER)
    return rough


def _stretches(known: NDArray[np.bool_]) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], known, [False]]).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _problem(records: Sequence[Record], dead_band: bool, latency: bool) -> Problem:
    """Free numbers and pieces; each piece starts at a fitted speed, and its angle at a fitted one."""
    most = max(float(np.abs(r.voltage).max()) for r in records)
    if most == 0.0:
        raise InsufficientDataError("the motor was never driven", got="an input of 0 throughout", expected="an input")
    numbers = [Parameter(INNER + SLOPE, 1.0, 1e-9, 1e9, True), Parameter(INNER + LAG, 0.1, 1e-5, 1e3, True)]
    if dead_band:
        numbers.append(Parameter(INNER + BAND, 0.0, 0.0, 0.5 * most))
    columns = dict.fromkeys(name for r in records for name, _ in r.columns)
    late = [Parameter(f"{LATENCY}.{name}", 0.0, EARLIEST, LATEST) for name in columns] if latency else []
    pieces = [_piece(r, first, last, latency) for r in records for first, last in r.pieces]
    # The robot is not used: a problem has one.
    return Problem(load_robot("axebot"), (*numbers, *late), len(numbers), tuple(pieces))


def _piece(record: Record, first: int, last: int, latency: bool) -> Piece:
    names = [name for name, _ in record.columns]
    start, offset = np.zeros(3), np.zeros(len(names))
    for c, name in enumerate(names):
        column = record.outputs[first : last + 1, c]
        known = column[np.isfinite(column)]
        begin = float(known[0]) if known.size else 0.0
        if name == "heading":
            offset[c] = begin
        else:
            start[AXIS] = begin
    free = np.array([False, False, True, *(name == "heading" for name in names)])
    margin = min(LATEST, 0.1 * float(record.t[last] - record.t[first])) if latency else 0.0
    return Piece(record, first, last, start, offset, free, np.full(len(names), margin))


def _begin(problem: Problem, records: Sequence[Record], lag: float) -> Point:
    """Slope by the regression of the input on the speed that it would bring about without a dead band."""
    point = problem.start()
    up = low = 0.0
    for r in records:
        names = [name for name, _ in r.columns]
        speed = (
            r.outputs[:, names.index("wheel_speed")] if "wheel_speed" in names else np.gradient(r.outputs[:, 0], r.t)
        )
        known = np.isfinite(speed)
        up += float(np.abs(r.voltage[known, 0]).sum())
        low += float(np.abs(speed[known]).sum())
    values = point.values.copy()
    values[0], values[1] = up / low if low > 0.0 else 1.0, lag
    return replace(point, values=values)


def _answer(solver: Solver, solution: Solution, known: Trust, motor: int, unit: str, between: str) -> MotorFit:
    problem, values = solver.problem, solution.state.point.values
    if known.blind[0]:
        raise InsufficientDataError(
            "the logs say nothing about this motor", got=f"motor {motor + 1}", expected="motion"
        )
    std, ci95 = intervals(problem, values, known)
    blind = {name for name, b in zip(problem.names, known.blind, strict=True) if b}
    for name, value, number in zip(problem.names, values, problem.parameters, strict=False):
        if name == INNER + BAND and value >= 0.99 * number.high:
            blind |= {name}
            std[name], ci95[name] = float("nan"), (number.low, number.high)
    records = {id(piece.record): piece.record for piece in problem.pieces}.values()
    left_out = sum(int(unresolved_rows(record.voltage[:, 0]).sum()) for record in records)
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
        left_out=left_out,
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


def run_motor(fit: MotorFit, runs: Run | Sequence[Run]) -> list[FloatArray]:
    """Free runs of a fitted motor under the inputs of other logs: its speed [rad/s], shape (rows,) each.

    Each piece starts at the measured speed; NaN outside of the pieces. Latencies are included.
    """
    every = [_with_speed(run) for run in ([runs] if isinstance(runs, Run) else runs)]
    kind = next(name for name, unit in INPUTS.items() if unit == fit.unit)
    records, _ = motor_records(every, fit.motor, kind, fit.between, angle=False)
    problem = _problem(records, BAND in fit.value, bool(fit.nuisances))
    values = [fit.value[name.removeprefix(INNER)] for name in problem.names[: problem.robot_count]]
    values += [_late(fit) for _ in problem.names[problem.robot_count :]]
    engine = MotorEngine(problem)
    point = replace(problem.start(), values=np.array(values))
    found = [np.full(len(r.t), np.nan) for r in records]
    for piece, (predicted, _) in zip(problem.pieces, engine.outputs(point), strict=True):
        k = next(i for i, r in enumerate(records) if r is piece.record)
        found[k][piece.first : piece.last + 1] = predicted[piece.first : piece.last + 1, 0]
    return found


def _late(fit: MotorFit) -> float:
    own = fit.nuisances.get(f"{LATENCY}.wheel_speed") or next(iter(fit.nuisances.values()))
    return own.value


def _with_speed(run: Run) -> Run:
    """The run with a speed; where only the angle is logged, by its slope: that is where a free run starts."""
    if run.wheel_speed is not None or run.wheel_angle is None or len(run) < SHORTEST:
        return run
    return run.replace(wheel_speed=np.gradient(run.wheel_angle, run.t, axis=0))


def fit_rmse(fit: MotorFit, runs: Run | Sequence[Run]) -> float:
    """Root mean square error of the speed [rad/s] of free runs beside logs; NaN where none has a speed.

    Rows whose input the log does not resolve do not count.
    """
    every = [runs] if isinstance(runs, Run) else list(runs)
    kind = next(name for name, unit in INPUTS.items() if unit == fit.unit)
    errors = [
        (ours - run.wheel_speed[:, fit.motor])[~unresolved_rows(getattr(run, kind)[:, fit.motor])]
        for ours, run in zip(run_motor(fit, every), every, strict=True)
        if run.wheel_speed is not None
    ]  # fmt: skip
    known = np.concatenate(errors) if errors else np.zeros(0)
    known = known[np.isfinite(known)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")
