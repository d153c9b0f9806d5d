"""The report of `omnidyn track`: what the path asks for, how near each controller came, pictures, a moving one."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from typing import Any

from omnidyn.control.tracking import Tracking, trackings_document
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel
from omnidyn.report.figures.moving import moving_picture
from omnidyn.report.figures.tracking import draw_tracking, draw_voltages
from omnidyn.report.html import Section, escaped, page, section
from omnidyn.statement import Statement


def animation(trackings: Sequence[Tracking], robot: Robot) -> bytes:
    """The bytes of a GIF: the path, each controller's robot on it, and a dot where the path is."""
    wanted = trackings[0].wanted[:, :2]
    poses = {tracking.controller: tracking.run.pose for tracking in trackings if tracking.run.pose is not None}
    return moving_picture(robot, trackings[0].run.t, poses, wanted, wanted)


def render_tracking(
    trackings: Sequence[Tracking], robot: Robot, provenance: Mapping[str, Any], *, notes: Sequence[Statement] = ()
) -> str:
    """The page as HTML: it needs no other file. robot: that was driven. notes: what the path asks for."""
    document = trackings_document(trackings, notes)
    limit = per_wheel(robot.motor.voltage_limit, robot.wheels.count)
    sections = [
        section("controllers", "Controllers", document["controllers"]),
        section("tracking", "Path and errors", draw_tracking(trackings)),
        Section("moving", "In motion", _moving(trackings, robot)),
        section("voltages", "Voltages", draw_voltages(trackings, limit)),
        section("warnings", "Warnings", document["warnings"], none="None."),
    ]
    if notes:
        sections.insert(1, section("path", "What the path asks for", document["path"]))
    title = f"{trackings[0].plant} along {trackings[0].path}"
    introduction = (
        "A simulated robot, driven step by step. Errors are distances from where the path is at that time. Position "
        "and heading: root mean square; effort: that of a voltage; change: of a voltage from step to step."
    )
    return page(title, introduction, sections, provenance, verdict=document.verdict_text)


def _moving(trackings: Sequence[Tracking], robot: Robot) -> str:
    """The animation inside the page."""
    data = base64.b64encode(animation(trackings, robot)).decode()
    names = ", ".join(tracking.controller for tracking in trackings)
    words = "The dot is where the path is at that time. To scale."
    image = f'<img alt="{escaped(f"{robot.name} driven by {names}")}" src="data:image/gif;base64,{data}">'
    return f'<figure id="animation"><div class="frame">{image}</div><figcaption>{escaped(words)}</figcaption></figure>'
