"""Steady-state identification: real logs beside the numbers of their README, simulated logs beside their truth."""

from __future__ import annotations

import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.size import scaled
from benchmarks.table import Table, machine
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import MotorLine, SteadyState
from omnidyn.identification.motors.estimate import MotorEstimate
from omnidyn.identification.steady.line import fit_line
from omnidyn.identification.steady.moment import moments
from omnidyn.identification.steady.operating_points import ForcePoints, force_points
from omnidyn.identification.steady.shapes import SHAPES, fit_shape, rms_and_error
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from tests.support import real_logs as logs
from tests.support.steady_logs import FRICTIONS, TRUTH, clean_runs, robot_with, spoiled

DRAWS, DIRECTIONS = scaled(200, 2), range(0, 360, 15)
SHARE = (0.4, 0.95)
TRAVEL = {
    "gray 0.1": (39.27, 0.30, 2.51),
    "gray 0.2": (39.15, 0.28, 2.38),
    "gray 0.3": (39.37, 0.28, 2.35),
    "green 0.1": (35.55, 0.25, 1.49),
}
LOO = {
    "box": (16.33, 16.34, 16.28, 15.58),
    "wheel": (12.33, 11.83, 11.93, 10.25),
    "wheels": (12.51, 12.01, 11.86, 10.61),
    "wheel+roller": (6.13, 6.28, 6.27, 5.88),
    "disc": (4.14, 3.82, 3.85, 1.98),
    "disc+wheel": (4.18, 3.85, 3.88, 1.96),
    "ellipse-plain": (2.53, 2.06, 2.30, 1.92),
}


def measure() -> Table:
    """Ours beside the README, then coverage and the choice of the shape over many simulated logs."""
    table = Table("steady: identification from steady windows", ["what", "where", "ours", "README or truth", "how"])
    table.notes.append(machine())
    data = logs.folder()
    if (data / "robotino").is_dir():
        _robotino(table, data)
        _motors(table, data)
    else:
        table.notes.append(f"no real logs in {data}: set OMNIDYN_DATA")
    _simulated(table)
    return table


def _robotino(table: Table, data: Path) -> None:
    began = time.process_time()
    runs, robot = logs.robotino_groups(data), load_robot("robotino")
    read = time.process_time() - began
    readme = logs.without_mass(robot)
    fixed = {group: force_points(own, readme, speed="set", window=SHARE) for group, own in runs.items()}
    for group, own in fixed.items():
        _travel(table, group, own, "rows 40..95 %", 0.02)
        _travel(table, group, force_points(runs[group], robot, speed="set"), "windows found", 1.1 * TRAVEL[group][1])
    for shape, told in LOO.items():
        _left_out(table, robot, fixed, shape, told)
    for group, told in (("gray 0.1", (42.5, 36.1)), ("green 0.1", (36.0, 35.1))):
        level = fit_shape(SHAPES["ellipse-plain"], robot, fixed[group], has_yaw=False, robust=False)
        assert level is not None
        table.add(
            "0.15 N",
            bool(np.abs(level.level - told).max() < 0.15),
            what="ellipse Cx, Cy [N]",
            where=group,
            ours=_list(level.level),
            how="plain form, rows 40..95 %",
            **{"README or truth": _list(told)},
        )
    gray = [group for group in runs if group.startswith("gray")]
    speed = np.concatenate([force_points(runs[group], robot, window=SHARE).speed for group in gray])
    line = fit_line(speed, np.concatenate([fixed[group].along for group in gray]))
    table.add(
        "covers 0",
        bool(line.ci95[0, 0] <= 0.0 <= line.ci95[0, 1]),
        what="B [N s/m]",
        where="gray",
        ours=_pm(line.free[0], line.std[0]),
        how="line along travel",
        **{"README or truth": "-0.02 +- 2.02"},
    )
    changed = {group: len(moments(own, robot, "current")[0]) for group, own in runs.items()}
    table.add(
        "1 in 100",
        sum(changed.values()) <= 2,
        what="runs over one floor said to change",
        where="all floors",
        ours=f"{sum(changed.values())} of {sum(map(len, runs.values()))}",
        how="held commands in pieces of 0.5 s",
        **{"README or truth": "0"},
    )
    _study(table, robot, runs, read)


