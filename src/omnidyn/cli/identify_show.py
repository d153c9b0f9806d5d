"""The part of `omnidyn identify` that writes and shows: robot files, the report, JSON or the summary."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import omnidyn
from omnidyn.attempts import Attempts
from omnidyn.cli.identify_brief import brief, with_plan
from omnidyn.cli.terminal.flags import with_flags
from omnidyn.cli.terminal.streams import say
from omnidyn.cli.terminal.telling import tell as tell_document
from omnidyn.files import check_output, keep_apart, write_atomic
from omnidyn.progress import Progress, Report

if TYPE_CHECKING:
    from omnidyn.attempts import Attempts
    from omnidyn.cli.identify_brief import Beside
    from omnidyn.identification.identification import Identification
    from omnidyn.identification.planning.got import Promises
    from omnidyn.model.robot import Robot

PAGE = "page"


@dataclass(frozen=True)
class Out:
    """Where results go. planned: what a plan promised, to show beside them. files: name of the robot -> file that holds
    it now. refused: why a robot file could not be written."""

    report: str
    out: str
    force: bool
    json: bool
    full: bool = False
    planned: Promises = field(default_factory=dict)
    files: dict[str, str] = field(default_factory=dict)
    refused: list[Exception] = field(default_factory=list)

    def save(self, robots: Mapping[str, Robot], inputs: Sequence[Mapping[str, str]]) -> None:
        """Write the robot of each group, or replace what was written before; `finish` raises what kept it from that."""
        try:
            for group, path in outputs(self, list(robots), inputs).items():
                omnidyn.save_robot(robots[group], path, self.force or group in self.files)
                self.files[group] = path
        except Exception as error:
            self.refused.append(error)

    def write_report(self, attempts: Attempts, result: Identification, record: Mapping[str, Any]) -> str:
        """Draw and write the report, with options as the command line writes them: its name where that worked."""

        def make() -> str:
            from omnidyn.report.identification_page import render_identification  # imported lazily: slow to load

            write_atomic(self.report, with_flags(render_identification(result, record)), self.force)
            return self.report

        return attempts.make(PAGE, make) or ""

    def finish(self, attempts: Attempts) -> None:
        """Name what is missing; raise what kept a robot file from being written, or the interrupt."""
        for omission in attempts.missing:
            say(f"omnidyn: not made: the {omission.part}: {omission.reason}")
        for error in self.refused:
            say("omnidyn: the robot file could not be written; the result is on stdout")
            raise error
        if attempts.interrupt is not None:
            raise attempts.interrupt


def load_meanwhile(to: Out, quick: bool) -> None:
    """Load what comes after a fit while it simulates, which leaves the interpreter free. What fails is told later."""

    def load() -> None:
        with contextlib.suppress(Exception):
            if not quick:
                import omnidyn.identification.structure.diagnosis

            if to.report:
                import omnidyn.report.fit_page  # noqa: F401

    threading.Thread(target=load).start()


def tell(
    result: Identification,
    attempts: Attempts,
    record: dict[str, Any],
    to: Out,
    progress: Progress,
    of_points: bool = False,
) -> None:
    """Draw the page of an identification, and show the result. of_points: of a table of steady points, one estimate."""
    report = ""
    if to.report:
        progress(Report("drawing"))
        report = to.write_report(attempts, result, record)
    progress(Report("writing"))
    files = [*to.files.values()]
    if of_points:
        document, output = result.estimate.document(), files[0] if files else None
    else:
        got = _beside_plan(to.planned, result)
        document, output = result.document() if to.json or to.full else brief(result, got), to.files or None
        if got and (to.json or to.full):
            document = with_plan(document, got)
    tell_document(document, to.json, record, output=output, report=report or None)
    say_written([*files, *([report] if report else [])])
    to.finish(attempts)


def _beside_plan(promises: Promises, result: Identification) -> Beside:
    """Group -> what was promised and what its fit has; nothing where the plan speaks of no number of these fits."""
    if not promises:
        return {}
    from omnidyn.identification.planning.got import beside

    found = {group: beside(promises, estimate) for group, estimate in result.groups.items()}
    if any(found.values()):
        return found
    say(f"omnidyn: the plan of --planned speaks of other numbers than this fit: {', '.join(promises)}")
    return {}


def outputs(to: Out, names: Sequence[str], inputs: Sequence[Mapping[str, str]] = ()) -> dict[str, str]:
    """Group -> file to write: the name given where there is one group, NAME-GROUP.toml where there are several.

    inputs: the record of what was read. Raises InputError for a file that is there, unless `force` or written here,
    for one file of two groups, and for one that was read.
    """
    if not to.out:
        return {}
    path = Path(to.out)
    plain = ["".join(c if c.isalnum() or c in "-_." else "-" for c in group) for group in names]
    several = [str(path.with_name(f"{path.stem}-{word}{path.suffix}")) for word in plain]
    files = dict(zip(names, [to.out] if len(names) == 1 else several, strict=True))
    keep_apart([*files.values(), to.report], [source["name"] for source in inputs])
    for group, file in files.items():
        check_output(file, to.force or group in to.files)
    return files


def say_written(paths: Iterable[str]) -> None:
    """Which files there are now."""
    for path in paths:
        if path:
            say(f"omnidyn: wrote {path}")
