"""The section of a report that says at which voltage the identified robot starts to move."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from omnidyn.document import Points
from omnidyn.model.known.dead_zone import dead_zone
from omnidyn.model.robot import Robot
from omnidyn.report.figures.dead_zone_map import draw_dead_zone_map
from omnidyn.report.html import Section, content, paragraph


def dead_zone_section(robots: Mapping[str, Robot]) -> Section:
    """Volts and duty of each group's robot, with their intervals, and the map of all directions."""
    parts = [
        paragraph(f"{group}:") + _one(group, robot) if len(robots) > 1 else _one("", robot)
        for group, robot in robots.items()
    ]
    return Section("dead-zone", "Dead zone", "".join(parts))


def _one(group: str, robot: Robot) -> str:
    if robot.wheels.traction_mu is not None:
        return paragraph("Wheels may slip (traction_mu): at which voltage this robot starts to move is not worked out.")
    zone = dead_zone(robot)
    zone_map = draw_dead_zone_map({robot.name: robot}, {robot.name: zone})
    anchor = "".join(c if c.isalnum() or c in "-_." else "-" for c in f"{zone_map.name}{group}")
    return content(zone.table(), Points(zone.statements()), replace(zone_map, name=anchor))
