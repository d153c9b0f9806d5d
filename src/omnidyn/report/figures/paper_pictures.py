"""The figures of the paper as far as they can be made from its numbers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes

from omnidyn.arrays import FloatArray
from omnidyn.identification.estimate import Estimate
from omnidyn.identification.steady.line import confidence_band
from omnidyn.identification.steady.steady_state import fit_steady_state
from omnidyn.model.frames import AXES
from omnidyn.model.robot import Robot
from omnidyn.paper.experiments import Ramp, StepResponse, dead_zone_ramps, step_responses, table1_runs
from omnidyn.paper.friction import table_1_points
from omnidyn.paper.reconcile import Reconciliation, reconciliations
from omnidyn.paper.tables import FORCE_UNIT, SPEED_UNIT, TABLE_1, TABLE_2_COULOMB, TABLE_2_VISCOUS
from omnidyn.report.figures.robot import draw_robot
from omnidyn.report.style import (
    AXIS_COLOUR,
    BLUE,
    GREY,
    INK,
    LEVEL_COLOURS,
    LEVEL_LINES,
    MEASURED,
    PALE,
    VERMILLION,
    WIDTH,
    Picture,
    axis_panels,
    axis_title,
    dress_panel,
    look,
    new_figure,
    note,
    picture,
    thin_out,
)
from omnidyn.run import Run


def paper_pictures(robot: Robot) -> Iterator[Picture]:
    """Figs. 1 to 5 for this robot beside the numbers of the paper, and what would reconcile the two."""
    yield draw_robot(robot)
    yield draw_traces(table1_runs(robot))
    points = table_1_points()
    yield draw_friction({rest: fit_steady_state(robot, points, rest_use=rest) for rest in TREATMENTS})
    yield draw_steps(step_responses(robot))
    yield draw_dead_zone(dead_zone_ramps(robot))
    yield draw_reconciliation(reconciliations(robot))


# Fig. 5: a slow voltage ramp on each axis, through the dead zone

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


# Fig. 3: force against steady speed, and the friction lines that one can draw through four points

TREATMENTS = {
    "line": (BLUE, "-", "fit to all four rows (the paper), 95 % band"),
    "bound": (VERMILLION, "--", "fit to the three moving rows, 95 % band"),
}


def draw_friction(estimates: Mapping[str, Estimate]) -> Picture:
    """One panel per axis; `estimates` by the treatment of the row at rest, "line" and "bound"."""
    with look():
        figure, panels = axis_panels(4.6, top=0.92, bottom=0.33)
        for k, panel in enumerate(panels):
            _friction_panel(panel, k, estimates)
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="lower left", bbox_to_anchor=(0.065, 0.0), ncols=2, columnspacing=1.5)
        return picture("fig3_friction", "Fig. 3: friction from steady speeds", _friction_caption(), figure)


def _friction_caption() -> str:
    return (
        "Force against steady speed: the rows of Table 1, the line through all four rows (as the paper does), "
        "the line through the three moving rows, each with its 95 % confidence band, and the line printed in "
        "Table 2. A robot at rest only shows that friction can hold that force: its row is a lower bound of "
        "breakaway, not a point of the line."
    )


def _friction_panel(axes: Axes, axis: int, estimates: Mapping[str, Estimate]) -> None:
    rows = TABLE_1[AXES[axis]]
    speed, force = np.array([row.speed for row in rows]), np.array([row.force for row in rows])
    span = np.linspace(0.0, 1.12 * speed.max(), 60)
    for rest, (colour, line, words) in TREATMENTS.items():
        _fit(axes, axis, estimates[rest], span, colour, line, words)
    printed = TABLE_2_VISCOUS[axis] * span + TABLE_2_COULOMB[axis]
    axes.plot(span, printed, ":", color=INK, linewidth=2.2, label="printed in Table 2")
    moving = speed != 0.0
    axes.plot(speed[moving], force[moving], "o", color=INK, markersize=7, zorder=5, label="Table 1, moving")
    axes.plot(
        speed[~moving],
        force[~moving],
        "o",
        color="white",
        markeredgecolor=INK,
        markeredgewidth=1.6,
        markersize=8,
        zorder=5,
        clip_on=False,
        label="Table 1, at rest",
    )
    axes.set_ylim(0.0, 1.35 * force.max())
    title = f"{axis_title(AXES[axis])}: force, {FORCE_UNIT[AXES[axis]]}"
    dress_panel(axes, title, f"speed, {SPEED_UNIT[AXES[axis]]}", span[-1])


def _fit(axes: Axes, axis: int, estimate: Estimate, span: FloatArray, colour: str, line: str, words: str) -> None:
    middle, half = confidence_band(estimate, axis, span)
    axes.fill_between(span, middle - half, middle + half, color=colour, alpha=0.16, linewidth=0)
    axes.plot(span, middle, line, color=colour, label=words)


# Fig. 4: the nine step responses of Table 4

SHOWN_S = 1.2  # of each response; the rest is steady


def draw_steps(responses: Mapping[str, Sequence[StepResponse]]) -> Picture:
    """One panel per axis, three steps each; a dot where Table 1 prints a speed for the same voltages."""
    with look():
        figure, panels = axis_panels(4.0, top=0.9, bottom=0.24)
        for axis, panel in zip(AXES, panels, strict=True):
            _steps_panel(panel, axis, responses[axis])
        figure.text(0.075, 0.03, _words(), fontsize=10)
        return picture("fig4_steps", "Fig. 4: nine voltage steps (Table 4)", _steps_caption(), figure)


def _words() -> str:
    return "Lines: simulated with Table 3.   Dots: steady speed printed in Table 1 for the same voltages."


def _steps_caption() -> str:
    return (
        "The steps of Table 4 from rest, simulated with the parameters of Table 3. Dots: the steady speed that Table 1 "
        "prints for the same voltages, where it has such a row."
    )


def _steps_panel(axes: Axes, axis: str, responses: Sequence[StepResponse]) -> None:
    for k, response in enumerate(responses):
        twist = response.run.twist
        assert twist is not None
        rows = response.run.t <= SHOWN_S
        speed, colour = twist[rows, AXES.index(axis)], LEVEL_COLOURS[k]
        axes.plot(response.run.t[rows], speed, LEVEL_LINES[k], color=colour)
        note(axes, 0.62 * SHOWN_S, response.settled_speed, f"{response.level:g} V", ha="center", va="center")
        if response.measured_speed is not None:
            axes.plot(
                [SHOWN_S] * 2,
                [response.settled_speed, response.measured_speed],
                color=colour,
                linewidth=1.2,
                clip_on=False,
            )
            axes.plot(
                [SHOWN_S],
                [response.measured_speed],
                "o",
                color=colour,
                markeredgecolor=MEASURED,
                markersize=8,
                clip_on=False,
                zorder=5,
            )
    axes.set_ylim(bottom=0.0)
    dress_panel(axes, f"{axis_title(axis)}: speed, {SPEED_UNIT[axis]}", "time, s", SHOWN_S)


# What would reconcile Table 3 with Table 1: one dot per number that was set free

NAMES = {
    "r": "wheel radius",
    "b": "robot radius",
    "R": "resistance",
    "drop": "driver drop",
    "friction": "all six friction numbers",
}


def draw_reconciliation(trials: Sequence[Reconciliation]) -> Picture:
    """Mean error that is left, in per cent of the largest speed of each axis, and how many rows agree."""
    sorted_trials = sorted((trial for trial in trials if trial.axes == AXES), key=lambda trial: trial.cost)
    with look():
        figure = new_figure(WIDTH, 0.6 + 0.36 * len(sorted_trials))
        axes = figure.add_axes((0.33, 0.15, 0.5, 0.76))
        place = np.arange(len(sorted_trials))[::-1]
        errors = [100.0 * trial.cost for trial in sorted_trials]
        axes.hlines(place, 0.0, errors, color=PALE, linewidth=5)
        axes.plot(errors, place, "o", color=BLUE, markersize=9)
        axes.set_yticks(place, [_name(trial) for trial in sorted_trials])
        axes.tick_params(axis="y", length=0)
        axes.set_xlim(0.0, 1.1 * max(errors))
        thin_out(axes, x=5)
        axes.set_ylim(-0.7, len(sorted_trials) - 0.3)
        axes.grid(False, axis="y")
        axes.set_xlabel("error left (rms), % of the largest speed of the axis")
        axes.set_title("set free", color=GREY, x=-0.02, ha="right")
        for k, trial in zip(place, sorted_trials, strict=True):
            words = f"{trial.explained} of {trial.rows}"
            axes.text(1.03, k, words, transform=axes.get_yaxis_transform(), va="center", color=INK)
        axes.text(1.03, 1.02, "rows within 5 %", transform=axes.transAxes, va="bottom", color=GREY)
        return picture("fig6_reconcile", "What would reconcile Table 3 with Table 1", _reconcile_caption(), figure)


def _reconcile_caption() -> str:
    return (
        "Numbers of Table 3 set free, alone or in pairs, and fitted to all steady speeds of Table 1: the error "
        "that is left, and how many of the rows then agree."
    )


def _name(trial: Reconciliation) -> str:
    return " + ".join(NAMES[name] for name in trial.freed) or "nothing (Table 3)"


# Fig. 2: speed and current of the twelve experiments of Table 1

TRACE_S = 1.0  # of each run; the rest is steady
TICKS = (0.0, 0.5, 1.0)
WORDS = "Lines: simulated with Table 3.   Dots: steady speed printed in Table 1 for the same voltages."


def draw_traces(runs: Mapping[str, Sequence[Run]]) -> Picture:
    """Speed above, current of the most driven wheel below; a column per axis, four voltages each."""
    with look():
        figure = new_figure(WIDTH, 6.0)
        panels = figure.subplots(2, len(AXES), sharex=True)
        figure.subplots_adjust(left=0.085, right=0.98, top=0.94, bottom=0.16, wspace=0.32, hspace=0.22)
        for column, axis in enumerate(AXES):
            _speeds(panels[0, column], axis, runs[axis])
            _currents(panels[1, column], axis, runs[axis])
        figure.text(0.085, 0.025, WORDS, fontsize=10)
        return picture("fig2_traces", "Fig. 2: speed and current of the runs of Table 1", _traces_caption(), figure)


def _traces_caption() -> str:
    return (
        "The twelve experiments of Table 1 from rest, simulated with the parameters of Table 3; each line carries "
        "its largest voltage. Above: speed, with the printed steady speed as a dot. Below: the current of the wheel "
        "that gets the largest voltage. The measured traces themselves are not in the text we work from."
    )


def _speeds(axes: Axes, axis: str, runs: Sequence[Run]) -> None:
    for k, (run, row) in enumerate(zip(runs, TABLE_1[axis], strict=True)):
        assert run.twist is not None
        rows = run.t <= TRACE_S
        speed = run.twist[rows, AXES.index(axis)]
        axes.plot(run.t[rows], speed, LEVEL_LINES[k], color=LEVEL_COLOURS[k])
        axes.plot([TRACE_S] * 2, [speed[-1], row.speed], color=LEVEL_COLOURS[k], linewidth=1.2, clip_on=False)
        axes.plot(
            [TRACE_S],
            [row.speed],
            "o",
            color=LEVEL_COLOURS[k],
            markeredgecolor=INK,
            markersize=7.5,
            clip_on=False,
            zorder=5,
        )
        words = f"{max(map(abs, row.voltage)):g} V"
        note(axes, 0.62 * TRACE_S, speed[-1], words, ha="center", va="bottom", fontsize=9.5, bbox=None)
    axes.set_title(f"{axis_title(axis)}: speed, {SPEED_UNIT[axis]}")
    axes.set_xlim(0.0, TRACE_S)
    axes.set_ylim(bottom=0.0)
    axes.set_xticks(TICKS)
    thin_out(axes, y=6)


def _currents(axes: Axes, axis: str, runs: Sequence[Run]) -> None:
    wheel = int(np.argmax(np.abs(TABLE_1[axis][-1].voltage)))
    for k, run in enumerate(runs):
        assert run.current is not None
        rows = run.t <= TRACE_S
        axes.plot(run.t[rows], run.current[rows, wheel], LEVEL_LINES[k], color=LEVEL_COLOURS[k])
    axes.set_title(f"current of wheel {wheel + 1}, A")
    axes.set_xlabel("time, s")
    thin_out(axes, y=6)
