"""Tab Robot: the robot that logs are read with and a fit starts from, and all robots of the session."""

from __future__ import annotations

from collections.abc import Callable
from urllib.parse import quote

from nicegui import ui

from omnidyn.model.wheels import ROBOT_RADII, WHEEL_RADII
from omnidyn.studio.page import Page
from omnidyn.studio.parts import ROBOT
from omnidyn.studio.robot.make import make_robot
from omnidyn.studio.session import ROBOT_SUFFIX


def _range(limits: tuple[float, float]) -> str:
    """What robots have."""
    return f"{limits[0]:g} to {limits[1]:g}"


class RobotTab:
    """The tab of one page. opened: the robot whose file is shown, "" for none."""

    def __init__(self, page: Page) -> None:
        self.page, self.session, self.opened = page, page.session, ""

    def build(self) -> None:
        """Lay it out."""
        self.page.part(self.page.robot_choice, ROBOT, of=self.page.robots)
        self.page.next_step("Robot")
        with self.page.box("Describe another robot"):
            self._robot_form()
        self.page.part(self._robots, ROBOT)

    def _robots(self) -> None:
        """Each robot with what can be done with it."""
        ui.label("Robots of this session").classes("title").props("role=heading aria-level=2")
        with ui.element("div").classes("robots"):
            for name in self.session.robots:
                with ui.row().classes("line entry"):
                    ui.label(name).classes("use" + " strong" * (name == self.session.robot))
                    ui.label("chosen" if name == self.session.robot else "").classes("quiet")
                    for words, act in self._acts(name).items():
                        ui.button(words, on_click=act).props(f"flat dense no-caps aria-label='{words} {name}'")
                    if self.session.is_file(name):
                        ui.link("Save", f"/robot/{quote(name)}").props("download")
                if name == self.opened:
                    self._editor(name)

    def _acts(self, name: str) -> dict[str, Callable[[], object]]:
        """What buttons do with a robot."""
        acts: dict[str, Callable[[], object]] = {}
        if name != self.session.robot:
            acts["Choose"] = lambda: self.session.choose(name)
        acts["Close" if name == self.opened else "View or edit"] = lambda: self._open(name)
        if self.session.is_file(name):
            acts["Remove"] = lambda: self.session.remove_robot(name)
        return acts

    def _open(self, name: str) -> None:
        self.opened = "" if name == self.opened else name
        self.page.changed(ROBOT)

    def _editor(self, name: str) -> None:
        """The text of a file, to be changed and kept under this name or another one."""
        text = ui.textarea(value=self.session.robot_text(name), label=f"File of {name}").classes("file")
        text.props("outlined autogrow input-class=code")
        saved = ui.input(
            "keep as", value=name if self.session.is_editable(name) else f"my-{name.removesuffix(ROBOT_SUFFIX)}.toml"
        ).classes("wide")
        trouble = ui.label().classes("text error-text")

        async def keep() -> str:
            self.opened = ""  # closed with what `keep_robot` changes
            words = await self.session.keep_robot(text.value or "", saved.value or "", name)
            self.opened = name if words else ""
            return words

        with ui.row().classes("line"):
            ui.button("Keep", on_click=self.page.busy(keep, trouble)).props("outline no-caps id=keep-robot")
            ui.label("Another name renames a file of yours; a preset and a fit stay as they are.").classes("text quiet")

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
            return await make_robot(self.session, name.value or "", options)

        ui.button("Make this robot", on_click=self.page.busy(make, trouble)).props("outline no-caps id=make-robot")
        ui.label("What is left empty is guessed, with a wide spread, and marked as a guess.").classes("text quiet")
