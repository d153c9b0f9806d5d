"""The picture of a program to drive: the room from above, the way in it, and where each move ends."""

from __future__ import annotations

import numpy as np

from omnidyn.driving.program import DriveProgram
from omnidyn.report.figures.tracking import COLOURS
from omnidyn.report.style import GREY, INK, Picture, look, new_figure, picture, thin_out

MOST_POINTS, SAME_PLACE = 6000, 0.04  # [m] between two ends that share a label
SIZE = (6.2, 4.2)


def draw_program(program: DriveProgram) -> Picture:
    """Way, ends of the moves with their numbers, border."""
    pose = np.asarray(program.predicted.pose)
    kept = np.unique(np.linspace(0, len(pose) - 1, MOST_POINTS).astype(int))
    half = 0.5 * np.array(program.area)
    with look():
        figure = new_figure(*SIZE)
        plane = figure.add_axes((0.11, 0.14, 0.86, 0.83))
        plane.plot(*(np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]]) * half).T, color=GREY, linewidth=3.0)
        plane.plot(*pose[kept, :2].T, color=COLOURS[0], linewidth=1.0)
        plane.plot(0.0, 0.0, marker="o", markersize=9, markerfacecolor="none", color=INK)
        plane.annotate("", (0.16 * half[0], 0.0), (0.0, 0.0), arrowprops={"arrowstyle": "->", "color": INK})
        for place, label in _labels(program):
            plane.plot(*place, marker=".", color=INK)
            plane.annotate(label, place, xytext=(4, 4), textcoords="offset points", fontsize=8, color=INK)
        plane.set_aspect("equal", adjustable="datalim")
        plane.set_xlabel("x, m")
        plane.set_ylabel("y, m")
        thin_out(plane, 7, 7)
        caption = (
            "The room (grey) and the way in it, from above; a ring and an arrow are the start. Numbers are moves: each "
            "stands where its move ends; those that end at the start are left out."
        )
        return picture("drive", f"A drive for {program.robot.name}", caption, figure)


def _labels(program: DriveProgram) -> list[tuple[tuple[float, float], str]]:
    """Where moves end, away from the start, and which: "7, 13"."""
    places: list[tuple[tuple[float, float], list[str]]] = []
    for k, leg in enumerate(program.legs, 1):
        x, y = leg.pose[:2]
        if np.hypot(x, y) < 2.0 * SAME_PLACE:
            continue
        near = next((found for found in places if np.hypot(found[0][0] - x, found[0][1] - y) < SAME_PLACE), None)
        if near is None:
            places.append(((x, y), [str(k)]))
        else:
            near[1].append(str(k))
    return [(place, ", ".join(numbers)) for place, numbers in places]
