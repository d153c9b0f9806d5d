"""The numbers of many robots as a struct of arrays, and blocks of WIDTH robots that kernels step as one.

A block is a table: a row for each number, a column for each robot. Its rows lie beside each other in memory, so that a
loop along a row becomes vector instructions, and a block stays in the cache nearest to the processor.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.model.dynamics import motor_wrench
from omnidyn.model.mass import axis_masses
from omnidyn.model.robot import Robot

WIDTH = 64  # robots in a block
MASS, INERTIA = 0, 2  # rows of `mass`


class BatchParameters(NamedTuple):
    """Forces and masses of n robots whose axes do not couple but for the turning frame. Units follow the axes.

    push: of each wheel per volt [N/V, N/V, N m/V], shape (3, wheels, n). damping: viscous friction and back-EMF
    [N s/m, N s/m, N m s]; coulomb, breakaway [N, N, N m]; mass: what a force along an axis speeds up, with all that
    spins [kg, kg, kg m^2], shape (3, n) each. body_mass [kg]: of the body alone, shape (n,).
    """

    push: FloatArray
    damping: FloatArray
    coulomb: FloatArray
    breakaway: FloatArray
    mass: FloatArray
    body_mass: FloatArray

    @property
    def count(self) -> int:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Number of robots."""
        return self.mass.shape[-1]

    @property
    def wheels(self) -> int:
        """Number of wheels of each."""
        return self.push.shape[1]

    def at(self, robots: Any) -> BatchParameters:
        """Those of some of the robots: a mask, indices or a slice."""
        return BatchParameters(*(values[..., robots] for values in self))


def wheels_of(robots: Sequence[Robot]) -> int:
    """The number of wheels of each of some robots. Raises InputError where they differ in it, or there is no robot."""
    if isinstance(robots, str | Robot) or not all(isinstance(robot, Robot) for robot in robots):
        raise InputError(
            "not robots",
            got=robots.name if isinstance(robots, Robot) else type(robots).__name__,
            expected="a list of robots, or what omnidyn.sample gives",
            remedy="[robot] * n is n robots alike, omnidyn.load_robot reads one",
            where="robots",
        )
    counts = sorted({robot.wheels.count for robot in robots})
    if len(counts) != 1:
        raise InputError(
            "cannot simulate these robots as one batch",
            got=f"robots of {' and '.join(map(str, counts))} wheels" if counts else "no robot",
            expected="one robot or more, all with as many wheels",
            remedy="simulate a batch for each number of wheels",
            where="robots",
        )
    return counts[0]


def batch_parameters(robots: Sequence[Robot]) -> BatchParameters:
    """The numbers of robots, one after the other. Raises InputError where they differ in their number of wheels."""
    wheels_of(robots)
    distinct_robots = {id(robot): robot for robot in robots}  # a robot that is repeated is read once
    position = {key: k for k, key in enumerate(distinct_robots)}
    rows = [_of_robot(robot) for robot in distinct_robots.values()]
    index = np.array([position[id(robot)] for robot in robots])
    return BatchParameters(*(np.stack(values, axis=-1)[..., index] for values in zip(*rows, strict=True)))


def _of_robot(robot: Robot) -> tuple[FloatArray, ...]:
    motors, axes, direction = motor_wrench(robot), robot.friction.axes, robot.friction.direction
    viscous, coulomb, breakaway = axes.levels
    along = np.array([direction.viscous, direction.viscous, direction.yaw_viscous])
    levels = np.array([*direction.coulomb, direction.yaw_coulomb])
    return (
        motors.driving.T + 0.0,
        viscous + along - np.diag(motors.braking),
        coulomb + levels,
        breakaway + levels,
        axis_masses(robot),
        np.array(robot.body.mass),
    )


def in_blocks(rows: FloatArray, dtype: Any) -> NDArray[Any]:
    """Rows of numbers, shape (rows, n), as blocks, shape (blocks, rows, WIDTH). The last robot fills the last block."""
    count = rows.shape[-1]
    blocks = -(-count // WIDTH)
    padded = np.empty((len(rows), blocks * WIDTH), dtype)
    padded[:, :count], padded[:, count:] = rows, rows[:, -1:]
    return np.ascontiguousarray(padded.reshape(len(rows), blocks, WIDTH).swapaxes(0, 1))


def out_of_blocks(blocks: NDArray[Any], count: int) -> NDArray[Any]:
    """The rows of the first `count` robots, shape (rows, count): `in_blocks` backward."""
    return blocks.swapaxes(0, 1).reshape(blocks.shape[1], -1)[:, :count]
