"""What other tools read in our exports: rows of `python -m benchmarks exports`: masses, covariances, frames."""

from __future__ import annotations

import importlib
import importlib.util
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

import omnidyn
from omnidyn.arrays import FloatArray
from omnidyn.errors import UnsupportedError
from omnidyn.export.kinds import KINDS, maker
from omnidyn.export.ros.odometry_covariance import odometry_error
from omnidyn.export.ros.ros2_control import ros2_control
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import wheel_speed
from omnidyn.run import Run
from tests.support.exported import exact_robot
from tests.support.mixed_robots import random_robot, with_centre, with_spin

NEAR = 1e-12
LOGS, FITTED = 200, 20  # of which as many give a covariance
LOW, HIGH, SIGMAS = 0.93, 0.97, 1.96  # of normalised errors within so many standard deviations: 95 %
ROBOTS = (
    *(random_robot(seed) for seed in range(14)),
    *(with_spin(random_robot(seed), seed) for seed in range(14, 20)),
    *(exact_robot(seed) for seed in range(9)),
    with_centre(exact_robot(9), 9),
)
COLUMN = "off"
Parts = tuple[FloatArray, FloatArray, FloatArray]  # masses, inertias about z, places (parts, 2): the base first


def rows(robot: Robot) -> Iterator[dict[str, Any]]:
    """A row for each tool: the largest relative error of what it reads, or a share."""
    yield _masses("urdf, by ElementTree", robot, _of_urdf)
    if importlib.util.find_spec("pysdf") is None:
        yield _masses("sdf, by ElementTree (python-sdformat: not installed)", robot, _of_sdf)
    else:
        yield _masses("sdf, by python-sdformat", robot, _of_python_sdformat)
    if importlib.util.find_spec("yaml") is not None:
        yield from _controller(robot)
    run = omnidyn.simulate(robot, np.repeat([[0.0, 3.0, -3.0], [2.0, 2.0, 2.0]], 100, axis=0), 0.01)
    for kind in ("xarray", "pandas", "polars"):
        if importlib.util.find_spec(kind) is None:
            yield {"tool": f"{kind}: not installed"}
        else:
            yield _frame(kind, run)
    yield _many()


def _masses(tool: str, robot: Robot, read: Callable[[str], Parts]) -> dict[str, Any]:
    """Mass and turning inertia of the parts against those of the robot, of thirty robots. read: masses, izz, places."""
    worst = 0.0
    for each in (robot, *ROBOTS):
        kind = "urdf" if tool.startswith("urdf") else "sdf"
        mass, about, place = read(maker(kind)(each).text)
        turning = about.sum() + mass @ ((place - each.body.centre) ** 2).sum(axis=1)
        worst = max(worst, abs(mass.sum() / each.body.mass - 1.0), abs(turning / each.body.inertia - 1.0))
    return {"tool": f"{tool}, 31 robots: mass, inertia", COLUMN: worst, "goal": (f"<= {NEAR:g}", worst <= NEAR)}


def _numbers(text: str | None) -> list[float]:
    return [float(each) for each in (text or "").split()]


def _of_urdf(text: str) -> Parts:
    root = ET.fromstring(text)
    mass = [float(each.attrib["value"]) for each in root.iter("mass")]
    about = [float(each.attrib["izz"]) for each in root.iter("inertia")]
    base = root.find("link/inertial/origin")
    places = [_numbers(each.attrib["xyz"]) for each in root.iterfind("joint/origin")]
    return np.array(mass), np.array(about), _places(None if base is None else base.attrib["xyz"], places)


def _places(base: str | None, wheels: Sequence[Sequence[float]]) -> FloatArray:
    """Where the base balances, then the wheels. Shape (parts, 2)."""
    return np.array([each[:2] for each in (_numbers(base) or [0.0, 0.0], *wheels)])


def _of_sdf(text: str) -> Parts:
    root = ET.fromstring(text)
    mass = [float(each.text or "") for each in root.iter("mass")]
    about = [float(each.text or "") for each in root.iter("izz")]
    places = [_numbers(k.findtext("pose")) for k in root.iter("link")][1:]
    return np.array(mass), np.array(about), _places(root.findtext("model/link/inertial/pose"), places)


