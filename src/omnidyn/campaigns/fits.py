"""Fits: identification campaigns. Many logs, many options, a row a fit: the numbers of `omnidyn identify` as a table.

Logs stay where they are, and their hashes in the manifest: one that changed is refused. A log that cannot be read or
fitted is a row that says why.
"""

from __future__ import annotations

import glob
import math
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from omnidyn.campaigns.spec import IdentifyTask, Spec, Variable
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.files import file_sha256
from omnidyn.identification.identification import Identification
from omnidyn.identification.identify import identify
from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.identification.output_error.prepare import expand_keys
from omnidyn.identification.steady.study_table import SteadyStudy
from omnidyn.identification.validation import FITTED, HELD_OUT
from omnidyn.logs.columns.mapping import load_map
from omnidyn.logs.log import Log
from omnidyn.logs.read_log import LogOptions, recorded_log
from omnidyn.logs.readers.folders import files_of, is_log_folder, natural
from omnidyn.logs.readers.read_table import logs_in
from omnidyn.logs.table.text_file import FILE_CUT_SHORT
from omnidyn.model.keys import Key
from omnidyn.model.robot import Robot
from omnidyn.statement import ERROR, SEVERITIES, Statement

LOG, VERDICT = "log", "verdict"  # the variable that the logs are; the column of the code of each fit
ENDS = ("low", "high")  # of the 95 % interval of a number, behind its name
KNOWN = "known_share"  # column: the share of the numbers of a fit that the log determines
Row = dict[str, bool | float | str | None]


def with_logs(spec: Spec, base: Path) -> Spec:
    """The spec with the paths of all its logs by the name of each fit, and these names as its first variable.

    base: the folder that paths are relative to. Raises InputError for what matches no log, and for a log to hold out
    that no fit predicts.
    """
    task = spec.identify
    if task is None:
        return spec
    if LOG in spec.vary:
        raise InputError("the logs vary already", got=LOG, expected="logs = [..] in [identify]", where="[vary]")
    held_out = _paths(task.hold_out, base)
    if isinstance(task.logs, Mapping):
        sets = {name: _paths(patterns, base) for name, patterns in task.logs.items()}
        strays = {*held_out} - {path for paths in sets.values() for path in paths}
        if strays:
            raise InputError("no set holds this log", got=min(strays), where="[identify] hold_out")
    else:
        single = [path for path in _paths(task.logs, base) if path not in held_out]
        sets = {name: [path, *held_out] for name, path in zip(_short(single), single, strict=True)}
    for name, paths in sets.items():
        if not {*paths} - {*held_out}:
            raise InputError("every log is held out", got=name, expected="one or more to fit", where="[identify]")
    if not sets:
        raise InputError("every log is held out", expected="one or more to fit", where="[identify]")
    return spec.replace(
        vary={LOG: Variable(values=tuple(sets)), **spec.vary},
        identify=task.replace(logs=sets, hold_out=tuple(held_out)),
    )


def _paths(patterns: Iterable[str], base: Path) -> list[str]:
    """The logs that files, folders and globs stand for, each once, in the order of their names."""
    paths = list[str]()
    for pattern in patterns:
        place = str((base / pattern).absolute())
        matches = [place] if os.path.exists(place) else sorted(glob.glob(place, recursive=True), key=natural)
        if not matches:
            raise InputError("no such log", got=pattern, expected="a file, a folder or a glob", where="[identify]")
        for match in matches:
            paths += logs_in(match) if os.path.isdir(match) and not is_log_folder(match) else [match]
    return [*dict.fromkeys(map(os.path.normpath, paths))]


def _short(paths: list[str]) -> list[str]:
    """Paths without the folders that they have in common."""
    common = os.path.commonpath([os.path.dirname(path) for path in paths]) if paths else ""
    return [Path(path).relative_to(common).as_posix() for path in paths]


def hashes_of(spec: Spec) -> dict[str, str]:
    """File of each log -> sha256. Raises InputError for one that is not there."""
    if spec.identify is None:
        return {}
    paths = dict.fromkeys(path for paths in spec.identify.logs.values() for path in paths)
    return {str(file): file_sha256(file) for path in paths for file in files_of(path)}


