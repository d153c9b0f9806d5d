"""Energy: motors that would have to be driven by the robot they drive.

On a level floor what the motors give goes into kinetic energy and friction, and friction takes:
integral of T w dt >= change of M v^2/2. Where that fails, voltage, speed and robot file are not of one robot.
"""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.log_under_check import MIN_ROWS, LogUnderCheck
from omnidyn.findings.signal.reference import ground, volts
from omnidyn.findings.signal.robust import white_noise
from omnidyn.model.keys import EMF
from omnidyn.model.mass import mass_matrix
from omnidyn.model.motor import back_emf, settled_current, wheel_torque
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import twist_from_wheel_speed, wheel_speed
from omnidyn.statement import ERROR

MARGIN = 0.08  # of the power that turns with the back-EMF: K, R and the gear are not known better
WINDOW = 0.4  # [s]
MOVING_SHARE = 0.2  # of the back-EMF that 95 % of the rows stay below: a robot at rest says nothing
LEAST_SHARE = 0.02  # of the rows
OF_BACK_EMF = (EMF, "motor.gear_ratio", "wheels.wheel_radius_m")


def check_energy(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """The finding on rows whose energy is impossible."""
    voltage, robot = volts(work), work.geometry
    speed = _speed(work)
    if voltage is None or robot is None or speed is None or voltage.shape != speed.shape or len(work) < 2:
        return [], work
    points = len(work) < MIN_ROWS and work.step >= 0.1
    if robot.drive.latency and not points:  # what acts now was asked before
        asked = np.searchsorted(work.t, work.t - robot.drive.latency + 1e-9, side="right") - 1
        voltage = voltage[np.maximum(asked, 0)]
    mask, worst = _points(robot, voltage, speed) if points else _windows(work, robot, voltage, speed)
    if not mask.any() or mask.mean() < (0.0 if points else LEAST_SHARE):
        return [], work
    excess = _excess(robot, voltage[mask], speed[mask])
    return [
        Finding(
            "energy",
            ERROR,
            "",
            {"worst_W": worst, "emf_over_voltage": excess},
            rows=work.lines(mask),
            count=int(mask.sum()),
            rests_on=OF_BACK_EMF,
        )
    ], work


def _speed(work: LogUnderCheck) -> FloatArray | None:
    speed, robot = work.full("wheel_speed"), work.geometry
    if speed is not None or robot is None:
        return speed
    floor_motion = ground(work)
    return (
        wheel_speed(robot.wheels, floor_motion.twist)
        if floor_motion is not None and len(floor_motion.axes) == 3
        else None
    )


def _power(robot: Robot, voltage: FloatArray, speed: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(mechanical power of the motors [W], power that turns with the back-EMF [W], the scale of it). Shape (rows,)."""
    torque = wheel_torque(robot.motor, settled_current(robot.motor, voltage, speed))
    braking_torque = wheel_torque(robot.motor, settled_current(robot.motor, back_emf(robot.motor, speed), 0.0 * speed))
    return (torque * speed).sum(axis=1), np.abs(braking_torque * speed).sum(axis=1)


def _excess(robot: Robot, voltage: FloatArray, speed: FloatArray) -> float:
    counter = back_emf(robot.motor, speed)
    return float(np.nansum(np.abs(counter)) / max(np.nansum(np.abs(voltage)), 1e-12))


def _points(robot: Robot, voltage: FloatArray, speed: FloatArray) -> tuple[BoolArray, float]:
    """Each row a steady state of its own."""
    power, scale = _power(robot, voltage, speed)
    counter = np.sqrt((back_emf(robot.motor, speed) ** 2).sum(axis=1))
    with np.errstate(invalid="ignore"):
        mask = (power < -MARGIN * scale) & (counter > MOVING_SHARE * np.nanquantile(counter, 0.95))
    return mask, float(-power[mask].min()) if mask.any() else 0.0


def _windows(work: LogUnderCheck, robot: Robot, voltage: FloatArray, speed: FloatArray) -> tuple[BoolArray, float]:
    """Balance over windows: work of the motors, change of kinetic energy."""
    nothing = np.zeros(len(work), dtype=bool), 0.0
    width = max(4, round(WINDOW / work.step))
    edges = []
    for segment in work.segments:
        ends = ((a, min(a + width, segment.stop - 1)) for a in range(segment.start, segment.stop, width))
        edges += [(a, b) for a, b in ends if b - a >= width // 2]
    if not edges:
        return nothing
    low, high = np.array(edges).T
    length = np.diff(work.t)
    mean = 0.5 * (speed[1:] + speed[:-1])
    power, scale = _power(robot, voltage[:-1], mean)
    finite = np.isfinite(power)
    work_done, size, missing_count = (
        np.concatenate([[0.0], np.cumsum(np.nan_to_num(column))])
        for column in (power * length, scale * length, np.where(finite, 0.0, 1.0))
    )
    twist = twist_from_wheel_speed(robot.wheels, speed)
    mass = mass_matrix(robot)
    momentum = twist @ mass
    kinetic = 0.5 * (twist * momentum).sum(axis=1)
    noise = np.array([white_noise(column) for column in twist.T])
    change = kinetic[high] - kinetic[low]
    unsure = 4.0 * np.sqrt(((momentum[low] * noise) ** 2).sum(axis=1) + ((momentum[high] * noise) ** 2).sum(axis=1))
    unsure += (np.diag(mass) * noise**2).sum() * 6.0
    spent = work_done[high] - work_done[low]
    impossible = (spent - change < -MARGIN * (size[high] - size[low]) - unsure - MARGIN * np.abs(change)) & (
        missing_count[high] - missing_count[low] == 0.0
    )
    # Only where the back-EMF is the larger of the two, and the robot moves.
    counter = np.sqrt((back_emf(robot.motor, mean) ** 2).sum(axis=1))
    applied = np.sqrt((voltage[:-1] ** 2).sum(axis=1))
    bar = MOVING_SHARE * float(np.nanquantile(counter, 0.95))
    e, u = (np.concatenate([[0.0], np.cumsum(np.nan_to_num(column))]) for column in (counter, applied))
    impossible &= (e[high] - e[low] > 1.02 * (u[high] - u[low])) & (e[high] - e[low] > bar * (high - low))
    # Noise of the speed makes E[w^2] too large, which looks like back-EMF.
    lift, _ = _power(robot, np.zeros((1, speed.shape[1])), np.array([[white_noise(column) for column in speed.T]]))
    span = work.t[high] - work.t[low]
    impossible &= spent - change < -MARGIN * (size[high] - size[low]) - unsure + 2.0 * float(lift[0]) * span
    mask = np.zeros(len(work), dtype=bool)
    for a, b in zip(low[impossible], high[impossible], strict=True):
        mask[a:b] = True
    if not impossible.any():
        return nothing
    return mask, float((-(spent - change) / span)[impossible].max())
