"""The equations of motion backward: which voltages make a robot move as wanted. dynamics.py read from right to left.

    wrench W = M twist' - frame - friction            eqs (4)-(6); friction as it slides, or as it gives way
    currents   G K i = W,  sum R i^2 least            eqs (7)-(10); more than three wheels share by least heat
    voltage  u = R i + K_v l w + V_d sgn i            eq (11), and what the dead band of the driver takes, on top

A gear of efficiency eta gives K eta i while its motor drives, K i/eta while it is driven.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.model.actuation import asked_for
from omnidyn.model.dynamics import frame_wrench
from omnidyn.model.mass import mass_matrix
from omnidyn.model.motor import traction, voltage_of_current
from omnidyn.model.robot import Robot
from omnidyn.model.sliding import ROUNDING, FrictionLevels, levels_of, resisting, speeds
from omnidyn.model.wheels import per_wheel, wheel_speed

ROUNDING_RATE = 1e-10  # [1/s] of the fastest speed: an acceleration less than that is rounding
AGAIN = 8  # times that the motors which drive are told apart from those which are driven


class Effort(NamedTuple):
    """voltage [V] to ask of the drivers and current [A] that then flows, shape (*batch, wheels) each."""

    voltage: FloatArray
    current: FloatArray


@dataclass(frozen=True, eq=False)
class Inverse:
    """What does not change from step to step: mass matrix (3, 3), friction, force per ampere (wheels,)."""

    robot: Robot
    mass: FloatArray
    levels: FrictionLevels
    per_ampere: FloatArray
    share: FloatArray  # currents of least heat per wrench, without losses of gears, (wheels, 3)
    rounding: float = ROUNDING  # of the fastest element: slower is at rest; more where numbers have fewer digits

    def friction(self, twist: FloatArray, acceleration: FloatArray) -> FloatArray:
        """Wrench of friction [N, N, N m] on a robot that moves so, and speeds up so; shapes (*batch, 3).

        An element at rest that is about to move resists with all that can hold it: its breakaway level.
        """
        levels, still, slight = self.levels, np.zeros(2), max(ROUNDING_RATE, self.rounding)
        speed, about = (speeds(levels, motion, self.rounding) for motion in (twist, acceleration))
        fastest = np.abs(speed).max(axis=-1, keepdims=True)
        about = np.where(np.abs(about) <= slight * fastest, 0.0, about)
        rests = speed == 0.0
        slide, ellipse = levels.sliding(speed, twist)
        coulomb = resisting(levels, speed, np.sign(speed), slide, twist[..., :2], ellipse)
        rising = np.where(rests, np.sign(about), 0.0)
        stands = np.all(twist[..., :2] == 0.0, axis=-1, keepdims=True)
        faint = np.abs(acceleration[..., :2]) <= slight * fastest
        direction = np.where(stands & ~faint, acceleration[..., :2], still)
        return coulomb + resisting(levels, 0.0 * speed, rising, levels.hold, direction, levels.ellipse_hold)

    def soft_friction(self, twist: FloatArray, fade: FloatArray) -> FloatArray:
        """Wrench of friction at a twist (*batch, 3), its dry part in proportion to the speed below `fade`, shape (3,).

        For a controller, whose twist is never exactly 0; no friction is like that.
        """
        levels = self.levels
        speed = twist @ levels.directions.T
        side = np.clip(speed / np.sqrt(levels.directions**2 @ fade**2), -1.0, 1.0)
        slide, ellipse = levels.sliding(speed, twist)
        least_dissipation = float(np.sqrt(np.sum(((1.0 if levels.plain else levels.ellipse_slide) * fade[:2]) ** 2)))
        return resisting(levels, speed, side, slide, twist[..., :2], ellipse, least_dissipation)

    def wrench(self, twist: FloatArray, acceleration: FloatArray, friction: FloatArray) -> FloatArray:
        """Wrench of the motors [N, N, N m] that a motion takes. Shapes (*batch, 3)."""
        return acceleration @ self.mass - frame_wrench(self.robot, twist) - friction

    def effort(self, twist: FloatArray, wrench: FloatArray, acceleration: FloatArray | None = None) -> Effort:
        """Voltage and current of each motor for a wrench at a twist. Shapes (*batch, 3) -> (*batch, wheels).

        acceleration: which way wheels at rest are about to turn, for gears that lose; None: no way.
        """
        speed = wheel_speed(self.robot.wheels, twist)
        current = wrench @ self.share.T
        if np.any(np.asarray(self.robot.motor.gear_efficiency) != 1.0):
            about = 0.0 * twist if acceleration is None else acceleration
            rims = slice(len(self.levels.directions) - speed.shape[-1], None)
            now, next_ = speeds(self.levels, twist)[..., rims], speeds(self.levels, about)[..., rims]
            current = self._behind_gears(wrench, current, np.sign(np.where(now == 0.0, next_, now)))
        return Effort(asked_for(self.robot, voltage_of_current(self.robot.motor, current, speed)), current)

    def _behind_gears(self, wrench: FloatArray, current: FloatArray, turning: FloatArray) -> FloatArray:
        """Currents whose gears lose: which motors drive is found by trying."""
        efficiency = per_wheel(self.robot.motor.gear_efficiency, self.robot.wheels.count)
        for _ in range(AGAIN):
            sides = np.sign(current) * turning
            gain = self.per_ampere * efficiency**sides
            trial = np.einsum("...wk,...k->...w", _least_heat(self.robot, gain), wrench)
            settled, current = bool((np.sign(trial) * turning == sides).all()), trial
            if settled:
                break
        return current


def inverse(robot: Robot) -> Inverse:
    """Make ready to ask a robot for voltages."""
    per_ampere = np.diag(traction(robot.motor, robot.wheels, np.eye(robot.wheels.count))).copy()
    return Inverse(robot, mass_matrix(robot), levels_of(robot), per_ampere, _least_heat(robot, per_ampere))


def _least_heat(robot: Robot, gain: FloatArray) -> FloatArray:
    """R^-1 H^T (H R^-1 H^T)^-1, H = G diag(gain): currents per wrench with the least sum of R i^2. (*batch, wheels, 3).

    gain [N/A]: force at the rim per ampere, shape (*batch, wheels).
    """
    push = robot.wheels.wrench_matrix * gain[..., None, :]
    eased = np.swapaxes(push, -1, -2) / per_wheel(robot.motor.resistance, robot.wheels.count)[:, None]
    return np.asarray(eased @ np.linalg.inv(push @ eased), dtype=float)
