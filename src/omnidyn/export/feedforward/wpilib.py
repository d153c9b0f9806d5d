"""wpilib: the gains as constants for SimpleMotorFeedforward, in Java, C++ and Python.

Each file holds kS, kV, kA of each axis, the share of the volts of each motor, and the gains of the wheels. The volts of
motor i are the sum over the axes of PATTERN[axis][i] times what the feed-forward of that axis says.
"""

from __future__ import annotations

import math

import numpy as np

from omnidyn.export.contract import Export
from omnidyn.export.features import left_out, refuse
from omnidyn.export.feedforward.gains import AXES, GainRow, gains, rows
from omnidyn.export.feedforward.gains_csv import spread
from omnidyn.export.feedforward.guessed_gains import guessed_gains
from omnidyn.export.spelling import c_comment, java_comment, number, python_comment
from omnidyn.model.robot import Robot

NOTES = (
    "the volts of motor i: the sum over x, y, yaw of PATTERN[axis][i] x SimpleMotorFeedforward(kS, kV, kA) of the axis",
    "the gains of a wheel hold on the axis that names them: a wheel carries another share of the robot on each",
)
USAGE = (
    "Volts of motor i: sum over x, y, yaw of PATTERN[axis][i] * feedforward(axis). Axes: x forward, y left, yaw ccw."
)


def wpilib(robot: Robot, force_guess: bool = False) -> Export:
    """kS, kV and kA with standard errors as constants in Java, C++ and Python.

    force_guess: also of a robot whose friction is a guess. Raises InputError for one without it.
    """
    refuse("wpilib", robot)
    omissions, guess = left_out("wpilib", robot), guessed_gains(robot, force_guess)
    about = [
        f"{robot.name}: feed-forward gains by omnidyn, SI units, volts.",
        *guess,
        USAGE,
        *(f"Not in it: {m}" for m in omissions),
    ]
    constants = [(_constant(row), row) for row in rows(robot)]
    pattern = gains(robot).pattern
    files = {
        "RobotGains.java": _java(about, constants, pattern),
        "robot_gains.h": _cpp(about, constants, pattern),
        "robot_gains.py": _python(about, constants, pattern),
    }
    return Export("wpilib", robot.name, files, omissions, (*guess, *NOTES), folder=True)


def _constant(row: GainRow) -> str:
    """X_KS, WHEEL2_ON_X_KV."""
    return f"{row.place.replace('wheel ', 'wheel').replace(' ', '_')}_{row.name}".upper()


def _java(about: list[str], constants: list[tuple[str, GainRow]], pattern: np.ndarray) -> str:
    lines = [f"  public static final double {name} = {number(row.value)}; // {spread(row)}" for name, row in constants]
    table = ",\n".join(f"    {{{', '.join(map(number, row))}}}" for row in pattern.tolist())
    return (
        java_comment(about)
        + "public final class RobotGains {\n  private RobotGains() {}\n\n"
        + "\n".join(lines)
        + f"\n\n  public static final double[][] PATTERN = {{\n{table}\n  }};\n}}\n"
    )


def _cpp(about: list[str], constants: list[tuple[str, GainRow]], pattern: np.ndarray) -> str:
    lines = [f"inline constexpr double {name} = {number(row.value)};  // {spread(row)}" for name, row in constants]
    table = ",\n".join(f"    {{{', '.join(map(number, row))}}}" for row in pattern.tolist())
    count = pattern.shape[1]
    return (
        c_comment(about)
        + "\n#pragma once\n\nnamespace robot_gains {\n"
        + "\n".join(lines)
        + f"\n\ninline constexpr double PATTERN[{len(AXES)}][{count}] = {{\n{table}}};\n}}  // namespace robot_gains\n"
    )


def _python(about: list[str], constants: list[tuple[str, GainRow]], pattern: np.ndarray) -> str:
    lines = [f"{name} = {number(row.value)}  # {spread(row)}" for name, row in constants]
    table = ",\n".join(f"    ({', '.join(map(number, row))})" for row in pattern.tolist())
    assert all(math.isfinite(row.value) for _, row in constants)
    return python_comment(about) + "\n" + "\n".join(lines) + f"\n\nPATTERN = (\n{table},\n)\n"