def _of_python_sdformat(text: str) -> Parts:
    pysdf: Any = importlib.import_module("pysdf")
    links = pysdf.SDF.from_xml(text).model.links
    mass = np.array([float(each.inertial.mass) for each in links])
    base = links[0].inertial.pose
    places = _places(None if base is None else base.text, [_numbers(each.pose.text) for each in links[1:]])
    return mass, np.array([float(each.inertial.inertia.izz) for each in links]), places


def _log(robot: Robot, seed: int) -> Run:
    """Four seconds, whose wheel speeds have white noise, and whose twist is the truth."""
    rng = np.random.default_rng(seed)
    run = omnidyn.simulate(robot, np.repeat(rng.uniform(-6.0, 6.0, (20, 3)), 20, axis=0), 0.01)
    assert run.wheel_speed is not None
    return run.replace(wheel_speed=run.wheel_speed + rng.normal(0.0, 0.5, run.wheel_speed.shape))


def _controller(robot: Robot) -> Iterator[dict[str, Any]]:
    """The controller's equations on our parameters; and its covariance of the twist on logs that did not make it."""
    yaml: Any = importlib.import_module("yaml")

    def given(made: Any) -> dict[str, Any]:
        return yaml.safe_load(made.files["controllers.yaml"])["omni_wheel_drive_controller"]["ros__parameters"]

    found = given(ros2_control(robot))
    theta = found["wheel_offset"] + 2.0 * np.pi * np.arange(3) / 3
    matrix = np.stack([np.sin(theta), -np.cos(theta), np.full(3, -found["robot_radius"])], axis=1)
    order = [int(name.removeprefix("wheel")[:1]) - 1 for name in found["wheel_names"]]
    twist = np.array([0.4, -0.7, 2.0])
    # The joints of its URDF turn about axes that point outwards, ours inwards.
    again = np.linalg.solve(matrix, -wheel_speed(robot.wheels, twist)[order] * found["wheel_radius"])
    off = float(np.abs(again - twist).max())
    yield {
        "tool": "ros2-control, by PyYAML and the controller's equations: twist",
        COLUMN: off,
        "goal": ("<= 1e-09", off <= 1e-9),
    }
    inside, count = np.zeros(3), 0
    for first in range(0, LOGS, LOGS // FITTED):
        variance = given(ros2_control(robot, _log(robot, 5000 + first)))["diagonal_covariance"]["twist"]
        std = np.sqrt(np.array(variance)[[0, 1, 5]])
        for seed in range(first, first + LOGS // FITTED):
            error = odometry_error(robot, _log(robot, seed))[1]
            inside, count = inside + (np.abs(error) < SIGMAS * std).sum(axis=0), count + len(error)
    share = inside / count
    told = " ".join(f"{each:.1%}" for each in share)
    yield {
        "tool": f"ros2-control, covariance on {LOGS} logs: within 95 % are {told}",
        "goal": ("93 to 97 %", bool(((share > LOW) & (share < HIGH)).all())),
    }


def _frame(kind: str, run: Run) -> dict[str, Any]:
    frame = run.to_xarray() if kind == "xarray" else run.to_dataframe(kind)
    again = omnidyn.interop.run_of(frame).replace(source=run.source, warnings=run.warnings)
    return {"tool": f"{kind}, a run there and back", COLUMN: float(again != run), "goal": ("same bits", again == run)}


def _many() -> dict[str, Any]:
    """Every kind with thirty robots: written, or refused by name."""
    written = refused = 0
    for robot in ROBOTS:
        for kind in KINDS:
            try:
                maker(kind)(robot, **({"compiled": False} if kind == "fmu" else {}))
                written += 1
            except UnsupportedError:
                refused += 1
    total = len(ROBOTS) * len(KINDS)
    return {
        "tool": f"{len(KINDS)} kinds x {len(ROBOTS)} robots: {written} written, {refused} refused by name",
        "goal": (f"{total} in all", written + refused == total),
    }
