"""The paper's line on each body axis, eqs (15)-(17), from the steady windows of logs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from omnidyn.identification.estimate import Estimate
from omnidyn.identification.methods import SteadyState
from omnidyn.identification.steady.operating_points import ForcePoints, force_points
from omnidyn.identification.steady.points import driven_axes
from omnidyn.identification.steady.steady_state import fit_steady_state
from omnidyn.logs.steady_table import SteadyTable
from omnidyn.model.frames import AXES
from omnidyn.model.friction import Friction
from omnidyn.model.keys import DIRECTION, WHEELS
from omnidyn.model.robot import Robot
from omnidyn.run import Run


def identify_lines(
    runs: Sequence[Run], robot: Robot, asked: SteadyState, groups: Sequence[str] | None = None
) -> dict[str, Estimate]:  # fmt: skip
    """B and C of each axis and group: group -> Estimate. groups: name of each run's group.

    Every point counts for the axes that it drives. Friction elsewhere than on the axes is taken off the robot.
    Raises InsufficientDataError when no axis of a group has three points at two speeds or more.
    """
    points = force_points(
        runs, robot, groups=groups, speed=asked.speed, force_from=asked.force_from, window=asked.window
    )
    plain = robot.replace(friction=Friction(axes=robot.friction.axes), priors=_without_other_friction(robot))
    found = {}
    for group in points.groups:
        own = points.chosen(np.array([name == group for name in points.group]))
        found[group] = fit_steady_state(plain, steady_table(robot, own, group))
    return found


def steady_table(robot: Robot, points: ForcePoints, source: str = "") -> SteadyTable:
    """The points as rows of a steady table, one for each axis that a point drives."""
    row, axis = np.nonzero(driven_axes(robot, points.twist, points.wrench) & (points.twist != 0.0))
    return SteadyTable(
        axis=[AXES[k] for k in axis], speed=points.twist[row, axis], force=points.wrench[row, axis],
        twist=points.twist[row], force_from=points.force_from, source=source, notes=points.notes,
    )  # fmt: skip


def _without_other_friction(robot: Robot) -> dict:
    return {key: prior for key, prior in robot.priors.items() if key.rpartition(".")[0] not in (DIRECTION, WHEELS)}
