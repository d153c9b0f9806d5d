"""Which kinds of export there are, and the file of each: it is imported when the kind is asked for."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from omnidyn.errors import InputError, did_you_mean

if TYPE_CHECKING:
    from omnidyn.export.contract import Export


class ExportKind(NamedTuple):
    """A kind of export: the module and function that make it, and what it is, in words."""

    module: str
    function: str
    words: str


KINDS = {
    "json": ExportKind("omnidyn.export.robot_json", "robot_json", "the robot with what is known of its numbers"),
    "c-model": ExportKind(
        "omnidyn.export.code.c_model", "c_model", "the step of the simulation as C99, for a microcontroller"
    ),
    "c-controller": ExportKind(
        "omnidyn.export.code.c_controller", "c_controller", "a controller as C99, for a microcontroller"
    ),
    "fmu": ExportKind("omnidyn.export.code.fmu", "fmu", "a co-simulation FMU (FMI 2 or 3), from the same C"),
    "wpilib": ExportKind(
        "omnidyn.export.feedforward.wpilib", "wpilib", "kS, kV, kA as constants in Java, C++ and Python"
    ),
    "road-runner": ExportKind("omnidyn.export.feedforward.road_runner", "road_runner", "kS, kV, kA for Road Runner"),
    "gains": ExportKind("omnidyn.export.feedforward.gains_csv", "gains_csv", "kS, kV, kA with standard errors as CSV"),
    "mjcf": ExportKind("omnidyn.export.bodies.mjcf", "mjcf", "a MuJoCo model, motors in volts"),
    "urdf": ExportKind("omnidyn.export.bodies.urdf", "urdf", "base and wheels as links and joints, for ROS"),
    "sdf": ExportKind("omnidyn.export.bodies.sdf", "sdf", "base and wheels as links and joints, for Gazebo"),
    "ros2-control": ExportKind(
        "omnidyn.export.ros.ros2_control", "ros2_control", "a package for ROS 2: omni or mecanum drive controller"
    ),
    "ros2-node": ExportKind(
        "omnidyn.export.ros.node",
        "ros2_node",
        "a package for ROS 2: a node that drives by feed-forward or a controller",
    ),
}


def python_name(kind: str) -> str:
    """The name of a kind in Python: c-model is omnidyn.export.c_model."""
    return kind.replace("-", "_")


def maker(kind: str) -> Callable[..., Export]:
    """The function that makes a kind of export of a robot. Raises InputError for a kind that there is not."""
    if kind not in KINDS:
        remedy = did_you_mean(kind, KINDS)
        raise InputError("no such kind of export", got=kind, expected=", ".join(KINDS), remedy=remedy, where="KIND")
    spec = KINDS[kind]
    return getattr(importlib.import_module(spec.module), spec.function)
