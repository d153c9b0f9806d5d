"""The real logs as runs, read as their owner would read them; the folder is OMNIDYN_DATA."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from omnidyn.logs.read_log import LogOptions, read_log, recorded_log
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run

ROOT = Path(__file__).resolve().parents[2]
PER_TURN = "ticks/2000@motor"  # of the Robotino's encoders
TIME_STEP = "0.000125 s"  # of the ODrive: 8 kHz, where its header says 8 Hz


def folder() -> Path:
    """Where the real logs are."""
    return Path(os.environ.get("OMNIDYN_DATA", ROOT.parent / "shared" / "data"))


def robotino_groups(data: Path) -> dict[str, list[Run]]:
    """Runs over two floors: "gray 0.1", "gray 0.2", "gray 0.3", "green 0.1"."""
    gray, green = (data / "robotino" / "one_surface_type" / name for name in ("gray_surface", "green_surface"))
    groups = {
        f"gray {speed}": [gray / f"exp{n:02d}.csv" for n in range(first, first + 72)]
        for speed, first in (("0.1", 0), ("0.2", 72), ("0.3", 144))
    }
    groups["green 0.1"] = [green / f"exp{n:02d}.csv" for n in range(0, 72, 2)]
    return {name: [_robotino(path) for path in paths] for name, paths in groups.items()}


def robotino_motors(data: Path) -> list[Run]:
    """Three runs with the wheels off the ground."""
    paths = sorted((data / "robotino" / "dc_motor_model_identification").glob("*.csv"))
    return [_robotino(path) for path in paths if not path.name.startswith("gray")]


def _robotino(path: Path) -> Run:
    columns = {f"a{wheel}": f"m{wheel}pos:{PER_TURN}" for wheel in (1, 2, 3)}
    return read_log(path, load_robot("robotino"), columns=columns, current_unsigned=True)


def udea_stairs(data: Path) -> list[Run]:
    """Stairs of PWM, 10 to 45 %."""
    tests = data / "udea_three_omni" / "motor_tests"
    return [read_log(tests / f"stage1_{k}.txt", assume={"u": "%"}) for k in (1, 2)]


def udea_turning(data: Path) -> tuple[Robot, Run]:
    """(robot, run): turning on the spot. Positive PWM turns its heading negative, so the heading is inverted here."""
    robot = load_robot("axebot")
    wheels = robot.wheels.replace(azimuth_deg=(150.0, 270.0, 30.0), robot_radius=0.099, wheel_radius=0.0325)
    path = data / "udea_three_omni" / "rotation_tests" / "stage2_1.txt"
    return robot.replace(wheels=wheels), read_log(path, assume={"u": "%"}, columns={"heading": "-alpha:rad"})


def odrive(data: Path, kinds: Sequence[str]) -> list[Run]:
    """Runs of a motor on a bench: "step", "chirp", "noise", "impulse", two of each."""
    paths = [data / "odrive_umn" / "demo_data" / f"{kind}{k}.csv" for kind in kinds for k in (1, 2)]
    options = LogOptions(overrides=(f"t=timestep (8Hz):{TIME_STEP}",))
    return [recorded_log(path, None, options).to_run() for path in paths]


def without_mass(robot: Robot) -> Robot:
    """The robot as the numbers of the README know it: they take no mass times acceleration off the forces."""
    return robot.replace(body=robot.body.replace(mass=1e-4, inertia=1e-9))
