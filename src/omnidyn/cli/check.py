"""omnidyn check LOG... [--robot ROBOT]: is this log fit for use, and if not, why."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import typer

from omnidyn.cli import log_options
from omnidyn.cli.log_options import NO_FLAGS, LogFlags, reads_logs
from omnidyn.cli.terminal.pictures import refuse_picture, write_picture
from omnidyn.cli.terminal.progress import progress
from omnidyn.cli.terminal.streams import painted, say, show, show_json, width
from omnidyn.errors import InputError, OmnidynError, printable

if TYPE_CHECKING:
    from omnidyn.findings.finding import Finding, Verdict
    from omnidyn.logs.log import Log
    from omnidyn.logs.read_log import LogOptions
    from omnidyn.model.robot import Robot

BLOCK = 500_000  # rows that are held at once
WHOLE = 3  # logs that are shown one by one in full
BAD_INPUT, INSUFFICIENT = 3, 4


@dataclass
class Checked:
    """One log: its verdict, or why it could not be read."""

    path: str
    verdict: Verdict | None = None
    error: OmnidynError | None = None
    digest: str = ""
    sha256: str = ""
    notes: tuple[str, ...] = ()
    log: Log | None = None  # its first block, where that is drawn


@reads_logs("sort")
def check(
    log: list[str] = log_options.LOGS,
    robot: str = typer.Option("", "--robot", metavar="ROBOT", help="The robot of the logs: a preset or a robot file."),
    picture: str = typer.Option("", "--picture", metavar="FILE", help="The raw log with what was found, .png or .svg."),
    full: bool = typer.Option(False, "--full", help="Every finding of every log, however many logs."),
    flags: LogFlags = NO_FLAGS,
    force: bool = typer.Option(False, "--force", help="Replace files that exist."),
    json: bool = typer.Option(False, "--json", help="The verdicts for machines."),
) -> None:
    """Say what logs are good for and what is wrong with them: which rows, why, and what to do.

    First what a log is good for: whole logs, steady state, motors, geometry. Then time base, sensors, units, wiring,
    scales, slip, lag, limits, energy, and what the log excites. Without a robot what needs none is checked. Exit code 4
    when a finding is fatal or nothing can be done with a log, 3 when one could not be read; the rest is still shown.
    """
    if picture and (len(log) > 1 or os.path.isdir(log[0])):
        raise InputError("a picture shows one log", got=" ".join(log), expected="one file", where="--picture")
    refuse_picture(picture, force)
    log_options.keep_inputs(log, [robot], [flags.map_file], picture, flags.save_map)
    if len(log) == 1:
        log_options.refuse_missing(log)
    options, maps = flags.options(), flags.maps(force)
    with progress("reading") as now:
        files = log_options.log_files(log)
        loaded = _robot(robot)
        done = [_checked(path, loaded, options, maps, now, bool(picture)) for path in files]
    _compare_data(done)
    _tell(done, json, full, robot)
    if picture:
        _draw(done[0], picture, force)
    if any(each.error is not None for each in done):
        raise typer.Exit(BAD_INPUT)
    if any(each.verdict is not None and (each.verdict.fatal or each.verdict.useless) for each in done):
        raise typer.Exit(INSUFFICIENT)


def _robot(robot: str) -> Robot | None:
    from omnidyn.model.robot_file import load_robot

    return load_robot(robot) if robot else None


def _checked(
    path: str, robot: Robot | None, options: LogOptions, maps: log_options.Maps, now: Callable[[str], None],
    picture: bool,
) -> Checked:  # fmt: skip
    """One log, block by block; an error in reading it does not stop the others."""
    done, digest = Checked(path), _Digest()
    now(f"reading {path}")

    def said(count: int, total: int) -> None:
        now(f"reading {path}, {100 * count // max(total, 1)} %")

    try:
        log_options.refuse_missing([path])
        from omnidyn.findings.check import check_blocks, check_log
        from omnidyn.logs.read_log import iter_logs

        log, only, blocks = _first(digest.through(iter_logs(path, robot, options, rows=BLOCK, progress=said)))
        if log is not None:
            maps.show(path, log.columns, doubts=False)
            done.notes = log.notes
        done.verdict = check_log(log, robot) if log is not None and only else check_blocks(blocks, robot)
        done.log = log if picture else None
    except OmnidynError as error:
        done.error = error
    done.digest, done.sha256 = digest.value, digest.sha256
    return done


def _draw(done: Checked, picture: str, force: bool) -> None:
    """The picture of a log that could be read."""
    if done.log is None or done.verdict is None:
        return
    with progress("drawing"):
        from omnidyn.report.figures.raw_log import draw_raw_log

        write_picture(draw_raw_log(done.log, done.verdict), picture, force)


def _first(blocks: Iterator[Log]) -> tuple[Log | None, bool, Iterator[Log]]:
    """The first block, which is kept for the picture, whether it is the only one, and all blocks."""
    from itertools import chain, islice

    head = list(islice(blocks, 2))
    return (head[0] if head else None), len(head) == 1, chain(head, blocks)


class _Digest:
    """What the numbers of a log hash to, whatever its name and format."""

    def __init__(self) -> None:
        import hashlib

        self.hash, self.sha256 = hashlib.sha256(), ""

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
            yield block


def _compare_data(done: list[Checked]) -> None:
    """Logs that hold the same numbers under two names: evidence that counts once."""
    from dataclasses import replace

    from omnidyn.findings.finding import WARN, Finding, in_order

    first: dict[str, Checked] = {}
    for each in done:
        if each.verdict is None:
            continue
        other = first.setdefault(each.digest, each)
        if other is not each:
            finding = Finding(
                "same_data", WARN, "", f"it holds the same numbers as {other.path}",
                "leave one of them out: they are one recording, not two", (), 0, {},
            )  # fmt: skip
            each.verdict = replace(each.verdict, findings=in_order([*each.verdict.findings, finding]))


def _tell(done: list[Checked], json: bool, full: bool, robot: str) -> None:
    for each in done:
        if each.error is not None:
            say(f"omnidyn: error: {each.error}")
    if json:
        show_json(_document(done, robot))
        return
    read = [each for each in done if each.verdict is not None]
    if len(done) > 1:
        show(_overall(done) + "\n")
    for each in read:
        assert each.verdict is not None
        for note in each.notes if full or len(read) <= WHOLE else ():
            say(f"omnidyn: {each.path}: {note}")
        show(each.verdict.as_text(width()) if full or len(read) <= WHOLE else _brief(each.verdict))
    if len(done) > 1:
        show(_summary(done, read))


def _document(done: list[Checked], robot: str) -> dict[str, Any]:
    from omnidyn.cli.terminal.session import provenance, robot_input

    logs = [
        each.verdict.to_dict() | {"source": each.path, "notes": list(each.notes)}
        for each in done
        if each.verdict is not None
    ]
    errors = [{"source": each.path, "error": str(each.error)} for each in done if each.error is not None]
    inputs = [{"role": "log", "name": each.path, "sha256": each.sha256} for each in done if each.verdict is not None]
    record = provenance([*([robot_input(robot)] if robot else []), *inputs])
    fatal = any(log["fatal"] for log in logs)
    verdict = logs[0]["verdict"] if len(done) == 1 and logs else _overall(done)
    return {"verdict": verdict, "logs": logs, "unread": errors, "fatal": fatal, "provenance": record}


def _overall(done: list[Checked]) -> str:
    """All logs in a sentence: how many are good for what, and how many cannot be used as they stand."""
    from omnidyn.document import all_of

    read = [each.verdict for each in done if each.verdict is not None]
    alike: dict[int, list[str]] = {}
    for use in read[0].uses if read else ():
        count = sum(each.good for verdict in read for each in verdict.uses if each.name == use.name)
        alike.setdefault(count, []).append(use.name)
    words = [f"{_are(count)} good for {all_of(names)}" for count, names in sorted(alike.items(), reverse=True) if count]
    bad = {
        "fatally wrong": sum(verdict.fatal and not verdict.useless for verdict in read),
        "good for nothing": sum(verdict.useless for verdict in read),
        "unreadable": len(done) - len(read),
    }
    words += [f"{_are(count)} {what}" for what, count in bad.items() if count]
    return f"Of {len(done)} logs {'; '.join(words)}."


def _are(count: int) -> str:
    return f"{count} {'is' if count == 1 else 'are'}"


def _brief(verdict: Verdict) -> str:
    """One log in a line: its findings by name."""
    from omnidyn.findings.finding import FATAL, LABELS, WARN
    from omnidyn.findings.use import good_for

    parts = []
    for level in (FATAL, WARN):
        codes = [f"{each.code} {each.where}".rstrip() for each in verdict.findings if each.level == level]
        if codes:
            parts.append(f"{painted(LABELS[level], level)} {', '.join(codes)}")
    return f"{verdict.source}: {'; '.join(parts) or 'nothing to heed'}; {good_for(verdict.uses)}"


def _summary(done: list[Checked], read: list[Checked]) -> str:
    """What was found over all logs: each kind once, in how many logs, with one example."""
    from omnidyn.findings.finding import LABELS, LEVELS

    groups: dict[tuple[str, str], list[tuple[str, Finding]]] = {}
    for each in read:
        for finding in each.verdict.findings if each.verdict is not None else ():
            groups.setdefault((finding.level, finding.code), []).append((each.path, finding))
    lines = [f"{len(done)} logs, {len(read)} read:"]
    for (level, code), members in sorted(groups.items(), key=lambda kind: (LEVELS.index(kind[0][0]), -len(kind[1]))):
        logs = len({path for path, _ in members})
        path, example = members[0]
        word = painted(f"{LABELS[level]:5s}", level)
        lines.append(f"  {word}  {code}: in {logs} log{'s' * (logs > 1)}, such as {printable(path)}: {example.message}")
        if example.remedy:
            lines.append(f"         -> {example.remedy}")
    return "\n".join(lines)
