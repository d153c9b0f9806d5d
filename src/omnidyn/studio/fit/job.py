"""Jobs of the tab Fit: a fit with all that is shown of it, and loading what the first one needs."""

from __future__ import annotations

import glob
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import omnidyn
from omnidyn.comparison.traces import unit as unit_of
from omnidyn.document import Table, interval_cell, percent_cell
from omnidyn.errors import OmnidynError
from omnidyn.identification.estimate import NOT_DETERMINED, Estimate
from omnidyn.identification.fit_document import difference_table, number_table
from omnidyn.identification.identification import Identification
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.identification.output_error.prepare import free_by_default, guesses
from omnidyn.identification.planning.got import Got, beside, wider_of_groups
from omnidyn.model.keys import EMF, ROTOR, TORQUE, Key, find_key, in_words, unit
from omnidyn.model.robot import Robot
from omnidyn.progress import Progress, Report
from omnidyn.statement import ERROR, SEVERITIES, Statement
from omnidyn.studio.job import Tell, read, robot_of, timed, write_free_runs
from omnidyn.studio.parts import FITTED, HELD_OUT, ROBOT_FILE
from omnidyn.studio.words import number_in_words

IDLE = 19  # of a process that waits for all others
LOADED, COMPILED = 2, 8  # of the first runs: a simulation and a fit; those of the exact engine, seconds each
PARTS = ("reading", "checking", "fitting", "diagnosing", "replaying", "drawing")  # how their phases begin
CHOICES = (  # what a page offers beside what is free by default; any key can be named on the command line
    "body.mass_kg",
    "body.inertia_kg_m2",
    "wheels.wheel_radius_m",
    "wheels.robot_radius_m",
    "motor.resistance_ohm",
    TORQUE,
    EMF,
    "motor.gear_ratio",
    ROTOR,
)


def fit(request: Mapping[str, Any], tell: Tell, commands: Any) -> dict[str, Any]:
    """What `omnidyn identify` says of logs: verdict, numbers, advice; writes robot, report, table and series.

    request: "robot", "logs" (path, name, map, unsigned each), "hold_out" (names), "free" (keys, or none for the
    default), "groups" (of each log, or none), "promises" (of the plan of a log: key -> half an interval, in the middle
    and at the worst), "folder" of the results.
    """
    with timed(tell, PARTS) as listen:
        return _fitted(request, listen)


def _fitted(request: Mapping[str, Any], listen: Progress) -> dict[str, Any]:
    folder, robot = Path(request["folder"]), robot_of(request)
    folder.mkdir(parents=True)
    listen(Report("reading"))
    logs = [read(log, robot) for log in request["logs"]]
    free = tuple(request.get("free") or ())
    result = omnidyn.identify(
        [log.to_run() for log in logs],
        robot,
        OutputError(free=free) if free else None,
        hold_out=[glob.escape(name) for name in request["hold_out"]],
        groups=request.get("groups") or None,
        progress=listen,
        check=logs,
        keep_best=True,
    )
    estimates = result.groups if len(result.groups) > 1 else {"": result.estimate}
    robots = {group: f"robot-{k}.toml" if group else ROBOT_FILE for k, group in enumerate(estimates, 1)}
    for group, file in robots.items():
        omnidyn.save_robot(estimates[group].robot, folder / file)
    _ = result.after  # what follows a fit is made here, where its progress is heard
    listen(Report("drawing"))
    promised = _beside_plan(estimates, request.get("promises") or {})
    table = _with_before(_numbers(estimates, promised), robot)
    of_fits = [warning for estimate in estimates.values() for warning in estimate.warnings]
    said = dict.fromkeys([*wider_of_groups(promised), *of_fits])
    warnings = [{"severity": warning.severity, "text": str(warning)} for warning in said]
    (folder / "numbers.csv").write_text(_csv(table), "utf-8")
    (folder / "warnings.csv").write_text(
        _csv(Table(("severity", "text"), [(*warning.values(),) for warning in warnings])), "utf-8"
    )
    shown = {
        "verdict": result.headline,
        "failed": bool(result.failures),
        "severity": ERROR if result.failures else gravest(result.outcome()),
        "interrupted": result.interrupted,
        "numbers": {"head": list(table.head), "rows": [list(row) for row in table.rows]},
        "robots": robots,
        "values": {
            group: {name: float(value) for name, value in estimate.value.items()}
            for group, estimate in estimates.items()
        },
        "differences": _differences(result),
        "warnings": warnings,
        "advice": [str(step) for step in result.advice],
        "remedies": _remedies(result),
        **_free_runs(result, folder),
    }
    from omnidyn.report.identification_page import render_identification  # imported lazily: slow to load

    page = render_identification(result, {**result.provenance, "command": request["command"]})
    (folder / "report.html").write_text(page, "utf-8")
    shown["report"] = True
    return shown


