"""Output error on real logs, fitted to some runs and run freely on others, beside the baselines of their README."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.real import real_loop, real_nuisances, udea
from benchmarks.real.choose_motor import choose_motor
from benchmarks.table import Table, machine
from omnidyn.identification.methods import AUTO
from omnidyn.identification.motors.choice import fit_rmse, run_motor
from omnidyn.identification.motors.estimate import MotorEstimate
from omnidyn.identification.motors.fit import fit_motor
from omnidyn.identification.motors.input_between_rows import MEAN
from omnidyn.logs.run_file import write_run
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support import real_logs as logs
from tests.support.axebot_logs import excitation, noisy_draw

TURN = 2.0 * np.pi
CHIRP_END = 4.0  # [s] after it the chirp outruns the rows
RMSE = {"step": 0.044, "chirp": 0.051}  # [turns/s], README, over both runs of a kind
VISCOUS, COULOMB, LAG = (0.05509, 0.00006), (0.35e-3, 0.24e-3), 5.3e-3  # V/(turn/s), V, s


def measure() -> Table:
    """All of it, two minutes."""
    table = Table("real_fit: output error on real logs", ["data", "what", "value", "+-", "unit"])
    table.notes += [machine(), "free runs are never set back; rmse of logs that were not fitted, unless said otherwise"]
    command(table)
    data = logs.folder()
    if not (data / "odrive_umn").is_dir():
        table.notes.append(f"no real logs in {data}: set OMNIDYN_DATA")
        return table
    bench(table)
    exam(table)
    chirp_alone(table)
    udea.turning(table)
    udea.drives(table)
    real_loop.robotino(table)
    real_nuisances.nuisances(table)
    return table


def command(table: Table) -> None:
    """From a CSV file of 60 s at 100 Hz of the axebot to the report, in one command, start-up included."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log.csv"
        write_run(noisy_draw(simulate(load_robot("axebot"), excitation(), 0.01), 0), log)
        words = [
            sys.executable,
            "-m",
            "omnidyn",
            "identify",
            str(log),
            "--robot",
            "axebot",
            "--force",
            "--report",
            str(Path(folder) / "report.html"),
        ]
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

    The input as it fits best, with a latency, as the command does by itself; to compare, without one, and the mean of
    both rows, as in the README.
    """
    runs = bench_runs()
    fitted, held = [each[0] for each in runs.values()], {kind: each[1] for kind, each in runs.items()}
    for between, latency in ((AUTO, True), (AUTO, False), (MEAN, True)):
        for dead_band in (True, False):
            fit = fit_motor(fitted, dead_band=dead_band, between=between, latency=latency)
            how = f"{fit.between}{', latency' if latency else ''}, {'with' if dead_band else 'without'} Coulomb"
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
            table.add(
                f"README {VISCOUS[0]} +- {VISCOUS[1]}",
                met,
                data="bench",
                what="... viscous",
                value=slope,
                unit="V/(turn/s)",
                **{"+-": error},
            )
            _band(table, fit)


def exam(table: Table) -> None:
    """Clean: input, latency and dead band are chosen on step1 and chirp1 alone, each predicted by the other.

    Only then are step2 and chirp2 run, once.
    """
    runs = bench_runs()
    choice = choose_motor([each[0] for each in runs.values()])
    for way, error in choice.errors:
        table.add(
            "",
            None,
            data="bench, choice",
            what=f"left out of training: {_words(way)}",
            value=error / TURN,
            unit="turns/s",
        )
    for kind, each in runs.items():
        value = fit_rmse(choice.fit, each[1]) / TURN
        table.add(
            f"<= 1.1 x {RMSE[kind]}, both {kind}s",
            value <= 1.1 * RMSE[kind],
            data="bench, choice",
            what=f"chosen: {_words(choice.options)}; rmse {kind}2",
            value=value,
            unit="turns/s",
        )


def chirp_alone(table: Table) -> None:
    """The control at its hardest: one chirp, and nothing beside it. Intervals are about noise, not the model."""
    runs = bench_runs()["chirp"]
    fits = [fit_motor(run) for run in runs]
    for k, fit in enumerate(fits):
        low = 1e3 * fit.ci95["dead_band"][0]
        table.add(
            "0: none seen",
            low <= 0.0,
            data="bench, chirp alone",
            value=low,
            unit="mV",
            what=f"Coulomb of chirp{k + 1} alone, lower end of its 95 % interval",
        )
    errors = [(run_motor(fits[0], run)[0] - run.wheel_speed[:, 0], run.t - run.t[0]) for run in runs]  # type: ignore[index]
    (first, t), (second, other) = errors
    known = np.isfinite(second)
    again = np.interp(t, other[known], second[known])
    both = np.isfinite(first) & (t > 0.1)
    table.add(
        "0 for noise",
        None,
        data="bench, chirp alone",
        what="correlation of the errors of chirp1 and chirp2",
        value=float(np.corrcoef(first[both], again[both])[0, 1]),
        unit="",
    )


def _words(way: Mapping[str, Any]) -> str:
    """A way of fitting in a few words."""
    late = "latency" if way["latency"] else "no latency"
    return f"{way['between']}, {late}, {'with' if way['dead_band'] else 'without'} Coulomb"


def _band(table: Table, fit: MotorEstimate) -> None:
    late = sum(fit.late.values())
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