def _travel(table: Table, group: str, own: ForcePoints, how: str, bound: float) -> None:
    along, (mean, error, spread) = own.along, TRAVEL[group]
    deviation = float(np.std(along, ddof=1))
    table.add(
        f"within {bound:.2g} N",
        abs(float(np.mean(along)) - mean) < bound,
        what="force along travel [N]",
        where=group,
        ours=f"{_pm(np.mean(along), deviation / np.sqrt(len(along)))}, sd {deviation:.2f}",
        how=how,
        **{"README or truth": f"{_pm(mean, error)}, sd {spread:.2f}"},
    )


def _left_out(table: Table, robot: Robot, points: dict[str, ForcePoints], shape: str, told: tuple[float, ...]) -> None:
    """The README takes the sign of set speeds of 4e-9 m/s, which are the rounding of its file; so, and without."""
    for how, still in (("sign of 4e-9 m/s, as README", 0.0), ("4e-9 m/s is no motion", 1.0)):
        ours = []
        for own in points.values():
            fit = fit_shape(SHAPES[shape], robot, replace(own, still=still * own.still), has_yaw=False, robust=False)
            assert fit is not None
            ours.append(rms_and_error((fit.error**2).sum(axis=1), fit.fold)[0])
        gap = np.array(ours) - told
        goal, met = ("0.06 N", np.abs(gap).max() < 0.06) if still == 0.0 else ("no worse", gap.max() < 0.06)
        table.add(
            goal,
            bool(met),
            what="left-out error [N]",
            where=shape,
            ours=_list(ours),
            how=how,
            **{"README or truth": _list(told)},
        )


def _study(table: Table, robot: Robot, runs: dict[str, list[Run]], read: float) -> None:
    every = [(run, group.split()[0]) for group, own in runs.items() for run in own]
    for speed in ("set", "wheel"):
        began = time.process_time()
        study = identify(
            [run for run, _ in every], robot, SteadyState(speed=speed), groups=[name for _, name in every]
        ).study
        seconds = time.process_time() - began
        ranking = ", ".join(f"{score.name} {score.loo:.2f}+-{score.loo_std:.2f}" for score in study.choice.scores)
        table.add(
            what="chosen shape",
            where=f"both floors, {speed} speed",
            ours=study.choice.chosen,
            how="robust, found windows",
            **{"README or truth": "ellipse"},
        )
        table.notes.append(f"{speed} speed: {ranking}")
        table.notes.extend(f"{speed} speed: {words}" for words in study.statements)
        table.add(
            "5 s",
            read + seconds < 5.0,
            what="cpu [s]",
            where="252 files",
            ours=f"{read:.2f} + {seconds:.2f}",
            how="reading + identifying",
            **{"README or truth": ""},
        )


