"""The pictures of how-to/friction-law.md: laws on the paper's robot. `python docs/friction_law_picture.py`"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from omnidyn.model.deadzone import axis_patterns, breakaway_voltage
from omnidyn.model.friction import AxesFriction, Friction
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import load_robot
from omnidyn.report.friction_picture import draw_friction
from omnidyn.report.style import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, SKY, VERMILLION, axis_panels, look, thin_out
from omnidyn.run import Run
from omnidyn.simulation.friction_study import friction_study
from omnidyn.simulation.simulate import simulate

IMAGES = Path(__file__).with_name("images")
LEVELS = {"viscous": (0.94, 0.96, 0.01), "coulomb": (2.2, 1.5, 0.099)}
HOLDS, FALLS = {"breakaway": (2.8, 1.9, 0.13)}, {"stribeck_speed": (0.02, 0.02, 0.2)}
STIFF = {"stiffness": (2e4, 2e4, 2e2)}
LAWS = {
    "Coulomb": {},
    "breakaway": HOLDS,
    "Stribeck": HOLDS | FALLS,
    "LuGre": HOLDS | FALLS | STIFF | {"law": "lugre"},
    "Dahl": STIFF | {"law": "dahl"},
}
MORE = {
    "elasto-plastic": HOLDS | FALLS | STIFF | {"law": "elastoplastic"},
    "Karnopp": HOLDS | {"law": "karnopp", "karnopp_speed": (2e-3, 2e-3, 2e-2)},
}
COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, GREY, ORANGE, SKY)
LINES = ("-", "--", "-.", (0, (1, 1)), (0, (4, 1, 1, 1)), (0, (5, 2)), (0, (2, 2)))
DT, RAMP, SWING = 1e-3, 4.0, 2.0  # [s]
TOP = 1.25  # of breakaway, that the ramp reaches
MIDDLE, AROUND, PACE = 1.1, 0.5, 20.0  # [N], [N], [Hz]


def main() -> None:
    """Draw them anew."""
    robot = load_robot("axebot")
    laws = {name: _with(robot, numbers) for name, numbers in LAWS.items()}
    studies = {name: friction_study(own) for name, own in laws.items()}
    _save(draw_friction(studies).figure, "friction_laws.png")
    _save(_near_rest(laws | {name: _with(robot, numbers) for name, numbers in MORE.items()}), "friction_near_rest.png")


def _with(robot: Robot, numbers: dict) -> Robot:
    return robot.replace(friction=Friction(axes=AxesFriction(**LEVELS, **numbers)))


def _save(figure, name: str) -> None:
    figure.savefig(IMAGES / name, dpi=120, metadata={"Software": None})


def _driven(robot: Robot, force: np.ndarray) -> Run:
    """A run under what would push with a force [N] along x, were there no back-EMF."""
    volts = axis_patterns(robot)[0]
    per_newton = breakaway_voltage(robot, axis_patterns(robot))[0] / robot.friction.axes.levels[2][0]
    return simulate(robot, force[:, None] * per_newton * volts, DT, tol=1e-6)


def _near_rest(laws: dict[str, Robot]):
    """A slow ramp there and back: speed, and how far it is from Stribeck's; a force that swings: how far it creeps."""
    t, swing = np.arange(0.0, RAMP, DT), np.arange(0.0, SWING, DT)
    ramp = TOP * HOLDS["breakaway"][0] * (1.0 - np.abs(2.0 * t / RAMP - 1.0))
    force = MIDDLE + AROUND * np.sin(2.0 * np.pi * PACE * swing)
    with look():
        figure, panels = axis_panels(4.3, top=0.9, bottom=0.3)
        runs = {name: _driven(robot, ramp) for name, robot in laws.items()}
        for (name, run), colour, line in zip(runs.items(), COLOURS, LINES, strict=True):
            how = {"color": colour, "linestyle": line, "label": name}
            panels[0].plot(run.t, 1e3 * run.twist[:, 0], **how)
            panels[1].plot(run.t, 1e3 * (run.twist[:, 0] - runs["Stribeck"].twist[:, 0]), **how)
            creeps = _driven(laws[name], force)
            panels[2].plot(creeps.t, 1e3 * creeps.pose[:, 0], **how)
        words = ("speed: mm/s", "less Stribeck's: mm/s", "creeps: mm")
        below = (
            "it sets off in a slow ramp, s",
            "ramp there and back, s",
            f"{MIDDLE:g} ± {AROUND:g} N at {PACE:g} Hz, s",
        )
        for panel, title, across in zip(panels, words, below, strict=True):
            panel.set_title(title)
            panel.set_xlabel(across)
            panel.axhline(0.0, color=INK, linewidth=0.6)
            thin_out(panel, 4, 6)
        panels[0].set_xlim(1.0, 2.2)
        panels[1].set_xlim(1.0, 3.2)
        panels[1].set_ylim(-10.0, 70.0)
        handles, names = panels[0].get_legend_handles_labels()
        figure.legend(handles, names, loc="lower left", bbox_to_anchor=(0.065, 0.0), ncols=4, columnspacing=1.5)
    return figure


if __name__ == "__main__":
    main()
