"""Strip of the tab Log: what a log tells while it grows, one bar for each number that must be known."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nicegui import ui

from omnidyn.studio.calls import LogFile
from omnidyn.studio.elements import verdict
from omnidyn.studio.live.state import Watching
from omnidyn.studio.page import Page
from omnidyn.studio.parts import LIVE, LOGS, ROBOT, WATCH

WIDE = 4.0  # times what is wanted: a full bar


class Strip:
    """The strip of one page. log: that the page shows."""

    def __init__(self, page: Page, watching: Watching, log: Callable[[], LogFile | None]) -> None:
        self.page, self.watching, self.log = page, watching, log

    def build(self) -> None:
        """Lay it out."""
        self.page.part(self._start, WATCH, LOGS, ROBOT, of=self._state)
        self.page.part(self._strip, LIVE)

    def _state(self) -> tuple[bool, str, str]:
        """Whether a log is watched, which one is shown, and what keeps from it."""
        log = self.log()
        return self.watching.running, log.key if log else "", self.watching.why_not()

    def _start(self) -> None:
        """The button that begins or ends it."""
        watching, log, session = self.watching, self.log(), self.page.session
        if log is None:
            return
        with ui.row().classes("line"):
            if watching.running:
                ui.button("Stop watching", on_click=watching.stop).props("outline no-caps id=stop-watching")
                return
            button = ui.button("Watch it grow", on_click=lambda: session.start(watching.run(log)))
            button.props("outline no-caps id=watch").set_enabled(not watching.why_not())
            within = ui.number("enough: ± %", value=watching.within, min=0.1, max=1000.0, step=1.0)
            within.props("dense for=within").classes("within")
            within.on("change", lambda: watching.want(within.value))
            self.page.mirror(within, WATCH, lambda: watching.within, "within")
            words = (
                watching.why_not() or "While the log is still recorded: numbers as they are now, and when it is enough."
            )
            ui.label(words).classes("text quiet")

    def _strip(self) -> None:
        """The answer, and the bars."""
        watching = self.watching
        if watching.trouble:
            verdict("error", watching.trouble, "watch-trouble")
        if watching.status is None or watching.log not in self.page.session.logs:
            return
        status = watching.status
        name = self.page.session.logs[watching.log].label
        verdict(status["severity"], f"{name}: {status['verdict']}", "live-verdict")
        with ui.element("div").classes("meters").props("id=meters"):
            for number in status["numbers"]:
                bar(number)
        for severity, words in status["said"]:
            ui.label(f"{severity}: {words}").classes("text")
        if not watching.running:
            self.page.calls(watching.command, watching.python, "call-watch", "The same by hand (watch)")


def bar(number: dict[str, Any], promised: float | None = None) -> None:
    """How wide the interval of a number is, how wide it may be, and how wide a plan promised that it will be."""
    half, within = number["half"], number["within"]
    width = 1.0 if half is None else min(half / within / WIDE, 1.0)
    now = (
        "unknown"
        if half is None
        else f"{number['value']:.3g} {number['unit']} ± {100.0 * half:.2g} %".replace("  ", " ")
    )
    words = f"{now}, wanted ± {100.0 * within:.2g} %"
    words += "" if promised is None else f", planned ± {100.0 * promised:.2g} %"
    ui.label(number["name"])
    with ui.element("div").classes("meter").props("role=meter") as meter:
        meter._props |= {"aria-label": f"{number['name']}: {words}", "aria-valuemin": "0", "aria-valuemax": "100"}
        meter._props |= {"aria-valuenow": f"{100.0 * width:.0f}"}
        ui.element("div").classes("width" + " reached" * number["reached"]).style(f"width: {100.0 * width:.1f}%")
        ui.element("div").classes("wanted").style(f"left: {100.0 / WIDE:.1f}%")
        if promised is not None:
            left = 100.0 * min(promised / within / WIDE, 1.0)
            ui.element("div").classes("promised").style(f"left: {left:.1f}%")
    ui.label(("✓ " if number["reached"] else "") + words)
