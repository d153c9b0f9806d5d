"""Layout: the tabs of a page. Pictures are drawn by static/*.js."""

from __future__ import annotations

import asyncio
import gc
import shutil
from pathlib import Path
from typing import Any

from nicegui import ui

from omnidyn.studio import workspace
from omnidyn.studio.compare.state import Comparing
from omnidyn.studio.compare.tab import CompareTab
from omnidyn.studio.drive.state import Driving
from omnidyn.studio.drive.tab import DriveTab
from omnidyn.studio.fit.state import Fitting
from omnidyn.studio.fit.tab import FitTab
from omnidyn.studio.live.state import Watching
from omnidyn.studio.log.tab import LogTab
from omnidyn.studio.page import Page
from omnidyn.studio.parts import FIT, LOGS, PROGRESS, ROBOT
from omnidyn.studio.planned.state import Planned
from omnidyn.studio.robot.tab import RobotTab
from omnidyn.studio.session import Session
from omnidyn.studio.steps import MARKS, StepState, following, steps
from omnidyn.studio.track.state import Tracks
from omnidyn.studio.track.tab import TrackTab

HEAD = """
<link rel="stylesheet" href="/static/studio.css">
<script type="module" src="/static/studio.js"></script>
"""


TAB = "tab"  # of an address: the tab that is shown
WATCH = f"""addEventListener('popstate', () =>
    emitEvent('{TAB}', new URLSearchParams(location.search).get('{TAB}') || ''));"""


class Studio:
    """What all pages share: the session, and the state of each tab that has one."""

    def __init__(self) -> None:
        self.session = Session()
        self.fitting, self.driving = Fitting(self.session), Driving(self.session)
        self.tracks, self.comparing = Tracks(self.session), Comparing(self.session)
        self.watching, self.planned = Watching(self.session), Planned(self.session)

        self.session.takers[workspace.SUFFIX] = self.open

    async def open(self, path: str, name: str) -> None:
        """Add what a workspace holds. Raises InputError for what is none, RefusedError for what is too large."""
        folder = self.session.new_folder()
        try:
            space = await asyncio.to_thread(workspace.read, path, folder)
            workspace.adopt(space, self.session, self.fitting)
        except Exception:
            shutil.rmtree(folder)
            raise

    async def save(self) -> Path:
        """The path of a new file with all of it. Raises InputError where that cannot be."""
        space = workspace.workspace_of(self.session, self.fitting)
        path = self.session.new_folder() / workspace.FILE_NAME
        await asyncio.to_thread(workspace.write, space, path)
        return path

    def line(self) -> list[StepState]:
        """Where each step stands."""
        return steps(self.session, self.fitting.last, self.fitting.why_not()[0])

    def tabs(self, page: Page) -> dict[str, Any]:
        """The tabs of a page, by name."""
        return {
            "Log": LogTab(page, self.watching),
            "Robot": RobotTab(page),
            "Fit": FitTab(page, self.fitting),
            "Drive": DriveTab(page, self.driving, self.planned),
            "Track": TrackTab(page, self.tracks),
            "Compare": CompareTab(page, self.comparing),
        }


def show(studio: Studio, tab: str = "") -> None:
    """Lay out a page. tab: that is shown first."""
    ui.add_head_html(HEAD)
    ui.colors(primary="#0b57a4")
    # What moves between press and release of the mouse loses the click: a list is there at once, with all its rows
    ui.select.default_props("transition-duration=0 virtual-scroll-slice-size=200")
    session, client = studio.session, ui.context.client
    page = Page(session, studio.line)
    tabs = studio.tabs(page)
    session.listeners.add(page.changed)
    client.on_delete(lambda: _forget(session, page))
    dark = ui.dark_mode(None)
    with ui.header().classes("bar"):
        with ui.element("h1").classes("brand"):
            ui.label("omnidyn studio")
        with ui.tabs().props("dense no-caps outside-arrows mobile-arrows") as page.tabs:
            marks = {name: _tab(name) for name in tabs}
        ui.space()
        ui.button("◐", on_click=lambda: dark.set_value(not dark.value)).props("flat dense aria-label='light or dark'")

    def line() -> None:
        """Where each step stands, on its tab, and what to do next."""
        all_steps = studio.line()
        for step in all_steps:
            mark, words = marks[step.name]
            mark.set_text(MARKS[step.state])
            words.set_text(step.words)
            for label, name in ((mark, "state"), (words, "state more")):
                label.classes(replace=f"{name} {step.state}")
        if after := following(all_steps):
            with ui.row().classes("line next").props("role=status id=next"):
                ui.label(f"Next: {after.next}.").classes("text")

    def undo() -> None:
        """What was removed last, and a button that brings it back."""
        if session.removed is not None:
            with ui.row().classes("line").props("role=status id=removed"):
                ui.label(f"Removed {session.removed.name}.").classes("text quiet")
                ui.button("Undo", on_click=session.undo).props("outline dense no-caps id=undo")

    page.part(line, LOGS, PROGRESS, ROBOT, FIT)
    page.part(undo, LOGS, ROBOT, of=lambda: session.removed)
    first = next((name for name in tabs if name.lower() == tab.lower()), next(iter(tabs)))
    with ui.tab_panels(page.tabs, value=first, animated=False).classes("panels"):
        for name, part in tabs.items():
            with ui.tab_panel(name):
                part.build()
    _keep_address(page)
    with ui.row().classes("line foot"):
        ui.link("Save the workspace", "/workspace").props("download")
        words = "All logs, maps, robots and fits as one file. To open it: drop it on the tab Log, or"
        ui.label(words).classes("text quiet")
        ui.label(f"omnidyn studio {workspace.FILE_NAME}").classes("code")


def _tab(name: str) -> tuple[ui.label, ui.label]:
    """A tab; the labels on it that say how far its step is: a mark, and words."""
    with ui.tab(name), ui.row().classes("gap-1 no-wrap").props("aria-hidden=true"):
        return ui.label(), ui.label()


def _keep_address(page: Page) -> None:
    """Let the address name the tab, so that a reload and "back" find it."""
    assert page.tabs is not None

    def push(name: str) -> None:
        tab = name.lower()
        ui.run_javascript(
            f"const u = new URL(location); if ((u.searchParams.get('{TAB}') || 'log') !== '{tab}') "
            f"{{ u.searchParams.set('{TAB}', '{tab}'); history.pushState(null, '', u); }}"
        )

    page.tabs.on_value_change(lambda event: push(str(event.value)))
    ui.add_body_html(f"<script>{WATCH}</script>")
    ui.on(TAB, lambda event: page.go(str(event.args).capitalize() or "Log"))


def _forget(session: Session, page: Page) -> None:
    """A page is gone: what it was made of is a circle of thousands of objects, which only the collector takes."""
    session.listeners.discard(page.changed)
    asyncio.get_running_loop().call_later(1.0, gc.collect)
