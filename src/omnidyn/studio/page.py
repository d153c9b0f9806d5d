"""Page: what one browser tab shows of the session, and what its tabs (log, fit, drive ...) share."""

from __future__ import annotations

import json
from collections.abc import Awaitable, Callable
from typing import Any

from nicegui import ui

from omnidyn.studio.elements import verdict
from omnidyn.studio.parts import FIT, LOGS, ROBOT
from omnidyn.studio.session import Session
from omnidyn.studio.steps import DONE, READY, WAITING, StepState
from omnidyn.studio.task import Task, progress_of

STEPS = (  # what a newcomer does: title, and words
    ("1. Log", "Drop a recording of your robot: CSV, Parquet, a ROS bag, MATLAB, WPILOG. It stays on this machine."),
    ("2. Robot", "Choose a robot file, or describe where its wheels stand and what it weighs."),
    ("3. Fit", "Friction and motor numbers with intervals, as a robot file to drive, track and compare with."),
)


class Page:
    """One browser tab. parts: what is made again when a part of the session changes."""

    def __init__(self, session: Session, line: Callable[[], list[StepState]]) -> None:
        self.session, self.line, self.client = session, line, ui.context.client
        # part -> label of a choice -> what lets it follow another page
        self.mirrors: dict[str, dict[str, Callable[[], None]]] = {}
        self.stale = set[str]()  # parts that changed while nobody was connected
        self.client.on_connect(self.catch_up)
        self.parts: dict[str, list[Any]] = {}
        self.tabs: ui.tabs | None = None
        self.folded: dict[str, bool] = {}  # title -> whether it is open

    def go(self, name: str) -> None:
        """Show another tab."""
        assert self.tabs is not None
        self.tabs.set_value(name)

    def changed(self, part: str) -> None:
        """Show a part anew: at once, or when somebody is connected again."""
        if not self.client.has_socket_connection:
            self.stale.add(part)
            return
        for refresh in (*self.parts.get(part, ()), *self.mirrors.get(part, {}).values()):
            refresh()

    def catch_up(self) -> None:
        """Show what changed while nobody was connected."""
        parts, self.stale = self.stale, set()
        for part in parts:
            self.changed(part)

    def next_step(self, name: str) -> None:
        """What comes after this tab, as its one primary button; on a tab that is not done, what is missing."""

        def after() -> str:
            line = self.line()
            places = {step.name: k for k, step in enumerate(line)}
            if line[places[name]].state != DONE:
                return ""
            return next(step.name for step in line[places[name] + 1 :] if step.state != DONE)

        def show() -> None:
            if step := after():
                with ui.row().classes("line"):
                    ui.button(f"Next: {step}", on_click=lambda: self.go(step)).props(
                        f"unelevated no-caps id=next-{name.lower()}"
                    )

        self.part(show, LOGS, ROBOT, FIT, of=after)

    def empty(self, name: str) -> None:
        """The three steps, and a picture, where this tab has nothing to show yet."""

        def show() -> None:
            line = self.line()
            if all(step.state not in (READY, WAITING) for step in line[: 1 if name == "Log" else 2]):
                return
            with ui.element("div").classes("empty"):
                ui.image("/static/steps.svg").props("alt='A robot seen from above, its log, and the fitted curve'")
                with ui.element("ol"):
                    for step, words in zip(line, STEPS, strict=False):
                        with ui.element("li").classes(step.state):
                            ui.label(f"{words[0]} ({step.words})").classes("strong")
                            ui.label(words[1]).classes("quiet")

        self.part(show, LOGS, ROBOT, FIT, of=self.line)

    def part(self, make: Callable[[], object], *parts: str, of: Callable[[], Any] | None = None) -> None:
        """A piece of the page that is made again when one of these parts of the session changes.

        of: what it shows; where that is the same, it stays, and with it the focus and a click that is under way.
        """
        shown = ui.refreshable(make)
        shown()
        last = [of() if of is not None else None]

        def refresh() -> None:
            if of is None:
                shown.refresh()
                return
            before, last[0] = last[0], of()
            if last[0] != before:
                shown.refresh()

        for part in parts:
            self.parts.setdefault(part, []).append(refresh)

    def mirror(self, choice: Any, part: str, get: Callable[[], Any], name: str = "") -> None:
        """Let a choice show what another page chose when a part changes; it is not made again: it may be open.

        name: of the choice on this page; its label by default.
        """

        def follow() -> None:
            if not choice.is_deleted and choice.value != get():
                choice.set_value(get())

        self.mirrors.setdefault(part, {})[name or choice.props["label"]] = follow

    def box(self, title: str, is_open: bool = False) -> ui.expansion:
        """A part that can be folded; it stays as it was when it is made again."""
        name = title.partition(" (")[0]
        is_open = self.folded.get(name, is_open)
        box = ui.expansion(title, value=is_open, on_value_change=lambda event: self.folded.update({name: event.value}))
        return box.classes("box")

    def stopped(self, task: Task, name: str, again: Callable[[], Any]) -> None:
        """Why a task has no result, and a button that begins it again where nothing else is to be done.

        name: of the verdict's id. again: makes what does the task again.
        """
        if task.error:
            verdict("error", task.error, name)
        elif task.stopped:
            verdict("warning", "Cancelled: there is no result.", f"{name}-cancelled")
        if task.stopped:
            ui.button("Run again", on_click=lambda: self.session.start(again())).props(
                f"outline no-caps id={name}-again"
            )

    def busy(self, work: Callable[[], Awaitable[Any]], trouble: ui.label | None = None) -> Callable[[Any], Any]:
        """What a button does, which shows that it works until the work is done. trouble: shows what it returns."""

        async def act(event: Any) -> None:
            button = event.sender.props("loading")
            words = await work()
            if not button.is_deleted:  # the part may have been made again
                button.props(remove="loading")
            if trouble is not None and not trouble.is_deleted:
                trouble.text = words
            elif words:
                ui.notify(words, type="negative", timeout=0, close_button="Close")

        return act

    def progress(self, part: str, task: Callable[[], Task], worker: str) -> None:
        """How far the task of a part is, and a button that cancels it.

        The button stays the same while the words beside it change: a click takes longer than they stand.
        """

        def words() -> None:
            if task().running:
                left = "" if task().left is None else f", about {task().left:.0f} s left of this"
                left += "" if task().before is None else f"; the last one took {task().before:.0f} s"
                with ui.row().classes("line"):
                    ui.spinner(size="1.2em")
                    words = "cancelling" if task().cancelling else task().progress
                    ui.label(words).props(f"id={part}-progress")
                    ui.label(f"{task().spent:.0f} s{left}").classes("quiet").props(f"id={part}-time")

        def button() -> None:
            if task().running:
                ui.button(
                    "Cancel", on_click=lambda: self.session.start(task().cancel(self.session, part, worker))
                ).props(f"outline dense no-caps id=cancel-{part}")

        def bar() -> None:
            share = task().share
            if task().running and share is not None:
                ui.linear_progress(share, show_value=False)

        with ui.row().classes("line"):
            self.part(words, part, progress_of(part))
            self.part(button, part)
        self.part(bar, part, progress_of(part))

    def plot(
        self, series: str, spans: list[list[Any]], name: str = "signals.png", other: str = "", offset: float = 0.0
    ) -> ui.element:
        """A picture of signals over time; it takes its place at once, so that nothing below it moves when it is drawn.

        Args:
            series: id of the signals.
            spans: what is shaded: number of a finding, its severity, from, to [s], its subject.
            name: of the file that the picture is saved as.
            other: id of a second series, drawn over the first.
            offset: that is added to the times of the second [s].
        """
        plot = ui.element("omni-plot")
        plot._props |= {"data-series": series, "data-spans": json.dumps(spans), "data-name": name}
        plot._props |= {"data-panels": str(len(self.session.series[series].meta["panels"]))}
        plot._props |= {"data-other": other, "data-offset": str(offset)} if other else {}
        return plot

    def robots(self) -> tuple[list[str], str]:
        """The robots of the session, and the one that is chosen."""
        return list(self.session.robots), self.session.robot

    def robot_choice(self) -> None:
        """The robot of the session, and a place to drop a robot file."""
        with ui.row().classes("line"):
            ui.select(
                list(self.session.robots),
                value=self.session.robot or None,
                label="Robot",
                on_change=lambda e: self.session.choose(e.value),
            ).classes("wide robot")
            ui.element("omni-drop").props("words='Drop a robot file (.toml), or click'")

    def calls(self, command: str, python: str, name: str = "call", title: str = "The same by hand") -> None:
        """The command line and the Python call that do the same. name: id of the former."""
        if not command:
            return
        with self.box(title):
            ui.label(command).classes("call").props(f"id={name}")
            ui.label(python).classes("call")
