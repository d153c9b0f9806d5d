"""Friction against speed, along x, along y and about yaw, with the band that an estimate leaves it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from omnidyn.arrays import FloatArray
from omnidyn.identification.estimate import Estimate
from omnidyn.identification.friction_curve import FrictionCurve, friction_curve
from omnidyn.model.frames import AXES
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
) -> Picture:
    """One panel per axis: a line and its band for each name in `curves` (x, y, yaw each).

    driven: the speeds that the logs hold, shaded, of each axis. banded: whether the curves have bands to speak of.
    """
    drawn_curves = dict(list(curves.items())[: len(COLOURS)])
    with look():
        figure, panels = axis_panels(4.1, top=0.9, bottom=0.27)
        for axis, panel in enumerate(panels):
            of = [parts[axis] for parts in drawn_curves.values()]
            _panel(panel, axis, dict(zip(drawn_curves, of, strict=True)), driven[axis] if driven else None)
        handles, names = panels[0].get_legend_handles_labels()
        figure.legend(handles, names, loc="lower left", bbox_to_anchor=(0.065, 0.0), ncols=3, columnspacing=1.5)
        words = _caption(drawn_curves, bool(driven) and any(driven), banded)
        return picture(name, "Friction against speed", words, figure)


def _panel(axes: Axes, axis: int, curves: Mapping[str, FrictionCurve], driven: tuple[float, float] | None) -> None:
    if driven is not None:
        axes.axvspan(*driven, color=PALE, alpha=0.6, linewidth=0.0, zorder=0, label="speeds in the logs (middle 90 %)")
    for (name, curve), colour, line in zip(curves.items(), COLOURS, LINES, strict=False):
        for k, way in enumerate((curve.speed < 0.0, curve.speed > 0.0)):
            speed, force, half = curve.speed[way], curve.force[way], curve.half[way]
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
    reach = max(float(np.abs(curve.speed).max()) for curve in curves.values())
    axes.set_xlim(-reach, reach)
    guess = "" if any(curve.fitted for curve in curves.values()) else " (not fitted)"
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


def estimate_curves(estimate: Estimate) -> list[FrictionCurve]:
    """The curves of an estimate along x, along y and about yaw, up to the speeds that its robot can reach."""
    tops = top_speeds(estimate.robot)
    return [friction_curve(estimate, axis, speeds_up_to(float(top))) for axis, top in enumerate(tops)]


def draw_estimates(estimates: Mapping[str, Estimate], **options: Any) -> Picture:
    """Friction against speed of one estimate, or of the groups of one identification."""
    names = {name: estimate.robot.name if name == ONLY_GROUP else name for name, estimate in estimates.items()}
    return draw_friction_speed(
        {names[name]: estimate_curves(estimate) for name, estimate in estimates.items()}, **options
    )
