"""The part of `omnidyn identify` that writes and shows: robot files, the report, JSON or the summary."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from omnidyn.cli.terminal.flags import with_flags
from omnidyn.cli.terminal.progress import progress
from omnidyn.cli.terminal.streams import say
from omnidyn.cli.terminal.telling import tell as tell_document
from omnidyn.identification.question import OUTPUT_ERROR, Question

if TYPE_CHECKING:
    from omnidyn.identification.estimate import Estimate
    from omnidyn.identification.identify import Identification


@dataclass(frozen=True)
class Out:
    """Where results go."""

    report: str
    out: str
    force: bool
    json: bool
    failed: list[Exception] = field(default_factory=list)

    def write_report(self, render: Callable[[], str]) -> str:
        """Draw and write the report, with options as the command line writes them: its name where that worked.

        All else is written and shown whatever becomes of the page: `finish` raises what happened.
        """
        from omnidyn.files import write_atomic

        try:
            write_atomic(self.report, with_flags(render()), self.force)
        except Exception as error:
            self.failed.append(error)
            return ""
        return self.report

    def finish(self) -> None:
        """Raise what kept the report from being written."""
        for error in self.failed:
            say("omnidyn: the report could not be made; everything else is written")
            raise error


def load_meanwhile(to: Out) -> None:
    """Load what comes after a fit while it simulates, which leaves the interpreter free. What fails is told later."""

    def load() -> None:
        with contextlib.suppress(Exception):
            import omnidyn.identification.structure.diagnosis

            if to.report:
                import omnidyn.report.fit_page  # noqa: F401

    threading.Thread(target=load).start()


def tell(found: Identification, record: dict[str, Any], to: Out) -> None:
    """Write and show an identification."""
    files = _outputs(to, found.estimates, record)
    _save(found.estimates, files, to.force)
    report = to.write_report(lambda: _page(found, record)) if to.report and _has_page(found) else ""
    tell_document(found.document(), to.json, record, output=files or None, report=report or None)
    say_written([*files.values(), report])
    to.finish()


def _has_page(found: Identification) -> bool:
    """Whether there is a report to write."""
    if found.study is None and found.method != OUTPUT_ERROR:
        say("omnidyn: --shape line has no page; --report is not used")
    return found.study is not None or bool(found.validations)


def _page(found: Identification, record: dict[str, Any]) -> str:
    """The report."""
    if found.study is not None:
        from omnidyn.report.steady_page import render_study

        return render_study(found.study, record, verdict=found.verdict, verdicts=found.verdicts)
    from omnidyn.report.fit_page import render_fit

    return render_fit(found, record)


def tell_table(table: str, robot: str, question: Question, to: Out) -> None:
    """The paper's way, from a table of steady points; what the reader had to decide joins the warnings."""
    from omnidyn.cli.terminal.session import provenance, robot_input
    from omnidyn.errors import InputError
    from omnidyn.identification.steady.steady_state import fit_steady_state
    from omnidyn.logs.steady_table import read_steady_table
    from omnidyn.model.robot_file import load_robot

    if question.method == OUTPUT_ERROR:
        raise InputError("a table of steady points has no time in it", got="a table axis,speed,force",
                         expected="logs, or `method` steady-state", where="method")  # fmt: skip
    if to.report:
        raise typer.BadParameter("--report needs logs; a table of points has none.")
    with progress("identifying"):
        start, data = load_robot(robot), read_steady_table(table)
        estimate = fit_steady_state(start, data, rest=question.rest)
        estimate = replace(estimate, warnings=(*data.notes, *estimate.warnings))
        record = provenance([robot_input(robot), {"role": "data", "name": table, "sha256": data.sha256}])
    if to.out:
        _save({"": estimate}, {"": to.out}, to.force)
    tell_document(estimate.document(), to.json, record, output=to.out or None)
    say_written([to.out])


def _outputs(to: Out, groups: Iterable[str], record: Mapping[str, Any]) -> dict[str, str]:
    """Group -> file to write: the name given where there is one group, NAME-GROUP.toml where there are several.

    Raises InputError for a file that is there, unless `force`, for one file of two groups, and for one that was read.
    """
    from omnidyn.files import check_output, keep_apart

    if not to.out:
        return {}
    names, path = list(groups), Path(to.out)
    plain = ["".join(c if c.isalnum() or c in "-_." else "-" for c in group) for group in names]
    several = [str(path.with_name(f"{path.stem}-{word}{path.suffix}")) for word in plain]
    files = dict(zip(names, [to.out] if len(names) == 1 else several, strict=True))
    keep_apart([*files.values(), to.report], [each["name"] for each in record["inputs"]])
    for each in files.values():
        check_output(each, to.force)
    return files


def _save(estimates: Mapping[str, Estimate], files: Mapping[str, str], force: bool) -> None:
    from omnidyn.model.robot_file import save_robot

    for group, path in files.items():
        save_robot(estimates[group].robot, path, force)


def say_written(paths: Iterable[str]) -> None:
    """Which files there are now."""
    for path in paths:
        if path:
            say(f"omnidyn: wrote {path}")
