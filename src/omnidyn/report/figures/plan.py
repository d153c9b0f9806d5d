"""The picture of a plan: where the robot goes in its room, and what its motors get."""

from __future__ import annotations

import numpy as np

from omnidyn.identification.planning.planned import Plan
from omnidyn.report.figures.tracking import COLOURS, LINES
from omnidyn.report.style import GREY, INK, WIDTH, Picture, look, new_figure, picture, thin_out

MOST_POINTS = 6000


def draw_plan(plan: Plan) -> Picture:
    """Path and inputs of the program, of the robot as its file has it."""
    run, commands = plan.drive(), plan.commands()
    pose, put_in = np.asarray(run.pose), plan.share
    kept = np.unique(np.linspace(0, len(pose) - 1, MOST_POINTS).astype(int))
    with look():
        figure = new_figure(WIDTH, 3.9)
        plane, inputs = figure.add_axes((0.08, 0.15, 0.36, 0.68)), figure.add_axes((0.55, 0.15, 0.44, 0.68))
        half_x, half_y = 0.5 * plan.area[0], 0.5 * plan.area[1]
        border = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]]) * (half_x, half_y)
        plane.plot(*border.T, color=GREY, linewidth=3.0)
        plane.plot(*pose[kept, :2].T, color=COLOURS[0], linewidth=1.0)
        plane.plot(0.0, 0.0, marker="o", markersize=8, markerfacecolor="none", color=INK)
        plane.set_aspect("equal", adjustable="datalim")
        plane.set_xlabel("x, m")
        plane.set_ylabel("y, m")
        plane.set_title("where it goes")
        thin_out(plane, 5, 5)
        for k in range(put_in.shape[1]):
            colour, line = COLOURS[k % len(COLOURS)], LINES[(k // len(COLOURS)) % len(LINES)]
            inputs.plot(commands.t, 100.0 * put_in[:, k], line, linewidth=0.9, color=colour, label=f"motor {k + 1}")
        inputs.set_xlabel("time, s")
        inputs.set_title("input, % of the largest")
        inputs.set_xlim(0.0, float(commands.t[-1]))
        figure.legend(*inputs.get_legend_handles_labels(), loc="upper right", ncols=6, bbox_to_anchor=(1.0, 1.0))
        caption = (
            f"Left: the room (grey) and the way of {plan.robot.name} in it, from above; a ring is the start. Right: "
            "the input of each motor; each move is followed by its mirror image."
        )
        return picture("plan", f"A plan for {plan.robot.name}", caption, figure)
