"""Tab Log: files, their signals with what was found in them, the map of their columns."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from nicegui import ui

from omnidyn.studio import calls
from omnidyn.studio.calls import LogFile
from omnidyn.studio.elements import MARK, UNUSED, column_row, verdict
from omnidyn.studio.live.state import Watching
from omnidyn.studio.live.strip import Strip
from omnidyn.studio.page import Page
from omnidyn.studio.parts import LOGS, PROGRESS, ROBOT


class LogTab:
    """The tab of one page."""

    def __init__(self, page: Page, watching: Watching) -> None:
        self.page, self.session, self.shown = page, page.session, ""
        self.strip = Strip(page, watching, self._log)

    def build(self) -> None:
        """Lay it out."""
        with ui.row().classes("line"):
            ui.element("omni-drop")
            self.page.part(self._room, LOGS, ROBOT, of=lambda: self.session.room)
            ui.button("Use the example log", on_click=self.page.busy(self.session.example)).props(
                "outline no-caps id=example"
            )
        self.page.empty("Log")
        self.page.part(self._choice, LOGS, of=self._choices)
        self.page.part(self._progress, LOGS, PROGRESS)
        self.page.next_step("Log")
        self.strip.build()
        self.page.part(self._content, LOGS)

    def _log(self) -> LogFile | None:
        """The log that this page shows."""
        logs = self.session.logs
        return logs.get(self.shown) or next(reversed(logs.values()), None)

    def _room(self) -> None:
        ui.label(self.session.room).classes("text quiet").props("id=room")

    def _choices(self) -> tuple[LogFile | None, dict[str, str]]:
        """The log that is shown, and the labels of all."""
        return self._log(), {key: other.label for key, other in self.session.logs.items()}

    def _choice(self) -> None:
        log, names = self._choices()
        if log is None:
            return
        with ui.row().classes("line"):
            ui.select(names, value=log.key, label="Log", on_change=lambda e: self._show(e.value)).classes("wide")
            ui.button("Remove", on_click=lambda: self.session.remove(log)).props("flat no-caps")

    def _show(self, key: str) -> None:
        self.shown = key
        self.page.changed(LOGS)

    def _progress(self) -> None:
        log = self._log()
        if log is not None and log.progress:
            with ui.row().classes("line"):
                ui.spinner(size="1.2em")
                ui.label(log.progress).props("id=reading")

    def _content(self) -> None:
        log = self._log()
        if log is None:
            return
        if log.error:
            verdict("error", log.error)
        if log.ended:
            ui.button("Run again", on_click=lambda: self.session.start(self.session.check(log))).props(
                "outline no-caps id=check-again"
            )
        if log.result is not None:
            verdict(log.result["severity"], log.result["verdict"])
        if log.series:
            findings = log.result["findings"] if log.result else []
            spans = [[k, f["severity"], a, b, f["subject"]] for k, f in enumerate(findings) for a, b in f["spans"]]
            self._plot(log, spans)
        if log.result is not None:
            self._findings(log)
            self._uses(log)
            self._columns(log)
        if log.other:
            words = calls.align(log, self.session.logs[log.other], self.session.robot_path)
            self.page.calls(*words, name="align-call", title="The same by hand (align)")
        self.page.calls(*calls.check(log, self.session.robot_path))

    def _plot(self, log: LogFile, spans: list[list[Any]]) -> None:
        """The signals, and those of another log over them."""
        others = {key: one.label for key, one in self.session.logs.items() if one is not log and one.series}
        if log.other not in others:
            log.other, log.offset, log.aligned = "", 0.0, None
        if others:
            self._second(log, others)
        other = self.session.logs[log.other].series if log.other else ""
        name = f"{Path(log.label).stem}.png"
        picture = self.page.plot(log.series, spans, name, other, log.offset)
        picture._props["data-words"] = self.session.logs[log.other].label if log.other else ""
        picture.on("moved", lambda event: self._move(log, event.args["detail"]), args=["detail"])

    def _second(self, log: LogFile, others: dict[str, str]) -> None:
        """The choice of another log, and what is added to its times."""
        with ui.row().classes("line"):
            ui.select(
                {"": "none", **others},
                value=log.other,
                label="Another log over it",
                on_change=lambda e: self._take(log, e.value),
            ).classes("wide").props("id=other-log")
            if log.other:
                field = ui.number("added to its times [s]", value=round(log.offset, 6), step=0.01, format="%.6f")
                field.props("dense for=offset").on("change", lambda: self._move(log, field.value))
                ui.button("Align", on_click=self.page.busy(lambda: self.session.align(log))).props(
                    "outline no-caps id=align"
                )
        if log.other and log.aligned is not None:
            verdict(log.aligned["severity"], log.aligned["verdict"], "aligned")

    def _take(self, log: LogFile, key: str) -> None:
        log.other, log.offset, log.aligned = key, 0.0, None
        self.page.changed(LOGS)

    def _move(self, log: LogFile, offset: Any) -> None:
        """Take an offset from the plot or the field; it is that of all pages."""
        if isinstance(offset, int | float) and round(offset, 6) != round(log.offset, 6):
            log.offset, log.aligned = float(offset), None
            self.session.changed(LOGS)

    def _findings(self, log: LogFile) -> None:
        """Errors and warnings, then notes, which are folded."""
        assert log.result is not None
        numbered = list(enumerate(log.result["findings"]))
        grave = [(k, finding) for k, finding in numbered if finding["severity"] != "note"]
        notes = numbered[len(grave) :]  # they come last
        for title, shown, is_open in (("Findings", grave, True), ("Notes", notes, False)):
            if shown:
                with self.page.box(f"{title} ({len(shown)})", is_open):
                    for k, finding in shown:
                        self._finding(log, k, finding)

    def _finding(self, log: LogFile, k: int, finding: dict[str, Any]) -> None:
        """What is the case, where, and what to do."""
        with ui.element("div").classes(f"finding {finding['severity']}").props(f"id=finding-{k}"):
            with ui.row().classes("line"):
                ui.label(MARK[finding["severity"]]).classes("mark")
                ui.label(f"{finding['severity']}: {finding['code'].replace('_', ' ')} {finding['subject']}").classes(
                    "strong"
                )
                if finding["spans"]:
                    look = (
                        f"document.querySelector('omni-plot').show({finding['spans'][0][0]}, {finding['spans'][-1][1]})"
                    )
                    ui.button("Show", on_click=lambda: ui.run_javascript(look)).props("flat dense no-caps")
            ui.label(finding["text"]).classes("text")
            if finding["remedy"]:
                ui.label(f"→ {finding['remedy']}").classes("text remedy")
            if finding["reading"]:
                remedy = self.session.remedy
                ui.button(
                    "Apply this remedy", on_click=lambda: self.session.start(remedy(log, finding["reading"]))
                ).props(f"outline dense no-caps id=apply-{k}")

    def _uses(self, log: LogFile) -> None:
        assert log.result is not None
        with self.page.box("What it can be used for", True):
            for use in log.result["uses"]:
                with ui.row().classes("line"):
                    ui.label(f"{use['name']}: {'yes' if use['good'] else 'no'}").classes("use")
                    ui.label(use["reason"]).classes("text")

    def _columns(self, log: LogFile) -> None:
        """The map of columns, to be corrected by hand."""
        assert log.result is not None
        with self.page.box(f"Columns and units ({len(log.result['columns'])})"):
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

            async def apply() -> str:
                return await self.session.map_columns(log, [r for r in rows if r["component"] != UNUSED])

            with ui.row().classes("line"):
                ui.button("Read the log this way", on_click=self.page.busy(apply, trouble)).props(
                    "outline no-caps id=apply-columns"
                )
                if log.map:
                    ui.link("Save this map", f"/log/{log.key}/map").props("download")
