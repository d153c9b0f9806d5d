"""The picture of how-to/watch-a-drive.md: intervals that shrink while a robot drives. `python docs/live_picture.py`"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from omnidyn.identification.live.live import Live
from omnidyn.identification.live.status import LiveStatus
from omnidyn.model.deadzone import axis_patterns
from omnidyn.model.keys import in_words
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import load_robot
from omnidyn.report.style import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, SKY, VERMILLION, WIDTH, look, new_figure
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate

PICTURE = Path(__file__).with_name("images") / "watch.png"
SECONDS, RATE, WITHIN = 60.0, 100.0, 0.1
MOST = 200.0  # [%] that is drawn
NOISE = np.array([0.02, 0.02, 0.1])  # [m/s, m/s, rad/s]
COLOURS = (BLUE, VERMILLION, GREEN, SKY, ORANGE, PURPLE, INK)
LINES = ("-", "-", "-", "--", "--", "--", "-.")


def main() -> None:
    """Draw it anew."""
    robot = load_robot("axebot")
    live = Live(robot, within=WITHIN)
    statuses = list(live.answers(driven(robot)))
    with look():
        figure = drawn(statuses)
        figure.savefig(PICTURE, dpi=120, metadata={"Software": None})


def driven(robot: Robot) -> Run:
    """A log of levels and ramps along all axes, by hand as it were."""
    rng, rows = np.random.default_rng(4), []
    while sum(map(len, rows)) < SECONDS * RATE:
        level = rng.uniform(-1.0, 1.0, 3) * np.eye(3)[len(rows) % 3] * (4.5, 4.5, 2.5)
        count = int(rng.uniform(0.4, 1.2) * RATE)
        shape = np.linspace(0.0, 1.0, count) if len(rows) % 2 else np.ones(count)
        rows.append(shape[:, None] * (level @ axis_patterns(robot)))
    volts = np.concatenate(rows)[: round(SECONDS * RATE)]
    run = simulate(robot, volts, 1.0 / RATE)
    return Run(t=run.t, voltage=run.voltage, twist=np.asarray(run.twist) + NOISE * rng.normal(size=(len(run), 3)))


def drawn(statuses: list[LiveStatus]):
    """Half of each interval over time, what is wanted, and when it is enough."""
    figure = new_figure(WIDTH, 4.2)
    axes = figure.add_axes((0.09, 0.13, 0.55, 0.76))
    shown = [status for status in statuses if status.numbers]
    names = [name for name, number in shown[-1].numbers.items() if number.within]
    for name, colour, line in zip(names, COLOURS, LINES, strict=False):
        pairs = [(status.seconds, 100.0 * status.numbers[name].half) for status in shown]
        finite = [pair for pair in pairs if pair[1] < MOST]
        axes.plot(*zip(*finite, strict=True), line, color=colour, linewidth=1.4, label=in_words(name))
    axes.axhline(100.0 * WITHIN, color=GREY, linewidth=2.5)
    axes.text(0.5, 88.0 * WITHIN, "wanted", color=GREY, ha="left", va="top")
    enough = next((status.enough_at for status in shown if status.is_enough), None)
    if enough is not None:
        axes.axvline(enough, color=INK, linewidth=1.0)
        axes.annotate(
            "enough", (enough, 1.0), (3, -2), xycoords=("data", "axes fraction"), textcoords="offset points", va="top"
        )
    axes.set_yscale("log")
    axes.set_ylim(0.3, MOST)
    axes.set_yticks([0.3, 1, 3, 10, 30, 100], ["0.3", "1", "3", "10", "30", "100"])
    axes.minorticks_off()
    axes.set_xlim(0.0, SECONDS)
    axes.set_xlabel("driven, s")
    axes.set_title("half of each 95 % interval, % of the number")
    figure.legend(*axes.get_legend_handles_labels(), loc="center left", bbox_to_anchor=(0.66, 0.5), frameon=False)
    return figure


if __name__ == "__main__":
    main()
