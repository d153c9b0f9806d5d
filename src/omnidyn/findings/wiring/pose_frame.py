"""The frame of a pose against its own heading: turned, or mirrored; and whether the pose follows the wheels at all."""

from __future__ import annotations

import numpy as np

from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.log_under_check import MIN_ROWS, LogUnderCheck
from omnidyn.findings.signal.reference import WHEELS, pose_twist, wheels_twist
from omnidyn.findings.wiring.orders import means
from omnidyn.findings.wiring.turned import is_turned, marker_finding, turned, with_marker
from omnidyn.model.wheels import wheel_speed
from omnidyn.statement import WARNING


def check_frame(work: LogUnderCheck, misfit: float) -> tuple[list[Finding], LogUnderCheck]:
    """A pose whose x and y belong to another frame than its heading: turned, or mirrored as a picture from above is.

    misfit: what the best other wiring of the wheels leaves unexplained.
    """
    speed, pose, robot = work.full("wheel_speed"), work.full("pose"), work.geometry
    if speed is None or pose is None or robot is None or work.get("twist") is not None or len(work) < 3 * MIN_ROWS:
        return [], work
    best, plain = (0.0, 0.0 + 0.0j, 1.0), 0.0
    for mirror in (1.0, -1.0):
        turned = pose * [1.0, mirror, mirror]
        twist, width = pose_twist(work, turned)
        wheel_motion = wheels_twist(work, speed, width)
        assert wheel_motion is not None
        w, g = means(work, wheel_motion[:, :2], twist[:, :2])
        if len(w) < 8:
            return [], work
        wheel, floor = w @ [1.0, 1.0j], g @ [1.0, 1.0j]
        size = np.sqrt((np.abs(wheel) ** 2).sum() * (np.abs(floor) ** 2).sum())
        slope = (np.conj(wheel) * floor).sum() / size if size > 0.0 else 0.0j
        if mirror > 0.0:
            plain = float(slope.real)
        if abs(slope) > best[0] + 0.05 * (mirror < 0.0):
            best = float(abs(slope)), complex(slope), mirror
    alike, slope, mirror = best
    angle = float(np.degrees(np.angle(slope)))
    trusted = commands_agree(work)
    if trusted and plain < 0.5 and alike < 0.8:
        return [Finding("pose_unlike", WARNING, "x y heading", {"likeness_as_logged": plain})], work.replace(pose=None)
    if not trusted and misfit < 0.6 * (1.0 - alike**2) + 0.005:
        return [], work
    if alike < (0.8 if trusted else 0.9) or plain > 0.95 * alike or not (trusted or _turns_say(work, mirror)):
        return _marker(work) if mirror > 0.0 else ([], work)
    mended = pose * [1.0, mirror, mirror]
    unit = np.exp(-1.0j * np.radians(angle))
    place = (mended[:, 0] + 1.0j * mended[:, 1]) * unit
    mended = np.column_stack([place.real, place.imag, mended[:, 2]])
    return [
        Finding(
            "pose_frame",
            WARNING,
            "x y",
            {"angle_deg": angle, "mirrored": float(mirror < 0.0), "likeness": alike, "likeness_as_logged": plain},
            "mirrored" if mirror < 0.0 else "turned",
        )
    ], work.replace(pose=mended)


def _marker(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """A marker that is mounted at an angle, by its own error: one too small to show in the likeness, too."""
    speed, pose = work.full("wheel_speed"), work.full("pose")
    assert speed is not None
    assert pose is not None
    body, width = pose_twist(work, pose)
    wheel_motion = wheels_twist(work, speed, width)
    assert wheel_motion is not None
    turn = turned(work, body[:, :2], wheel_motion[:, :2], body[:, 2])
    if turn is None or not is_turned(turn):
        return [], work
    return [marker_finding(turn, WHEELS)], with_marker(work, pose, turn.angle)


def commands_agree(work: LogUnderCheck) -> bool:
    """Whether the wheels turn as the commanded twist says: then they are wired as the firmware thinks."""
    orders, speed, robot = work.full("twist_command"), work.full("wheel_speed"), work.geometry
    if orders is None or speed is None or robot is None:
        return False
    commanded, turned = means(work, wheel_speed(robot.wheels, orders), speed)
    size = np.sqrt((commanded**2).sum() * (turned**2).sum())
    return bool(size > 0.0 and (commanded * turned).sum() > 0.9 * size)


def _turns_say(work: LogUnderCheck, mirror: float) -> bool:
    """Whether the robot turns enough to see that its wheels are right about yaw, whatever they are about x and y."""
    speed, pose = work.full("wheel_speed"), work.full("pose")
    if speed is None or pose is None:
        return False
    twist, width = pose_twist(work, pose * [1.0, mirror, mirror])
    wheel_motion = wheels_twist(work, speed, width)
    assert wheel_motion is not None
    w, g = means(work, wheel_motion[:, 2:], twist[:, 2:])
    size = np.sqrt((w**2).sum() * (g**2).sum())
    turn_size = np.sqrt((w**2).sum()) * float(np.mean(work.geometry.wheels.robot_radius))  # type: ignore[union-attr]
    planar = np.sqrt((means(work, wheel_motion[:, :2])[0] ** 2).sum())
    return bool(size > 0.0 and (w * g).sum() > 0.97 * size and turn_size > 0.3 * planar)
