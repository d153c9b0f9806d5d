"""`omnidyn check` on 12 faults put into 200 clean simulated logs each, and on 1000 clean logs.

A clean log is a simulated run of a random robot: three or four wheels, box or disc friction, some with a turning
frame, 1 to 10 kg, 0.8 to 2 m/s without load; 10 to 60 s at 50 to 200 Hz; pushes in random directions, ramps and
pauses; voltage, or duty with its supply; current with noise of 0.3 to 2 % of its stall value (8 logs in 10); wheel
speed with noise of 0.3 to 2 % and steps of 0.2 to 3 % of its top (95 in 100), three in ten of them differences of
counts; a twist, a pose, a gyro only, or nothing; jitter of 0, 2 or 10 % of the step.

The size of a fault is drawn evenly in its logarithm, in a log with channels that show it; a fault that leaves the log
as it was is drawn again. It counts as found when its own finding names the component, the rows, or the size that was
put in. Slip is in one stretch of 2 s to 60 % of the log, or, one time in four, all through it: then only the motors
can tell it from a wrong radius or gear, and the finding that names all of them counts.
"""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np

from benchmarks.logs.check_faults import FAULTS, draw
from benchmarks.size import scaled
from benchmarks.table import Table, machine, one_core
from omnidyn.findings.check import check
from omnidyn.logs.log import Log
from omnidyn.report.figures.raw_log import draw_raw_log
from omnidyn.report.style import BLUE, GREY, VERMILLION, WIDTH, look, new_figure, picture
from omnidyn.statement import NOTE
from tests.support.random_logs import clean

LOGS, CLEAN = scaled(200, 2), scaled(1000, 4)
RECALL, FALSE = 0.95, 0.02  # the goals
ROWS, COLUMNS, SECONDS = 500_000, 10, 2.0  # and of the speed, CPU seconds
BINS = 5


class Outcome(NamedTuple):
    """Of one fault: sizes and whether each was found; logs in which something else was said that is not so."""

    sizes: np.ndarray
    found: np.ndarray
    untrue: int


def run_fault(name: str, logs: int = LOGS) -> Outcome:
    """Check `logs` logs with one fault."""
    fault, sizes, found, untrue = FAULTS[name], [], [], 0
    for seed in range(logs):
        log, robot, broken, size = draw(name, seed)
        verdict = check(log, robot)
        sizes.append(size)
        found.append(fault.found(verdict, broken))
        untrue += any(f.severity != NOTE and f.code not in (*CODES[name], *fault.also) for f in verdict.findings)
    return Outcome(np.array(sizes), np.array(found), untrue)


# What a verdict may say about each fault; anything else above a note is counted as untrue.
CODES = {
    "swapped motor": ("swapped",),
    "inverted sign": ("inverted",),
    "rpm as rad/s": ("unit",),
    "one-sample lag": ("lag",),
    "gap": ("gap",),
    "repeated stamps": ("time_repeats",),
    "saturation": ("saturation",),
    "sag": ("sag",),
    "slip": ("slip",),
    "stuck encoder": ("stuck",),
    "dead channel": ("dead",),
    "wrong gear": ("gear", "path_ratio"),
}


def run_clean(logs: int = CLEAN) -> tuple[int, list[str]]:
    """(clean logs in which anything untrue is said, what)."""
    wrong, words = 0, []
    for seed in range(logs):
        log, robot, scene = clean(seed)
        said = [f for f in check(log, robot).findings if f.severity != NOTE]
        wrong += bool(said)
        words += [f"clean log {seed} ({robot.name}, {scene.floor}): {f.code} {f.subject}" for f in said]
    return wrong, words