def check_fit(task: IdentifyTask, robot: Robot) -> None:
    """Raises InputError for options that no method takes, and for numbers that the robot does not have."""
    method = task.method_asked()
    for name in (*(getattr(method, "free", None) or ()), *getattr(method, "fixed", ())):
        for key in expand_keys(name, robot):
            Key.parse(key).get(robot)
    _options(task)


def _options(task: IdentifyTask) -> LogOptions:
    """How logs are read. Raises InputError for a map that cannot be."""
    read = task.read
    return LogOptions(
        columns=load_map(task.map) if task.map else None,
        overrides=tuple(f"{component}={text}" for component, text in read.columns.items()),
        assume=read.assume,
        latency=read.latency,
        header=read.header,
        skip_bad_rows=read.skip_bad_rows,
        current_unsigned=read.current_unsigned,
        variables=read.variables,
        rate=read.rate,
    )


def fit_row(name: str, robot: Robot, task: IdentifyTask, hashes: Mapping[str, str]) -> Row:
    """What a fit says: verdict, words, method, each number, and what free runs, or shapes of friction, are off by.

    name: of the fit in `logs`. robot: where it starts. hashes: file -> sha256 as it was when the campaign began.
    Raises InputError where a log has changed since.
    """
    paths, held_out = task.logs[name], {*task.hold_out}
    for file in (file for path in paths for file in files_of(path)):
        if hashes and hashes.get(str(file)) != file_sha256(file):
            raise InputError("the log has changed since the campaign began", where=str(file))
    try:
        logs = [recorded_log(path, robot, _options(task)) for path in paths]
        runs = [log.to_run(sort=task.read.sort) for log in logs]
    except (InputError, InsufficientDataError) as error:
        return _row_without_numbers(Statement("log_not_read", ERROR, name, {"error": str(error)}))
    try:
        hold_out = [glob.escape(path) for path in paths if path in held_out]
        method = task.method_asked()
        row = _row(identify(runs, robot, method, hold_out=hold_out, quick=task.quick, check=logs))
        return row | _cut_short(name, logs)
    except (InputError, InsufficientDataError) as error:
        return _row_without_numbers(Statement("log_not_fitted", ERROR, name, {"error": str(error)}))


def _cut_short(name: str, logs: Iterable[Log]) -> Row:
    """What a row says where a file of its logs ends too early: its numbers are of what was there."""
    notes = [note for log in logs for note in log.notes if note.code == FILE_CUT_SHORT]
    if not notes:
        return {}
    statement = Statement("fit_of_part", ERROR, name, {"why": str(notes[0])})
    return {"ok": False, VERDICT: statement.code, "words": str(statement)}


def _row_without_numbers(statement: Statement) -> Row:
    return {"ok": False, VERDICT: statement.code, "words": str(statement), "method": ""}


def _row(result: Identification) -> Row:
    """The row of a fit. A number that was not determined has no interval."""
    estimate = result.estimate
    gravest = min(result.outcome(), key=lambda statement: SEVERITIES.index(statement.severity))
    failure = next(iter(result.failures), None)
    row: Row = {
        "ok": failure is None,
        VERDICT: (failure or gravest).code,
        "words": result.headline,
        "method": result.method.name,
    }
    if isinstance(result.study, SteadyStudy):
        row |= {"shape": result.study.choice.chosen, "left_out_rmse_N": result.study.choice.error}
    numbers = {key: (value, estimate.ci95[key]) for key, value in estimate.value.items()}
    if isinstance(estimate, OutputErrorEstimate):
        numbers |= {key: (nuisance.value, nuisance.ci95) for key, nuisance in estimate.nuisances.items()}
    unknown = {*estimate.unidentifiable}
    row[KNOWN] = sum(key not in unknown for key in numbers) / len(numbers) if numbers else None
    for key, (value, ends) in numbers.items():
        low, high = (math.nan, math.nan) if key in unknown else ends
        row |= {f"fit.{key}": value, f"fit.{key}.{ENDS[0]}": low, f"fit.{key}.{ENDS[1]}": high}
    scores = {} if result.validation is None else result.validation.scores
    for logs, head in ((FITTED, "rmse"), (HELD_OUT, "held_out_rmse")):
        row |= {f"{head}.{component}": score.rmse for component, score in scores.get(logs, {}).items()}
    return {key: _plain(value) for key, value in row.items()}


def _plain(value: Any) -> bool | float | str | None:
    """None for what is no finite number."""
    return value if isinstance(value, str) or math.isfinite(value) else None
