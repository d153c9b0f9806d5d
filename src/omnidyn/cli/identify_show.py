"""The part of `omnidyn identify` that writes and shows: robot files, the report, JSON or the summary."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from omnidyn.cli.terminal.flags import with_flags
from omnidyn.cli.terminal.progress import progress
from omnidyn.cli.terminal.streams import say, show, show_json
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

    def write_report(self, page: str) -> None:
        """Write the report, with options as the command line writes them."""
        from omnidyn.files import write_atomic

        write_atomic(self.report, with_flags(page), self.force)


def tell(found: Identification, record: dict[str, Any], to: Out) -> None:
    """Write and show an identification."""
    if found.method == OUTPUT_ERROR:
        _tell_fit(found, record, to)
    elif found.study is not None:
        _tell_study(found, record, to)
    else:
        _tell_lines(found, record, to)


def _tell_fit(found: Identification, record: dict[str, Any], to: Out) -> None:
    fits, validations = found.fits, found.validations or {}
    files, report = _outputs(to.out, fits, to.force), to.report if validations else ""
    if report:
        from omnidyn.report.fit_page import render_fit

        to.write_report(render_fit(fits, validations, found.verdicts, record, found.differences))
    _save(fits, files, to.force)
    if to.json:
        say_warnings(words for fit in fits.values() for words in fit.warnings)
        groups = {
            g: {**fit.to_dict(), "validation": validations[g].to_dict() if g in validations else None}
            for g, fit in fits.items()
        }
        show_json({
            "method": OUTPUT_ERROR, "verdict": {"ok": not found.failures, "words": found.verdict},
            **(next(iter(groups.values())) if len(groups) == 1 else {"groups": groups}),
            "differences": [{**vars(d), "differs": d.differs} for d in found.differences], "next": found.advice,
            "check": [{"source": v.source, "fatal": v.fatal, "counts": v.counts} for v in found.verdicts],
            "output": files or None, "report": report or None, "provenance": record,
        })  # fmt: skip
    else:
        show(_fit_text(found))
    say_written([*files.values(), report])


def _fit_text(found: Identification) -> str:
    from omnidyn.identification.advice import DIFFERENCE_HEAD, difference_rows
    from omnidyn.identification.steady.study_table import table_text

    lines = [*textwrap.wrap(found.verdict, 100), ""] if found.verdict else []
    for group, fit in found.estimates.items():
        lines += [f"group {group}", ""] if len(found.estimates) > 1 else []
        lines += [fit.summary().rstrip("\n"), ""]
        if found.validations and group in found.validations:
            lines += [found.validations[group].summary(), ""]
    if found.differences:
        lines += [*table_text(DIFFERENCE_HEAD, difference_rows(found.differences)), ""]
    if found.advice:
        lines.append("next:")
        for words in found.advice:
            lines += textwrap.wrap(f"- {with_flags(words)}", 100, subsequent_indent="  ")
    return "\n".join(line.encode("ascii", "backslashreplace").decode() for line in lines).rstrip("\n")


def _tell_study(found: Identification, record: dict[str, Any], to: Out) -> None:
    """Friction and its shape."""
    from omnidyn.identification.steady.study_table import study_document

    study = found.study
    assert study is not None
    files = _outputs(to.out, found.estimates, to.force)
    if to.report:
        from omnidyn.report.steady_page import render_study

        to.write_report(render_study(study, record))
    _save(found.estimates, files, to.force)
    tell_document(study_document(study), to.json, record, output=files or None, report=to.report or None)
    say_written([*files.values(), to.report])


def _tell_lines(found: Identification, record: dict[str, Any], to: Out) -> None:
    """The lines of the axes of each group."""
    files = _outputs(to.out, found.estimates, to.force)
    _save(found.estimates, files, to.force)
    if to.report:
        say("omnidyn: --shape line has no page; --report is not used")
    if to.json:
        groups = {group: estimate.to_dict() for group, estimate in found.estimates.items()}
        show_json({"shape": found.question.shape, "groups": groups, "output": files or None, "provenance": record})
    else:
        show("\n".join(estimate.summary() for estimate in found.estimates.values()).rstrip("\n"))
    say_written([*files.values()])


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


def _outputs(out: str, groups: Iterable[str], force: bool) -> dict[str, str]:
    """Group -> file to write: the name given where there is one group, NAME-GROUP.toml where there are several.

    Raises InputError for a file that is there, unless `force`.
    """
    from omnidyn.files import check_output

    if not out:
        return {}
    names, path = list(groups), Path(out)
    plain = ["".join(c if c.isalnum() or c in "-_." else "-" for c in group) for group in names]
    several = [str(path.with_name(f"{path.stem}-{word}{path.suffix}")) for word in plain]
    files = dict(zip(names, [out] if len(names) == 1 else several, strict=True))
    for each in files.values():
        check_output(each, force)
    return files


def _save(estimates: Mapping[str, Estimate], files: Mapping[str, str], force: bool) -> None:
    from omnidyn.model.robot_file import save_robot

    for group, path in files.items():
        save_robot(estimates[group].robot, path, force)


def say_warnings(warnings: Iterable[str]) -> None:
    """Beside JSON: every warning once."""
    for warning in dict.fromkeys(warnings):
        say(f"omnidyn: warning: {warning}")


def say_written(paths: Iterable[str]) -> None:
    """Which files there are now."""
    for path in paths:
        if path:
            say(f"omnidyn: wrote {path}")
