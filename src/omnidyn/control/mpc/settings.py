"""What can be chosen of the controller: weights of its cost, and what its observer expects."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.control.mpc.model import emf, volts
from omnidyn.control.mpc.program import (
    AGAIN,
    AVERAGED,
    CURRENT,
    LAST_WEIGHT,
    LEARN,
    POSE_WEIGHT,
    SETTINGS_SIZE,
    SLEW,
    SPEED,
    SPEED_WEIGHT,
    TWIST_WEIGHT,
)
from omnidyn.errors import InputError
from omnidyn.model.dynamics import motor_wrench
from omnidyn.model.mass import per_mass
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel

Three = tuple[float, float, float]
POSE: Three = (200.0, 200.0, 20.0)  # of the paper's robot, as VOLTS [1/V^2] and WALK
VOLTS = 2e-3
WALK: Three = (0.003, 0.003, 0.012)
PUSH_WALK: Three = (0.02, 0.02, 0.08)
PAPER_RATE, MOST_WALK = 6.7, 4.0  # [1/s] at which the paper's robot settles; times as much for a faster speed loop
LOOP_VOLTS = 0.25  # of the cost of volts, of commands of a speed loop: that is smooth by itself
NOISE: Three = (0.01, 0.01, 0.04)
POSE_NOISE: Three = (0.002, 0.002, 0.004)
FILTERED: Three = (1e-9, 1e-9, 1e-9)  # of poses that come from a PoseEstimator: the observer believes them
MOST_PRECISE = 8.0  # times as fast it learns a push of sensors that are so many times as precise as NOISE
LEAST_NOISE = np.array([2e-4, 2e-4, 8e-4])
TURN = 2.0 * math.pi
PAPER_MASS = 1.5  # [kg]
PER_VOLT_SQUARE = 4.788951776922385  # [m^2/s^4/V^2] sum of its squared accelerations in the plane by 1 V on a wheel


class Tables(NamedTuple):
    """Settings as kernels read them: settings (SETTINGS_SIZE,); weight of each wheel's volts, (wheels,).

    limit (2, wheels): of volts [V], and R i_max [V]. emf (wheels, 3): back-EMF.
    """

    settings: FloatArray
    weight: FloatArray
    limit: FloatArray
    emf: FloatArray


@dataclass(frozen=True)
class Settings:
    """Weights of errors of the pose [1/m^2, 1/m^2, 1/rad^2], of the twist, of volts beside those of the path [1/V^2].

    pose, volts, walk: None: POSE, VOLTS and WALK of the paper's robot; of another volts go with the square of what a
    volt speeds it up by, pose and the square of walk with the mass. pose_noise: None: what the sensors say of it, else
    POSE_NOISE. push_walk: None: PUSH_WALK; behind a speed loop it goes with the rate at which that settles, MOST_WALK
    times as much at the most: the same share of a model that is wrong is a larger push there.
    last: how much more the end of the horizon counts. again: how often at most a step is made linear anew.
    noise, pose_noise: std of the measured twist and pose that the observer expects [m/s, m/s, rad/s], [m, m, rad];
    noise: None: NOISE, `twist_noise` where that is more; where it is less, push_walk is larger by as much.
    walk, pose_walk: std of what a step may bring that the model does not know. push_walk: of the change of an unknown
    push in a step [m/s^2, m/s^2, rad/s^2]; scale_walk: of the share of the modelled friction.
    current: limit of each motor [A], that of the robot's motors by default. slew: limit of the change of volts [V/s].
    speed: limits of the twist [m/s, m/s, rad/s], soft: speed_weight is the cost beyond them, as of the twist.
    """

    pose: Three | None = None
    twist: Three = (1.0, 1.0, 0.1)
    volts: float | None = None
    last: float = 5.0
    again: int = 2
    noise: Three | None = None
    pose_noise: Three | None = None
    walk: Three | None = None
    pose_walk: Three = (5e-4, 5e-4, 1e-3)
    push_walk: Three | None = None
    scale_walk: float = 0.005
    current: float | None = None
    slew: float | None = None
    speed: Three | None = None
    speed_weight: float = 1e4

    def __post_init__(self) -> None:
        for name in ("pose", "twist", "noise", "pose_noise", "walk", "pose_walk", "push_walk"):
            if name != "twist" and name != "pose_walk" and getattr(self, name) is None:
                continue
            value = np.asarray(getattr(self, name), dtype=float)
            if value.shape != (3,) or not np.all((value >= 0.0) & (value <= 1e9)):
                raise InputError("not weights", got=getattr(self, name), expected="three numbers >= 0", where=name)
        for name in ("current", "slew"):
            value = getattr(self, name)
            if value is not None and not 0.0 < value <= 1e9:
                raise InputError("not a limit", got=value, expected="a number above 0, or None", where=name)
        speed = self.speed
        if speed is not None and (len(speed) != 3 or not all(0.0 < limit <= 1e9 for limit in speed)):
            raise InputError("not limits", got=speed, expected="three numbers above 0, or None", where="speed")
        for name, low, high in (("last", 0.0, 1e6), ("again", 1, 20), ("scale_walk", 0.0, 10.0)):
            if not low <= getattr(self, name) <= high:
                raise InputError("out of range", got=getattr(self, name), expected=f"{low:g} to {high:g}", where=name)

        if self.volts is not None and not 1e-9 <= self.volts <= 1e9:
            raise InputError("out of range", got=self.volts, expected="1e-09 to 1e+09, or None", where="volts")

    def of(self, robot: Robot, dt: float, driven: Robot | None = None) -> Settings:
        """The settings with a number in place of each None, for a robot and steps of dt [s].

        driven: the robot as its speed loop lets it be driven.

        A heavier robot has more of what its model does not know, and pays less for the volts that correct it. Both laws
        were found beside others on `bench control_real`. A volt that a speed loop answers with more back-EMF speeds it
        up by less, and costs less by the square of that, times LOOP_VOLTS.
        """
        heavier = min(max(robot.body.mass / PAPER_MASS, 0.1), 100.0)
        pose = tuple(heavier * weight for weight in POSE) if self.pose is None else self.pose
        walk = tuple(math.sqrt(heavier) * std for std in WALK) if self.walk is None else self.walk
        volts = self.volts
        if volts is None:
            per_volt = per_mass(robot, motor_wrench(robot).driving)[:, :2]
            volts = VOLTS * min(max(round(float(np.sum(per_volt**2)) / PER_VOLT_SQUARE, 12), 1e-3), 1e3)
            if driven is not None:
                volts *= LOOP_VOLTS * float(np.sum(emf(robot) ** 2) / np.sum(emf(driven) ** 2))
        push_walk = self.push_walk
        if push_walk is None:
            more = 1.0 if driven is None else min(max(_rate(driven) / PAPER_RATE, 1.0), MOST_WALK)
            rows = zip(PUSH_WALK, NOISE, twist_noise(robot, dt), strict=True)
            push_walk = tuple(more * std * min(max(most / noise, 1.0), MOST_PRECISE) for std, most, noise in rows)
        pose_noise = POSE_NOISE if self.pose_noise is None else self.pose_noise
        noise = self.noise
        if noise is None:  # what a model misses of a step is no less than that of usual sensors
            noise = tuple(np.maximum(NOISE, twist_noise(robot, dt)).tolist())
        return replace(self, pose=pose, walk=walk, volts=volts, noise=noise, pose_noise=pose_noise, push_walk=push_walk)

    def tables(self, robot: Robot, dt: float, learn: bool) -> Tables:
        """The settings for a robot and steps of dt [s]; learn: whether the observer runs."""
        settings = self.of(robot, dt)
        table, count = np.zeros(SETTINGS_SIZE), robot.wheels.count
        table[POSE_WEIGHT : POSE_WEIGHT + 3], table[TWIST_WEIGHT : TWIST_WEIGHT + 3] = settings.pose, settings.twist
        table[LAST_WEIGHT], table[AGAIN], table[LEARN] = self.last, self.again, learn
        table[AVERAGED] = robot.sensor_model.averaged
        table[SLEW] = 0.0 if self.slew is None else self.slew * dt
        motor_current = robot.motor.current_limit
        table[CURRENT] = self.current is not None or motor_current is not None
        if self.speed is not None:
            table[SPEED : SPEED + 3], table[SPEED_WEIGHT] = self.speed, self.speed_weight
        amperes = np.minimum(
            *(per_wheel(np.inf if maximum is None else maximum, count) for maximum in (self.current, motor_current))
        )
        limit = np.array([volts(robot), np.minimum(amperes * per_wheel(robot.motor.resistance, count), 1e9)])
        return Tables(table, np.full(count, settings.volts), limit, emf(robot))


def twist_noise(robot: Robot, dt: float) -> Three:
    """Std of a measured twist [m/s, m/s, rad/s]: of counts of encoders and of a gyroscope, as the sensors say.

    A difference of counts is off by that of two roundings, q/sqrt(6) where a count is q [m] at the rim; over a step of
    dt [s] that is q/(sqrt(6) dt) of the speed of the rim.
    """
    sensors = robot.sensor_model
    noise = np.array(NOISE)
    if sensors.encoder_counts is not None:
        rim = TURN * robot.wheels.radii / (sensors.encoder_counts * math.sqrt(6.0) * dt)
        noise = np.sqrt(np.linalg.pinv(robot.wheels.wrench_matrix.T) ** 2 @ rim**2)
    if sensors.has_gyroscope:
        noise[2] = math.hypot(sensors.gyro_noise or 0.0, sensors.gyro_bias or 0.0)
    along, across, turning = np.maximum(noise, LEAST_NOISE).tolist()
    return along, across, turning


def _rate(robot: Robot) -> float:
    """How fast motors and friction let a robot settle, the mean along x and y [1/s]."""
    return float(-np.mean(np.diag(per_mass(robot, motor_wrench(robot).braking))[:2]))
