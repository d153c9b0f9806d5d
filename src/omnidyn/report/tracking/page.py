"""The report of `omnidyn track`: what the path asks for, how near each controller came, pictures, a moving one."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from typing import Any

from omnidyn.control.tracking import Tracking, trackings_document
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel
from omnidyn.report.html import Section, escaped, page, section
from omnidyn.report.tracking.animation import animation
from omnidyn.report.tracking.pictures import draw_tracking, draw_voltages
from omnidyn.statement import Statement


def render_tracking(
    found: Sequence[Tracking], robot: Robot, provenance: Mapping[str, Any], *, notes: Sequence[Statement] = ()
) -> str:
    """The page as HTML: it needs no other file. robot: that was driven. notes: what the path asks for."""
    told = trackings_document(found, notes)
    limit = per_wheel(robot.motor.voltage_limit, robot.wheels.count)
    sections = [
        section("controllers", "Controllers", told["controllers"]),
        section("tracking", "Path and errors", draw_tracking(found)),
        Section("moving", "In motion", _moving(found, robot)),
        section("voltages", "Voltages", draw_voltages(found, limit)),
        section("warnings", "Warnings", told["warnings"], none="None."),
    ]
    if notes:
        sections.insert(1, section("path", "What the path asks for", told["path"]))
    title = f"{found[0].plant} along {found[0].path}"
    introduction = (
        "A simulated robot, driven step by step. Errors are distances from where the path is at that time. Position "
        "and heading: root mean square; effort: that of a voltage; change: of a voltage from step to step."
    )
    return page(title, introduction, sections, provenance, verdict=told.verdict_text)


def _moving(found: Sequence[Tracking], robot: Robot) -> str:
    """The animation inside the page."""
    data = base64.b64encode(animation(found, robot)).decode()
    names = ", ".join(each.controller for each in found)
    words = "The dot is where the path is at that time. To scale, a large robot apart."
    image = f'<img alt="{escaped(f"{robot.name} driven by {names}")}" src="data:image/gif;base64,{data}">'
    return f'<figure id="animation"><div class="frame">{image}</div><figcaption>{escaped(words)}</figcaption></figure>'