def _motors(table: Table, data: Path) -> None:
    free = identify(logs.robotino_motors(data), None, MotorLine(input="current", steady=True)).study
    for line, told in zip(free.motors, ("0.170", "0.142", "0.164", "0.159 +- 0.004"), strict=True):
        _band(table, "free motors: Coulomb [A]", line, told, abs(line.value["dead_band"] - float(told[:5])) < 0.005)
    slope = free.motors[-1]
    table.add(
        "0.3e-4",
        abs(slope.value["slope"] / 16.0 - 3.9e-4) < 0.3e-4,
        what="free motors: slope [A s/rad, motor]",
        where="all",
        ours=_pm(slope.value["slope"] / 16.0, slope.std["slope"] / 16.0),
        how="steady windows",
        **{"README or truth": "(3.9 +- 0.3)e-4"},
    )
    stairs = identify(logs.udea_stairs(data), None, MotorLine()).motors[-1]
    low, high = np.quantile(stairs.draws["dead_band"], [0.05, 0.95])
    gains = np.quantile(1.0 / stairs.draws["slope"], [0.15865, 0.84135])
    table.add(
        "covers 0",
        not stairs.dead_band_seen,
        what="stairs: dead zone [%]",
        where="all",
        ours=f"{stairs.value['dead_band']:.2f}, 90 % {low:.1f}..{high:.1f}",
        how="last two thirds of each step",
        **{"README or truth": "-1.75, 90 % -14..+4.8"},
    )
    table.add(
        "0.073",
        abs(1.0 / stairs.value["slope"] - 0.429) < 0.073,
        what="stairs: slope [(rad/s)/%]",
        where="all",
        ours=_pm(1.0 / stairs.value["slope"], 0.5 * np.ptp(gains)),
        how="",
        **{"README or truth": "0.429 +- 0.073"},
    )
    robot, run = logs.udea_turning(data)
    turning = identify([run], robot, MotorLine(speed="ground")).motors[-1]
    _band(table, "turning: dead zone [%]", turning, "0.85 +- 0.54", abs(turning.value["dead_band"] - 0.85) < 0.54)
    table.add(
        "0.09",
        abs(turning.value["slope"] - 1.96) < 0.09,
        what="turning: slope [% s/rad]",
        where="all",
        ours=_pm(turning.value["slope"], turning.std["slope"]),
        how="speed from heading",
        **{"README or truth": "1.96 +- 0.09"},
    )
    bench = identify(logs.odrive(data, ("step", "chirp")), None, MotorLine()).motors[0]
    _band(table, "bench: Coulomb [V]", bench, "0.00035 +- 0.00024, none", not bench.dead_band_seen)
    turn = 2.0 * np.pi
    table.add(
        "1 %",
        abs(bench.value["slope"] * turn / 0.05509 - 1.0) < 0.01,
        what="bench: viscous [V/(turn/s)]",
        where="all",
        ours=_pm(bench.value["slope"] * turn, bench.std["slope"] * turn),
        how="step and chirp",
        **{"README or truth": "0.05509 +- 0.00006"},
    )


def _band(table: Table, what: str, line: MotorEstimate, told: str, met: bool) -> None:
    low, high = line.ci95["dead_band"]
    table.add(
        "",
        met,
        what=what,
        where=f"motor {_of(line)}",
        how=f"{line.count} windows",
        ours=f"{_pm(line.value['dead_band'], line.std['dead_band'])}, 95 % {low:.3g}..{high:.3g}",
        **{"README or truth": told},
    )


def _of(line: MotorEstimate) -> str:
    return "all" if line.motor is None else str(line.motor + 1)


def _simulated(table: Table) -> None:
    """Many draws of noise for each true shape: is it chosen, and do the intervals hold the truth?"""
    axebot = load_robot("axebot")
    for shape in FRICTIONS:
        clean, rng = clean_runs(robot_with(shape), DIRECTIONS), np.random.default_rng(0)
        chosen: Counter[str] = Counter()
        held: dict[str, list[bool]] = {key: [] for key in TRUTH[shape]}
        for _ in range(DRAWS):
            runs = [spoiled(run, rng) for run in clean]
            chosen[identify(runs, axebot, SteadyState()).study.choice.chosen] += 1
            estimate = identify(runs, axebot, SteadyState(shape=shape)).estimate
            for key, truth in TRUTH[shape].items():
                low, high = estimate.ci95[key]
                held[key].append(low <= truth <= high)
        wrong = sum(number for name, number in chosen.items() if name.split("+")[0].split("-")[0] != shape)
        table.add(
            "1 %",
            wrong <= 0.01 * DRAWS,
            what="true shape chosen",
            where=shape,
            ours=f"{chosen[shape]} of {DRAWS}",
            how=", ".join(f"{name} {number}" for name, number in chosen.most_common()),
            **{"README or truth": "another kind never"},
        )
        for key, cover in held.items():
            share = float(np.mean(cover))
            table.add(
                "90..99 %",
                0.90 <= share <= 0.995,
                what="95 % interval holds the truth",
                where=key,
                ours=f"{100 * share:.1f} %",
                how=f"{DRAWS} draws",
                **{"README or truth": "95 %"},
            )


def _pm(value: float, std: float) -> str:
    digits = max(0, 1 - int(np.floor(np.log10(std)))) if std > 0.0 else 3
    return f"{value:.{digits}f} +- {std:.{digits}f}"


def _list(values) -> str:
    return " / ".join(f"{value:.2f}" for value in values)
