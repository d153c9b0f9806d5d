"""Tab Fit: the robot to start from, the fit, what it found, what may be missing."""

from __future__ import annotations

from collections.abc import Callable

from nicegui import ui

from omnidyn.model.wheels import ROBOT_RADII, WHEEL_RADII
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


def _range(limits: tuple[float, float]) -> str:
    """What robots have."""
    return f"{limits[0]:g} to {limits[1]:g}"


class FitTab:
    """The tab of one page."""

    def __init__(self, page: Page, fitting: Fitting) -> None:
        self.page, self.session, self.fitting = page, page.session, fitting

    def build(self) -> None:
        """Lay it out."""
        self.page.part(self.page.robot_choice, ROBOT)
        with self.page.box("Describe another robot"):
            self._robot_form()
        self.page.part(self._choices, FREE, LOGS, ROBOT)
        self.page.part(self._start, FIT, LOGS)
        self.page.progress(FIT, lambda: self.fitting.last, "fit")
        self.page.part(self._result, FIT)

    def _robot_form(self) -> None:
        """What `init` asks for, within what robots have, and the robot as it is described."""
        fields = {
            "--azimuth": ("wheels stand at [degree]", "60,180,300", "0 is forward, 90 left"),
            "--wheel-radius": ("radius of a wheel [m]", "0.05", _range(WHEEL_RADII)),
            "--robot-radius": ("centre to wheel [m]", "0.15", _range(ROBOT_RADII)),
            "--mass": ("mass [kg]", "3", ""),
            "--voltage-limit": ("voltage limit [V]", "", "a guess where it is empty"),
            "--gear-ratio": ("gear ratio [1]", "", "a guess where it is empty"),
        }
        with ui.element("div").classes("form"):
            with ui.row().classes("line"):
                name = ui.input("name", value="my-robot")
                inputs = {
                    flag: ui.input(words, value=value).props(f"hint='{hint}'")
                    for flag, (words, value, hint) in fields.items()
                }
            picture = ui.element("omni-robot")
        drawn = ("--azimuth", "--wheel-radius", "--robot-radius")

        def draw() -> None:
            for flag in drawn:
                picture._props[f"data{flag[1:]}"] = str(inputs[flag].value or "")
            picture.update()

        draw()
        for flag in drawn:
            inputs[flag].on_value_change(draw)
        trouble = ui.label().classes("text error-text")

        async def make() -> str:
            options = [f"{flag}={field.value}" for flag, field in inputs.items() if str(field.value or "").strip()]
            return await self.session.make_robot(name.value or "", options)

        ui.button("Make this robot", on_click=self.page.busy(make, trouble)).props("outline no-caps id=make-robot")
        ui.label("What is left empty is guessed, with a wide spread, and marked as a guess.").classes("text quiet")

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
                "outline no-caps id=fit"
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
