"""Tab Fit: the robot to start from, the fit, what it found, what may be missing."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any
from urllib.parse import quote

from nicegui import ui

from omnidyn.document import in_clauses
from omnidyn.model.keys import in_words
from omnidyn.studio.calls import LogFile
from omnidyn.studio.elements import table, verdict
from omnidyn.studio.fit.state import MAX_GROUP, MAX_NOTE, Fitting, Kept
from omnidyn.studio.page import Page
from omnidyn.studio.parts import FIT, FITTED, FREE, HELD_OUT, LEFT_OUT, LOGS, ROBOT
from omnidyn.studio.session import ROBOT_SUFFIX
from omnidyn.studio.task import Task

WHY = {
    "no_log": "Add a log first: tab Log.",
    "no_robot": "Choose a robot first.",
    "checking": "{} is being checked.",
    "nothing_free": "Nothing is free: choose what to fit.",
    "all_held_out": "No log is fitted: choose one to fit.",
    "no_group": "{} has no group: name one for each log, or for none.",
    "one_group": "The logs that are fitted are all of one group: name another one, or none.",
    "group_held_out": "A group has only logs that are held out: choose one to fit, or name another group.",
}


class FitTab:
    """The tab of one page."""

    def __init__(self, page: Page, fitting: Fitting) -> None:
        self.page, self.session, self.fitting = page, page.session, fitting

    def build(self) -> None:
        """Lay it out."""
        self.page.empty("Fit")
        self.page.part(self.page.robot_choice, ROBOT, of=self.page.robots)
        self.page.part(self._uses, LOGS, of=self._labels)  # a check that ends takes no click and no text away
        self.page.part(self._unusable, LOGS, FIT, of=self._not_usable)
        self.page.part(self._remedies, LOGS, FIT, of=self._wrong)
        self.page.part(self._free, FREE, ROBOT)
        self.page.part(self._start, FIT, LOGS, of=self._ready)
        self.page.progress(FIT, lambda: self.fitting.last, "fit")
        self.page.part(self._result, FIT)
        self.page.part(self._history, FIT, ROBOT, of=self._kept)

    def _uses(self) -> None:
        """What each log is used for: fitted, predicted only, or not at all."""
        if len(self.session.logs) < 2:
            return
        with ui.element("div").classes("robots"):
            for key, label in self._labels().items():
                with ui.row().classes("line entry"):
                    ui.label(label).classes("use")
                    use = ui.toggle(
                        [FITTED, HELD_OUT, LEFT_OUT], value=self.fitting.use_of(key), on_change=self._use(key)
                    )
                    use.props(f"no-caps dense unelevated aria-label='use of {label}'")
                    self.page.mirror(use, FIT, partial(self.fitting.use_of, key), key)
                    group = ui.input(value=self.fitting.group_of(key), placeholder="group, such as carpet")
                    group.props(f"dense maxlength={MAX_GROUP} aria-label='group of {label}'").classes("group")
                    group.on("change", self._name_group(key, group))
                    self.page.mirror(group, FIT, partial(self.fitting.group_of, key), f"group of {key}")
        ui.label(
            "What is held out is predicted, not fitted: that shows what the model is worth. "
            "Logs of several floors or loads: name a group for each log, and each group gets friction of its own."
        ).classes("text quiet")

    def _labels(self) -> dict[str, str]:
        """Key of each log -> its label."""
        return {key: log.label for key, log in self.session.logs.items()}

    def _not_usable(self) -> list[str]:
        """Labels of logs that cannot be used as they are, and that no button mends."""
        mended = [log for log, _ in self._wrong()]
        bad = [log for log in self.session.logs.values() if log.error or (log.result and log.result["has_errors"])]
        return [log.label for log in bad if log not in mended]

    def _unusable(self) -> None:
        """Which logs cannot be used as they are, and what to do."""
        if len(self.session.logs) > 1 and (labels := self._not_usable()):
            words = f"Not usable: {', '.join(labels)}. Leave it out, or mend it on the tab Log."
            ui.label(words).classes("text error-text")

    def _use(self, key: str) -> Callable[[Any], None]:
        """What takes the use of a log."""
        return lambda event: self.fitting.use(key, event.value)

    def _name_group(self, key: str, group: ui.input) -> Callable[[], None]:
        """What takes the group of a log."""
        return lambda: self.fitting.name_group(key, str(group.value or ""))

    def _remedies(self) -> None:
        """What is wrong with a log and can be mended by reading it another way, each with a button."""
        for log, finding in self._wrong():
            with ui.row().classes("line verdict warning"):
                ui.label("!").classes("mark")
                ui.label(f"{log.label}: {finding['text']}").classes("text")
                mend = ui.button(f"Mend {log.label}: {_mend(finding)}")
                mend.props(f"outline no-caps aria-label='mend {log.label}'")
                mend.on_click(self._read_anew(log, finding["reading"]))

    def _wrong(self) -> list[tuple[LogFile, dict[str, Any]]]:
        """Errors of the logs that are used, where another reading mends them."""
        found = [(log, finding) for log in self.fitting.logs for finding in (log.result or {}).get("findings", ())]
        return [(log, finding) for log, finding in found if finding["severity"] == "error" and finding["reading"]]

    def _read_anew(self, log: LogFile, reading: dict[str, Any]) -> Callable[[], None]:
        """What reads a log as its remedy says."""
        return lambda: self.session.start(self.session.remedy(log, reading))

    def _ready(self) -> tuple[tuple[str, str], bool, str]:
        """Why there is no fit now, whether one goes on, and what would be fitted."""
        names = ", ".join(log.label for log in self.fitting.logs)
        return self.fitting.why_not(), self.fitting.last.running, f"{names}, from {self.session.robot}"

    def _start(self) -> None:
        """The button, or why it waits."""
        session = self.session
        (code, words), running, fitted = self._ready()
        with ui.row().classes("line"):
            button = ui.button("Fit", on_click=lambda: session.start(self.fitting.run())).props(
                "unelevated no-caps id=fit"
            )
            button.set_enabled(not code and not running)
            if code:
                ui.label(words if code in ("unfit", "unread") else WHY[code].format(words)).classes("text quiet").props(
                    "id=why"
                )
            elif not running:
                ui.label(fitted).classes("text quiet")

    def _free(self) -> None:
        """What is fitted; at first what `identify` fits of itself."""
        self.fitting.want_choices()
        choices = self.fitting.choices
        names = dict([*choices["default"], *choices["others"]])
        if names:
            free = ui.select(
                names,
                value=[key for key in self.fitting.free if key in names],
                multiple=True,
                label="Free: what is fitted",
                on_change=lambda e: self.fitting.set_free(e.value),
            )
            free.classes("wide free").props("use-chips")
            self.page.mirror(free, FIT, lambda: [key for key in self.fitting.free if key in names])

    def _result(self) -> None:
        fit = self.fitting.last
        self.page.stopped(fit, "fit-stopped", self.fitting.run)
        if fit.result is None:
            return
        result = fit.result
        verdict(result["severity"], result["verdict"], "fit-verdict")
        with ui.row().classes("line"):
            for name in self.fitting.names_of(fit):
                ui.link(f"Robot file {name}", f"/robot/{quote(name)}").props("download").classes("robot-file")
            ui.link("Numbers (CSV)", "/fit/numbers.csv").props("download")
            if result["report"]:
                ui.link("Report", "/fit/report.html", new_tab=True)
        table(result["numbers"], "numbers")
        if result.get("differences", {}).get("rows"):
            ui.label("Between the groups").classes("title")
            table(result["differences"], "differences")
        for remedy in result["remedies"]:
            with ui.row().classes("line"):
                ui.label(remedy["text"]).classes("text")
                ui.button(
                    f"Add {in_words(remedy['key'])} and refit",
                    on_click=self._refit(remedy["key"]),
                ).props("outline dense no-caps")
        for words in result["advice"]:
            ui.label(f"→ {words}").classes("text")
        if result.get("runs"):
            self._runs(fit, result)
        with self.page.box(f"Warnings and notes ({len(result['warnings'])})"):
            for warning in result["warnings"]:
                ui.label(f"{warning['severity']}: {warning['text']}").classes("text")
        self.page.calls(fit.command, fit.python)

    def _runs(self, fit: Task, result: dict[str, Any]) -> None:
        """The error of each log, and its free run or what that leaves."""
        ui.label("Free run over each log: the model gets the inputs only").classes("title")
        table(result["logs"], "fit-logs")
        runs, at = result["runs"], {"log": next(iter(result["runs"])), "kind": 0}

        def look(**more: Any) -> None:
            at.update(more)
            picture.props["data-series"] = fit.series[runs[at["log"]][at["kind"]]]

        with ui.row().classes("line"):
            if len(runs) > 1:
                ui.select(list(runs), value=at["log"], label="Log", on_change=lambda e: look(log=e.value)).classes(
                    "wide run-log"
                )
            ui.toggle({0: "free run", 1: "residuals"}, value=0, on_change=lambda e: look(kind=e.value)).props(
                "no-caps dense unelevated id=run-kind"
            )
        picture = self.page.plot(fit.series[runs[at["log"]][0]], [], "free-run.png")

    def _kept(self) -> tuple[list[str], list[str]]:
        """The fits of the history, and those that are shown."""
        return list(self.fitting.history), self.fitting.names_of(self.fitting.last)

    def _history(self) -> None:
        """All fits of the session, to be looked at again, named, noted, removed."""
        fitting = self.fitting
        if not fitting.history:
            return
        with self.page.box(f"History ({len(fitting.history)})"):
            with ui.element("div").classes("robots"):
                for name, kept in reversed(fitting.history.items()):
                    self._fit_entry(name, kept)
            with ui.row().classes("line"):
                ui.link("Save the work as a Python script", "/script").props("download")
                ui.label("It makes the same numbers from the same logs.").classes("text quiet")

    def _fit_entry(self, name: str, kept: Kept) -> None:
        """A fit of the history."""
        fit = kept.fit
        fitting, stem = self.fitting, name.removesuffix(ROBOT_SUFFIX)
        trouble = ui.label().classes("text error-text")
        with ui.row().classes("line entry"):
            named = ui.input(value=stem).props(f"dense aria-label='name of {stem}'").classes("use")

            def rename() -> None:
                if named.value and named.value != stem:
                    trouble.text = fitting.rename(name, str(named.value))

            named.on("change", rename)
            note = ui.input(placeholder="note", value=kept.note).classes("wide")
            note.props(f"dense maxlength={MAX_NOTE} aria-label='note to {stem}'")
            note.on("change", lambda: fitting.note(name, str(note.value or "")))
            shown = fit is fitting.last
            button = ui.button("Shown" if shown else "Show", on_click=lambda: fitting.show(name))
            button.props(f"flat dense no-caps aria-label='show {stem}'").set_enabled(not shown)
            ui.button("Remove", on_click=lambda: fitting.remove(name)).props(
                f"flat dense no-caps aria-label='remove {stem}'"
            )
        if fit.result is not None:
            ui.label(in_clauses(fit.result["verdict"])[0]).classes("text quiet")

    def _refit(self, key: str) -> Callable[[], None]:
        """What fits again, with a number that the model has not yet."""
        return lambda: self.session.start(self.fitting.run(key))


def _mend(finding: dict[str, Any]) -> str:
    """What the button of a remedy does, in words."""
    return f"{finding['subject']} with the other sign" if finding["code"] == "inverted" else "apply the remedy"
