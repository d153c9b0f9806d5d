"""Jobs of the tab Compare: robots against logs, and fits of one robot beside each other."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import omnidyn
from omnidyn.document import Document
from omnidyn.progress import Progress, Report
from omnidyn.report.drift_picture import draw_drift
from omnidyn.studio.job import Tell, read, shown, timed, write_free_runs

PICTURE = "drift.svg"


def compare(request: Mapping[str, Any], tell: Tell, commands: Any) -> dict[str, Any]:
    """What `omnidyn compare` says of one robot or two and logs; writes the free runs over each log.

    request: "robots" (paths), "logs" (path, map, unsigned each), "folder" of the results.
    """
    with timed(tell) as listen:
        return _compared(request, listen)


def _compared(request: Mapping[str, Any], listen: Progress) -> dict[str, Any]:
    folder = Path(request["folder"])
    folder.mkdir(parents=True)
    listen(Report("reading"))
    robots = [omnidyn.load_robot(path) for path in request["robots"]]
    runs, unsigned = [], False
    for log in request["logs"]:
        loaded = read({**log, "unsigned": False}, robots[0])
        run = loaded.to_run()
        runs.append(run.replace(warnings=(*run.warnings, *loaded.columns.doubts)))
        unsigned = unsigned or log["unsigned"]
    comparison = omnidyn.compare(robots[0], runs, *robots[1:], current_unsigned=unsigned, progress=listen)
    listen(Report("drawing"))
    brief = Document([*comparison.brief_head(), comparison.brief_table()], verdict=comparison.verdict)
    paths = {f"log-{k + 1}": Path(log["path"]) for k, log in enumerate(request["logs"])}
    names = {
        name: path.name for k, (name, path) in enumerate(paths.items()) if write_free_runs(comparison, k, folder / name)
    }
    parts = shown(comparison.document())["parts"]
    return {**shown(brief), "failed": comparison.failed, "all": parts, "series": names}


def drift(request: Mapping[str, Any], tell: Tell, commands: Any) -> dict[str, Any]:
    """What `omnidyn drift` says of fits, the oldest first; draws them. request: "fits" (paths), "names", "folder"."""
    folder = Path(request["folder"])
    folder.mkdir(parents=True)
    result = omnidyn.drift(request["fits"], request["names"])
    (folder / PICTURE).write_bytes(draw_drift(result).svg)
    return shown(result.document())
