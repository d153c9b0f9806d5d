"""What the sensors of a robot log of a run, with their noise."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.model.drive import DUTY, SPEED
from omnidyn.model.robot import Robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate

Noise = Mapping[str, FloatArray]
CHANNELS = {
    "wheel_angle": 0,
    "wheel_speed": 0,
    "current": 0,
    "twist": 3,
    "pose": 3,
}  # entries of each; 0: one per wheel
INPUTS = ("voltage", "duty", "supply", "wheel_speed_command")
SPEED_SHARE = 0.8  # of the speed without load: the most that a firmware is asked for, so that it can hold it
FINE = 4  # steps in a row, over which the angle of a wheel adds up
TOLERANCE = 3e-4  # [m/s] of a run: well below what stands, and what sensors see
COUNTS = 2048.0  # in a turn of a wheel, where the robot file says nothing


def noise_of(robot: Robot, dt: float, given: Mapping[str, object] | None = None) -> dict[str, FloatArray]:
    """Channel -> std of its noise, one per component; of wheel_angle the step of a count [rad].

    given: by the user; else by the [sensors] of the robot file, or what a fit found of its logs: counts and poses.
    Where that says nothing of counts, speeds are taken as logged that are differences of COUNTS a turn: with the noise
    of what a count rounds off.

    Raises InputError for another channel, or for a noise that is no positive number, or as many as components.
    """
    wheels, sensors = robot.wheels.count, robot.sensor_model
    if given is None:
        tick = 2.0 * np.pi / (sensors.encoder_counts or COUNTS)
        given = {"wheel_angle": tick} if sensors.encoder_counts else {"wheel_speed": tick / dt / np.sqrt(6.0)}
        if sensors.pose_noise is not None:
            heading = sensors.heading_noise or sensors.pose_noise
            given |= {"pose": (sensors.pose_noise, sensors.pose_noise, heading)}
    stds = {}
    for channel, std in given.items():
        if channel not in CHANNELS:
            raise InputError("no such channel", got=channel, expected=", ".join(CHANNELS), where="noise")
        count = CHANNELS[channel] or wheels
        try:
            values = np.broadcast_to(np.asarray(std, dtype=float), count).copy()
        except (TypeError, ValueError):
            values = np.full(count, np.nan)
        if not (np.isfinite(values).all() and (values > 0.0).all()):
            expected = f"a number above 0, or {count} of them"
            raise InputError(f"not a noise of {channel}", got=std, expected=expected, where="noise")
        stds[channel] = values
    if not stds:
        raise InputError("nothing is recorded", got="no channel", expected=", ".join(CHANNELS), where="noise")
    return stds


def driven(robot: Robot, share: FloatArray, dt: float, tol: float = TOLERANCE) -> Run:
    """A run from rest under an input given as a share of the largest one, rows of dt [s], shape (rows, wheels)."""
    rows = share * largest_input(robot)
    if robot.drive.kind == DUTY:
        return simulate(robot, duty=rows, supply=robot.drive.supply, dt=dt, tol=tol)
    if robot.drive.kind == SPEED:
        return simulate(robot, wheel_speed_command=rows, dt=dt, tol=tol)
    return simulate(robot, rows, dt, tol=tol)


def largest_input(robot: Robot) -> FloatArray:
    """The most that is asked for: a duty of 1, volts, or rad/s of a speed loop, of each wheel or of all."""
    if robot.drive.kind == DUTY:
        return np.ones(1)
    limit = np.broadcast_to(np.asarray(robot.motor.voltage_limit, dtype=float), robot.wheels.count)
    if robot.drive.kind == SPEED:
        return SPEED_SHARE * limit / (np.asarray(robot.motor.emf_constant) * np.asarray(robot.motor.gear_ratio))
    return limit


def recorded(robot: Robot, share: FloatArray, dt: float, noise: Noise, rng: np.random.Generator) -> Run:
    """The log of such a run: its inputs, and each channel that has a noise; poses only as often as they come."""
    fine = FINE if "wheel_angle" in noise else 1
    run = driven(robot, np.repeat(share, fine, axis=0), dt / fine)
    t = np.asarray(dt * np.arange(len(share) + 1), dtype=float)
    channels = {}
    for channel, std in noise.items():
        if channel == "wheel_angle":
            speed = np.asarray(run.wheel_speed)
            angle = np.concatenate([np.zeros((1, len(std))), np.cumsum(0.5 * (speed[1:] + speed[:-1]), axis=0)])
            channels[channel] = std * np.floor(angle[::fine] * dt / fine / std + rng.random(len(std)))
            continue
        exact = np.asarray(getattr(run, channel))[::fine]
        channels[channel] = exact + std * rng.standard_normal(exact.shape)
        rate = robot.sensor_model.pose_rate
        if channel == "pose" and rate is not None:
            channels[channel][np.diff(np.floor(t * rate), prepend=-1.0) == 0.0] = np.nan
    inputs = {name: None if rows is None else rows[::fine] for name in INPUTS for rows in (getattr(run, name),)}
    return Run(t=t, source="planned", **inputs, **channels)
