"""The logs of udea's robot: free runs of a fitted motor, and the same numbers scored in the way of the README."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.stats import trim_mean

from benchmarks.real.choose_motor import choose_motor
from benchmarks.table import Table
from omnidyn.identification.motors.choice import run_motor
from omnidyn.identification.motors.estimate import MotorEstimate
from omnidyn.identification.motors.fit import fit_motor
from omnidyn.identification.motors.input_between_rows import HOLD, MEAN
from omnidyn.logs.read_log import read_log
from omnidyn.run import Run
from tests.support import real_logs as logs

FloatArray = NDArray[np.float64]

TURNING, TURNING_PROPORTIONAL, DRIVES = 0.46, 0.56, 1.55  # [rad/s], README, means over 0.5 s
TURNING_DUTY = 0.93  # [%], README: what is left of the duty
WINDOW = 0.5  # [s]
TRIM, SPAN = 0.15, 0.12  # of the samples at each end; largest change of the duty in a window
HOW = {"kind": "duty", "angle": True, "latency": True}  # of the log of turning


def turning(table: Table) -> None:
    """The robot that turns on the spot: fitted to one half of the log, run on the other, and the whole."""
    run = turning_run()
    half = len(run) // 2
    parts = [part(run, slice(0, half)), part(run, slice(half, None))]
    for dead_band, baseline in ((True, TURNING), (False, TURNING_PROPORTIONAL)):
        words = "with Coulomb" if dead_band else "without Coulomb"
        whole = fit_motor(run, dead_band=dead_band, **HOW)
        own = window_rmse(whole, [run])
        table.add(
            f"<= {baseline}",
            own <= baseline,
            data="udea turning",
            what=f"free run, rmse of w, {words}, fitted to all",
            value=own,
            unit="rad/s",
        )
        crossed = [window_rmse(fit_motor(a, dead_band=dead_band, **HOW), [b]) for a, b in (parts, parts[::-1])]
        other = float(np.sqrt(np.mean(np.square(crossed))))
        table.add(
            f"<= {baseline}",
            other <= baseline,
            data="udea turning",
            what=f"... halves, each by the other, {words}",
            value=other,
            unit="rad/s",
        )
        table.add(
            "README 0.51",
            None,
            data="udea turning",
            what="... 1/slope",
            value=1.0 / whole.value["slope"],
            unit="(rad/s)/%",
            **{"+-": whole.std["slope"] / whole.value["slope"] ** 2},
        )
        if dead_band:
            table.add(
                "README 0.85 +- 0.54",
                None,
                data="udea turning",
                what="... dead zone",
                value=whole.value["dead_band"],
                unit="%",
                **{"+-": whole.std["dead_band"]},
            )
        _turning_as_in_readme(table, run, whole, dead_band)
    chosen(table, parts)


def chosen(table: Table, parts: Sequence[Run]) -> None:
    """Clean: latency and dead band chosen on the first half, by its own quarters; then run on the second half, once."""
    ways = [{"dead_band": band, "latency": late} for band in (False, True) for late in (False, True)]
    choice = choose_motor(parts[0], ways=ways, score=window_rmse, kind="duty", angle=True)
    words = ", ".join(f"{name}: {'yes' if value else 'no'}" for name, value in choice.options.items())
    value = window_rmse(choice.fit, [parts[1]])
    baseline = TURNING if choice.options["dead_band"] else TURNING_PROPORTIONAL
    table.add(
        f"<= {baseline}",
        value <= baseline,
        data="udea turning",
        what=f"chosen on the first half ({words}), second half",
        value=value,
        unit="rad/s",
    )


def _turning_as_in_readme(table: Table, run: Run, fit: MotorEstimate, dead_band: bool) -> None:
    """Measured w in the equation, no free run: u = slope w + dead zone sgn w + inertia dw/dt, means over 0.5 s.

    With Coulomb: the dead zone and the inertia (slope times lag); without: neither, as in the README. Beside our
    numbers the README's regression on the very same windows: where they begin is not said there.
    """
    u, w, change = windows_of_turning(run)
    columns = np.stack([w, np.sign(w), change], axis=1) if dead_band else w[:, None]
    names = ("slope", "dead_band", "inertia") if dead_band else ("slope",)
    ours = np.array([fit.value[name] for name in names])
    theirs = np.linalg.lstsq(columns, u, rcond=None)[0]
    for words, numbers in (("our numbers", ours), ("README's regression, these windows", theirs)):
        left = u - columns @ numbers
        rms = float(np.sqrt(np.mean(left**2)))
        way = f"README's way {'with' if dead_band else 'without'} Coulomb, {words}"
        if dead_band:
            table.add(
                f"README {TURNING_DUTY}", None, data="udea turning", what=f"{way}: rmse of u", value=rms, unit="%"
            )
        table.add(
            f"README {TURNING if dead_band else TURNING_PROPORTIONAL}",
            None,
            data="udea turning",
            what=f"{way}: rmse of w",
            value=rms / float(numbers[0]),
            unit="rad/s",
        )


def windows_of_turning(run: Run) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(mean duty [%], speed by the angle turned [rad/s], its change [rad/s^2]) of windows of 0.5 s."""
    assert run.duty is not None
    assert run.wheel_angle is not None
    rows = max(round(WINDOW / float(np.median(np.diff(run.t)))), 1)
    edges = np.arange(0, len(run), rows)
    u = np.array([100.0 * run.duty[a:b, 0].mean() for a, b in pairwise(edges)])
    w = np.diff(run.wheel_angle[edges, 0]) / np.diff(run.t[edges])
    return u, w, np.gradient(w, WINDOW)


