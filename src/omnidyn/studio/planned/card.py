"""Card of the tab Drive: a plan, the room and the key by which it is driven, and a bar for each number."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from nicegui import ui

from omnidyn.studio.elements import document, verdict
from omnidyn.studio.live.strip import bar
from omnidyn.studio.page import Page
from omnidyn.studio.parts import BARS, COURSE, DRIVE, PLAN, ROBOT
from omnidyn.studio.planned.state import AT_ADDRESS, DONE, FAST, RUNNING, SIMULATED, STOPPED, Planned


class PlanCard:
    """The card of one page."""

    def __init__(self, page: Page, planned: Planned) -> None:
        self.page, self.session, self.planned = page, page.session, planned
        self.key: ui.element | None = None

    def build(self) -> None:
        """Lay it out."""
        planned = self.planned
        self._wanted()
        self.page.part(
            self._start, PLAN, COURSE, ROBOT, of=lambda: (planned.why_not(), self._is_busy(), planned.is_planned)
        )
        self.page.progress(PLAN, lambda: planned.last, PLAN)
        self.page.part(self._plan, PLAN, ROBOT, of=lambda: (planned.is_planned, planned.last.running, id(planned.last)))
        self.page.part(self._robot, PLAN, COURSE, DRIVE, ROBOT, of=self._of_robot)
        self.page.part(self._ended, PLAN, COURSE, ROBOT, of=self._of_end)
        with ui.element("div").classes("run"):
            with ui.element("div"):
                self.page.part(self._key, PLAN, COURSE, ROBOT, of=lambda: planned.is_planned)
            with ui.element("div"):
                self.page.part(self._bars, BARS, PLAN, ROBOT)
        self.page.parts.setdefault(COURSE, []).append(self._course)
        self.page.part(self._calls, PLAN, ROBOT, of=lambda: (planned.is_planned, planned.last.command))

    def _is_busy(self) -> bool:
        return self.planned.last.running or self.planned.stage == RUNNING

    def _wanted(self) -> None:
        """What a plan may take, and what is enough."""
        planned = self.planned
        with ui.row().classes("line sizes"):
            for axis, words in enumerate(("room along x [m]", "room along y [m]")):
                self._number(
                    words, lambda axis=axis: planned.area[axis], lambda v, axis=axis: planned.want_side(axis, v), 0.1
                )
            self._number("time [s]", lambda: planned.seconds, lambda v: planned.want(seconds=v), 5.0)
            self._number("enough: ± %", lambda: planned.within, lambda v: planned.want(within=v), 0.5)

    def _number(self, words: str, get: Callable[[], float], take: Callable[[Any], None], step: float) -> None:
        number = ui.number(words, value=get(), min=step, step=step).props("dense")
        number.on("change", lambda: take(number.value))
        self.page.mirror(number, PLAN, get, f"plan {words}")

    def _start(self) -> None:
        """The button that plans."""
        planned = self.planned
        why = planned.why_not()
        with ui.row().classes("line"):
            look = "outline" if planned.is_planned else "unelevated"
            words = "Plan anew" if planned.is_planned else "Plan a drive"
            button = ui.button(words, on_click=lambda: self.session.start(planned.plan()))
            button.props(f"{look} no-caps id=plan").set_enabled(not why and not self._is_busy())
            said = why or "Moves inside the room that tell most about the robot, in the time that there is."
            ui.label(said).classes("text quiet")

    def _plan(self) -> None:
        """What the plan says."""
        last = self.planned.last
        self.page.stopped(last, "plan-stopped", self.planned.plan)
        if last.result is not None and self.planned.is_planned:
            verdict(last.result["severity"], last.result["verdict"], "plan-verdict")
            with self.page.box("What it asks, tells and drives"):
                document(last.result["parts"], "planned")

    def _of_robot(self) -> tuple[Any, ...]:
        planned = self.planned
        return planned.is_planned, planned.stage == RUNNING, planned.which, planned.why_no_drive()

    def _robot(self) -> None:
        """Which robot drives it."""
        planned = self.planned
        if not planned.is_planned:
            return
        with ui.row().classes("line"):
            which = ui.select(
                [SIMULATED, FAST, AT_ADDRESS], value=planned.which, label="Robot that drives it",
                on_change=lambda e: planned.want(which=e.value),
            )  # fmt: skip
            which.classes("wide which").set_enabled(planned.stage != RUNNING)
            if planned.which == AT_ADDRESS:
                address = ui.input(
                    "Address", value=planned.address, placeholder="udp:192.168.4.1:9870, serial:/dev/ttyUSB0"
                )
                address.props("stack-label id=address").classes("wide").set_enabled(planned.stage != RUNNING)
                address.on("change", lambda: planned.want(address=str(address.value or "")))
            if why := planned.why_no_drive():
                ui.label(why if planned.stage != RUNNING else "").classes("text quiet")

    def _of_end(self) -> tuple[Any, ...]:
        planned = self.planned
        return planned.is_planned, planned.stage, id(planned.result), planned.trouble

    def _ended(self) -> None:
        """Why the drive ended, and what comes next."""
        planned, result = self.planned, self.planned.result
        if not planned.is_planned:
            return
        if planned.trouble:
            verdict("error", planned.trouble, "drive-trouble")
        if result is not None:
            verdict(result["severity"], result["verdict"], "drive-verdict")
            if result["remedy"]:
                ui.label(result["remedy"]).classes("text").props("id=drive-remedy")
        with ui.row().classes("line"):
            if planned.stage == RUNNING:
                ui.button("Stop", on_click=planned.stop).props("outline no-caps id=stop-plan")
            if planned.stage == STOPPED and planned.can_go_on:
                words = "It stands in the middle again: go on"
                ui.button(words, on_click=planned.go_on).props("unelevated no-caps id=go-on")
            if planned.logs and planned.stage != RUNNING:
                ui.button("Fit the log", on_click=lambda: self.page.go("Fit")).props(
                    f"{'unelevated' if planned.stage == DONE else 'outline'} no-caps id=fit-plan"
                )

    def _key(self) -> None:
        """The room, the next move, and the key; it stays the same while it is held."""
        self.key = None
        if self.planned.is_planned:
            self.key = ui.element("omni-run")
            self._course()

    def _course(self) -> None:
        """What is driven, or comes next."""
        if self.key is not None and not self.key.is_deleted and self.planned.course is not None:
            self.key._props |= {"data-course": json.dumps(self.planned.course), "data-stage": self.planned.stage}
            self.key.update()

    def _bars(self) -> None:
        """How well each number is known by now, beside what is wanted and what was planned."""
        planned, result = self.planned, self.planned.last.result
        if not planned.is_planned or result is None:
            return
        status = planned.status or {"numbers": [], "said": []}
        if planned.status is not None:
            verdict(status["severity"], status["verdict"], "told-verdict")
        unknown = [{**number, "within": planned.within / 100.0, "reached": False} for number in result["numbers"]]
        with ui.element("div").classes("meters narrow").props("id=told"):
            for number in status["numbers"] or unknown:
                bar(number, (result["promises"].get(number["key"]) or [None])[0])
        for severity, words in status["said"]:
            ui.label(f"{severity}: {words}").classes("text")

    def _calls(self) -> None:
        if self.planned.is_planned:
            self.page.calls(self.planned.last.command, self.planned.last.python, "call-plan", "The same by hand (plan)")