def speed() -> float:
    """CPU seconds for a long log of ten columns."""
    log, robot, _ = clean(7)  # three wheels, duty, current, wheel speed and twist
    kept = {
        name: np.tile(log.channels[name], (ROWS // len(log) + 1, 1))[:ROWS] for name in ("duty", "wheel_speed", "twist")
    }
    step = float(np.median(np.diff(log.t)))
    long = Log(np.arange(ROWS, dtype=float) * step, kept, np.arange(ROWS) + 2)
    check(log, robot)
    with one_core():
        begin = time.process_time()
        check(long, robot)  # the times and nine columns
        return time.process_time() - begin


def measure(logs: int = LOGS, clean_logs: int = CLEAN) -> Table:
    """Recall of each fault, false alarms, speed; and the pictures of docs/."""
    outcomes = {name: run_fault(name, logs) for name in FAULTS}
    table = table_of(outcomes, run_clean(clean_logs), clean_logs)
    table.pictures |= {"check_recall.png": lambda: draw_recall(outcomes), "check_log.png": draw_example}
    return table


def table_of(outcomes: dict[str, Outcome], false: tuple[int, list[str]], clean_logs: int) -> Table:
    """The outcomes as a table."""
    table = Table(
        "check: faults put into clean simulated logs", ["fault", "sizes", "logs", "found", "recall %", "untrue"]
    )
    for name, outcome in outcomes.items():
        fault, share = FAULTS[name], float(outcome.found.mean())
        sizes = f"{fault.low:g} to {fault.high:g} {fault.unit}" if fault.high > fault.low else f"{fault.unit}"
        table.add(
            f">= {100 * RECALL:g} %",
            share >= RECALL,
            fault=name,
            sizes=sizes,
            logs=len(outcome.found),
            found=int(outcome.found.sum()),
            untrue=outcome.untrue,
            **{"recall %": 100.0 * share},
        )
    wrong, words = false
    goal = f"<= {100 * FALSE:g} % untrue"
    table.add(goal, wrong <= FALSE * clean_logs, fault="none (clean)", sizes="", logs=clean_logs, untrue=wrong)
    seconds = speed()
    table.add(
        f"<= {SECONDS:g} s of CPU",
        seconds <= SECONDS,
        fault=f"{ROWS} rows x {COLUMNS} columns",
        sizes=f"{seconds:.2f} s",
    )
    table.notes += [machine(), "untrue: logs in which a warning or a fatal finding says what is not the case"]
    table.notes += [f"untrue in {each}" for each in words[:20]]
    return table


def draw_recall(outcomes: dict[str, Outcome]) -> bytes:
    """Recall against size, a panel per fault that has sizes. PNG."""
    sized = [name for name in outcomes if FAULTS[name].high > FAULTS[name].low]
    with look():
        figure = new_figure(WIDTH, 4.6)
        panels = figure.subplots(2, -(-len(sized) // 2), sharey=True).ravel()
        figure.subplots_adjust(left=0.085, right=0.98, top=0.93, bottom=0.13, wspace=0.22, hspace=0.55)
        for axes, name in zip(panels, sized, strict=False):
            fault, outcome = FAULTS[name], outcomes[name]
            edges = np.geomspace(fault.low, fault.high, BINS + 1)
            place = np.clip(np.searchsorted(edges, outcome.sizes, side="right") - 1, 0, BINS - 1)
            middle = np.sqrt(edges[1:] * edges[:-1])
            number = np.bincount(place, minlength=BINS)
            share = np.bincount(place, outcome.found, minlength=BINS) / np.maximum(number, 1)
            axes.axhline(100 * RECALL, color=VERMILLION, linewidth=1.2, linestyle="--")
            axes.plot(middle[number > 0], 100 * share[number > 0], "o-", color=BLUE)
            axes.set_xscale("log")
            ticks = [fault.low, round(float(np.sqrt(fault.low * fault.high))) or 1, fault.high]
            axes.set_xticks(ticks, [f"{round(each, 1):g}" for each in ticks])
            axes.minorticks_off()
            axes.set_title(name)
            axes.set_xlabel(fault.unit)
            axes.set_ylim(0.0, 104.0)
        for axes in panels[len(sized) :]:
            axes.set_axis_off()
        for axes in panels[:: len(panels) // 2]:
            axes.set_ylabel("found, %")
        figure.text(0.985, 0.012, "dashed: 95 %", color=GREY, ha="right", fontsize=9.5)
        return picture("check_recall", "Recall against size", "", figure).png


def draw_example() -> bytes:
    """A log with a stuck encoder and a gap, as `omnidyn check --picture` shows it. PNG."""
    log, robot, _, _ = draw("stuck encoder", 3)
    broken = log.rows(np.r_[0:600, 900 : len(log)])
    return draw_raw_log(broken, check(broken, robot)).png
