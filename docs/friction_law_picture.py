"""The picture of how-to/friction-law.md: five laws on the paper's robot. `python docs/friction_law_picture.py`"""

from __future__ import annotations

from pathlib import Path

from omnidyn.model.friction import AxesFriction, Friction
from omnidyn.model.robot_file import load_robot
from omnidyn.report.friction_picture import draw_friction
from omnidyn.simulation.friction_study import friction_study

FILE = Path(__file__).with_name("images") / "friction_laws.png"
LEVELS = {"viscous": (0.94, 0.96, 0.01), "coulomb": (2.2, 1.5, 0.099)}
HOLDS, FALLS = {"breakaway": (2.8, 1.9, 0.13)}, {"stribeck_speed": (0.02, 0.02, 0.2)}
STIFF = {"stiffness": (2e4, 2e4, 2e2)}
LAWS = {
    "Coulomb": {}, "breakaway": HOLDS, "Stribeck": HOLDS | FALLS, "LuGre": HOLDS | FALLS | STIFF | {"law": "lugre"},
    "Dahl": STIFF | {"law": "dahl"},
}  # fmt: skip


def main() -> None:
    """Draw it anew."""
    robot = load_robot("axebot")
    laws = {name: Friction(axes=AxesFriction(**LEVELS, **numbers)) for name, numbers in LAWS.items()}
    studies = {name: friction_study(robot.replace(friction=friction)) for name, friction in laws.items()}
    draw_friction(studies).figure.savefig(FILE, dpi=120, metadata={"Software": None})


if __name__ == "__main__":
    main()
