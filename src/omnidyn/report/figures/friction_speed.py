"""Friction against speed, along x, along y and about yaw, with the band that an estimate leaves it and its data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.identification.estimate import Estimate
from omnidyn.identification.friction_curve import FrictionCurve, friction_curve
from omnidyn.logs.steady_table import SteadyTable
from omnidyn.model.frames import AXES
from omnidyn.model.robot import Robot
from omnidyn.model.sliding import top_speeds
from omnidyn.report.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    PALE,
    PURPLE,
    VERMILLION,
    Picture,
    axis_panels,
    look,
    picture,
    thin_out,
)

COLOURS, LINES = (BLUE, VERMILLION, GREEN, PURPLE), ("-", "--", "-.", (0, (1, 1)))
SPEED_UNIT, FORCE_UNIT = ("m/s", "m/s", "rad/s"), ("N", "N", "N m")
ALONG = ("along x", "along y", "about yaw")
POINTS = 40  # of each side of a curve
MARKS = ("o", "s", "^", "D")
MOST_MARKED = 300  # points of one panel that are drawn with a rim
ROOM = 1.12  # beyond the fastest point
SIDEWAYS_SHARE = 0.1  # of the rim speed: a point with more of it on other axes is not on the curve of one axis


def speeds_up_to(top: float) -> FloatArray:
    """Speeds at which a curve is drawn: both ways, none of them 0."""
    side = np.linspace(1e-6, 1.0, POINTS) * top
    return np.concatenate([-side[::-1], side])


def draw_friction_speed(
    curves: Mapping[str, Sequence[FrictionCurve]],
    driven: Sequence[tuple[float, float] | None] = (),
    name: str = "friction_speed",
    *,
    banded: bool = True,
    points: Mapping[str, Sequence[AxisPoints]] | None = None,
) -> Picture:
    """One panel per axis: a line and its band for each name in `curves` (x, y, yaw each).

    Args:
        curves: name -> x, y, yaw.
        driven: the speeds that the logs hold, shaded, of each axis.
        name: of the picture.
        banded: whether the curves have bands to speak of.
        points: name -> the points at constant speed that its curves were fitted to, x, y, yaw.
    """
    points = points or {}
    drawn_curves = dict(list(curves.items())[: len(COLOURS)])
    with look():
        figure, panels = axis_panels(4.1, top=0.9, bottom=0.27)
        for axis, panel in enumerate(panels):
            of = [parts[axis] for parts in drawn_curves.values()]
            _panel(panel, axis, dict(zip(drawn_curves, of, strict=True)), driven[axis] if driven else None)
            for name_of, mark, colour in zip(drawn_curves, MARKS, COLOURS, strict=False):
                if name_of in points:
                    _mark(panel, points[name_of][axis], mark, INK if len(drawn_curves) == 1 else colour)
        handles: dict[str, Any] = {}
        for panel in panels:
            for handle, words in zip(*panel.get_legend_handles_labels(), strict=True):
                handles.setdefault(words, handle)
        place = {"loc": "lower left", "bbox_to_anchor": (0.065, 0.0), "ncols": 3, "columnspacing": 1.5}
        figure.legend(handles.values(), handles.keys(), **place)
        words = _caption(drawn_curves, bool(driven) and any(driven), banded) + _points_caption(points)
        return picture(name, "Friction against speed", words, figure)


def _panel(axes: Axes, axis: int, curves: Mapping[str, FrictionCurve], driven: tuple[float, float] | None) -> None:
    if driven is not None:
        axes.axvspan(*driven, color=PALE, alpha=0.6, linewidth=0.0, zorder=0, label="speeds in the logs (middle 90 %)")
    for (name, curve), colour, line in zip(curves.items(), COLOURS, LINES, strict=False):
        sides = [side for side in (curve.speed < 0.0, curve.speed > 0.0) if side.any()]
        for k, direction in enumerate(sides):
            speed, force, half = curve.speed[direction], curve.force[direction], curve.half[direction]
            if half.any():
                axes.fill_between(
                    speed,
                    force - half,
                    force + half,
                    color=colour,
                    alpha=0.22,
                    linewidth=0.0,
                    label="95 % band" if k == 0 and colour == COLOURS[0] else None,
                )
            style: dict[str, Any] = (
                {"linestyle": line, "color": colour} if curve.fitted else {"linestyle": ":", "color": GREY}
            )
            axes.plot(speed, force, label=name if k == 0 else None, **style)
    axes.axhline(0.0, color=INK, linewidth=0.6)
    axes.axvline(0.0, color=INK, linewidth=0.6)
    axes.set_xlim(min(curve.speed[0] for curve in curves.values()), max(curve.speed[-1] for curve in curves.values()))
    guess = "" if any(curve.fitted for curve in curves.values()) else ", not fitted"
    axes.set_title(f"{ALONG[axis]}: {FORCE_UNIT[axis]}{guess}")
    axes.set_xlabel(f"speed, {SPEED_UNIT[axis]}")
    thin_out(axes, 5, 6)


def _caption(curves: Mapping[str, Sequence[FrictionCurve]], driven: bool, banded: bool) -> str:
    unknown = list(dict.fromkeys(name for parts in curves.values() for curve in parts for name in curve.unknown))
    band = (
        " The band is the 95 % interval that the errors of the fitted levels and their correlations leave, at each "
        "speed by itself."
        if banded
        else ""
    )
    remark = f" Not determined by the data, and not in the band: {', '.join(unknown)}." if unknown else ""
    guessed = [curve.axis for parts in list(curves.values())[:1] for curve in parts if not curve.fitted]
    if guessed:
        verb = "was" if len(guessed) == 1 else "were"
        remark += f" Dotted: {' and '.join(guessed)} {verb} not fitted, the line is that of the robot file."
    range_words = " Beyond the grey speeds the line is the law, not the data." if driven else ""
    return (
        f"What friction takes from a robot that moves along {AXES[0]}, along {AXES[1]}, or turns about {AXES[2]}; at "
        f"speed 0 it holds anything up to the jump.{band}{remark}{range_words}"
    )


# The friction of an estimate against speed, or of the groups of one identification

ONLY_GROUP = "all"  # the name of the one group where there are no groups


@dataclass(frozen=True, eq=False)
class AxisPoints:
    """Points at constant speed along or about one axis. speed [m/s, yaw rad/s], force [N, yaw N m], shape (n,) each.

    force_std: of the force, same unit; None where it is not known. left_out: how many move along other axes too, where
    the force along this one is not that of this speed alone.
    """

    speed: FloatArray
    force: FloatArray
    force_std: FloatArray | None
    left_out: int


def axis_points(estimate: Estimate) -> list[AxisPoints]:
    """The points that an estimate was fitted to, along x, along y and about yaw; none for a fit to whole logs."""
    if estimate.points is None:
        return []
    table = estimate.points
    along_one = np.ones(len(table), bool) if estimate.robot.friction.only_axes else _along_one(table, estimate.robot)
    parts = []
    for axis in range(len(AXES)):
        of_axis = table.axis_index == axis
        rows = of_axis & along_one
        std = None if table.force_std is None else table.force_std[rows]
        parts.append(AxisPoints(table.speed[rows], table.force[rows], std, int((of_axis & ~rows).sum())))
    return parts


def _along_one(table: SteadyTable, robot: Robot) -> BoolArray:
    """Which points move along or about their own axis alone. Shape (points,)."""
    rims = np.abs(table.twists) * [1.0, 1.0, float(np.mean(robot.wheels.robot_radius))]
    return rims.sum(axis=1) - rims[np.arange(len(table)), table.axis_index] <= SIDEWAYS_SHARE * rims.max(axis=1)


def estimate_curves(estimate: Estimate) -> list[FrictionCurve]:
    """The curves of an estimate along x, along y and about yaw, as far as its points reach, else as its robot can."""
    curves, parts = [], axis_points(estimate)
    for axis, top in enumerate(top_speeds(estimate.robot)):
        speed = parts[axis].speed if parts else np.empty(0)
        speeds = speeds_up_to(ROOM * float(np.abs(speed).max()) if speed.any() else float(top))
        ways_driven = speed.any() and (speed >= 0.0).all()
        curves.append(friction_curve(estimate, axis, speeds[speeds > 0.0] if ways_driven else speeds))
    return curves


def _mark(axes: Axes, points: AxisPoints, mark: str, colour: str) -> None:
    """Points in motion, filled, and at rest, hollow, where they show what friction can hold."""
    rest = points.speed == 0.0
    many = len(points.speed) > MOST_MARKED
    style: dict[str, Any] = {"linestyle": "", "color": colour, "markersize": 3.0 if many else 6.0, "zorder": 5}
    style |= {"alpha": 0.5, "markeredgewidth": 0.0} if many else {}
    for rows, words, more in (
        (~rest, "steady points", {}),
        (rest, "at rest", {"markerfacecolor": "white", "clip_on": False}),
    ):
        if rows.any():
            std = None if points.force_std is None else 2.0 * points.force_std[rows]
            axes.errorbar(
                points.speed[rows], points.force[rows], std, fmt=mark, capsize=3, label=words, **style, **more
            )
    if points.speed.any() and (points.speed >= 0.0).all() and (points.force >= 0.0).all():
        axes.set_xlim(left=0.0)
        axes.set_ylim(0.0, max(1.25 * float(points.force.max()), axes.get_ylim()[1]))


def _points_caption(points: Mapping[str, Sequence[AxisPoints]]) -> str:
    """What the marks are."""
    parts = [part for group in points.values() for part in group]
    if not parts:
        return ""
    words = " Marks: the points at constant speed that the lines were fitted to."
    if any((part.speed == 0.0).any() for part in parts):
        words += " A robot at rest only shows that friction can hold that force: hollow."
    if any(part.force_std is not None for part in parts):
        words += " Bars: two standard deviations."
    count = sum(part.left_out for part in parts)
    return words + (f" Not drawn: {count} that move along several axes at once." if count else "")


def draw_estimates(estimates: Mapping[str, Estimate], **options: Any) -> Picture:
    """Friction against speed of one estimate, or of the groups of one identification."""
    names = {name: estimate.robot.name if name == ONLY_GROUP else name for name, estimate in estimates.items()}
    curves = {names[name]: estimate_curves(estimate) for name, estimate in estimates.items()}
    points = {names[name]: axis_points(estimate) for name, estimate in estimates.items() if estimate.points is not None}
    return draw_friction_speed(curves, points=points, **options)
