"""What one channel should be, told by others: the redundancy that every check of wiring, scale and lag lives on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.findings.signal.log_under_check import LogUnderCheck
from omnidyn.findings.signal.robust import central_rate, smooth
from omnidyn.model.actuation import asked_voltage
from omnidyn.model.frames import unwrapped, world_to_body
from omnidyn.model.keys import EMF
from omnidyn.model.motor import back_emf, no_load_speed
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel, twist_from_wheel_speed, wheel_speed

# Sources that say how fast a wheel turns; the others are channels.
CURRENT_AND_VOLTAGE, DRIVE, FLOOR, WHEELS = "circuit", "drive", "floor", "wheels"
MEASUREMENTS = ("twist", "pose", CURRENT_AND_VOLTAGE)  # those that say what it did
GEOMETRY = ("wheels.azimuth_deg", "wheels.robot_radius_m", "wheels.wheel_radius_m")
CIRCUIT = ("motor.resistance_ohm", EMF, "motor.gear_ratio")  # what a speed by voltage and current is made of
BEYOND_RATIO = 20.0
POSE_WINDOW = 0.12  # [s] over which a speed is taken from a pose
POSE_TURN = 0.35  # [rad] that the robot may turn in it: a chord is then 0.5 % shorter than its arc


class Ground(NamedTuple):
    """How the robot moved over the floor. name: of the channel. twist: shape (rows, 3), NaN for an axis not measured.

    width: rows over which it is a mean; whatever is compared with it must be smoothed alike.
    """

    name: str
    twist: FloatArray
    width: int

    @property
    def axes(self) -> list[int]:
        """Axes that were measured."""
        return [k for k in range(3) if np.isfinite(self.twist[:, k]).any()]


def ground(work: LogUnderCheck) -> Ground | None:
    """The twist as measured, else that of the pose; None where neither was recorded.

    A twist without all axes, of a gyroscope, yields to a pose that was recorded in most rows and tells all of them.
    """
    twist, pose = work.get("twist"), work.get("pose")
    twist_ground = Ground("twist", twist, 1) if twist is not None else None
    if pose is None or work.step <= 0.0 or len(work) < 20:
        return twist_ground
    often = min(len(work.recorded("pose", k)) for k in range(3)) > 0.5 * len(work)
    if twist_ground is not None and (
        len(twist_ground.axes) == 3 or not often or not np.isfinite(pose).any(axis=0).all()
    ):
        return twist_ground
    return Ground("pose", *pose_twist(work, pose))


def pose_twist(work: LogUnderCheck, pose: FloatArray) -> tuple[FloatArray, int]:
    """(twist of the body from differences of the pose, shape (rows, 3); rows over which each is a mean)."""
    heading = unwrapped(pose[:, 2])
    rate = central_rate(heading, work.t, max(1, round(0.5 * POSE_WINDOW / work.step)))
    turning = np.nanquantile(np.abs(rate), 0.95) if np.isfinite(rate).any() else 0.0
    seconds = min(POSE_WINDOW, POSE_TURN / turning) if turning > 0.0 else POSE_WINDOW
    half = max(1, round(0.5 * seconds / work.step))
    twist = np.full((len(pose), 3), np.nan)
    twist[:, 2] = central_rate(heading, work.t, half)
    if np.isfinite(heading).any() and np.isfinite(pose[:, :2]).any():
        speed = np.column_stack([central_rate(pose[:, k], work.t, half) for k in range(2)])
        turn = world_to_body(smooth(heading, 2 * half + 1))
        twist[:, :2] = np.einsum("kij,kj->ki", turn[:, :2, :2], speed)
    for segment in work.segments[1:]:
        twist[max(0, segment.start - half) : segment.start + half] = np.nan
    return twist, 2 * half + 1


def wheels_twist(work: LogUnderCheck, speed: FloatArray, width: int = 1) -> FloatArray | None:
    """Twist of the robot from its wheels, smoothed over `width` rows. Shape (rows, 3); None without a robot."""
    robot = work.geometry
    if robot is None or speed.shape[1] != robot.wheels.count:
        return None
    return twist_from_wheel_speed(robot.wheels, smooth(speed, width))


def volts(work: LogUnderCheck) -> FloatArray | None:
    """Voltage of the motors: as logged, else duty times the supply (logged, or of the robot file)."""
    nominal = work.geometry.drive.supply if work.geometry is not None else None
    return asked_voltage(work.get("voltage"), work.get("duty"), work.get("supply"), nominal)


def ohmic(work: LogUnderCheck, current: FloatArray) -> FloatArray | None:
    """Voltage lost in the windings, R i and the drop of brushes and driver [V]; None without a robot."""
    robot = work.geometry
    if robot is None:
        return None
    motor, n = robot.motor, robot.wheels.count
    voltage_drop = per_wheel(motor.resistance, n) * current
    drop = per_wheel(motor.voltage_drop, n)
    return voltage_drop + drop * np.sign(current) if drop.any() else voltage_drop


def stall_current(robot: Robot) -> float:
    """Most that a blocked motor of the robot draws [A]."""
    return float(np.max(robot.motor.voltage_limit)) / float(np.min(robot.motor.resistance))


def beyond_stall(robot: Robot, current: FloatArray) -> float:
    """How many times the current of a blocked motor is usually reached; above BEYOND_RATIO it is no current in A."""
    return float(np.nanquantile(np.abs(current), 0.95)) / stall_current(robot)


def keys_behind(source: str) -> tuple[str, ...]:
    """The keys of the robot file that a source of `expected_wheel_speed` takes."""
    if source == CURRENT_AND_VOLTAGE:
        return CIRCUIT
    return GEOMETRY if source in ("twist", "pose", "twist_command", FLOOR) else ()


def electric_speed(work: LogUnderCheck) -> FloatArray | None:
    """Wheel speed that voltage and current imply, (u - R i - drop)/(K l) [rad/s]; None where one is missing."""
    voltage, current, robot = volts(work), work.get("current"), work.geometry
    if voltage is None or current is None or robot is None or work.log.current_unsigned:
        return None
    if beyond_stall(robot, current) > BEYOND_RATIO:
        return None
    ohmic_drop = ohmic(work, current)
    return None if ohmic_drop is None else no_load_speed(robot.motor, voltage - ohmic_drop)


def emf(work: LogUnderCheck, speed: FloatArray) -> FloatArray | None:
    """Back-EMF at a wheel speed [V]; None without a robot."""
    return None if work.geometry is None else back_emf(work.geometry.motor, speed)


def expected_wheel_speed(work: LogUnderCheck, without: str = "") -> tuple[str, FloatArray] | None:
    """(source, wheel speed by it, shape (rows, wheels)), from the most exact source there is."""
    robot, floor_motion = work.geometry, ground(work)
    if robot is not None and floor_motion is not None and len(floor_motion.axes) == 3:
        return floor_motion.name, wheel_speed(robot.wheels, floor_motion.twist)
    electric = electric_speed(work)
    if electric is not None:
        return CURRENT_AND_VOLTAGE, electric
    command = work.get("wheel_speed_command")
    if command is not None:
        return "wheel_speed_command", command
    orders = work.full("twist_command")
    if robot is not None and orders is not None:
        return "twist_command", wheel_speed(robot.wheels, orders)
    driven, speed = work.get("voltage"), work.get("wheel_speed")
    if driven is None:
        driven = work.get("duty")
    if driven is None or speed is None or without != "wheel_speed" or driven.shape != speed.shape:
        return None
    top, below = np.nansum(np.abs(speed)), np.nansum(np.abs(driven))
    return (DRIVE, driven * (top / below)) if below > 0.0 else None
