"""Output error on real logs, fitted to some runs and run freely on others, beside the baselines of their README."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.stats import trim_mean

from benchmarks import real_logs as logs
from benchmarks.identify import excitation, noisy
from benchmarks.table import Table, machine
from omnidyn.identification.motor_fit import AUTO, HOLD, MotorFit, fit_motor, fit_rmse, run_motor
from omnidyn.logs.read_log import read_log
from omnidyn.logs.run_file import write_run
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate

TURN = 2.0 * np.pi
CHIRP_END = 4.0  # [s] after it the chirp outruns the rows
RMSE = {"step": 0.044, "chirp": 0.051}  # [turns/s], README, over both runs of a kind
VISCOUS, COULOMB, LAG = (0.05509, 0.00006), (0.35e-3, 0.24e-3), 5.3e-3  # V/(turn/s), V, s
TURNING, TURNING_PROPORTIONAL, DRIVES = 0.46, 0.56, 1.55  # [rad/s], README, means over 0.5 s
WINDOW = 0.5  # [s]
TRIM, SPAN = 0.15, 0.12  # of the samples at each end; largest change of the duty in a window


def measure() -> Table:
    """All of it, half a minute."""
    table = Table("real_fit: output error on real logs", ["data", "what", "value", "+-", "unit"])
    table.notes += [machine(), "free runs are never set back; rmse of logs that were not fitted, unless said otherwise"]
    command(table)
    data = logs.folder()
    if not (data / "odrive_umn").is_dir():
        table.notes.append(f"no real logs in {data}: set OMNIDYN_DATA")
        return table
    bench(table)
    turning(table)
    drives(table)
    return table


def command(table: Table) -> None:
    """From a CSV file of 60 s at 100 Hz of the axebot to the report, in one command, start-up included."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log.csv"
        write_run(noisy(simulate(load_robot("axebot"), excitation(), 0.01), 0), log)
        words = [sys.executable, "-m", "omnidyn", "identify", str(log), "--robot", "axebot", "--force", "--report",
                 str(Path(folder) / "report.html")]  # fmt: skip
        times = []
        for _ in range(2):
            start = time.perf_counter()
            subprocess.run(words, check=True, capture_output=True)
            times.append(time.perf_counter() - start)
    table.add("<= 10", times[1] <= 10.0, data="simulated", what="CSV to report, one command", value=times[1], unit="s")
    table.add("", None, data="simulated", what="... the first time, kernels may be compiled", value=times[0], unit="s")


def bench_runs() -> dict[str, list[Run]]:
    """Two steps and two chirps of the motor bench, the chirps up to CHIRP_END."""
    data = logs.folder()
    return {"step": logs.odrive(data, ("step",)), "chirp": [cut(r, CHIRP_END) for r in logs.odrive(data, ("chirp",))]}


def cut(run: Run, end: float) -> Run:
    """The first `end` seconds."""
    keep = run.t - run.t[0] <= end
    return Run(t=run.t[keep], **{name: values[keep] for name, values in run.channels.items()}, source=run.source)


def bench(table: Table) -> None:
    """Fitted to step1 and chirp1, run on step2 and chirp2: with and without Coulomb.

    The input as it fits best (between rows the mean of both, as in the README); to compare, held, with a latency.
    """
    runs = bench_runs()
    fitted, held = [each[0] for each in runs.values()], {kind: each[1] for kind, each in runs.items()}
    for between in (AUTO, HOLD):
        for dead_band in (True, False):
            fit = fit_motor(fitted, dead_band=dead_band, between=between, latency=between == HOLD)
            how = f"{fit.between}{', latency' if between == HOLD else ''}, {'with' if dead_band else 'without'} Coulomb"
            for kind, run in held.items():
                value = fit_rmse(fit, run) / TURN
                table.add(
                    f"README {RMSE[kind]}", data="bench", what=f"rmse {kind}2, {how}", value=value, unit="turns/s"
                )
            for kind, each in runs.items():
                value = fit_rmse(fit, each) / TURN
                met = value <= 1.1 * RMSE[kind]
                table.add(
                    f"<= 1.1 x {RMSE[kind]}", met, data="bench", what=f"... both {kind}s", value=value, unit="turns/s"
                )
            slope, error = TURN * fit.value["slope"], TURN * fit.std["slope"]
            met = abs(slope - VISCOUS[0]) <= 3.0 * np.hypot(error, VISCOUS[1])
            table.add(f"README {VISCOUS[0]} +- {VISCOUS[1]}", met, data="bench", what="... viscous", value=slope,
                      unit="V/(turn/s)", **{"+-": error})  # fmt: skip
            _band(table, fit)


def _band(table: Table, fit: MotorFit) -> None:
    late = sum(n.value for n in fit.nuisances.values())
    table.add(
        "README 5.3", None, data="bench", what="... lag + latency", value=1e3 * (fit.value["lag"] + late), unit="ms"
    )
    if "dead_band" in fit.value:
        value, error = 1e3 * fit.value["dead_band"], 1e3 * fit.std["dead_band"]
        low = 1e3 * fit.ci95["dead_band"][0]
        table.add(
            "README 0.35 +- 0.24: none", None, data="bench", what="... Coulomb", value=value, unit="mV", **{"+-": error}
        )
        table.add(
            "0: none seen",
            low <= 0.0,
            data="bench",
            what="... lower end of its 95 % interval",
            value=low,
            unit="mV",
        )


