"""The force of the motors at constant speed over the direction of travel, and the shapes of friction through it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.projections.polar import PolarAxes

from omnidyn.arrays import FloatArray
from omnidyn.document import sentence
from omnidyn.identification.steady.operating_points import SPEEDS, ForcePoints
from omnidyn.identification.steady.shapes import SHAPES
from omnidyn.identification.steady.study_table import SteadyStudy
from omnidyn.model.keys import Key
from omnidyn.model.layout import YAW
from omnidyn.report.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    WIDTH,
    Picture,
    around_robot,
    look,
    new_figure,
    picture,
    thin_out,
)

GROUP_COLOURS, GROUP_MARKS = (BLUE, VERMILLION, GREEN, PURPLE), ("o", "s", "^", "D")
MARKS: dict[str, Any] = {"markersize": 3.5, "alpha": 0.55, "markeredgewidth": 0}  # of points that were measured
LINES = ("-", "--", "-.", (0, (1, 1)))
COMPARED = {"box": (ORANGE, ":"), "wheel": (SKY, "-.")}
MAX_GROUPS, MAX_SHAPES = 4, 12
STEP_DEG = 1.0


def shape_pictures(study: SteadyStudy) -> list[Picture]:
    """All pictures of a study, in the order in which one reads them."""
    return [draw_scores(study), draw_polar(study), draw_components(study)]


def draw_scores(study: SteadyStudy) -> Picture:
    """Left-out error of every shape, with its standard error; the chosen one stands out."""
    scores = study.choice.scores[:MAX_SHAPES][::-1]
    with look():
        figure = new_figure(WIDTH, 1.1 + 0.33 * len(scores))
        height = 1.1 + 0.33 * len(scores)
        axes = figure.add_axes((0.27, 0.62 / height, 0.70, 1.0 - 0.72 / height))
        for row, score in enumerate(scores):
            is_choice = score.name == study.choice.chosen
            colour = BLUE if is_choice else INK if score.in_model else GREY
            axes.errorbar(
                score.loo,
                row,
                xerr=2.0 * score.loo_std,
                fmt="o" if score.in_model else "D",
                color=colour,
                markersize=8 if is_choice else 6,
                capsize=3,
                markerfacecolor=colour if score.in_model else "white",
            )
        axes.set_yticks(range(len(scores)), [_score_label(study, score.name) for score in scores])
        axes.set_xlim(left=0.0)
        axes.set_ylim(-0.6, len(scores) - 0.4)
        axes.set_xlabel("force error in a direction left out, N (bars: two standard errors)")
        axes.grid(axis="y", visible=False)
        return picture(
            "shape_errors",
            "Which shape predicts the force in a direction it has not seen",
            _scores_words(study),
            figure,
        )


def _score_label(study: SteadyStudy, name: str) -> str:
    return f"{name}  (chosen)" if name == study.choice.chosen else name


def _scores_words(study: SteadyStudy) -> str:
    return (
        "Each shape of friction is fitted to all other directions and asked for the force vector in the one left out: "
        "root mean square over all points. Diamonds are shapes that a robot file cannot hold, drawn to compare. "
        f"{sentence(str(study.statements[0]))}"
    )


def draw_polar(study: SteadyStudy) -> Picture:
    """Force along travel over the direction: a mark per point, a line per group of the chosen shape."""
    groups = study.points.groups[:MAX_GROUPS]
    with look():
        figure = new_figure(WIDTH, 5.2)
        axes = cast(PolarAxes, figure.add_axes((0.06, 0.06, 0.56, 0.84), projection="polar"))
        top = 0.0
        for group, colour, mark, line in zip(groups, GROUP_COLOURS, GROUP_MARKS, LINES, strict=False):
            group_points = _of(study.points, group)
            name = "measured" if group == "all" else group
            directions = np.arctan2(group_points.twist[:, 1], group_points.twist[:, 0])
            axes.plot(directions, group_points.along, mark, color=colour, label=name, **MARKS)
            directions, curve = _curve(study, group, study.choice.of(group), group_points)
            axes.plot(
                np.radians(directions),
                _along(directions, curve),
                color=colour,
                linestyle=line,
                linewidth=2.2,  # type: ignore[arg-type]
                label=study.choice.of(group) + ("" if group == "all" else f", {group}"),
            )
            top = max(top, float(np.nanmax(group_points.along, initial=0.0)))
        _compared(study, axes, groups[0])
        around_robot(axes, top)
        figure.legend(*axes.get_legend_handles_labels(), loc="center left", bbox_to_anchor=(0.68, 0.5))
        figure.text(0.02, 0.95, "force along travel, N", fontsize=11.5)
        return picture("force_polar", "Force along travel, over the direction of travel", _polar_words(study), figure)


def _compared(study: SteadyStudy, axes: PolarAxes, group: str) -> None:
    """The box of the paper and the wheels, of the first group, to compare."""
    for name, (colour, line) in COMPARED.items():
        if name in study.choice.fits and name != study.choice.of(group):
            directions, curve = _curve(study, group, name, _of(study.points, group))
            axes.plot(
                np.radians(directions),
                _along(directions, curve),
                color=colour,
                linestyle=line,
                linewidth=1.5,
                label=name,
            )


def _polar_words(study: SteadyStudy) -> str:
    return (
        "What it takes to keep the robot moving at constant speed, seen from above: forward is up, left is left. "
        f"Marks: one run and command each, direction from the {SPEEDS[study.points.speed_from]}. Lines: fitted shapes; "
        "a box or friction at the wheels has corners, friction along the direction of travel has none."
    )


def draw_components(study: SteadyStudy) -> Picture:
    """Both components of the force over the direction, with the chosen shape and the box."""
    groups = study.points.groups[:MAX_GROUPS]
    with look():
        figure = new_figure(WIDTH, 4.6)
        panels = figure.subplots(1, 2)
        figure.subplots_adjust(left=0.075, right=0.985, top=0.92, bottom=0.3, wspace=0.24)
        for component, panel in enumerate(panels):
            for k, group in enumerate(groups):
                _component(study, panel, component, group, k)
            panel.set_title(f"force along {'xy'[component]}, N")
            panel.set_xlabel("direction of travel, degree")
            panel.set_xticks(range(-180, 181, 90))
            thin_out(panel, None, 6)
        handles, names = panels[0].get_legend_handles_labels()
        figure.legend(handles, names, loc="lower left", bbox_to_anchor=(0.065, 0.0), ncols=3, columnspacing=1.5)
        return picture(
            "force_components",
            "Both components of the force",
            "The same points, as components along the body axes "
            "(x forward, y left), over the direction of travel (90 degrees is left). The line is the chosen shape; the "
            "dotted one is the box of the paper, which jumps where an axis changes its sign.",
            figure,
        )


def _component(study: SteadyStudy, panel: Axes, component: int, group: str, number: int) -> None:
    group_points = _of(study.points, group)
    colour = GROUP_COLOURS[number]
    directions = np.degrees(np.arctan2(group_points.twist[:, 1], group_points.twist[:, 0]))
    name = "measured" if group == "all" else group
    panel.plot(directions, group_points.wrench[:, component], GROUP_MARKS[number], color=colour, label=name, **MARKS)
    angles, curve = _curve(study, group, study.choice.of(group), group_points)
    label = study.choice.of(group) + ("" if group == "all" else f", {group}")
    panel.plot(angles, curve[:, component], color=colour, linestyle=LINES[number], label=label)  # type: ignore[arg-type]
    if number == 0 and "box" in study.choice.fits and study.choice.of(group) != "box":
        angles, curve = _curve(study, group, "box", group_points)
        panel.plot(angles, curve[:, component], ":", color=ORANGE, linewidth=1.6, label="box (the paper)")


def _curve(study: SteadyStudy, group: str, name: str, group_points: ForcePoints) -> tuple[FloatArray, FloatArray]:
    """(direction [degree], driving wrench) of a fitted shape at the middle speed of the group, without turning."""
    fit = study.choice.fits[name][group]
    directions = np.arange(-180.0, 180.0 + STEP_DEG, STEP_DEG) + 0.01  # beside the corners, not on them
    speed = float(np.median(group_points.speed))
    angle = np.radians(directions)
    twist = speed * np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    empty = np.zeros(len(directions))
    points = replace(
        group_points,
        twist=twist,
        still=empty,
        wrench=np.zeros((len(directions), 3)),
        wrench_std=np.zeros((len(directions), 3)),
        traction=np.zeros((len(directions), group_points.traction.shape[1])),
        direction=directions,
        travels=empty == 0.0,
        turns=empty > 0.0,
        group=(group,) * len(directions),
        run=empty.astype(np.int64),
        rows=empty.astype(np.int64),
    )
    turning = any(Key.parse(key).axis == YAW for key in fit.keys)
    return directions, SHAPES[name].force(study.robot, points, turning, fit.level)


def _along(directions: FloatArray, wrench: FloatArray) -> FloatArray:
    angle = np.radians(directions)
    return wrench[:, 0] * np.cos(angle) + wrench[:, 1] * np.sin(angle)


def _of(points: ForcePoints, group: str) -> ForcePoints:
    in_group = np.array([name == group for name in points.group])
    return points.chosen(in_group & points.travels if (in_group & points.travels).any() else in_group)
