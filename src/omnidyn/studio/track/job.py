"""Job of the tab Track: controllers on one path, with all that is shown of them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path as FilePath
from typing import Any

import numpy as np

import omnidyn
from omnidyn.control.drawn import least_smoothing, smoothed
from omnidyn.control.paths.motion import Path
from omnidyn.control.paths.polyline import path_of_file, through
from omnidyn.control.readings import with_sensors
from omnidyn.control.tracking import Tracking, trackings_document
from omnidyn.document import plain
from omnidyn.model.robot import Robot
from omnidyn.progress import Progress, Report
from omnidyn.report.figures.robot import wheel_lines, wheel_places
from omnidyn.studio.job import Tell, robot_of, shown, timed
from omnidyn.studio.series import SERIES, write_series

DRAWN, MOTION = "drawn.csv", "motion.json"
MAX_FRAMES = 3000  # of the animation


def track(request: Mapping[str, Any], tell: Tell, commands: Any) -> dict[str, Any]:
    """What `omnidyn track` says of controllers on a path; writes their runs, the animation and series.

    request: "robot", "plant" ("" for the same), "path" (as `track` takes it), "file" (the name of one, where it is
    one), "points", "speed", "closed" and "smoothing" ([s], None for what the robot needs) of one drawn by hand,
    "controllers", "sensors", "folder" of the results.
    """
    with timed(tell) as listen:
        return _tracked(request, listen)


def _tracked(request: Mapping[str, Any], listen: Progress) -> dict[str, Any]:
    folder, robot = FilePath(request["folder"]), robot_of(request)
    assert robot is not None
    folder.mkdir(parents=True)
    listen(Report("reading"))
    plant = omnidyn.load_robot(request["plant"]) if request["plant"] else robot
    sensors, path = request["sensors"] or None, _path(request, folder, robot)
    trackings = omnidyn.track(robot, path, request["controllers"], plant=plant, sensors=sensors, progress=listen)
    listen(Report("drawing"))
    demand = omnidyn.path_demand(with_sensors(robot, sensors), path)
    for k, tracking in enumerate(trackings):
        omnidyn.write_run(tracking.run, folder / f"run-{k + 1}.csv")
    (folder / MOTION).write_text(json.dumps(_motion(trackings, plant)), "utf-8")
    _write_signals(trackings, folder / SERIES)
    document = trackings_document([*trackings], [demand.verdict, *demand.statements()])
    names = [tracking.controller for tracking in trackings]
    return {**shown(document), "names": names, "drawn": bool(request["points"]), "series": [SERIES]}


def _path(request: Mapping[str, Any], folder: FilePath, robot: Robot) -> Path:
    """The path; one drawn by hand is written as a file first, which `omnidyn track` takes."""
    if request["points"]:
        drawn, closed = through(request["points"], request["speed"], request["closed"], DRAWN), request["closed"]
        width = request["smoothing"]
        drawn = smoothed(drawn, least_smoothing(robot, drawn, closed=closed) if width is None else width, closed=closed)
        omnidyn.write_run(omnidyn.Run(t=drawn.t, pose=drawn.pose), folder / DRAWN)
        return replace(path_of_file(folder / DRAWN), name=DRAWN)
    if request["file"]:
        return replace(path_of_file(request["path"]), name=request["file"])
    return omnidyn.path(request["path"])


def _motion(trackings: Tracking, robot: Robot) -> dict[str, Any]:
    """What the animation shows: poses [m, m, rad], distances from the path [mm], over time [s]; the robot [m]."""
    first = trackings[0]
    rows = np.unique(np.linspace(0, len(first.run) - 1, min(len(first.run), MAX_FRAMES)).astype(int))
    places = wheel_places(robot.wheels)
    return plain(
        {
            "t": first.run.t[rows],
            "path": first.wanted[rows],
            "names": [tracking.controller for tracking in trackings],
            "poses": [np.asarray(tracking.run.pose)[rows] for tracking in trackings],
            "distance": [1e3 * tracking.distance[rows] for tracking in trackings],
            "wheels": wheel_lines(robot.wheels),
            "reach": float(np.linalg.norm(places, axis=1).max()),
        }
    )


def _write_signals(trackings: Tracking, folder: FilePath) -> None:
    """Errors and voltages over time, a panel each, all controllers in each panel."""
    names = [tracking.controller for tracking in trackings]
    volts = [np.asarray(tracking.run.voltage).T for tracking in trackings]
    shown_signals = [
        ("distance from the path", "m", [tracking.distance for tracking in trackings]),
        ("heading minus that of the path", "rad", [tracking.error[:, 2] for tracking in trackings]),
        *((f"voltage of wheel {k + 1}", "V", [rows[k] for rows in volts]) for k in range(len(volts[0]))),
    ]
    panels = [{"title": title, "unit": unit, "signals": names} for title, unit, _ in shown_signals]
    values = np.array([signal for *_, signals in shown_signals for signal in signals])
    write_series(folder, trackings[0].run.t, panels, values)
