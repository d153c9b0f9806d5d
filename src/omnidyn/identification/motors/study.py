"""study_motors: every motor of some logs, by one of two ways, and what they say together."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from omnidyn.document import Document, Points, Table
from omnidyn.document import plain as plain_values
from omnidyn.errors import InsufficientDataError
from omnidyn.findings.finding import Verdict
from omnidyn.findings.fitness import MOTORS as MOTORS_USE
from omnidyn.identification.grouping import held_out
from omnidyn.identification.log_verdicts import checked, log_verdicts, of_motors, told_why, unfit, verdict_advice
from omnidyn.identification.methods import OUTPUT_ERROR, STEADY_STATE, MotorFit, MotorLine
from omnidyn.identification.motors.choice import block_errors, fit_rmse
from omnidyn.identification.motors.estimate import HEAD, MotorEstimate, named
from omnidyn.identification.motors.fit import logs_of_free_runs
from omnidyn.identification.motors.held_out import written_and_plain
from omnidyn.identification.motors.log import (
    ANGLE,
    GROUND,
    MotorLog,
    averaged_statements,
    is_axis,
    motor_logs,
    orientation_of,
)
from omnidyn.identification.motors.points import is_slow, points_of_logs, starts_of_points, windows_of_points
from omnidyn.identification.motors.rest import CURRENT
from omnidyn.identification.motors.start import STARTS_HEAD, MotorStart, motor_starts, slopes_by_direction
from omnidyn.identification.motors.steady_curve import (
    CURVES_HEAD,
    Curves,
    SteadyCurve,
    curves_of_logs,
    curves_of_points,
)
from omnidyn.identification.motors.steady_windows import turned_under
from omnidyn.identification.motors.window_fit import fit_line
from omnidyn.identification.motors.windows import MotorWindows, motor_windows
from omnidyn.identification.selection.blocks import compare_blocks
from omnidyn.logs.log import Log
from omnidyn.logs.motor_table import MotorTable
from omnidyn.model.robot import Robot
from omnidyn.progress import Progress, Report, silent
from omnidyn.run import Run
from omnidyn.shown import FIGURE, Displayable, make
from omnidyn.statement import ERROR, NOTE, WARNING, Statement, as_verdict, by_severity, statements

if TYPE_CHECKING:
    from matplotlib.figure import Figure

from omnidyn.identification.motors.estimate import BAND
from omnidyn.identification.motors.motor_verdict import motors_verdict

MISSES = 0.1  # of the largest speed: error of a line that describes no motor
SPEED_ERRORS = 5.0  # errors of the mean speeds, from which such an error is no noise
SAME_SPEED = 1e-9  # spread of speeds over the largest, below which they are one


@dataclass(frozen=True, eq=False, repr=False)
class MotorStudy(Displayable):
    """motors: an estimate each, the last for all together where there are several in windows.

    plain: the same motors by slope and lag alone, from free runs only, and not of those with a curve. method, kind,
    unit, speed_from: how they were found. windows: that the lines go through, None of free runs; drawn: those of a
    picture of free runs. starts: each direction of each motor by itself, with the input at which it sets off. supply
    [V]: of a duty, the mean of the logs; NaN where it is not logged. log_warnings: of the logs; `warnings` has those of
    each motor too. verdicts: of `check` on each log. curves: of the motors whose speed is no line of their input.
    """

    method: str
    kind: str
    unit: str
    speed_from: str
    motors: tuple[MotorEstimate, ...]
    plain: tuple[MotorEstimate, ...] = ()
    windows: MotorWindows | None = None
    starts: tuple[MotorStart, ...] = ()
    supply: float = math.nan
    log_warnings: tuple[Statement, ...] = ()
    verdicts: tuple[Verdict, ...] = ()
    drawn: MotorWindows | None = None
    curves: tuple[SteadyCurve, ...] = ()

    def __repr__(self) -> str:
        return f"<MotorStudy {self.kind} [{self.unit}], {self.verdict}>"

    def plot(self) -> Figure:
        """Input against speed, with the lines and where each motor starts, as a matplotlib Figure.

        Raises InputError where the logs have no windows to draw.
        """
        return make(FIGURE, self)

    @property
    def statements(self) -> tuple[Statement, ...]:
        """What the logs say of each motor, and whether its dead band is any use on held-out logs."""
        motors_with_start = {start.motor for start in self.starts if start.sharp}
        bent_motors = {curve.motor for curve in self.curves}
        lines = [motor for motor in self.motors if motor.motor not in bent_motors]
        motor_statements = [motor.statement(has_start=motor.motor in motors_with_start) for motor in lines]
        motor_statements += [curve.statement() for curve in self.curves]
        motor_statements += [statement for motor in self.motors if (statement := motor.of_blocks())]
        for estimate in self.motors:
            plain_motor, comparison = self._plain_of(estimate), estimate.on_held_out
            if plain_motor and comparison and estimate.dead_band_seen and not comparison.is_better:
                errors = {"written": estimate.held_out, "plain": plain_motor.held_out, "travel": estimate.travel}
                numbers = errors | comparison.counts
                motor_statements.append(Statement("held_out_no_better", WARNING, estimate.name, numbers))
        return (
            *motor_statements,
            *(start.statement() for start in self.starts),
            *slopes_by_direction(self.starts, self.motors[0].travel),
        )

    def _plain_of(self, motor: MotorEstimate) -> MotorEstimate | None:
        return next((plain_motor for plain_motor in self.plain if plain_motor.motor == motor.motor), None)

    @property
    def verdict(self) -> Statement:
        """Which motors answer to their input, and at which input they start; failures first."""
        if faults := unfit(self.verdicts):
            return Statement("failed", ERROR, numbers={"failures": faults})
        return motors_verdict(self.motors, self.starts, self.curves)

    @property
    def failed(self) -> bool:
        """Whether the numbers mean nothing: no motor is seen to answer to its input, or `check` finds a log unfit."""
        return self.verdict.severity == ERROR

    @property
    def advice(self) -> tuple[Statement, ...]:
        """What to mend in the logs."""
        return tuple(verdict_advice(self.verdicts))

    @property
    def warnings(self) -> tuple[Statement, ...]:
        """Of the logs, then of each motor."""
        all_warnings = list(self.log_warnings)
        for motor in self.motors:
            warnings = [*motor.warnings, *(Statement("at_its_bound", subject=name) for name in motor.at_bound)]
            warnings += [Statement("errors_with_memory", NOTE)] if motor.covariance == "sandwich" else []
            warnings += [] if motor.converged else [Statement("motor_fit_cut_short")]
            all_warnings += [warning.of(motor.name) for warning in warnings]
        return (*all_warnings, *(warning.of(start.name) for start in self.starts for warning in start.warnings))

    def document(self) -> Document:
        """What the study says: a row per motor, with a dead band and without, then words."""
        method_words = "free runs of whole logs"
        if self.windows is not None:
            method_words = f"windows of {self.windows.length:g} s in integral form"
            if self.windows.settled:
                method_words = "steady windows" if math.isfinite(self.windows.length) else "a point per row"
        pairs = [filter(None, (motor, self._plain_of(motor))) for motor in self.motors]
        parts = [
            f"motors: {self.kind} [{self.unit}] against speed from {self.speed_from}, {method_words}",
            "",
            Table(HEAD, [estimate.row() for estimates in pairs for estimate in estimates], name="motors"),
            "",
            *([Table(STARTS_HEAD, [start.row() for start in self.starts], name="starts"), ""] if self.starts else []),
            *(
                [Table(CURVES_HEAD, [row for c in self.curves for row in c.rows()], name="curves"), ""]
                if self.curves
                else []
            ),
            Points(self.statements, name="statements"),
            by_severity(self.warnings, "warnings"),
            Points(self.advice, "next:", "next"),
        ]
        return Document(parts, self.to_dict(), self.warnings, verdict=self.verdict)

    def to_dict(self) -> dict[str, Any]:
        """The study as JSON can hold it."""
        motors = [motor.to_dict() for motor in self.motors]
        for record, motor in zip(motors, self.motors, strict=True):
            if plain_motor := self._plain_of(motor):
                record["plain"] = plain_motor.to_dict()
        return {
            **as_verdict(self.verdict),
            "ok": not self.failed,
            "method": self.method,
            "input": self.kind,
            "unit": self.unit,
            "speed_from": self.speed_from,
            "window_s": self.windows.length if self.windows is not None else None,
            "motors": motors,
            "starts": [start.to_dict() for start in self.starts],
            "curves": [curve.to_dict() for curve in self.curves],
            "statements": plain_values(self.statements),
            "warnings": plain_values(self.warnings),
            "next": plain_values(self.advice),
            "check": checked(self.verdicts),
        }


def study_motors(
    runs: Sequence[Run],
    robot: Robot | None,
    method: MotorLine | MotorFit,
    hold_out: Sequence[str] = (),
    logs: Sequence[Log] = (),
    progress: Progress = silent,
) -> MotorStudy:
    """Slope, dead band, lag and inertia of every motor of some logs.

    Each direction of each motor has its own start, stop, line and lag in `MotorStudy.starts`. Rows of a log that are
    more than 0.1 s apart are points like those of a table.

    Args:
        robot: whose heading is the speed, where that is "ground".
        method: windows in integral form, with the line of all motors together; or free runs of whole logs.
        hold_out: globs of the sources of runs that are predicted, by free runs only.
        logs: where the runs come from, to be checked as well.
    Raises InputError for a run without the channels, InsufficientDataError where the motors say nothing.
    """
    extra_channels = ["pose"] if isinstance(method, MotorLine) and method.speed == GROUND else []
    extra_channels += ["pose", "twist"] if any(is_axis(run) for run in runs) else []
    verdicts = log_verdicts([of_motors(log, *extra_channels) for log in logs], robot, progress)
    with told_why(verdicts, MOTORS_USE):
        if isinstance(method, MotorFit):
            study = _free_runs(runs, method, hold_out, progress)
        else:
            study = _lines(motor_logs(runs, method.input, method.speed, robot), method)
    return replace(study, verdicts=verdicts)


def _lines(logs: Sequence[MotorLog], method: MotorLine) -> MotorStudy:
    if is_slow(logs):
        points = points_of_logs(logs)
        study = study_points(points, logs[0].motion_from, [Statement("rows_as_points")])
        return replace(study, supply=_supply(logs))
    windows = motor_windows(logs, steady=method.steady, share=method.window)
    source = named([log.run.source for log in logs])
    motors, lines = _of_each(windows, source)
    lines = tuple(
        line
        if line.motor is None
        else line.bounded(turned_under(logs, line.motor, orientation=orientation_of(logs, line.motor)), line.rest)
        for line in (_with_misses(line, windows) for line in lines)
    )
    study = MotorStudy(
        STEADY_STATE,
        windows.kind,
        windows.unit,
        windows.speed_from,
        lines,
        (),
        windows,
        motor_starts(logs, windows, motors),
        _supply(logs),
        (*averaged_statements(logs), *_of_windows(windows, lines)),
    )
    return _along(study, curves_of_logs(logs))


def _along(study: MotorStudy, curves_found: Curves) -> MotorStudy:
    """The study with what is left of the lines of motors whose speed is none.

    A line whose error over all rows is below that of the curve at the levels left out stays a line.
    """
    error_by_motor = {m.motor: m.rmse for m in study.motors}
    curves, notes = curves_found
    curves = tuple(curve for curve in curves if not error_by_motor.get(curve.motor, math.inf) < curve.neighbours)
    curve_by_motor = {curve.motor: curve for curve in curves}
    bent_names = {f"motor {motor + 1}" for motor in curve_by_motor}
    of_lines = [w for w in study.log_warnings if not (w.code == "dead_bands_apart" and w.subject in bent_names)]
    study = replace(study, log_warnings=(*of_lines, *notes))
    if not curve_by_motor:
        return study
    motors = tuple(
        curve_by_motor[m.motor].estimate(m) if m.motor in curve_by_motor else m
        for m in study.motors
        if m.motor is not None
    )
    plain_estimates = tuple(m for m in study.plain if m.motor not in curve_by_motor)
    starts = tuple(curve_by_motor[s.motor].start(s) if s.motor in curve_by_motor else s for s in study.starts)
    return replace(study, motors=motors, plain=plain_estimates, starts=starts, curves=curves)


def _with_misses(line: MotorEstimate, windows: MotorWindows) -> MotorEstimate:
    """The line, with a warning where it misses mean speeds that are known; a current makes a torque, no speed."""
    _, speed, error, *_ = windows.of(line.motor)
    share = line.rmse / float(np.abs(speed).max())
    if windows.kind == CURRENT or share <= MISSES or line.rmse <= SPEED_ERRORS * float(np.median(error)):
        return line
    numbers = {"rmse": line.rmse, "share": share}
    return replace(line, warnings=(*line.warnings, Statement("line_misses", WARNING, numbers=numbers)))


def _of_each(windows: MotorWindows, source: str) -> tuple[list[int], tuple[MotorEstimate, ...]]:
    """(numbers of the motors, a line each, and one of all where there are several)."""
    motors = [int(motor) for motor in np.unique(windows.motor)]
    lines = tuple(fit_line(windows, motor, source) for motor in (*motors, *([None] if motors[1:] else [])))
    speeds = [windows.of(motor)[1] for motor in motors]
    if all(np.ptp(speed) <= SAME_SPEED * np.abs(speed).max() for speed in speeds):
        raise InsufficientDataError(
            "a line needs several speeds",
            got=f"{speeds[0][0]:.4g} rad/s in every window",
            expected="speeds that change",
            remedy="drive the motors with several inputs, or look at their sensors",
            where=source,
        )
    return motors, lines


def study_points(points: MotorTable, origin: str = "a table", remarks: Sequence[Statement] = ()) -> MotorStudy:
    """The study of points of steady speed."""
    windows = windows_of_points(points, origin)
    _, lines = _of_each(windows, points.source)
    lines = tuple(
        line if line.motor is None else line.bounded(windows.turned_under(line.motor), line.rest)
        for line in (_with_misses(line, windows) for line in lines)
    )
    study = MotorStudy(
        STEADY_STATE,
        points.kind,
        points.unit,
        origin,
        lines,
        (),
        windows,
        starts_of_points(points),
        log_warnings=(*statements(points.notes), *remarks, *_of_windows(windows, lines)),
    )
    return _along(study, curves_of_points(points))


def _free_runs(runs: Sequence[Run], method: MotorFit, hold_out: Sequence[str], progress: Progress) -> MotorStudy:
    held_mask = held_out([run.source for run in runs], hold_out)
    held_out_runs = [run for run, is_held_out in zip(runs, held_mask, strict=True) if is_held_out]
    logs = logs_of_free_runs(
        [run for run, is_held_out in zip(runs, held_mask, strict=True) if not is_held_out], method.input
    )
    motors = [
        m
        for m in range(min(log.motors for log in logs))
        if all(np.isfinite(log.input_values[:, m]).any() for log in logs)
    ] or [0]
    pairs = []
    for motor in motors:
        progress(Report(f"fitting motor {motor + 1} of {len(motors)}"))
        written, plain = written_and_plain(logs, motor, method)
        if held_out_runs:
            comparison = compare_blocks(*(block_errors(fit, held_out_runs) for fit in (plain, written)))
            written = replace(written, held_out=fit_rmse(written, held_out_runs), on_held_out=comparison)
            plain = replace(plain, held_out=fit_rmse(plain, held_out_runs))
        pairs.append((written, plain))
    bands, plain_motors = zip(*pairs, strict=True)
    origin = logs[0].motion_from if logs[0].speed is None else "wheel_speed"
    slow = is_slow(logs)
    try:
        windows_seen = None if slow else motor_windows(logs)
    except InsufficientDataError:  # no window for the line of a direction
        windows_seen = None
    starts = starts_of_points(points_of_logs(logs)) if slow else motor_starts(logs, windows_seen, motors)
    study = MotorStudy(
        OUTPUT_ERROR,
        logs[0].kind,
        logs[0].unit,
        origin,
        bands,
        plain_motors,
        starts=starts,
        supply=_supply(logs),
        drawn=windows_seen,
        log_warnings=tuple(averaged_statements(logs, False)) + _of_counts(runs, logs),
    )
    if windows_seen is not None:
        study = replace(study, log_warnings=(*study.log_warnings, *dead_bands_apart(bands, windows_seen)))
    return _along(study, curves_of_points(points_of_logs(logs)) if slow else curves_of_logs(logs))


def _of_counts(runs: Sequence[Run], logs: Sequence[MotorLog]) -> tuple[Statement, ...]:
    """Whether speeds were taken for the angles of which they are differences."""
    has_angles = any(run.wheel_speed is not None for run in runs) and all(log.speed is None for log in logs)
    return (Statement("speeds_added_up", NOTE),) if has_angles and logs[0].travel == ANGLE else ()


def dead_bands_apart(motors: Sequence[MotorEstimate], windows: MotorWindows) -> Iterator[Statement]:
    """Motors whose windows tell a dead band that their free run excludes, or the other way round."""
    for motor in motors:
        try:
            line = fit_line(windows, motor.motor, motor.source)
        except InsufficientDataError:
            continue
        ends = motor.rejected.get(BAND, motor.ci95.get(BAND, (math.nan, math.nan)))
        (low, high), (free_low, free_high) = ends, line.ci95[BAND]
        if (motor.dead_band_seen or line.dead_band_seen) and (high < free_low or free_high < low):
            numbers = {"free_run": ends, "windows": (free_low, free_high), "unit": motor.unit}
            yield Statement("dead_bands_apart", WARNING, motor.name, numbers)


def _supply(logs: Sequence[MotorLog]) -> float:
    """Mean supply of the logs [V], NaN where one has none."""
    means = [float(np.nanmean(log.run.supply)) if log.run.supply is not None else math.nan for log in logs]
    return float(np.mean(means))


def _of_windows(windows: MotorWindows, lines: Sequence[MotorEstimate]) -> Iterator[Statement]:
    """What was left out, and what cannot be told apart."""
    if windows.unresolved:
        yield Statement("windows_unresolved", numbers={"windows": windows.unresolved})
    if windows.resting:
        yield Statement("motor_windows_at_rest", NOTE, numbers={"windows": windows.resting})
    if windows.every > 1:
        yield Statement("windows_thinned", NOTE, numbers={"every": windows.every})
    if any(line.one_way for line in lines):
        yield Statement("turned_one_way")
