"""What friction does near zero speed: force against speed, presliding loop, breakaway against rate."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from omnidyn.report.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    PURPLE,
    VERMILLION,
    Picture,
    axis_panels,
    log_scale,
    look,
    picture,
    thin_out,
)
from omnidyn.simulation.friction_study import FrictionStudy

COLOURS, LINES = (BLUE, VERMILLION, GREEN, PURPLE, GREY), ("-", "--", "-.", (0, (1, 1)), (0, (4, 1, 1, 1)))
SLOW_SHARE = 0.15  # of the top speed: the part of a curve that is shown


def draw_friction(studies: Mapping[str, FrictionStudy], axis: int = 0) -> Picture:
    """Three panels for one axis of each robot: force against speed, a presliding loop, breakaway against rate."""
    with look():
        figure, panels = axis_panels(4.1, top=0.9, bottom=0.27)
        for (name, study), colour, line in zip(studies.items(), COLOURS, LINES, strict=False):
            curves = study.axes[axis]
            slow = np.abs(curves.speed) <= SLOW_SHARE * curves.speed.max()
            for k, side in enumerate((curves.speed < 0.0, curves.speed > 0.0)):
                rows, label = slow & side, name if k == 0 else None
                panels[0].plot(curves.speed[rows], curves.force[rows], color=colour, linestyle=line, label=label)
            panels[0].plot([0.0, 0.0], [-curves.holds[1], curves.holds[0]], color=colour, linestyle=line)
            milli = 1e3
            if curves.bends > 0.0:
                panels[1].plot(curves.travel * milli, curves.loop, color=colour, linestyle=line)
            else:
                panels[1].plot([0.0, 0.0], [-curves.holds[1], curves.holds[0]], color=colour, linestyle=line)
            panels[2].plot(curves.rate, curves.breakaway, color=colour, linestyle=line, marker=".")
        unit = next(iter(studies.values())).axes[axis].unit
        speed, distance = ("rad/s", "mrad") if unit == "N m" else ("m/s", "mm")
        for panel, title, below in zip(
            panels,
            (f"force: {unit}", f"slow loop: {unit}", f"breakaway: {unit}"),
            (f"speed, {speed}", f"way, {distance}", f"rate of the force, {unit}/s"),
            strict=True,
        ):
            panel.set_title(title)
            panel.set_xlabel(below)
        log_scale(panels[2], "x")
        for panel in panels[:2]:
            panel.axhline(0.0, color=INK, linewidth=0.6)
            panel.axvline(0.0, color=INK, linewidth=0.6)
            thin_out(panel, 3, 6)
        handles, names = panels[0].get_legend_handles_labels()
        figure.legend(handles, names, loc="lower left", bbox_to_anchor=(0.065, 0.0), ncols=3, columnspacing=1.5)
        along = ("along x", "along y", "about yaw")[axis]
        words = (
            f"Friction {along}: in motion (left; at speed 0 anything up to the vertical line), on a slow way there and "
            "back (middle; a vertical line holds without moving), and the most that resists a force that rises so "
            "fast (right)."
        )
        return picture("friction", "What friction does near zero speed", words, figure)
