"""omnidyn check LOG... [--robot ROBOT]: is this log fit for use, and if not, why."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain, islice
from typing import TYPE_CHECKING, Any

import typer

import omnidyn
from omnidyn.cli import log_options
from omnidyn.cli.log_options import NO_FLAGS, LogFlags, reads_logs
from omnidyn.cli.terminal.pictures import refuse_picture, write_picture
from omnidyn.cli.terminal.progress import shown_progress
from omnidyn.cli.terminal.session import provenance, robot_input
from omnidyn.cli.terminal.streams import painted, say, show, show_json, width
from omnidyn.errors import InputError, OmnidynError
from omnidyn.files import check_output
from omnidyn.progress import Progress, Report
from omnidyn.statement import WARNING

if TYPE_CHECKING:
    from omnidyn.findings.finding import Verdict
    from omnidyn.logs.log import Log
    from omnidyn.logs.read_log import LogOptions
    from omnidyn.logs.wheel_table import WheelTable
    from omnidyn.model.robot import Robot
    from omnidyn.statement import Statement

BLOCK = 500_000  # rows that are held at once
BAD_INPUT, INSUFFICIENT = 3, 4


@dataclass
class CheckedLog:
    """One log: its verdict, or why it could not be read."""

    path: str
    verdict: Verdict | None = None
    error: OmnidynError | None = None
    digest: str = ""
    sha256: str = ""
    notes: tuple[Statement, ...] = ()
    log: Log | None = None  # its first block, where that is drawn


@reads_logs("sort")
def check(
    log: list[str] = log_options.LOGS,
    robot: str = typer.Option("", "--robot", metavar="ROBOT", help="The robot of the logs: a preset or a robot file."),
    picture: str = typer.Option("", "--picture", metavar="FILE", help="The raw log with what was found, .png or .svg."),
    wheel_table: str = typer.Option(
        "",
        "--wheel-table",
        metavar="FILE",
        help="Table by which wheels turn as asked, of all logs, .csv; with --robot.",
    ),
    full: bool = typer.Option(False, "--full", help="Every finding of every log, notes too."),
    flags: LogFlags = NO_FLAGS,
    force: bool = typer.Option(False, "--force", help="Replace files that exist."),
    json: bool = typer.Option(False, "--json", help="The verdicts for machines."),
) -> None:
    """Say what logs can be used for and what is wrong with them: which rows, why, and what to do.

    First what a log can be used for: whole logs, steady state, motors, geometry. Then time base, sensors, units,
    wiring, scales, slip, lag, limits, energy, and what the log excites. Without a robot, what needs none is checked.
    Exit code 4 when a log has errors or cannot be used for anything, 3 when one could not be read; the rest is still
    shown.
    """
    if picture and (len(log) > 1 or os.path.isdir(log[0])):
        raise InputError("a picture shows one log", got=" ".join(log), expected="one file", where="--picture")
    if wheel_table and not robot:
        raise InputError("a table of wheels needs the robot", expected="--robot ROBOT", where="--wheel-table")
    refuse_picture(picture, force)
    if wheel_table:
        check_output(wheel_table, force)
    files = log_options.keep_inputs(log, [robot], [flags.map_file], picture, flags.save_map, wheel_table)
    if len(log) == 1:
        log_options.refuse_missing(files)
    options, maps = flags.options(), flags.maps(force)
    with shown_progress("reading") as progress:
        loaded = omnidyn.load_robot(robot) if robot else None
        checked_logs = [_checked(path, loaded, options, maps, progress, bool(picture)) for path in files]
        table, no_table = None, None
        if wheel_table and loaded is not None and not any(log.error for log in checked_logs):
            try:
                runs = [one.to_run() for _, one in log_options.load_logs(files, loaded, options)]
                table = omnidyn.wheel_table(runs, loaded)
                table.write(wheel_table, force)
            except OmnidynError as error:  # what was checked is shown first
                no_table = error
    _compare_data(checked_logs)
    _tell(checked_logs, json, full, robot, table)
    if picture:
        _draw(checked_logs[0], picture, force)
    if no_table is not None:
        raise no_table
    if any(log.error is not None for log in checked_logs):
        raise typer.Exit(BAD_INPUT)
    if any(log.verdict is not None and (log.verdict.has_errors or log.verdict.useless) for log in checked_logs):
        raise typer.Exit(INSUFFICIENT)


def _checked(
    path: str,
    robot: Robot | None,
    options: LogOptions,
    maps: log_options.Maps,
    progress: Progress,
    picture: bool,
) -> CheckedLog:
    """One log, block by block; an error in reading it does not stop the others."""
    checked, digest = CheckedLog(path), _Digest()
    progress(Report(f"reading {path}"))

    def listen(report: Report) -> None:
        progress(report._replace(phase=f"reading {path}"))

    try:
        log_options.refuse_missing([path])
        from omnidyn.findings.check import check_blocks, check_log
        from omnidyn.logs.read_log import iter_logs

        log, only, blocks = _first(digest.through(iter_logs(path, robot, options, rows=BLOCK, progress=listen)))
        if log is not None:
            maps.show(path, log.columns, doubts=False)
        checked.verdict = check_log(log, robot) if log is not None and only else check_blocks(blocks, robot)
        checked.log = log if picture else None
    except OmnidynError as error:
        doubt = getattr(error, "doubt", None)  # of an UnclearTimeError: a question about the log, as a finding
        if doubt is None or not doubt.units:
            checked.error = error
        else:
            from omnidyn.findings.check import undecided

            checked.verdict = undecided(error)  # type: ignore[arg-type]
    checked.digest, checked.sha256, checked.notes = digest.value, digest.sha256, tuple(digest.notes)
    return checked


def _draw(checked: CheckedLog, picture: str, force: bool) -> None:
    """The picture of a log that could be read."""
    if checked.log is None or checked.verdict is None:
        return
    with shown_progress("drawing"):
        from omnidyn.report.figures.raw_log import draw_raw_log

        write_picture(draw_raw_log(checked.log, checked.verdict), picture, force)


def _first(blocks: Iterator[Log]) -> tuple[Log | None, bool, Iterator[Log]]:
    """The first block, which is kept for the picture, whether it is the only one, and all blocks."""
    head = list(islice(blocks, 2))
    return (head[0] if head else None), len(head) == 1, chain(head, blocks)


class _Digest:
    """What the numbers of a log hash to, whatever its name and format, and what was said of its blocks, once each."""

    def __init__(self) -> None:
        import hashlib

        self.hash, self.sha256 = hashlib.sha256(), ""
        self.notes: dict[Statement, None] = {}

    @property
    def value(self) -> str:
        return self.hash.hexdigest()

    def through(self, blocks: Iterator[Log]) -> Iterator[Log]:
        """The same blocks, taken note of."""
        for block in blocks:
            self.hash.update(block.t.tobytes())
            for name, values in sorted(block.channels.items()):
                self.hash.update(name.encode() + values.tobytes())
            self.sha256 = block.sha256 or self.sha256
            self.notes |= dict.fromkeys(block.notes)
            yield block


def _compare_data(checked_logs: list[CheckedLog]) -> None:
    """Logs that hold the same numbers under two names: evidence that counts once."""
    from omnidyn.findings.finding import Finding, in_order

    first: dict[str, CheckedLog] = {}
    for log in checked_logs:
        if log.verdict is None:
            continue
        twin = first.setdefault(log.digest, log)
        if twin is not log:
            finding = Finding("same_data", WARNING, "", {"other": twin.path})
            log.verdict = replace(log.verdict, findings=in_order([*log.verdict.findings, finding]))


def _tell(checked_logs: list[CheckedLog], json: bool, full: bool, robot: str, table: WheelTable | None) -> None:
    for log in checked_logs:
        if log.error is not None:
            say(f"omnidyn: error: {log.error}")
        for note in log.notes if full or len(checked_logs) == 1 else ():
            say(f"omnidyn: {log.path}: {note}")
    if json:
        show_json(_document(checked_logs, robot) | ({"wheel_table": table.to_dict()["wheels"]} if table else {}))
        return
    from omnidyn.telling import log_verdict

    read = [log.verdict for log in checked_logs if log.verdict is not None]
    documents = []
    if len(checked_logs) > 1:
        documents.append(log_verdict.of_several({log.path: log.verdict for log in checked_logs}, width(), full))
    if full:
        documents += [verdict.document() for verdict in read]
    elif len(checked_logs) == 1:
        documents += [log_verdict.in_brief(verdict, width()) for verdict in read]
    for document in [*documents, *([table.document()] if table else [])]:
        show(document.to_text(width(), painted))


def _document(checked_logs: list[CheckedLog], robot: str) -> dict[str, Any]:
    from omnidyn.telling.log_verdict import overall

    logs = [
        log.verdict.to_dict() | {"source": log.path, "notes": [note.to_dict() for note in log.notes]}
        for log in checked_logs
        if log.verdict is not None
    ]
    errors = [{"source": log.path, "error": str(log.error)} for log in checked_logs if log.error is not None]
    inputs = [
        {"role": "log", "name": log.path, "sha256": log.sha256} for log in checked_logs if log.verdict is not None
    ]
    record = provenance([*([robot_input(robot)] if robot else []), *inputs])
    verdict = (
        logs[0]["verdict"]
        if len(checked_logs) == 1 and logs
        else overall({log.path: log.verdict for log in checked_logs})
    )
    has_errors = any(log["has_errors"] for log in logs)
    return {"verdict": verdict, "logs": logs, "unread": errors, "has_errors": has_errors, "provenance": record}
