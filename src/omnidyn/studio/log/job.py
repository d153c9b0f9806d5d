"""Jobs of the tab Log: check a log, save a map of columns, make the example."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import omnidyn
from omnidyn.arrays import FloatArray, IntArray
from omnidyn.comparison.traces import unit as unit_of
from omnidyn.document import plain, sentence
from omnidyn.files import default_max_bytes, too_large
from omnidyn.findings.check import check_blocks, check_log
from omnidyn.findings.finding import Finding, Verdict
from omnidyn.findings.remedies import remedied
from omnidyn.logs.channels import components, si_suffix
from omnidyn.logs.column import MOTOR_SIDE, WHEEL_SIDE
from omnidyn.logs.columns.mapping import ColumnMap, map_to_toml, parse_column
from omnidyn.logs.log import Log
from omnidyn.logs.read_log import LogOptions, iter_logs
from omnidyn.model.robot import Robot
from omnidyn.progress import Progress, Report
from omnidyn.run import CHANNELS
from omnidyn.studio.drive.job import as_measured
from omnidyn.studio.job import Tell, listener, options_of, read, robot_of
from omnidyn.studio.series import SHOWN, shown_times, write_series

BLOCK = 500_000  # rows that are checked at once, as `omnidyn check` does
EXAMPLE = "axebot"
SECONDS, DT, HOLDS, SEED = 40.0, 0.01, (20, 100), 7  # [s], [s], rows that a command is held


def check(request: Mapping[str, Any], tell: Tell, commands: Any) -> dict[str, Any]:
    """What `omnidyn check` says of a log, its columns, and its signals as a series in a folder.

    request: "path", "robot", "map", "unsigned" of the log, and the "folder" of the series, which is made.
    """
    robot, options, listen = robot_of(request), options_of(request), listener(tell)
    listen(Report(f"reading {Path(request['path']).name}", urgent=True))
    blocks = _blocks(request["path"], robot, options, listen)
    _write_blocks(blocks, Path(request["folder"]))
    tell("progress", {"text": "checking", "share": None, "drawn": True})
    verdict = check_log(blocks[0], robot) if len(blocks) == 1 else check_blocks(_counted(blocks, listen), robot)
    return _told(blocks, verdict, options)


def _blocks(path: str, robot: Robot | None, options: LogOptions, listen: Progress) -> list[Log]:
    """A log in blocks of BLOCK rows, as `omnidyn check` reads it. Raises InputError for more than memory may hold."""
    blocks, held, limit = [], 0, default_max_bytes()
    for block in iter_logs(path, robot, options, rows=BLOCK, progress=listen):
        blocks.append(block)
        held += block.t.nbytes + sum(values.nbytes for values in block.channels.values())
        if held > limit:
            raise too_large(path, limit, "cut it into pieces")
    return blocks


def _counted(blocks: list[Log], listen: Progress) -> Iterator[Log]:
    """The blocks, and how many of them are checked."""
    for k, block in enumerate(blocks):
        listen(Report("checking", k, len(blocks), urgent=True))
        yield block


def _told(blocks: list[Log], verdict: Verdict, options: LogOptions) -> dict[str, Any]:
    """The verdict and the columns, as the page shows them."""
    log = blocks[0]
    t = shown_times(np.concatenate([block.t for block in blocks]))
    rows = np.concatenate([block.lines for block in blocks])
    lines = {"error": 0, "warning": 1, "note": 2}
    findings = [
        {
            "severity": finding.severity,
            "code": finding.code,
            "subject": finding.subject,
            "text": str(finding),
            "remedy": finding.remedy_text,
            "count": finding.count,
            "spans": _spans(t, rows, finding),
            "reading": _reading(finding, options, log.columns),
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
            "latency": column.latency,
            "frame": column.frame,
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
        "notes": [str(note) for note in dict.fromkeys(note for block in blocks for note in block.notes)],
    }


def _reading(finding: Finding, options: LogOptions, columns: ColumnMap) -> dict[str, Any] | None:
    """What a button does about a finding: another map, as text, or a sign for the currents; None for neither."""
    mended = remedied(finding, options, columns)
    if mended is None:
        return None
    changed = None if mended.columns is options.columns else mended.columns
    return {"map": map_to_toml(changed) if changed else "", "unsigned": mended.current_unsigned}


def _spans(t: FloatArray, lines: IntArray, finding: Finding) -> list[tuple[float, float]]:
    """The stretches of time in which a finding has its rows [s]. t, lines: of all rows, shape (rows,)."""
    spans = []
    for first, last in finding.rows:
        a, b = np.searchsorted(lines, [first, last])
        if a < len(t):
            spans.append((float(t[a]), float(t[min(b, len(t) - 1)])))
    return spans


def _write_blocks(blocks: list[Log], folder: Path) -> None:
    """The channels of a log that hold a number, as a series."""
    panels, columns = [], []
    for channel in CHANNELS:
        parts = [block.channels[channel].reshape(len(block), -1) for block in blocks if channel in block.channels]
        if len(parts) < len(blocks):
            continue
        by_unit: dict[str, list[str]] = {}
        for k, name in enumerate(components(channel, parts[0].shape[1])):
            if any(np.isfinite(part[:, k]).any() for part in parts):
                by_unit.setdefault(unit_of(name), []).append(name)
                columns.append([part[:, k] for part in parts])
        panels += [
            {"title": channel.replace("_", " "), "unit": unit, "signals": signals} for unit, signals in by_unit.items()
        ]
    t = np.concatenate([block.t for block in blocks])
    if columns and len(t):
        values = np.empty((len(columns), len(t)), SHOWN)
        for row, parts in zip(values, columns, strict=True):
            np.concatenate(parts, out=row, casting="same_kind")
        write_series(folder, t, panels, values)


def align(request: Mapping[str, Any], tell: Tell, commands: Any) -> dict[str, Any]:
    """What `omnidyn align` says of two logs. request: "logs" (path, map, unsigned each), "robot"."""
    robot = robot_of(request)
    first, second = (read(log, robot).to_run() for log in request["logs"])
    alignment = omnidyn.align(first, second)
    verdict = alignment.verdict
    remedy = verdict.remedy_text and sentence(verdict.remedy_text)
    said = " ".join(filter(None, (alignment.document().verdict_text, remedy)))
    return {"offset": alignment.offset, "severity": verdict.severity, "verdict": said}


def save_columns(request: Mapping[str, Any], tell: Tell, commands: Any) -> dict[str, Any]:
    """Write the map of columns that a table says, which `--map` takes. request: "rows", "path"."""
    columns = {}
    for row in request["rows"]:
        sign, side = "-" if row["invert"] else "", MOTOR_SIDE if row["motor"] else WHEEL_SIDE
        text = f"{row['component']}={sign}{row['column']}:{row['unit']}@{side}"
        component, column = parse_column(text)
        more = {"latency": row.get("latency", 0.0), "frame": row.get("frame", "")}
        columns[component] = replace(column, name=row["column"], unit=row["unit"] or si_suffix(component), **more)
    Path(request["path"]).write_text(map_to_toml(ColumnMap(columns)), "utf-8")
    return {}


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