def gravest(statements: Sequence[Statement]) -> str:
    """The severity of the gravest statement."""
    return min((statement.severity for statement in statements), key=SEVERITIES.index)


def _beside_plan(
    estimates: Mapping[str, Estimate], promises: Mapping[str, Sequence[float | None]]
) -> dict[str, Mapping[str, Got]]:
    """Group -> what a plan promised of its numbers (half an interval, in the middle and at the worst) and what the fit
    has; nothing without a plan."""
    shares = {key: (_share(half), _share(worst)) for key, (half, worst) in promises.items()}
    return {group: beside(shares, estimate) for group, estimate in estimates.items()} if promises else {}


def _numbers(estimates: Mapping[str, Estimate], promised: Mapping[str, Mapping[str, Got]]) -> Table:
    """Every number with its interval, and behind it its group where there are several; beside it what a plan promised,
    where there was one."""
    tables = {group: _numbers_of(estimate) for group, estimate in estimates.items()}
    tables = {group: _with_plan(table, promised[group]) for group, table in tables.items()} if promised else tables
    rows = [
        (f"{row[0]} ({group})" if group else row[0], *row[1:]) for group, table in tables.items() for row in table.rows
    ]
    return replace(next(iter(tables.values())), rows=rows)


def _share(value: float | None) -> float:
    """A share as a result has it for JSON."""
    return math.inf if value is None else value


def _differences(result: Identification) -> dict[str, Any]:
    """What differs between groups, and what may: a table, empty where there are no groups."""
    table = difference_table(result.differences)
    return {"head": ["number", *table.head[1:-1]], "rows": [[row[-1], *row[1:-1]] for row in table.rows]}


def _numbers_of(estimate: Estimate) -> Table:
    """Every number with its interval."""
    if isinstance(estimate, OutputErrorEstimate):
        table = number_table(estimate)
        return replace(table, rows=[(row[0] or number_in_words(row[1]), *row[1:]) for row in table.rows])
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


def _with_before(table: Table, robot: Robot | None) -> Table:
    """The table, and beside each number what the robot had before the fit."""
    before = [_number_of(row[1], robot) for row in table.rows]
    rows = [(*row[:5], old, *row[5:]) for row, old in zip(table.rows, before, strict=True)]
    return replace(table, head=(*table.head[:5], "before", *table.head[5:]), rows=rows)


def _with_plan(table: Table, got: Mapping[str, Got]) -> Table:
    """The table, and beside each number how well a plan promised that it will be known, and how well it is."""
    cells = [
        f"{percent_cell(got[row[1]].planned)}, {percent_cell(got[row[1]].got)}" if row[1] in got else ""
        for row in table.rows
    ]
    rows = [(*row[:5], cell, *row[5:]) for row, cell in zip(table.rows, cells, strict=True)]
    return replace(table, head=(*table.head[:5], "planned, got +- %", *table.head[5:]), rows=rows)


def _number_of(name: str, robot: Robot | None) -> str:
    """A number of a robot, "" for none."""
    try:
        return f"{Key.parse(name).get(robot):.5g}" if robot is not None and find_key(name) else ""
    except (OmnidynError, TypeError, ValueError):
        return ""


