"""Fig. 5: a slow voltage ramp on each axis, through the dead zone."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.axes import Axes

from omnidyn.model.frames import AXES
from omnidyn.paper.experiments import Ramp
from omnidyn.paper.tables import SPEED_UNIT
from omnidyn.report.style import (
    AXIS_COLOUR,
    INK,
    PALE,
    Picture,
    axis_panels,
    axis_title,
    dress_panel,
    look,
    note,
    picture,
)

SAMPLE_STRIDE = 10  # a ramp has far more samples than a page has dots


def draw_dead_zone(ramps: Mapping[str, Ramp]) -> Picture:
    """Speed against voltage; the stuck region shaded, its end in the model and in the paper's words."""
    with look():
        figure, panels = axis_panels(3.8, top=0.85, bottom=0.17)
        for axis, panel in zip(AXES, panels, strict=True):
            _panel(panel, axis, ramps[axis])
        return picture("fig5_dead_zone", "Fig. 5: the dead zone", _caption(ramps), figure)


def _caption(ramps: Mapping[str, Ramp]) -> str:
    ours = ", ".join(f"{ramps[axis].breakaway_voltage:.3f}" for axis in AXES)
    printed = ", ".join(f"{ramps[axis].printed_voltage:g}" for axis in AXES)
    return (
        "A ramp of voltage along x, y and yaw, simulated. Shaded: the robot stays exactly at rest. "
        f"The model moves beyond {ours} V; the paper says about {printed} V."
    )


def _panel(axes: Axes, axis: str, ramp: Ramp) -> None:
    twist = ramp.run.twist
    assert twist is not None
    speed = twist[:, AXES.index(axis)]
    ours, printed, top = ramp.breakaway_voltage, ramp.printed_voltage, float(speed.max())
    axes.axvspan(0.0, ours, color=PALE, linewidth=0)
    axes.plot(ramp.scale[::SAMPLE_STRIDE], speed[::SAMPLE_STRIDE], color=AXIS_COLOUR[axis])
    axes.axvline(printed, color=INK, linestyle=":", linewidth=1.6)
    note(axes, 0.5 * ours, 0.55 * top, f"at rest\nup to\n{ours:.3f} V", ha="center", va="center", bbox=None)
    note(
        axes,
        printed,
        1.01,
        f"paper: about {printed:g} V",
        ha="center",
        va="bottom",
        transform=axes.get_xaxis_transform(),
    )
    axes.set_ylim(-0.02 * top, 1.05 * top)
    title = f"{axis_title(axis)}: speed, {SPEED_UNIT[axis]}"
    dress_panel(axes, title, "voltage, V", float(ramp.scale.max()), steps=5, pad=22)
