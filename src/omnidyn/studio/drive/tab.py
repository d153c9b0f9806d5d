"""Tab Drive: the robot from above, driven by hand, and its recordings; or a plan that is driven."""

from __future__ import annotations

import json
from pathlib import Path

from nicegui import ui

from omnidyn.studio import calls
from omnidyn.studio.drive.state import Driving
from omnidyn.studio.elements import verdict
from omnidyn.studio.page import Page
from omnidyn.studio.parts import DRIVE, NUMBERS, ROBOT, VIEW
from omnidyn.studio.planned.card import PlanCard
from omnidyn.studio.planned.state import Planned

BY_HAND, A_PLAN = "By hand", "A plan"


class DriveTab:
    """The tab of one page."""

    def __init__(self, page: Page, drive: Driving, planned: Planned) -> None:
        self.page, self.session, self.drive, self.planned = page, page.session, drive, planned
        self.view: ui.element | None = None

    def build(self) -> None:
        """Lay it out."""
        self.page.part(self.page.robot_choice, ROBOT, of=self.page.robots)
        mode = ui.toggle(
            [BY_HAND, A_PLAN], value=A_PLAN if self.planned.last.running or self.planned.is_planned else BY_HAND
        )
        mode.props("no-caps dense unelevated aria-label='what is driven'")
        with ui.element("div").classes("mode") as by_hand:
            self.page.part(self._content, DRIVE, ROBOT)
            self.page.part(self._view, VIEW)
            self.page.part(self._calls, ROBOT)
        with ui.element("div").classes("mode") as of_plan:
            PlanCard(self.page, self.planned).build()
        by_hand.bind_visibility_from(mode, "value", value=BY_HAND)
        of_plan.bind_visibility_from(mode, "value", value=A_PLAN)
        self.page.parts[NUMBERS] = [self._numbers]

    def _content(self) -> None:
        session, drive = self.session, self.drive
        if drive.trouble:
            verdict("error", drive.trouble)
        with ui.row().classes("line"):
            if drive.running:
                ui.button("Stop", on_click=lambda: drive.send({"stop": True})).props("outline no-caps id=stop")
                ui.button("Back to the start", on_click=lambda: drive.send({"home": True})).props("flat no-caps")
                ui.button(
                    "End the recording" if drive.recording else "Record",
                    on_click=lambda: drive.send({"record": not drive.recording}),
                ).props("outline no-caps id=record")
            else:
                ui.button("Drive", on_click=self._start).props("unelevated no-caps id=drive")
            if any(Path(log.path).name.startswith("drive-") for log in session.logs.values()):
                ui.button("Fit the recording", on_click=lambda: self.page.go("Fit")).props("outline no-caps id=to-fit")
            if not drive.running:
                words = session.robot or "Choose a robot, then drive it by keys or sliders."
                ui.label(words).classes("text quiet")

    def _view(self) -> None:
        drive = self.drive
        if drive.running and drive.robot is None:
            ui.spinner(size="1.2em")
        elif drive.running:
            view = self.view = ui.element("omni-drive")
            view._props["data-robot"] = json.dumps(drive.robot)

    def _calls(self) -> None:
        if self.session.robot:
            self.page.calls(*calls.drive(self.session.robot))

    def _numbers(self) -> None:
        """The same element goes on with other numbers of the robot."""
        if self.view is not None and not self.view.is_deleted and self.drive.running:
            self.view._props["data-robot"] = json.dumps(self.drive.robot)
            self.view.update()

    def _start(self) -> None:
        self.session.robot = self.session.robot or "axebot"
        self.session.changed(ROBOT)
        self.session.start(self.drive.run())