def turning_run() -> Run:
    """One motor in place of three: the mean PWM, and the angle that the wheels turned by the heading of the robot."""
    robot, run = logs.udea_turning(logs.folder())
    assert run.duty is not None
    assert run.pose is not None
    lever = float(np.mean(robot.wheels.robot_radius)) / float(np.mean(robot.wheels.wheel_radius))
    angle = lever * run.pose[:, [2]]
    return Run(t=run.t, duty=run.duty.mean(axis=1, keepdims=True), wheel_angle=angle, source=run.source)


def window_rmse(fit: MotorEstimate, runs: Sequence[Run], most_span: float = np.inf) -> float:
    """Root mean square over windows of 0.5 s of mean model speed minus measured one [rad/s].

    Measured: by the angle turned where it is logged, else the trimmed mean of the speed. most_span: windows in which
    the input changes by more are left out.
    """
    errors = [
        float(np.mean(speed[rows])) - _measured(run, rows, fit.motor)
        for run, speed in zip(runs, run_motor(fit, runs), strict=True)
        for rows in windows(run, fit.motor, most_span)
    ]
    return float(np.sqrt(np.nanmean(np.square(errors))))


def windows(run: Run, motor: int, most_span: float = np.inf) -> Iterator[NDArray[np.int64]]:
    """Rows of each 0.5 s in which the duty of a motor changes by less than most_span."""
    assert run.duty is not None
    for begin in np.arange(run.t[0], run.t[-1] - WINDOW, WINDOW):
        rows = np.flatnonzero((run.t >= begin) & (run.t < begin + WINDOW))
        if np.ptp(run.duty[rows, motor]) < most_span:
            yield rows


def _measured(run: Run, rows: np.ndarray, motor: int) -> float:
    if run.wheel_angle is not None:
        first, last = rows[0], rows[-1]
        return float((run.wheel_angle[last, motor] - run.wheel_angle[first, motor]) / (run.t[last] - run.t[first]))
    assert run.wheel_speed is not None
    return float(trim_mean(run.wheel_speed[rows, motor], TRIM))