def turning(table: Table) -> None:
    """The robot that turns on the spot: fitted to one half of the log, run on the other, and the whole."""
    run = turning_run()
    half = len(run) // 2
    parts = [part(run, slice(0, half)), part(run, slice(half, None))]
    for dead_band, baseline in ((True, TURNING), (False, TURNING_PROPORTIONAL)):
        words = "with dead zone" if dead_band else "proportional"
        how = {"dead_band": dead_band, "kind": "duty", "angle": True, "latency": True}
        whole = fit_motor(run, **how)
        own = window_rmse(whole, [run])
        table.add(f"<= {baseline}", own <= baseline, data="udea turning", what=f"rmse of w, {words}, fitted to all",
                  value=own, unit="rad/s")  # fmt: skip
        crossed = [window_rmse(fit_motor(a, **how), [b]) for a, b in (parts, parts[::-1])]
        other = float(np.sqrt(np.mean(np.square(crossed))))
        table.add(f"<= {baseline}", other <= baseline, data="udea turning",
                  what=f"... halves, each by the other, {words}", value=other, unit="rad/s")  # fmt: skip
        table.add("README 0.51", None, data="udea turning", what="... 1/slope", value=0.01 / whole.value["slope"],
                  unit="(rad/s)/%", **{"+-": 0.01 * whole.std["slope"] / whole.value["slope"] ** 2})  # fmt: skip
        if dead_band:
            table.add("README 0.85 +- 0.54", None, data="udea turning", what="... dead zone",
                      value=100.0 * whole.value["dead_band"], unit="%",
                      **{"+-": 100.0 * whole.std["dead_band"]})  # fmt: skip


def turning_run() -> Run:
    """One motor in place of three: the mean PWM, and the angle that the wheels turned by the heading of the robot."""
    robot, run = logs.udea_turning(logs.folder())
    assert run.duty is not None
    assert run.pose is not None
    lever = float(np.mean(robot.wheels.robot_radius)) / float(np.mean(robot.wheels.wheel_radius))
    angle = lever * run.pose[:, [2]]
    return Run(t=run.t, duty=run.duty.mean(axis=1, keepdims=True), wheel_angle=angle, source=run.source)


def window_rmse(fit: MotorFit, runs: Sequence[Run], most_span: float = np.inf) -> float:
    """Root mean square over windows of 0.5 s of mean model speed minus measured one [rad/s].

    Measured: by the angle turned where it is logged, else the trimmed mean of the speed. most_span: windows in which
    the input changes by more are left out.
    """
    errors = []
    for run, speed in zip(runs, run_motor(fit, runs), strict=True):
        starts = np.arange(run.t[0], run.t[-1] - WINDOW, WINDOW)
        for begin in starts:
            rows = np.flatnonzero((run.t >= begin) & (run.t < begin + WINDOW))
            assert run.duty is not None
            if np.ptp(run.duty[rows, fit.motor]) >= most_span:
                continue
            errors.append(float(np.mean(speed[rows])) - _measured(run, rows, fit.motor))
    return float(np.sqrt(np.nanmean(np.square(errors))))


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
        words = "with dead zone" if dead_band else "proportional"
        own, other = [], []
        for motor in range(3):
            fit = fit_motor(runs[:3], motor, dead_band=dead_band, kind="duty", loss="student-t", between=HOLD)
            own.append(window_rmse(fit, runs[:3], SPAN))
            other.append(window_rmse(fit, runs[3:], SPAN))
            if dead_band:
                table.add("README 1.0, none visible", None, data="udea drives", what=f"dead zone, motor {motor + 1}",
                          value=100.0 * fit.value["dead_band"], unit="%",
                          **{"+-": 100.0 * fit.std["dead_band"]})  # fmt: skip
            table.add("README 0.32 to 0.33", None, data="udea drives", what=f"1/slope, motor {motor + 1}, {words}",
                      value=0.01 / fit.value["slope"], unit="(rad/s)/%")  # fmt: skip
        rms = [float(np.sqrt(np.mean(np.square(each)))) for each in (own, other)]
        table.add(f"README {DRIVES}, fitted to all", None, data="udea drives", what=f"rmse of w, {words}, exp1..3",
                  value=rms[0], unit="rad/s")  # fmt: skip
        table.add(f"README {DRIVES}, fitted to all", None, data="udea drives", what=f"rmse of w, {words}, exp4, exp5",
                  value=rms[1], unit="rad/s")  # fmt: skip


def drive_runs() -> list[Run]:
    """exp1 to exp5."""
    folder = logs.folder() / "udea_three_omni" / "sensor_data"
    return [read_log(folder / f"exp{k}.txt", assume={"u": "%"}) for k in range(1, 6)]


def part(run: Run, rows: slice) -> Run:
    """Some rows of a run."""
    return Run(t=run.t[rows], **{name: values[rows] for name, values in run.channels.items()}, source=run.source)
