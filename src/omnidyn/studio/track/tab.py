"""Tab Track: the path, the controllers, and what they did."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from nicegui import ui

from omnidyn.control.drawn import LONGEST_WINDOW
from omnidyn.control.paths.path import OPTIONS
from omnidyn.studio.elements import document, verdict
from omnidyn.studio.page import Page
from omnidyn.studio.parts import PATH, ROBOT, TRACK, TRACK_START
from omnidyn.studio.series import SERIES
from omnidyn.studio.track.job import DRAWN
from omnidyn.studio.track.state import Tracks

UNITS = {"_rad_s": "rad/s", "_rad": "rad", "_m": "m", "_s": "s"}  # of the names of sizes
WHY = {
    "no_robot": "Choose a robot first.",
    "no_controller": "Choose a controller first.",
    "no_line": "Draw a path first.",
}


class TrackTab:
    """The tab of one page."""

    def __init__(self, page: Page, tracks: Tracks) -> None:
        self.page, self.session, self.tracks = page, page.session, tracks

    def build(self) -> None:
        """Lay it out."""
        self.page.part(self.page.robot_choice, ROBOT, of=self.page.robots)
        self.page.part(self._path, PATH)
        self.page.part(self._loop, PATH, ROBOT)
        self.page.part(self._start, TRACK, TRACK_START, PATH, ROBOT)
        self.page.progress(TRACK, lambda: self.tracks.last, TRACK)
        self.page.part(self._result, TRACK)

    def _path(self) -> None:
        """The path, and its sizes or the place to draw it."""
        tracks = self.tracks
        with ui.row().classes("line"):
            ui.select(
                tracks.paths, value=tracks.path, label="Path", on_change=lambda e: tracks.choose(e.value)
            ).classes("wide path")
            ui.element("omni-drop").props(
                "kind=track words='Drop a path (.csv: t_s, x_m, y_m, heading_rad) or a controller (.toml), or click'"
            )
        if tracks.path == DRAWN:
            self._drawing()
        with ui.row().classes("line sizes"):
            for name, value in OPTIONS.get(tracks.path, {}).items():
                given = tracks.options[tracks.path]
                ui.input(
                    _label(name),
                    value=given.get(name, ""),
                    placeholder="" if value is None else f"{value}",
                    on_change=_into(given, name),
                ).props("dense stack-label")

    def _drawing(self) -> None:
        """A place to draw a path on."""
        tracks = self.tracks
        drawing = ui.element("omni-path").on("drawn", lambda e: tracks.draw(e.args["detail"]), args=["detail"])
        drawing._props["data-points"] = json.dumps(tracks.points)
        with ui.row().classes("line"):
            ui.input("speed [m/s]", value=tracks.speed, on_change=lambda e: setattr(tracks, "speed", e.value)).props(
                "dense"
            )
            ui.checkbox(
                "closed: back to where it began",
                value=tracks.closed,
                on_change=lambda e: setattr(tracks, "closed", e.value),
            )
        with ui.row().classes("line"):
            words = ui.label().classes("text quiet").props("id=smoothing-words")

            def smooth(value: float | None) -> None:
                tracks.smoothing = value
                said = "as much as the robot needs" if value is None else f"over {value:g} s"
                words.set_text("Corners stay as drawn." if value == 0.0 else f"Corners are smoothed {said}.")
                slider.set_enabled(value is not None)

            ui.checkbox(
                "smooth as the robot needs",
                value=tracks.smoothing is None,
                on_change=lambda e: smooth(None if e.value else slider.value),
            )
            value = 0.2 if tracks.smoothing is None else tracks.smoothing
            slider = ui.slider(min=0.0, max=LONGEST_WINDOW, step=0.05, value=value, on_change=lambda e: smooth(e.value))
            slider.props("aria-label='seconds over which corners are smoothed'").classes("smoothing")
            smooth(tracks.smoothing)

    def _loop(self) -> None:
        """The controllers, the sensors, and the robot that is driven in truth."""
        tracks = self.tracks
        with ui.row().classes("line"):
            controllers = ui.select(
                tracks.controller_names,
                value=tracks.controllers,
                multiple=True,
                label="Controllers side by side",
                on_change=lambda e: tracks.control(e.value),
            )
            controllers.classes("wide controllers").props("use-chips")
            self.page.mirror(controllers, TRACK_START, lambda: tracks.controllers)
            ui.select(
                ["", *self.session.robots],
                value=tracks.plant if tracks.plant in self.session.robots else "",
                label="Driven in truth: another robot",
                on_change=lambda e: setattr(tracks, "plant", e.value),
            ).classes("wide plant")
            ui.input(
                "Sensors",
                value=tracks.sensors,
                placeholder="such as encoder:2048,filter:30ms",
                on_change=lambda e: setattr(tracks, "sensors", e.value or ""),
            ).classes("wide").props("stack-label hint='empty: as the robot file says'")

    def _start(self) -> None:
        code = self.tracks.why_not()
        with ui.row().classes("line"):
            button = ui.button("Track", on_click=lambda: self.session.start(self.tracks.run()))
            button.props("unelevated no-caps id=track").set_enabled(not code and not self.tracks.last.running)
            if code:
                ui.label(WHY[code]).classes("text quiet").props("id=why-track")

    def _result(self) -> None:
        task = self.tracks.last
        self.page.stopped(task, "track-verdict", self.tracks.run)
        if task.result is None:
            return
        result = task.result
        verdict(result["severity"], result["verdict"], "track-verdict")
        motion = ui.element("omni-track")
        motion._props["data-motion"] = task.series[SERIES]
        document(result["parts"], "tracked")
        with ui.row().classes("line"):
            for k, name in enumerate(result["names"]):
                ui.link(f"Run of {name} (CSV)", f"/track/run-{k + 1}.csv").props("download")
            if result["drawn"]:
                ui.link("Drawn path (CSV)", f"/track/{DRAWN}").props("download")
        self.page.plot(task.series[SERIES], [], "track-signals.png")
        self.page.calls(task.command, task.python, "call-track")


def _label(name: str) -> str:
    """The name of a size as a page has it: words, and the unit."""
    end = next((end for end in UNITS if name.endswith(end)), "")
    return f"{name.removesuffix(end)} [{UNITS[end]}]" if end else name


def _into(given: dict[str, str], name: str) -> Callable[[Any], None]:
    """What keeps the text of an input."""
    return lambda event: given.__setitem__(name, event.value or "")
