"""The firmware's speed loop: PI on the speed of each wheel, once per tick, saturating.

    e = set speed - speed,  u = clip(kp e + sum, +-limit),  sum += ki e period unless that pushes further into the limit

Between ticks the voltage stays. Of what it asks for the motors get all but the dead band of the driver. The branch of a
tick is told apart from what it gives, so that the derivative of the loop is taken of the same lines, on the branch that
the run took.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.compiled.kernel import part
from omnidyn.model.layout import N_AXES
from omnidyn.model.robot import Robot
from omnidyn.simulation.commands import loop_gains


class LoopSettings(NamedTuple):
    """Gains and set points of a speed loop; without commands the voltages are given."""

    kp: FloatArray  # (n,) [V s/rad]
    ki: FloatArray  # (n,) [V/rad]
    limit: FloatArray  # (n,) [V]
    radius: FloatArray  # (n,) [m]
    command: FloatArray  # (rows, n) [rad/s], or (0, n)
    tick: BoolArray  # (rows,) whether the loop runs at the start of the row; else its voltage stays
    period: float  # [s]
    sum: FloatArray  # (n,) integral so far [V]
    dead: float  # [V] of what the loop asks for the driver passes on all but this


def no_loop(wheels: int) -> LoopSettings:
    """No speed loop: voltages are given."""
    zeros = np.zeros(wheels)
    return LoopSettings(
        zeros, zeros, zeros, zeros, np.zeros((0, wheels)), np.zeros(0, np.bool_), 0.0, zeros.copy(), 0.0
    )


def loop_of(robot: Robot, set_point: FloatArray, tick: BoolArray) -> LoopSettings:
    """The loop of a robot at rest. set_point [rad/s], shape (rows, n), and tick, shape (rows,): see `on_ticks`."""
    period, total = 1.0 / (robot.drive.rate or np.inf), np.zeros(robot.wheels.count)
    return LoopSettings(*loop_gains(robot), set_point, tick, period, total, robot.drive.dead_band)


@part
def passed(voltage, dead):
    """What a driver with a dead band makes of a voltage [V], as `reaching` does."""
    size = abs(voltage) - dead
    return 0.0 if size <= 0.0 else (size if voltage > 0.0 else -size)


@part
def seen_speed(g, x, radius, moves):
    """Speed of a wheel, its local direction g, as the encoder shows it [rad/s]: exactly 0 where it sticks."""
    rim = g[0] * x[0] + g[1] * x[1] + g[2] * x[2]
    return rim / radius if moves else 0.0


@part
def tick_branch(kp, ki, limit, period, error, total):
    """(whether the integral takes its step, side of the limit at which the voltage stands: -1, 0 or 1)."""
    next_total = total + ki * error * period
    wanted_volts = kp * error + next_total
    takes = (abs(wanted_volts) <= limit) | (wanted_volts * error < 0.0)
    volts = wanted_volts if takes else kp * error + total
    return takes, (1.0 if volts > limit else (-1.0 if volts < -limit else 0.0))


@part
def tick_answer(kp, ki, limit, period, error, total, takes, side):
    """(voltage [V], integral [V]) after a tick on that branch."""
    total = total + ki * error * period if takes else total
    return (side * limit if side != 0.0 else kp * error + total), total


@part
def close_loop(plant, state, loop, command, voltage):
    """One tick of all wheels under set points (n,): the voltages (n,), and the integrals in place."""
    for w in range(len(loop.kp)):
        kp, ki, limit, e = loop.kp[w], loop.ki[w], loop.limit[w], N_AXES + w
        error = command[w] - seen_speed(plant.element[e].g, state.x, loop.radius[w], state.each[e].sign != 0.0)
        takes, side = tick_branch(kp, ki, limit, loop.period, error, loop.sum[w])
        voltage[w], loop.sum[w] = tick_answer(kp, ki, limit, loop.period, error, loop.sum[w], takes, side)
