"""Page: what one browser tab shows of the session: tabs, buttons, tables. Pictures are drawn by static/studio.js."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from nicegui import ui

from omnidyn.studio import calls
from omnidyn.studio.calls import LogFile
from omnidyn.studio.elements import MARK, UNUSED, column_row, plot, table, verdict
from omnidyn.studio.session import DRIVE, FIT, LOGS, NUMBERS, PROGRESS, ROBOT, VIEW, Session

HEAD = """
<link rel="stylesheet" href="/static/studio.css">
<script type="module" src="/static/studio.js"></script>
"""
WHY = {
    "no_log": "Add a log first: tab Log.",
    "no_robot": "Choose a robot first.",
    "checking": "The log is being checked.",
    "all_held_out": "Every log is held out: leave one to fit.",
}


class Page:
    """One browser tab."""

    def __init__(self, session: Session) -> None:
        self.session, self.shown = session, ""
        self.parts: dict[str, list[Any]] = {}
        self.view: ui.element | None = None  # of the drive
        self.folded: dict[str, bool] = {}  # title -> whether it is open

    def build(self) -> None:
        """Lay out the page."""
        ui.add_head_html(HEAD)
        ui.colors(primary="#0b57a4")
        session, client = self.session, ui.context.client
        session.listeners.add(self.changed)
        client.on_delete(lambda: session.listeners.discard(self.changed))
        dark = ui.dark_mode(None)
        with ui.header().classes("bar"):
            with ui.element("h1").classes("brand"):
                ui.label("omnidyn studio")
            with ui.tabs().props("dense no-caps inline-label") as tabs:
                log_tab, fit_tab, drive_tab = (ui.tab(name) for name in ("Log", "Fit", "Drive"))
            ui.space()
            ui.button("◐", on_click=lambda: dark.set_value(not dark.value)).props(
                "flat dense aria-label='light or dark'"
            )
        with ui.tab_panels(tabs, value=log_tab, animated=False).classes("panels"):
            with ui.tab_panel(log_tab):
                self._log_tab()
            with ui.tab_panel(fit_tab):
                self._fit_tab()
            with ui.tab_panel(drive_tab):
                self._drive_tab(lambda: tabs.set_value("Fit"))

    def changed(self, part: str) -> None:
        """Show a part anew."""
        for refresh in self.parts.get(part, ()):
            refresh()

    def _part(self, make: Callable[[], None], *parts: str) -> None:
        """A piece of the page that is made again when one of these parts of the session changes."""
        shown = ui.refreshable(make)
        shown()
        for part in parts:
            self.parts.setdefault(part, []).append(shown.refresh)

    def _box(self, title: str, is_open: bool = False) -> ui.expansion:
        """A part that can be folded; it stays as it was when it is made again."""
        name = title.partition(" (")[0]
        is_open = self.folded.get(name, is_open)
        box = ui.expansion(title, value=is_open, on_value_change=lambda event: self.folded.update({name: event.value}))
        return box.classes("box")

    # Log

    def _log_tab(self) -> None:
        with ui.row().classes("line"):
            ui.element("omni-drop")
            ui.button("Use the example log", on_click=self._example).props("outline no-caps id=example")
        self._part(self._log_choice, LOGS)
        self._part(self._log_progress, LOGS, PROGRESS)
        self._part(self._log_content, LOGS)

    async def _example(self) -> None:
        await self.session.example()

    def _log(self) -> LogFile | None:
        """The log that this page shows."""
        logs = self.session.logs
        return logs.get(self.shown) or next(reversed(logs.values()), None)

    def _log_choice(self) -> None:
        log = self._log()
        if log is None:
            ui.label(
                "No log yet. Drop a file here: CSV, Parquet, a ROS bag, MATLAB, WPILOG. It stays on this machine."
            ).classes("quiet")
            return
        with ui.row().classes("line"):
            names = {key: other.label for key, other in self.session.logs.items()}
            ui.select(names, value=log.key, label="Log", on_change=lambda e: self._show(e.value)).classes("wide")
            ui.button("Remove", on_click=lambda: self.session.remove(log)).props("flat no-caps")

    def _show(self, key: str) -> None:
        self.shown = key
        self.changed(LOGS)

    def _log_progress(self) -> None:
        log = self._log()
        if log is not None and log.progress:
            with ui.row().classes("line"):
                ui.spinner(size="1.2em")
                ui.label(log.progress)

    def _log_content(self) -> None:
        log = self._log()
        if log is None:
            return
        if log.error:
            verdict("error", log.error)
        if log.result is not None:
            verdict(log.result["severity"], log.result["verdict"])
        if log.series:
            findings = log.result["findings"] if log.result else []
            spans = [[k, f["severity"], a, b, f["subject"]] for k, f in enumerate(findings) for a, b in f["spans"]]
            plot(log.series, spans)
        if log.result is not None:
            self._findings(log)
            self._uses(log)
            self._columns(log)
        self._calls(*calls.check(log, self.session.robot_path))

    def _findings(self, log: LogFile) -> None:
        """Errors and warnings, then notes, which are folded."""
        assert log.result is not None
        numbered = list(enumerate(log.result["findings"]))
        grave = [(k, finding) for k, finding in numbered if finding["severity"] != "note"]
        notes = numbered[len(grave) :]  # they come last
        for title, shown, is_open in (("Findings", grave, True), ("Notes", notes, False)):
            if shown:
                with self._box(f"{title} ({len(shown)})", is_open):
                    for k, finding in shown:
                        self._finding(log, k, finding)

    def _finding(self, log: LogFile, k: int, finding: dict[str, Any]) -> None:
        """What is the case, where, and what to do."""
        with ui.element("div").classes(f"finding {finding['severity']}").props(f"id=finding-{k}"):
            with ui.row().classes("line"):
                ui.label(MARK[finding["severity"]]).classes("mark")
                ui.label(f"{finding['severity']}: {finding['code']} {finding['subject']}").classes("code")
                if finding["spans"]:
                    look = (
                        f"document.querySelector('omni-plot').show({finding['spans'][0][0]}, {finding['spans'][-1][1]})"
                    )
                    ui.button("Show", on_click=lambda: ui.run_javascript(look)).props("flat dense no-caps")
            ui.label(finding["text"]).classes("text")
            if finding["remedy"]:
                ui.label(f"→ {finding['remedy']}").classes("text remedy")
            if finding["code"] == "unsigned" and not log.unsigned:
                ui.button("Apply this remedy", on_click=lambda: self._signed(log)).props(
                    "outline dense no-caps id=apply-remedy"
                )

    def _signed(self, log: LogFile) -> None:
        log.unsigned = True
        self.session.start(self.session.check(log))

    def _uses(self, log: LogFile) -> None:
        assert log.result is not None
        with self._box("What it can be used for", True):
            for use in log.result["uses"]:
                with ui.row().classes("line"):
                    ui.label(f"{use['name']}: {'yes' if use['good'] else 'no'}").classes("use")
                    ui.label(use["reason"]).classes("text")

    def _columns(self, log: LogFile) -> None:
        """The map of columns, to be corrected by hand."""
        assert log.result is not None
        with self._box(f"Columns and units ({len(log.result['columns'])})"):
            for doubt in log.result["doubts"]:
                ui.label(doubt).classes("text quiet")
            rows = [dict(row) for row in log.result["columns"]]
            blank = {"component": UNUSED, "unit": "", "motor": False, "invert": False}
            rows += [{**blank, "column": name} for name in log.result["unused"]]
            with ui.element("div").classes("table columns"):
                for head in ("column of the file", "is", "in unit", "at the motor", "other sign"):
                    ui.label(head).classes("head")
                for row in rows:
                    column_row(row)
            trouble = ui.label().classes("text error-text")

            async def apply() -> None:
                trouble.text = await self.session.map_columns(log, [r for r in rows if r["component"] != UNUSED])

            with ui.row().classes("line"):
                ui.button("Read the log this way", on_click=apply).props("outline no-caps id=apply-columns")
                if log.map:
                    ui.link("Save this map", f"/log/{log.key}/map").props("download")

    # Fit

    def _fit_tab(self) -> None:
        self._part(self._robot_choice, ROBOT)
        with self._box("Describe another robot"):
            self._robot_form()
        self._part(self._fit_start, FIT, LOGS)
        self._part(self._fit_progress, FIT, PROGRESS)
        self._part(self._fit_result, FIT)

    def _robot_choice(self) -> None:
        with ui.row().classes("line"):
            ui.select(
                list(self.session.robots),
                value=self.session.robot or None,
                label="Robot",
                on_change=lambda e: self.session.choose(e.value),
            ).classes("wide robot")
            ui.element("omni-drop").props("words='Drop a robot file (.toml), or click'")

    def _robot_form(self) -> None:
        fields = {
            "--azimuth": ("wheels stand at [degree]", "60,180,300"),
            "--wheel-radius": ("radius of a wheel [m]", "0.05"),
            "--robot-radius": ("centre to wheel [m]", "0.15"),
            "--mass": ("mass [kg]", "3"),
            "--voltage-limit": ("voltage limit [V]", ""),
        }
        with ui.row().classes("line"):
            name = ui.input("name", value="my-robot")
            inputs = {flag: ui.input(words, value=value) for flag, (words, value) in fields.items()}
        trouble = ui.label().classes("text error-text")

        async def make() -> None:
            options = [f"{flag}={field.value}" for flag, field in inputs.items() if str(field.value).strip()]
            trouble.text = await self.session.make_robot(name.value or "", options)

        ui.button("Make this robot", on_click=make).props("outline no-caps id=make-robot")
        ui.label("What is left empty is guessed, with a wide spread, and marked as a guess.").classes("text quiet")

    def _fit_start(self) -> None:
        session = self.session
        if len(session.logs) > 1:
            names = {key: log.label for key, log in session.logs.items()}
            ui.select(
                names,
                value=session.held_out,
                multiple=True,
                label="Hold out: predict these logs, do not fit them",
                on_change=lambda e: self._hold_out(e.value),
            ).classes("wide").props("use-chips")
        code, words = session.why_no_fit()
        with ui.row().classes("line"):
            button = ui.button("Fit", on_click=lambda: session.start(session.run_fit())).props("outline no-caps id=fit")
            button.set_enabled(not code and not session.fit.running)
            if code:
                ui.label(words if code in ("unfit", "unread") else WHY[code]).classes("text quiet").props("id=why")
            elif not session.fit.running:
                names = ", ".join(log.label for log in session.logs.values())
                ui.label(f"{names}, from {session.robot}").classes("text quiet")

    def _hold_out(self, keys: list[str]) -> None:
        self.session.held_out = keys
        self.session.changed(FIT)

    def _fit_progress(self) -> None:
        fit = self.session.fit
        if not fit.running:
            return
        with ui.row().classes("line"):
            ui.spinner(size="1.2em")
            ui.label(fit.progress).props("id=fit-progress")
            ui.button("Cancel", on_click=lambda: self.session.start(self.session.workers["fit"].cancel())).props(
                "outline dense no-caps id=cancel"
            )
        if fit.share is not None:
            ui.linear_progress(fit.share, show_value=False)

    def _fit_result(self) -> None:
        fit = self.session.fit
        if fit.error:
            verdict("error", fit.error)
        if fit.result is None:
            return
        result = fit.result
        verdict("error" if result["failed"] else "note", result["verdict"], "fit-verdict")
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
        if fit.series:
            ui.label("Free run: the model gets the inputs only").classes("title")
            plot(fit.series, [])
        with self._box(f"Warnings and notes ({len(result['warnings'])})"):
            for warning in result["warnings"]:
                ui.label(f"{warning['severity']}: {warning['text']}").classes("text")
        self._calls(fit.command, fit.python)

    def _refit(self, key: str) -> Callable[[], None]:
        """What fits again, with a number that the model has not yet."""
        return lambda: self.session.start(self.session.run_fit(("friction", key)))

    def _calls(self, command: str, python: str) -> None:
        """The command line and the Python call that do the same."""
        with self._box("The same by hand"):
            ui.label(command).classes("call").props("id=call")
            ui.label(python).classes("call")

    # Drive

    def _drive_tab(self, to_fit: Callable[[], object]) -> None:
        self._part(self._robot_choice, ROBOT)
        self._part(lambda: self._drive_content(to_fit), DRIVE, ROBOT)
        self._part(self._drive_view, VIEW)
        self.parts[NUMBERS] = [self._drive_numbers]

    def _drive_content(self, to_fit: Callable[[], object]) -> None:
        session, drive = self.session, self.session.drive
        if drive.trouble:
            verdict("error", drive.trouble)
        with ui.row().classes("line"):
            if drive.running:
                ui.button("Stop", on_click=lambda: session.command({"stop": True})).props("outline no-caps id=stop")
                ui.button("Back to the start", on_click=lambda: session.command({"home": True})).props("flat no-caps")
                ui.button(
                    "End the recording" if drive.recording else "Record",
                    on_click=lambda: session.command({"record": not drive.recording}),
                ).props("outline no-caps id=record")
            else:
                ui.button("Drive", on_click=self._drive).props("outline no-caps id=drive")
            if any(Path(log.path).name.startswith("drive-") for log in session.logs.values()):
                ui.button("Fit the recording", on_click=to_fit).props("outline no-caps id=to-fit")
            if not drive.running:
                words = session.robot or "Choose a robot, then drive it by keys or sliders."
                ui.label(words).classes("text quiet")

    def _drive_view(self) -> None:
        drive = self.session.drive
        if drive.running and drive.robot is None:
            ui.spinner(size="1.2em")
        elif drive.running:
            view = self.view = ui.element("omni-drive")
            view._props["data-robot"] = json.dumps(drive.robot)

    def _drive_numbers(self) -> None:
        """The same element goes on with other numbers of the robot."""
        if self.view is not None and not self.view.is_deleted and self.session.drive.running:
            self.view._props["data-robot"] = json.dumps(self.session.drive.robot)
            self.view.update()

    def _drive(self) -> None:
        self.session.robot = self.session.robot or "axebot"
        self.session.changed(ROBOT)
        self.session.start(self.session.run_drive())
