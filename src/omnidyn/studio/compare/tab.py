"""Tab Compare: robots and fits over the same logs; fits of one robot, and what changed between them."""

from __future__ import annotations

from urllib.parse import quote

from nicegui import ui

from omnidyn.studio.compare.job import PICTURE
from omnidyn.studio.compare.state import FIT, Comparing
from omnidyn.studio.elements import document, verdict
from omnidyn.studio.page import Page
from omnidyn.studio.parts import COMPARE, COMPARE_START, DRIFT, LOGS, ROBOT

WHY = {"no_robot": "Choose a robot first.", "no_log": "Add a log first: tab Log."}


class CompareTab:
    """The tab of one page."""

    def __init__(self, page: Page, comparing: Comparing) -> None:
        self.page, self.session, self.comparing = page, page.session, comparing

    def build(self) -> None:
        """Lay it out."""
        page = self.page
        page.empty("Compare")
        page.part(self._robots, ROBOT)  # apart: a log that was just read takes no choice away
        page.part(self._logs, LOGS)
        page.part(self._start, COMPARE, COMPARE_START, LOGS, ROBOT)
        page.progress(COMPARE, lambda: self.comparing.last, COMPARE)
        page.part(self._result, COMPARE)
        ui.label("Drift: what changed between fits of one robot").classes("title").props("role=heading aria-level=2")
        page.part(self._fits, ROBOT)
        page.part(self._start_drift, DRIFT, COMPARE_START, ROBOT)
        page.progress(DRIFT, lambda: self.comparing.last_drift, COMPARE)
        page.part(self._drift, DRIFT)

    def _robots(self) -> None:
        """Choices of robots, and more of them."""
        comparing, session = self.comparing, self.session
        first, second = comparing.robots
        with ui.row().classes("line"):
            one = ui.select(
                list(session.robots),
                value=first or None,
                label="Robot A",
                on_change=lambda e: comparing.choose(0, e.value),
            )
            one.classes("wide robot-a")
            self.page.mirror(one, COMPARE_START, lambda: comparing.robots[0] or None)
            other = ui.select(
                ["", *session.robots],
                value=second,
                label="Robot B, if any",
                on_change=lambda e: comparing.choose(1, e.value),
            )
            other.classes("wide robot-b")
            self.page.mirror(other, COMPARE_START, lambda: comparing.robots[1])
            ui.element("omni-drop").props(f"kind={FIT} words='Drop robot files or fits (.toml), or click'")

    def _logs(self) -> None:
        """Which of the logs."""
        comparing, session = self.comparing, self.session
        if len(session.logs) > 1:
            logs = ui.select(
                {key: log.label for key, log in session.logs.items()},
                value=[log.key for log in comparing.logs],
                multiple=True,
                label="Logs",
                on_change=lambda e: comparing.choose_logs(e.value),
            )
            logs.classes("wide logs").props("use-chips")
            self.page.mirror(logs, COMPARE_START, lambda: [log.key for log in comparing.logs])

    def _start(self) -> None:
        comparing = self.comparing
        code = comparing.why_not()
        with ui.row().classes("line"):
            button = ui.button("Compare", on_click=lambda: self.session.start(comparing.run()))
            button.props("unelevated no-caps id=compare").set_enabled(not code and not comparing.last.running)
            if code:
                ui.label(WHY[code]).classes("text quiet").props("id=why-compare")

    def _result(self) -> None:
        task = self.comparing.last
        self.page.stopped(task, "compare-verdict", self.comparing.run)
        if task.result is None:
            return
        result = task.result
        verdict("error" if result["failed"] else result["severity"], result["verdict"], "compare-verdict")
        document(result["parts"], "compared")
        names = list(task.series)
        if len(names) > 1:
            ui.toggle(result["series"], value=names[0], on_change=lambda e: show(e.value)).props("no-caps")
        if names:
            ui.label("Free run: the model gets the inputs only").classes("title")
            signals = self.page.plot(task.series[names[0]], [], "compare.png")

            def show(name: str) -> None:
                signals.props["data-series"] = task.series[name]

        with self.page.box("All that the comparison says"):
            document(result["all"], "compared-all")
        self.page.calls(task.command, task.python, "call-compare")

    def _fits(self) -> None:
        """Fits in their order, and their files."""
        comparing = self.comparing
        if not comparing.files:
            ui.label("No fit yet. Fit a robot, or drop fits here: robot files that identify wrote.").classes(
                "text quiet"
            )
            return
        with ui.row().classes("line"):
            fits = ui.select(
                comparing.files,
                value=comparing.fits,
                multiple=True,
                label="Fits, the oldest first",
                on_change=lambda e: comparing.choose_fits(e.value),
            )
            fits.classes("wide fits").props("use-chips")
            self.page.mirror(fits, COMPARE_START, lambda: comparing.fits)
        with ui.row().classes("line"):
            for name in comparing.files:
                ui.link(name, f"/robot/{quote(name)}").props("download")

    def _start_drift(self) -> None:
        comparing = self.comparing
        if not comparing.files:
            return
        with ui.row().classes("line"):
            button = ui.button("Compare fits", on_click=lambda: self.session.start(comparing.run_drift()))
            button.props("outline no-caps id=drift").set_enabled(
                len(comparing.fits) > 1 and not comparing.last_drift.running
            )
            if len(comparing.fits) < 2:
                ui.label("Choose two fits or more.").classes("text quiet")

    def _drift(self) -> None:
        task = self.comparing.last_drift
        self.page.stopped(task, "drift-verdict", self.comparing.run_drift)
        if task.result is None:
            return
        verdict(task.result["severity"], task.result["verdict"], "drift-verdict")
        with ui.element("div").classes("scroll").props("tabindex=0 role=region aria-label='picture of the drift'"):
            picture = ui.element("img").classes("picture")
            picture._props["src"] = f"/drift/{PICTURE}?of={task.folder.parent.name if task.folder else ''}"
            picture._props["alt"] = task.result["verdict"]
        ui.link("Save this picture", f"/drift/{PICTURE}").props("download")
        document(task.result["parts"], "drifted")
        self.page.calls(task.command, task.python, "call-drift")
