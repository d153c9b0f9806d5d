"""From the robot to the numbers of the exact step and of the outputs, and how these change with a free parameter.

The physics stands in model/ and exact/exact_march.py; here it is only read off, once for the value and once or twice
for each derivative. The friction of the axes enters linearly, each axis for itself: there one probe serves all six
numbers, and the whole fit.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.problem.parameters import Parameter, robot_at
from omnidyn.model.dynamics import MotorWrench, motor_wrench, settled_currents, state_space
from omnidyn.model.keys import BOX, Key
from omnidyn.model.mass import axis_masses
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import wheel_speed
from omnidyn.simulation.exact.exact_march import axis_levels

EPS = 1e-5  # relative change of a parameter: rounding 1e-11, curvature 1e-10


@dataclass(frozen=True, eq=False)
class Primitives:
    """Numbers of the exact step, and linear maps from twist and voltage to wheel speed and current.

    rate, coulomb, hold (3,); drive (3, W); wheels (W, 3) [rad/s per twist]; braking (W, 3) [A per twist]; per_volt (W,)
    [A/V]; per_force (3,) [1/kg, 1/kg, 1/(kg m^2)]. As derivatives all arrays have one more axis, the parameter, at the
    end.
    """

    rate: FloatArray
    coulomb: FloatArray
    hold: FloatArray
    drive: FloatArray
    wheels: FloatArray
    braking: FloatArray
    per_volt: FloatArray
    per_force: FloatArray

    @property
    def parts(self) -> tuple[FloatArray, ...]:
        return self.rate, self.coulomb, self.hold, self.drive, self.wheels, self.braking, self.per_volt, self.per_force


def primitives(robot: Robot, motors: MotorWrench | None = None) -> Primitives:
    """The numbers of a robot that the exact engine takes. motors: its `motor_wrench`, where that is known."""
    system, count = state_space(robot, motors), robot.wheels.count
    rate, coulomb, hold = axis_levels(robot, system)
    return Primitives(
        rate,
        coulomb,
        hold,
        system.B,
        wheel_speed(robot.wheels, np.eye(3)).T,
        settled_currents(robot, np.eye(3), np.zeros(count)).T,
        np.diag(settled_currents(robot, np.zeros(3), np.eye(count))).copy(),
        1.0 / axis_masses(robot),
    )


class PrimitiveMap:
    """From the free parameters of a robot to its primitives and their derivatives.

    breakaway (3,): levels S that stay [N, N, N m], as the robot file has them; NaN where S follows coulomb.
    """

    def __init__(self, robot: Robot, parameters: Sequence[Parameter]):
        self.robot, self.parameters = robot, tuple(parameters)
        breakaway = robot.friction.axes.breakaway
        self.breakaway = np.full(3, np.nan) if breakaway is None else np.array(breakaway)
        self.linear = all(p.name in BOX for p in parameters)
        self._start = np.array([Key.parse(p.name).get(robot) for p in parameters])
        motors = motor_wrench(robot)
        self._base, self._masses = primitives(robot, motors), axis_masses(robot)
        self._probe = self._friction_slopes(robot, self._base, motors)

    def with_levels(self, levels: Mapping[str, float]) -> Self:
        """The same with these levels of breakaway, by key; 0 follows coulomb."""
        new_map = copy.copy(self)
        new_map.breakaway = self.breakaway.copy()
        for name, level in levels.items():
            new_map.breakaway[Key.parse(name).axis] = level
        return new_map

    def robot_at(self, values: FloatArray) -> Robot:
        """The robot with these values, not checked."""
        return robot_at(self.robot, self.parameters, values)

    def at(self, values: FloatArray) -> tuple[Primitives, Primitives]:
        """(primitives, their derivatives by the values). `values`, shape (P,)."""
        if self.linear:  # in rate and coulomb; nothing else depends on the friction of the axes
            value_changes, base, probe = values - self._start, self._base, self._probe
            rate, coulomb = base.rate + probe.rate @ value_changes, base.coulomb + probe.coulomb @ value_changes
            return self._held(base, self._masses, rate, coulomb), probe
        robot = self.robot_at(values)
        motors = motor_wrench(robot)
        primitives_now = primitives(robot, motors)
        slopes = [np.zeros((*part.shape, len(values))) for part in primitives_now.parts]
        fast = self._friction_slopes(robot, primitives_now, motors)
        for j, (p, value) in enumerate(zip(self.parameters, values, strict=True)):
            if p.name in BOX:
                for slope, fast_slope in zip(slopes, fast.parts, strict=True):
                    slope[..., j] = fast_slope[..., j]
                continue
            step = EPS * (abs(float(value)) or 1.0)
            upper, lower = (primitives(p.on(robot, float(value) + side * step)) for side in (1.0, -1.0))
            for slope, a, b in zip(slopes, upper.parts, lower.parts, strict=True):
                slope[..., j] = (a - b) / (2.0 * step)
        return self._held(primitives_now, axis_masses(robot), primitives_now.rate, primitives_now.coulomb), Primitives(
            *slopes
        )

    def _held(
        self, primitives_now: Primitives, masses: FloatArray, rate: FloatArray, coulomb: FloatArray
    ) -> Primitives:
        """At this rate and coulomb, with the breakaway of this mapping; never below coulomb."""
        hold = np.fmax(coulomb, self.breakaway / masses)
        return replace(primitives_now, rate=rate, coulomb=coulomb, hold=hold)

    def _friction_slopes(self, robot: Robot, base: Primitives, motors: MotorWrench) -> Primitives:
        """Derivatives by the six levels of the axes, from one probe: B moves the rate of its axis, C its coulomb."""
        slopes = [np.zeros((*part.shape, len(self.parameters))) for part in base.parts]
        viscous, coulomb, _ = robot.friction.axes.levels
        levels = {"viscous": tuple(viscous + 1.0), "coulomb": tuple(coulomb + 1.0), "breakaway": None}
        friction = robot.friction.model_copy(update={"axes": robot.friction.axes.model_copy(update=levels)})
        probe = robot.model_copy(update={"friction": friction})
        rate, coulomb, _ = axis_levels(probe, state_space(probe, motors))
        for j, p in enumerate(self.parameters):
            if p.name in BOX:
                kind, axis = divmod(BOX.index(p.name), 3)
                slopes[kind][axis, j] = (rate - base.rate, coulomb - base.coulomb)[kind][axis]
        return Primitives(*slopes)