def _csv(table: Table) -> str:
    """A table as CSV."""
    import csv
    import io

    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([table.head, *table.rows])
    return text.getvalue()


def _remedies(result: Identification) -> list[dict[str, str]]:
    """What may be missing in the model and can be fitted: key, and words."""
    causes = [cause for fit in result.fits.values() if fit.lack_of_fit for cause in fit.lack_of_fit.causes]
    offered = {cause.key: str(cause.cause) for cause in reversed(causes) if cause.offered and find_key(cause.key)}
    return [{"key": key, "text": text} for key, text in reversed(offered.items())]


def _free_runs(result: Identification, folder: Path) -> dict[str, Any]:
    """The free run over each log and what it leaves, those that were held out first.

    "logs": a table of their errors. "series": folders. "runs": what a page calls a log -> its free run, its residuals.
    """
    rows, runs, channels = [], {}, dict[str, None]()
    of_uses = {HELD_OUT: [one.held_out for one in result.validations.values()]}
    of_uses[FITTED] = [one.fitted for one in result.validations.values()]
    for use, comparison in ((use, one) for use, all_of_use in of_uses.items() for one in all_of_use if one is not None):
        for k, run in enumerate(comparison.measured):
            errors, title = comparison.rmse_of_log(k), f"{run.source} ({use})"
            rows.append((run.source, use, errors))
            channels |= dict.fromkeys(errors)
            name, rest = f"run-{len(rows)}", f"rest-{len(rows)}"
            if write_free_runs(comparison, k, folder / name, title=title):
                write_free_runs(comparison, k, folder / rest, residuals=True, title=title)
                runs[title] = [name, rest]
    head = ["log", "use", *(f"rmse of {name} [{unit_of(name)}]" for name in channels)]
    table = [
        [log, use, *(f"{errors[name]:.3g}" if name in errors else "" for name in channels)] for log, use, errors in rows
    ]
    head *= bool(table)
    names = [name for pair in runs.values() for name in pair]
    return {"series": names, "runs": runs, "logs": {"head": head, "rows": table}}


def free_keys(request: Mapping[str, Any], tell: Tell, commands: Any) -> dict[str, Any]:
    """What can be free of a robot: key and words; those that are so by default first. request: "robot"."""
    robot = robot_of(request)
    assert robot is not None
    default = dict.fromkeys((*free_by_default(robot), *guesses(robot)))
    others = (key for key in map(Key.parse, CHOICES) if key.name not in default and _is_there(key, robot))
    return {"default": [[key, in_words(key)] for key in default], "others": [[str(key), key.words] for key in others]}


def _is_there(key: Key, robot: Robot) -> bool:
    """Whether the robot has one such number, and not 0."""
    try:
        return key.get(robot) > 0.0
    except (OmnidynError, TypeError, ValueError):
        return False


def warm(request: Mapping[str, Any], tell: Tell, commands: Any) -> dict[str, Any]:
    """Load what fits need, and compile what is not on disk; "is_warm": whether all was there.

    request: "all": whether to compile all that `omnidyn warm` does; else only what comes first, until a command comes:
    a fit waits for one run at most.
    """
    from omnidyn.compiled.kernel import kept
    from omnidyn.compiled.warmed import circumstances, recalled, remember
    from omnidyn.control import first_runs as of_control
    from omnidyn.identification import first_runs as of_identification

    if request["all"] and hasattr(os, "nice"):
        os.nice(IDLE)
    made_with = circumstances()
    is_warm, runs = bool(recalled(made_with)), of_identification.first_runs()
    runs = [*runs, *of_control.first_runs()] if request["all"] else runs[: LOADED if is_warm else COMPILED]
    for name, make in runs:
        if not commands.empty():
            break
        tell("progress", {"text": name, "share": None})
        make()
    if request["all"]:
        remember(kept(), made_with)
    return {"is_warm": is_warm}
