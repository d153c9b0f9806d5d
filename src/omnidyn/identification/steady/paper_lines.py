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
    runs: Sequence[Run], robot: Robot, method: SteadyState, groups: Sequence[str] | None = None
) -> dict[str, Estimate]:
    """B and C of each axis and group: group -> Estimate. groups: name of each run's group.

    Every point counts for the axes that it drives. Friction elsewhere than on the axes is taken off the robot.
    Raises InsufficientDataError when no axis of a group has three points at two speeds or more.
    """
    points = force_points(
        runs, robot, groups=groups, speed=method.speed, force_from=method.force_from, window=method.window
    )
    priors = {key: prior for key, prior in robot.priors.items() if key.rpartition(".")[0] not in (DIRECTION, WHEELS)}
    plain_robot = robot.replace(friction=Friction(axes=robot.friction.axes), priors=priors)
    estimates = {}
    for group in points.groups:
        group_points = points.of(group)
        estimates[group] = fit_steady_state(plain_robot, steady_table(robot, group_points, group))
    return estimates


def steady_table(robot: Robot, points: ForcePoints, source: str = "") -> SteadyTable:
    """The points as rows of a steady table, one for each axis that a point drives."""
    row, axis = np.nonzero(driven_axes(robot, points.twist, points.wrench) & (points.twist != 0.0))
    return SteadyTable(
        axis=[AXES[k] for k in axis],
        speed=points.twist[row, axis],
        force=points.wrench[row, axis],
        twist=points.twist[row],
        force_from=points.force_from,
        source=source,
        notes=points.notes,
    )
