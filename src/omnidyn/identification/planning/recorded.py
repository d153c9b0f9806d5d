"""What the sensors of a robot log of a run, with their noise."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.model.log_effects import Sensors
from omnidyn.model.robot import Robot
from omnidyn.run import Run

Noise = Mapping[str, FloatArray]
CHANNELS = {"wheel_speed": 0, "current": 0, "twist": 3, "pose": 3}  # entries of each; 0: one per wheel
COUNTS = 2048.0  # in a turn of a wheel, where the robot file says nothing


def noise_of(robot: Robot, dt: float, given: Mapping[str, object] | None = None) -> dict[str, FloatArray]:
    """Channel -> std of its noise, one per component. given: by the user; else by the [sensors] of the robot file.

    Differences of counts of an encoder are speeds with the noise of what the count rounds off.

    Raises InputError for another channel, or for a noise that is no positive number, or as many as components.
    """
    wheels, sensors = robot.wheels.count, robot.sensors or Sensors()
    if given is None:
        speed = 2.0 * np.pi / (sensors.encoder_counts or COUNTS) / dt / np.sqrt(6.0)
        given = {"wheel_speed": speed}
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
            raise InputError(f"no noise of {channel}", got=std, expected=expected, where="noise")
        stds[channel] = values
    if not stds:
        raise InputError("nothing is recorded", got="no channel", expected=", ".join(CHANNELS), where="noise")
    return stds


def recorded(run: Run, robot: Robot, noise: Noise, rng: np.random.Generator) -> Run:
    """The run as it is logged: its inputs, and each channel that has a noise; poses only as often as they come."""
    channels = {}
    for channel, std in noise.items():
        values = np.asarray(getattr(run, channel)) + std * rng.standard_normal((len(run.t), len(std)))
        rate = (robot.sensors or Sensors()).pose_rate
        if channel == "pose" and rate is not None:
            new = np.diff(np.floor(run.t * rate), prepend=-1.0) > 0.0
            values[~new] = np.nan
        channels[channel] = values
    return Run(t=run.t, voltage=run.voltage, duty=run.duty, supply=run.supply, source="planned", **channels)
