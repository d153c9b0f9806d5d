"""The dead zone over the direction of travel: how much it takes to set a robot at rest in motion, whichever way."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import cast

import numpy as np
from matplotlib.projections.polar import PolarAxes

from omnidyn.arrays import FloatArray
from omnidyn.model.deadzone import dead_zone_force, dead_zone_map
from omnidyn.model.known.dead_zone import DeadZone
from omnidyn.model.robot import Robot
from omnidyn.report.style import (
    BLUE,
    GREEN,
    PURPLE,
    VERMILLION,
    WIDTH,
    Picture,
    around_robot,
    look,
    new_figure,
    picture,
)

STEP_DEG = 1.0
NOTHING: Mapping[str, DeadZone] = MappingProxyType({})
COLOURS, LINES = (BLUE, VERMILLION, GREEN, PURPLE), ("-", "--", "-.", (0, (1, 1)))
AROUND = {
    0.0: "x\nforward",
    45.0: "45°",
    90.0: "y\nleft",
    135.0: "135°",
    180.0: "180°",
    225.0: "-135°",
    270.0: "-90°",
    315.0: "-45°",
}


def draw_dead_zone_map(robots: Mapping[str, Robot], zones: Mapping[str, DeadZone] = NOTHING) -> Picture:
    """One closed line per robot (name -> robot, at most four): voltage on the left, force on the right.

    One robot alone is filled: inside it stays exactly at rest. zones: name -> DeadZone, whose 95 % interval of the
    voltage is drawn as a band.
    """
    if not 1 <= len(robots) <= len(COLOURS):
        raise ValueError(f"{len(robots)} robots; expected 1 to {len(COLOURS)}")
    directions = np.radians(np.arange(0.0, 360.0 + STEP_DEG, STEP_DEG))
    with look():
        figure = new_figure(WIDTH, 5.1)
        places = ((0.07, 0.15, 0.39, 0.612), (0.555, 0.15, 0.39, 0.612))
        left, right = (cast(PolarAxes, figure.add_axes(place, projection="polar")) for place in places)
        for (name, robot), colour, line in zip(robots.items(), COLOURS, LINES, strict=False):
            volts, force = dead_zone_map(robot, directions)[0], dead_zone_force(robot, directions)
            for axes, level in ((left, volts), (right, force)):
                _closed_line(axes, directions, level, colour, line, name, fill=len(robots) == 1)
            if name in zones:
                _band(left, zones[name], colour)
        for axes, words in ((left, "voltage of the most loaded motor, V"), (right, "push of the motors, N")):
            axes.tick_params(axis="x", pad=4)
            around_robot(axes, axes.get_ylim()[1], AROUND, 1.06)
            figure.text(axes.get_position().x0 - 0.05, 0.94, words, fontsize=11.5)
        handles, names = left.get_legend_handles_labels()
        figure.legend(handles, names, loc="lower center", ncols=len(names), bbox_to_anchor=(0.5, 0.0))
        return picture("dead_zone_map", "The dead zone over the direction of travel", _caption(robots, zones), figure)


def _closed_line(
    axes: PolarAxes, directions: FloatArray, level: FloatArray, colour: str, line: object, name: str, fill: bool
) -> None:
    """The level over the direction; a gap where no voltage moves the robot."""
    level = np.where(np.isfinite(level), level, np.nan)
    if fill:
        axes.fill(directions, np.nan_to_num(level), color=colour, alpha=0.12, linewidth=0)
    axes.plot(directions, level, color=colour, linestyle=line, label=name)  # type: ignore[arg-type]


def _band(axes: PolarAxes, zone: DeadZone, colour: str) -> None:
    """The 95 % interval of the voltage, all around; a gap where the robot may never move."""
    if zone.band is None:
        return
    around = np.append(zone.directions, zone.directions[0] + 2.0 * np.pi)
    low, high = (np.append(end, end[0]) for end in zone.band)
    axes.fill_between(
        around, low, high, where=np.isfinite(high).tolist(), color=colour, alpha=0.28, linewidth=0, label="95 %"
    )


def _caption(robots: Mapping[str, Robot], zones: Mapping[str, DeadZone]) -> str:
    has_band = any(zone.band is not None for zone in zones.values())
    band = " Band: 95 % interval, from the std of the robot file." if has_band else ""
    subject = next(iter(robots.values())).name if len(robots) == 1 else "each robot"
    return (
        f"How hard it is to set {subject} in motion from rest, over the direction of travel: the voltage of the most "
        "loaded motor (left) and the push of the motors (right) at which it starts to move. Below that it stays "
        f"exactly at rest. The voltages push along the direction, without a torque.{band}"
    )
