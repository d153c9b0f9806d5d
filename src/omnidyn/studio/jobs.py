"""What the library is asked for, in the process of a worker: each job takes plain values and gives plain values.

Each of JOBS has the arguments request, tell (sends a message to the page) and commands (a queue of what a page sends
while the job goes on).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import omnidyn
from omnidyn.arrays import FloatArray
from omnidyn.comparison.result import Comparison
from omnidyn.comparison.traces import unit as unit_of
from omnidyn.document import Table, interval_cell, plain
from omnidyn.findings.check import check_blocks, check_log
from omnidyn.findings.finding import Finding, Verdict
from omnidyn.identification.estimate import NOT_DETERMINED, Estimate
from omnidyn.identification.fit_document import number_table
from omnidyn.identification.identification import Identification
from omnidyn.identification.methods import OutputError, SteadyState
from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.logs.channels import components, si_suffix
from omnidyn.logs.column import MOTOR_SIDE, WHEEL_SIDE
from omnidyn.logs.columns.mapping import ColumnMap, load_map, map_to_toml, parse_column
from omnidyn.logs.log import Log
from omnidyn.logs.read_log import LogOptions, iter_logs
from omnidyn.model.keys import find_key, in_words, unit
from omnidyn.model.robot import Robot
from omnidyn.progress import Report
from omnidyn.run import CHANNELS
from omnidyn.studio.driving import Drive, as_measured
from omnidyn.studio.series import shown_times, write_series

BLOCK = 500_000  # rows that are checked at once, as `omnidyn check` does
Tell = Callable[[str, Any], None]
INTERVAL = 0.1  # [s] between two reports of progress


def _progress(tell: Tell) -> Callable[[Report], None]:
    """A listener of the library that tells the page."""
    last = [0.0]

    def listen(report: Report) -> None:
        now = time.monotonic()
        if report.urgent or now - last[0] > INTERVAL:
            last[0] = now
            share = report.done / report.total if report.total else None
            tell("progress", {"text": str(report), "share": share})

    return listen


def _robot(request: Mapping[str, Any]) -> Robot | None:
    return omnidyn.load_robot(request["robot"]) if request.get("robot") else None


def _options(log: Mapping[str, Any]) -> LogOptions:
    """How a log is read."""
    columns = load_map(log["map"]) if log.get("map") else None
    return LogOptions(columns=columns, current_unsigned=bool(log.get("unsigned")))


# Log


def check(request: Mapping[str, Any], tell: Tell, commands: Any) -> dict[str, Any]:
    """What `omnidyn check` says of a log, its columns, and its signals as a series in a folder.

    request: "path", "robot", "map", "unsigned" of the log, and the "folder" of the series, which is made.
    """
    robot, options, listen = _robot(request), _options(request), _progress(tell)
    listen(Report(f"reading {Path(request['path']).name}", urgent=True))
    log = omnidyn.load_log(request["path"], robot, options)
    _write_log(log, Path(request["folder"]))
    tell("progress", {"text": "checking", "share": None, "drawn": True})
    if len(log) <= BLOCK:
        verdict = check_log(log, robot)
    else:
        verdict = check_blocks(iter_logs(request["path"], robot, options, rows=BLOCK, progress=listen), robot)
    return _told(log, verdict)


def _told(log: Log, verdict: Verdict) -> dict[str, Any]:
    """The verdict and the columns, as the page shows them."""
    lines = {"error": 0, "warning": 1, "note": 2}
    findings = [
        {
            "severity": finding.severity,
            "code": finding.code,
            "subject": finding.subject,
            "text": str(finding),
            "remedy": finding.remedy_text,
            "count": finding.count,
            "spans": _spans(log, finding),
        }
        for finding in sorted(verdict.findings, key=lambda finding: lines[finding.severity])
    ]
    columns = [
        {
            "component": component,
            "column": column.name,
            "unit": column.unit,
            "motor": column.side == MOTOR_SIDE,
            "invert": column.invert,
        }
        for component, column in log.columns.columns.items()
    ]
    return {
        "verdict": verdict.verdict,
        "severity": verdict.conclusion.severity,
        "headline": verdict.headline(),
        "has_errors": verdict.has_errors,
        "rows": verdict.rows,
        "uses": plain([{"name": use.name, "good": use.good, "reason": str(use.reason)} for use in verdict.uses]),
        "findings": findings,
        "columns": columns,
        "unused": list(log.columns.unused),
        "doubts": [doubt.with_remedy for doubt in log.columns.doubts],
        "notes": [str(note) for note in log.notes],
    }


def _spans(log: Log, finding: Finding) -> list[tuple[float, float]]:
    """The stretches of time in which a finding has its rows [s]."""
    t = shown_times(log.t)
    spans = []
    for first, last in finding.rows:
        a, b = np.searchsorted(log.lines, [first, last])
        if a < len(t):
            spans.append((float(t[a]), float(t[min(b, len(t) - 1)])))
    return spans


def _write_log(log: Log, folder: Path) -> None:
    """The channels of a log that hold a number, as a series."""
    panels, values = [], []
    for channel in CHANNELS:
        if channel not in log.channels:
            continue
        columns = log.channels[channel].reshape(len(log), -1)
        names = components(channel, columns.shape[1])
        by_unit: dict[str, list[str]] = {}
        for name, column in zip(names, columns.T, strict=True):
            if np.isfinite(column).any():
                by_unit.setdefault(unit_of(name), []).append(name)
                values.append(column)
        panels += [
            {"title": channel.replace("_", " "), "unit": unit, "signals": signals} for unit, signals in by_unit.items()
        ]
    if values and len(log):
        write_series(folder, log.t, panels, np.array(values))


def save_columns(request: Mapping[str, Any], tell: Tell, commands: Any) -> dict[str, Any]:
    """Write the map of columns that a table says, which `--map` takes. request: "rows", "path"."""
    columns = {}
    for row in request["rows"]:
        sign, side = "-" if row["invert"] else "", MOTOR_SIDE if row["motor"] else WHEEL_SIDE
        text = f"{row['component']}={sign}{row['column']}:{row['unit']}@{side}"
        component, column = parse_column(text)
        columns[component] = replace(column, name=row["column"], unit=row["unit"] or si_suffix(component))
    Path(request["path"]).write_text(map_to_toml(ColumnMap(columns)), "utf-8")
    return {}


# Fit


def fit(request: Mapping[str, Any], tell: Tell, commands: Any) -> dict[str, Any]:
    """What `omnidyn identify` says of logs: verdict, numbers, advice; writes robot, report, table and series.

    request: "robot", "logs" (path, map, unsigned each), "hold_out" (paths), "free" (keys, or none for the default),
    "folder" of the results.
    """
    listen, folder, robot = _progress(tell), Path(request["folder"]), _robot(request)
    folder.mkdir(parents=True)
    listen(Report("reading", urgent=True))
    logs = [omnidyn.load_log(log["path"], robot, _options(log)) for log in request["logs"]]
    free = tuple(request.get("free") or ())
    result = omnidyn.identify(
        [log.to_run() for log in logs],
        robot,
        OutputError(free=free) if free else None,
        hold_out=[_literal(path) for path in request["hold_out"]],
        progress=listen,
        check=logs,
        keep_best=True,
    )
    estimate = result.estimate
    omnidyn.save_robot(estimate.robot, folder / "robot.toml")
    _ = result.after  # what follows a fit is made here, where its progress is heard
    listen(Report("drawing", urgent=True))
    table = _numbers(estimate)
    (folder / "numbers.csv").write_text(_csv(table), "utf-8")
    shown = {
        "verdict": result.headline,
        "failed": bool(result.failures),
        "interrupted": result.interrupted,
        "numbers": {"head": list(table.head), "rows": [list(row) for row in table.rows]},
        "values": {name: float(value) for name, value in estimate.value.items()},
        "warnings": [{"severity": w.severity, "text": str(w)} for w in dict.fromkeys(estimate.warnings)],
        "advice": [str(step) for step in result.advice],
        "remedies": _remedies(result),
        "series": _write_free_run(result, folder / "series"),
    }
    shown["report"] = _write_report(result, request, folder / "report.html")
    return shown


def _literal(path: str) -> str:
    """A glob that only this path fits."""
    return "".join(f"[{c}]" if c in "*?[" else c for c in path)


def _numbers(estimate: Estimate) -> Table:
    """Every number with its interval."""
    if isinstance(estimate, OutputErrorEstimate):
        table = number_table(estimate)
        return replace(table, rows=[(row[0], *row[1:]) for row in table.rows])
    rows = [
        (
            in_words(name),
            name,
            f"{value:.5g}",
            f"{estimate.std[name]:.2g}",
            NOT_DETERMINED if name in estimate.unidentifiable else interval_cell(estimate.ci95[name]),
            unit(name),
            "",
        )
        for name, value in estimate.value.items()
    ]
    return Table(("number", "key", "value", "std error", "95 % interval", "unit", ""), rows)


def _csv(table: Table) -> str:
    """A table as CSV."""
    import csv
    import io

    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([table.head, *table.rows])
    return text.getvalue()


def _remedies(result: Identification) -> list[dict[str, str]]:
    """What may be missing in the model and can be fitted: key, and words."""
    fits = list(result.fits.values())
    if not fits or fits[0].lack_of_fit is None:
        return []
    return [
        {"key": remedy.key, "text": str(remedy.cause)}
        for remedy in fits[0].lack_of_fit.causes
        if remedy.offered and find_key(remedy.key) is not None
    ]


def _write_free_run(result: Identification, folder: Path) -> bool:
    """The free run over the first log that was held out, or fitted; whether there is one."""
    validation = result.validation if isinstance(result.method, OutputError) else None
    if validation is None:
        return False
    comparison = validation.held_out or validation.fitted
    panels, t, values = _measured_and_model(comparison)
    if not panels:
        return False
    title = "held-out log" if validation.held_out else "fitted log"
    write_series(folder, t, panels, values, title=f"{title}: {comparison.measured[0].source}")
    return True


def _measured_and_model(comparison: Comparison) -> tuple[list[dict[str, Any]], FloatArray, FloatArray]:
    """A panel for each component of the first log: measured and model."""
    segments = [segment for segment in comparison.segments if segment.log == 0]
    panels, columns, t = [], [], np.zeros(0)
    for name in comparison.channels:
        traces = [comparison.trace(comparison.robots[0], name, segment) for segment in segments]
        if not traces:
            continue
        t = np.concatenate([trace.t for trace in traces])
        measured, model = (np.concatenate([getattr(trace, part) for trace in traces]) for part in ("measured", "model"))
        panels.append({"title": name, "unit": unit_of(name), "signals": ["measured", "model"]})
        columns += [measured, model]
    return panels, t, np.array(columns)


def _write_report(result: Identification, request: Mapping[str, Any], path: Path) -> bool:
    """The page that `--report` writes; whether there is one."""
    record = {"omnidyn": omnidyn.__version__, "command": request["command"], "inputs": []}
    if isinstance(result.method, SteadyState) and result.study is not None:
        from omnidyn.report.steady_page import render_study

        study: Any = result.study
        page = render_study(study, record, verdict=result.verdict, verdicts=result.verdicts)
    elif isinstance(result.method, OutputError):
        from omnidyn.report.fit_page import render_fit

        page = render_fit(result, record)
    else:
        return False
    path.write_text(page, "utf-8")
    return True


def warm(request: Mapping[str, Any], tell: Tell, commands: Any) -> dict[str, Any]:
    """Load what fits need, so that the first one starts at once."""
    from omnidyn.identification.first_runs import first_runs

    for name, make in first_runs()[:2]:
        tell("progress", {"text": name, "share": None})
        make()
    return {}


# Example and drive

EXAMPLE = "axebot"
SECONDS, DT, HOLDS, SEED = 40.0, 0.01, (20, 100), 7  # [s], [s], rows that a command is held


def example(request: Mapping[str, Any], tell: Tell, commands: Any) -> dict[str, Any]:
    """Write a simulated log of the axebot under random voltages. request: "path"."""
    robot, draws = omnidyn.load_robot(EXAMPLE), np.random.default_rng(SEED)
    rows = round(SECONDS / DT)
    limit = float(np.max(robot.motor.voltage_limit))
    held = list(_held(draws, rows, robot.wheels.count, limit))
    run = omnidyn.simulate(robot, np.concatenate(held)[:rows], DT)
    assert run.twist is not None
    kept = omnidyn.Run(t=run.t, voltage=run.voltage, twist=as_measured(run.twist, SEED), source="example")
    omnidyn.write_run(kept, request["path"])
    return {}


def _held(draws: np.random.Generator, rows: int, wheels: int, limit: float) -> Iterator[FloatArray]:
    """Voltages that are held for a while, then others [V]. Shape (held, wheels) each."""
    made = 0
    while made < rows:
        count = int(draws.integers(*HOLDS))
        made += count
        yield np.tile(draws.uniform(-limit, limit, wheels), (count, 1))


def drive(request: Mapping[str, Any], tell: Tell, commands: Any) -> dict[str, Any]:
    """Drive a robot until the page stops it. request: "robot", "folder" of recorded logs."""
    robot = _robot(request)
    assert robot is not None
    return Drive(robot, Path(request["folder"]), tell, commands).run()


JOBS: dict[str, Callable[[Mapping[str, Any], Tell, Any], dict[str, Any]]] = {
    "check": check,
    "save_columns": save_columns,
    "fit": fit,
    "warm": warm,
    "example": example,
    "drive": drive,
}
