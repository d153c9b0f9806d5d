"""Band: between which lines a predicted run lies, as far as the robot file knows its numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from omnidyn.arguments import Rng, check_order, seed_of
from omnidyn.arrays import FloatArray
from omnidyn.compiled.parallel import one_by_one
from omnidyn.model.known.uncertainty import DRAWS, QuantileTails, first_order_std, plausible
from omnidyn.model.robot import Robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate

COMMANDED = ("duty", "wheel_speed_command", "twist_command", "supply")  # the same for every robot
HALF_WIDTH = float(ndtri(0.975))  # half of a 95 % interval, in std of a normal


class Band(NamedTuple):
    """The ends of a 95 % interval of a run, sample by sample and component by component: what a robot may do whose
    numbers are off as its file says. What sensors add is not in it. draws: robots that were run, 0 of slopes.

    The low end is no run of one robot: where one goes further along x, it may go less far along y.
    """

    low: Run
    high: Run
    draws: int


def confidence_band(
    robot: Robot,
    voltage: ArrayLike | None = None,
    dt: ArrayLike | None = None,
    *,
    draws: int = DRAWS,
    rng: Rng = 0,
    **options: Any,
) -> Band:
    """The band of `simulate(robot, voltage, dt, **options)`: the same run by so many plausible robots.

    Args:
        robot: A robot whose file has std.
        voltage: As in `simulate` [V], shape (n, wheels).
        dt: Length of the rows [s], a number or shape (n,).
        draws: Number of plausible robots.
        rng: A seed or a numpy.random.Generator of the draws.
        options: Other arguments of `simulate`.

    Raises InsufficientDataError where no number of the robot has a std, and what `simulate` raises.

    >>> import omnidyn
    >>> from omnidyn.model.robot import Prior
    >>> robot = omnidyn.load_robot("axebot").replace(priors={"motor.resistance_ohm": Prior(std=0.05)})
    >>> band = omnidyn.confidence_band(robot, [[0.0, 3.0, -3.0]] * 50, dt=0.02, draws=20)
    >>> bool(band.low.twist[-1, 0] < band.high.twist[-1, 0])
    True
    """
    check_order("confidence_band(robot, voltage, dt)", (robot, Robot), (voltage, object))
    return band_of(plausible(robot, draws, seed_of(rng)), lambda candidate: simulate(candidate, voltage, dt, **options))


def band_of(robots: Sequence[Robot], run_of: Callable[[Robot], Run]) -> Band:
    """The band over the runs of some robots, all at the same times. The kernels let other threads run."""
    first, ends = run_of(robots[0]), QuantileTails(len(robots))
    ends.add(_predicted(first))
    for run in one_by_one(run_of, robots[1:]):
        ends.add(_predicted(run))
    low, high = (_as_run(first, end, words) for end, words in zip(ends.interval, ("low", "high"), strict=True))
    return Band(low, high, len(robots))


def first_order_band(robot: Robot, run: Run, run_of: Callable[[Robot], Run]) -> Band:
    """The band about the run of a robot, from its slopes along all that may be off.

    run_of: what robots beside it do, at the same times; their runs may be coarse, for only their differences count.
    What is about to move, or to stop, has no slope: where it rests, the band has no width.
    """
    half = HALF_WIDTH * first_order_std(robot, lambda candidate: _predicted(run_of(candidate)))
    at = _predicted(run)
    return Band(_as_run(run, at - half, "low"), _as_run(run, at + half, "high"), 0)


def _predicted(run: Run) -> FloatArray:
    """What follows from the robot, side by side. Shape (samples, columns)."""
    return np.hstack([values for name, values in run.channels.items() if name not in COMMANDED])


def _as_run(like: Run, end: FloatArray, end_name: str) -> Run:
    channels, column = {}, 0
    for name, values in like.channels.items():
        if name not in COMMANDED:
            channels[name] = end[:, column : column + values.shape[1]]
            column += values.shape[1]
    return Run(t=like.t, **channels, source=f"{like.source}, {end_name} end of the 95 % band")