def drives(table: Table) -> None:
    """Closed-loop drives with very noisy encoders: fitted to exp1..3, run on exp4 and exp5; errors of 0.5 s means."""
    runs = drive_runs()
    for dead_band in (True, False):
        words = "with Coulomb" if dead_band else "without Coulomb"
        own, other = [], []
        for motor in range(3):
            fit = drive_fit(runs[:3], motor, dead_band)
            own.append(window_rmse(fit, runs[:3], SPAN))
            other.append(window_rmse(fit, runs[3:], SPAN))
            if dead_band:
                table.add(
                    "README 1.0, none visible",
                    None,
                    data="udea drives",
                    what=f"dead zone, motor {motor + 1}",
                    value=fit.value["dead_band"],
                    unit="%",
                    **{"+-": fit.std["dead_band"]},
                )
            table.add(
                "README 0.32 to 0.33",
                None,
                data="udea drives",
                what=f"1/slope, motor {motor + 1}, {words}",
                value=1.0 / fit.value["slope"],
                unit="(rad/s)/%",
            )
        for logs_, each in (("exp1..3", own), ("exp4, exp5", other)):
            table.add(
                f"README {DRIVES}, fitted to all",
                None,
                data="udea drives",
                what=f"free run, rmse of w, {words}, {logs_}",
                value=_together(each),
                unit="rad/s",
            )
        _drives_as_in_readme(table, runs, dead_band)
    _drives_chosen(table, runs)


def drive_fit(runs: Sequence[Run], motor: int, dead_band: bool) -> MotorEstimate:
    """One motor of the drives; Student's t, for the encoders have spikes."""
    return fit_motor(runs, motor, dead_band=dead_band, kind="duty", loss="student-t", between=HOLD)


def _drives_as_in_readme(table: Table, runs: Sequence[Run], dead_band: bool) -> None:
    """w = (|u| - dead zone)+ sgn u / slope at the mean u of a window, no free run; all logs, there and here."""
    errors = []
    for motor in range(3):
        fit = drive_fit(runs, motor, dead_band)
        band = fit.value.get("dead_band", 0.0)
        for run in runs:
            assert run.duty is not None
            for rows in windows(run, motor, SPAN):
                u = 100.0 * float(run.duty[rows, motor].mean())
                errors.append(np.sign(u) * max(abs(u) - band, 0.0) / fit.value["slope"] - _measured(run, rows, motor))
    words = f"README's way {'with' if dead_band else 'without'} Coulomb, our numbers, exp1..5"
    table.add(
        f"README {DRIVES}",
        None,
        data="udea drives",
        what=f"{words}: rmse of w",
        value=float(np.sqrt(np.mean(np.square(errors)))),
        unit="rad/s",
    )


def _drives_chosen(table: Table, runs: Sequence[Run]) -> None:
    """Clean: input and dead band of each motor chosen on exp1..3, each left out in turn; then exp4 and exp5, once."""

    def score(fit: MotorEstimate, out: Sequence[Run]) -> float:
        return window_rmse(fit, out, SPAN)

    ways = [{"dead_band": band, "between": between} for band in (False, True) for between in (HOLD, MEAN)]
    choices = [
        choose_motor(runs[:3], motor, ways=ways, score=score, kind="duty", loss="student-t") for motor in range(3)
    ]
    words = "; ".join(
        f"{c.options['between']}, {'with' if c.options['dead_band'] else 'without'} Coulomb" for c in choices
    )
    value = _together([score(choice.fit, runs[3:]) for choice in choices])
    table.add(
        f"<= {DRIVES}, README, fitted to all",
        value <= DRIVES,
        data="udea drives",
        what=f"chosen on exp1..3 ({words}): exp4, exp5",
        value=value,
        unit="rad/s",
    )


def _together(errors: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))


def drive_runs() -> list[Run]:
    """exp1 to exp5."""
    folder = logs.folder() / "udea_three_omni" / "sensor_data"
    return [read_log(folder / f"exp{k}.txt", assume={"u": "%"}) for k in range(1, 6)]


def part(run: Run, rows: slice) -> Run:
    """Some rows of a run."""
    return Run(t=run.t[rows], **{name: values[rows] for name, values in run.channels.items()}, source=run.source)
