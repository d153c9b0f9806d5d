"""Tab Fit: the robot to start from, the fit, what it found, what may be missing."""

from __future__ import annotations

from collections.abc import Callable

from nicegui import ui

from omnidyn.studio.elements import table, verdict
from omnidyn.studio.fit.state import Fitting
from omnidyn.studio.page import Page
from omnidyn.studio.parts import FIT, FREE, LOGS, ROBOT
from omnidyn.studio.series import SERIES

WHY = {
    "no_log": "Add a log first: tab Log.",
    "no_robot": "Choose a robot first.",
    "checking": "The log is being checked.",
    "nothing_free": "Nothing is free: choose what to fit.",
    "all_held_out": "Every log is held out: leave one to fit.",
}


class FitTab:
    """The tab of one page."""

    def __init__(self, page: Page, fitting: Fitting) -> None:
        self.page, self.session, self.fitting = page, page.session, fitting

    def build(self) -> None:
        """Lay it out."""
        self.page.empty("Fit")
        self.page.part(self.page.robot_choice, ROBOT)
        self.page.part(self._choices, FREE, LOGS, ROBOT)
        self.page.part(self._start, FIT, LOGS)
        self.page.progress(FIT, lambda: self.fitting.last, "fit")
        self.page.part(self._result, FIT)

    def _choices(self) -> None:
        """What is held out, and what is fitted; not made again while somebody chooses."""
        session = self.session
        if len(session.logs) > 1:
            names = {key: log.label for key, log in session.logs.items()}
            ui.select(
                names,
                value=self.fitting.held_out,
                multiple=True,
                label="Hold out: predict these logs, do not fit them",
                on_change=lambda e: self.fitting.hold_out(e.value),
            ).classes("wide held-out").props("use-chips")
        self._free()

    def _start(self) -> None:
        """The button, or why it waits."""
        session = self.session
        code, words = self.fitting.why_not()
        with ui.row().classes("line"):
            button = ui.button("Fit", on_click=lambda: session.start(self.fitting.run())).props(
                "unelevated no-caps id=fit"
            )
            button.set_enabled(not code and not self.fitting.last.running)
            if code:
                ui.label(words if code in ("unfit", "unread") else WHY[code]).classes("text quiet").props("id=why")
            elif not self.fitting.last.running:
                names = ", ".join(log.label for log in session.logs.values())
                ui.label(f"{names}, from {session.robot}").classes("text quiet")

    def _free(self) -> None:
        """What is fitted; at first what `identify` fits of itself."""
        self.fitting.want_choices()
        choices = self.fitting.choices
        names = {key: f"{words} ({key})" for group in ("default", "others") for key, words in choices[group]}
        if names:
            ui.select(
                names,
                value=[key for key in self.fitting.free if key in names],
                multiple=True,
                label="Free: what is fitted",
                on_change=lambda e: self.fitting.set_free(e.value),
            ).classes("wide free").props("use-chips")

    def _result(self) -> None:
        fit = self.fitting.last
        self.page.stopped(fit, "fit-stopped", self.fitting.run)
        if fit.result is None:
            return
        result = fit.result
        verdict(result["severity"], result["verdict"], "fit-verdict")
        with ui.row().classes("line"):
            ui.link("Robot file", "/fit/robot.toml").props("download")
            ui.link("Numbers (CSV)", "/fit/numbers.csv").props("download")
            if result["report"]:
                ui.link("Report", "/fit/report.html", new_tab=True)
        table(result["numbers"], "numbers")
        for remedy in result["remedies"]:
            with ui.row().classes("line"):
                ui.label(remedy["text"]).classes("text")
                ui.button(
                    f"Add {remedy['key']} and refit",
                    on_click=self._refit(remedy["key"]),
                ).props("outline dense no-caps")
        for words in result["advice"]:
            ui.label(f"→ {words}").classes("text")
        if SERIES in fit.series:
            ui.label("Free run: the model gets the inputs only").classes("title")
            self.page.plot(fit.series[SERIES], [], "free-run.png")
        with self.page.box(f"Warnings and notes ({len(result['warnings'])})"):
            for warning in result["warnings"]:
                ui.label(f"{warning['severity']}: {warning['text']}").classes("text")
        self.page.calls(fit.command, fit.python)

    def _refit(self, key: str) -> Callable[[], None]:
        """What fits again, with a number that the model has not yet."""
        return lambda: self.session.start(self.fitting.run(key))
