"""The twist against the motion of the pose: in the frame of the room, turned (a marker at an angle), or mirrored."""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.log_under_check import MIN_ROWS, LogUnderCheck
from omnidyn.findings.signal.reference import WHEELS, pose_twist, wheels_twist
from omnidyn.findings.signal.robust import smooth
from omnidyn.findings.wiring.turned import TURNED_LIKENESS, Turned, is_turned, marker_finding, turned, with_marker
from omnidyn.model.frames import unwrapped
from omnidyn.statement import ERROR, WARNING

BEST_SHARE = 0.35  # the right frame leaves at most so much of what the one as logged leaves
NAMES = ("x", "y", "heading")


class FrameCandidate(NamedTuple):
    """signs: of x, y and heading. room: whether the twist is in the frame of the room. turn: what is left."""

    signs: tuple[float, float, float]
    room: bool
    turn: Turned

    @property
    def left(self) -> float:
        """What no turn explains, and what the frame as it stands leaves."""
        return 1.0 - (self.turn.plain if self.room else self.turn.alike)


def check_twist_frame(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """Findings on twist against pose, else on what was commanded against it; the work with them in one frame."""
    pose = work.full("pose")
    twist, command = (None, None) if pose is None else (work.full("twist"), work.full("twist_command"))
    if pose is None or len(work) < 3 * MIN_ROWS or work.step <= 0.0:
        return [], work
    if twist is not None:
        return _against_twist(work, pose, twist)
    if command is None or work.full("wheel_speed") is not None:
        return [], work
    body, width = pose_twist(work, pose)
    turn = turned(work, body[:, :2], smooth(command[:, :2], width), body[:, 2])
    if turn is None or not is_turned(turn):
        return [], work
    return [marker_finding(turn, "twist_command")], with_marker(work, pose, turn.angle)


def _against_twist(work: LogUnderCheck, pose: FloatArray, twist: FloatArray) -> tuple[list[Finding], LogUnderCheck]:
    plain = _found(work, pose, twist, (1.0, 1.0, 1.0), False)
    if plain is None:
        return [], work
    if plain.turn.plain > TURNED_LIKENESS and not is_turned(plain.turn):
        return [], work
    candidates = [_found(work, pose, twist, (1.0, 1.0, 1.0), True)]
    candidates += [_found(work, pose, twist, (1.0, y, turn), False) for y, turn in product((1.0, -1.0), repeat=2)]
    answers = [candidate for candidate in candidates if candidate is not None]
    best = min(answers, key=lambda answer: answer.left)
    room = answers[0]
    if (
        room.left < best.left + 0.02
        and 1.0 - room.left > TURNED_LIKENESS
        and room.left < BEST_SHARE * (1.0 - plain.turn.plain)
    ):
        likeness = {"likeness": room.turn.plain, "likeness_as_logged": plain.turn.plain}
        return [Finding("twist_frame", ERROR, "vx vy", likeness)], work.replace(twist=_as_in_body(pose, twist))
    if best.signs != (1.0, 1.0, 1.0) and 1.0 - best.left > TURNED_LIKENESS and best.left < BEST_SHARE * plain.left:
        return [_mirror_finding(plain, best)], work.replace(pose=pose * best.signs)
    if is_turned(plain.turn):
        return _turned(work, pose, twist, plain.turn)
    return [], work


def _found(
    work: LogUnderCheck, pose: FloatArray, twist: FloatArray, signs: tuple[float, float, float], room: bool
) -> FrameCandidate | None:
    body, width = pose_twist(work, pose * signs)
    plane_velocity = smooth(twist[:, :2], width) if not room else smooth(_as_in_body(pose, twist)[:, :2], width)
    turn = turned(work, body[:, :2], plane_velocity, body[:, 2])
    return None if turn is None else FrameCandidate(signs, room, turn)


def _as_in_body(pose: FloatArray, twist: FloatArray) -> FloatArray:
    """The twist, taken as one in the frame of the room, in that of the robot."""
    plane = (twist @ [1.0, 1.0j, 0.0]) * np.exp(-1j * unwrapped(pose[:, 2]))
    return np.column_stack([plane.real, plane.imag, twist[:, 2]])


def _mirror_finding(plain: FrameCandidate, best: FrameCandidate) -> Finding:
    columns = [name for name, sign in zip(NAMES, best.signs, strict=True) if sign < 0.0]
    return Finding(
        "pose_frame",
        ERROR,
        " ".join(columns),
        {"likeness": best.turn.alike, "likeness_as_logged": plain.turn.plain, "mirrored": 1.0},
    )


def _turned(
    work: LogUnderCheck, pose: FloatArray, twist: FloatArray, turn: Turned
) -> tuple[list[Finding], LogUnderCheck]:
    """A twist and a pose that are turned against each other: what else is known says which of them is wrong."""
    body, width = pose_twist(work, pose)
    for name, velocity in _others(work, width):
        against = turned(work, velocity, smooth(twist[:, :2], width), body[:, 2])
        if against is None or against.alike < TURNED_LIKENESS:
            continue
        if abs(against.angle - turn.angle) < abs(against.angle):  # the other agrees with the pose
            return [_sensor_finding(against, name)], work.replace(twist=_turned_back(twist, against.angle))
        return [marker_finding(turn, "twist", name)], with_marker(work, pose, turn.angle)
    return [marker_finding(turn, "twist")], with_marker(work, pose, turn.angle)


def _others(work: LogUnderCheck, width: int) -> list[tuple[str, FloatArray]]:
    """What else says how the robot moves in the plane: (name, velocity, shape (rows, 2))."""
    speed, command = work.full("wheel_speed"), work.full("twist_command")
    wheel_motion = None if speed is None else wheels_twist(work, speed, width)
    sources = [] if wheel_motion is None else [(WHEELS, wheel_motion[:, :2])]
    return sources + ([] if command is None else [("twist_command", smooth(command[:, :2], width))])


def _sensor_finding(turn: Turned, name: str) -> Finding:
    return Finding("twist_frame", WARNING, "vx vy", {**turn.numbers, "agrees": name}, "turned")


def _turned_back(twist: FloatArray, angle: float) -> FloatArray:
    plane = (twist @ [1.0, 1.0j, 0.0]) * np.exp(-1j * angle)
    return np.column_stack([plane.real, plane.imag, twist[:, 2]])
