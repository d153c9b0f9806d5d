"""The figures of the paper as far as they can be made from its numbers."""

from __future__ import annotations

from collections.abc import Iterator

from omnidyn.identification.steady.steady_state import fit_steady_state
from omnidyn.model.robot import Robot
from omnidyn.paper.experiments import dead_zone_ramps, step_responses, table1_runs
from omnidyn.paper.friction import table_1_points
from omnidyn.paper.reconcile import reconciliations
from omnidyn.report.figures.paper_dead_zone import draw_dead_zone
from omnidyn.report.figures.paper_friction import TREATMENTS, draw_friction
from omnidyn.report.figures.paper_reconciliation import draw_reconciliation
from omnidyn.report.figures.paper_steps import draw_steps
from omnidyn.report.figures.paper_traces import draw_traces
from omnidyn.report.figures.robot import draw_robot
from omnidyn.report.style import (
    Picture,
)


def paper_pictures(robot: Robot) -> Iterator[Picture]:
    """Figs. 1 to 5 for this robot beside the numbers of the paper, and what would reconcile the two."""
    yield draw_robot(robot)
    yield draw_traces(table1_runs(robot))
    points = table_1_points()
    yield draw_friction({rest: fit_steady_state(robot, points, rest_use=rest) for rest in TREATMENTS})
    yield draw_steps(step_responses(robot))
    yield draw_dead_zone(dead_zone_ramps(robot))
    yield draw_reconciliation(reconciliations(robot))
