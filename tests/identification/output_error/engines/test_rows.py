"""The rows that an engine shows add up to the sums that it gives."""

from __future__ import annotations

import numpy as np
import pytest

from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.engines.engine import Weighting, added
from omnidyn.identification.output_error.fit import Fit
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import excitation, noisy

AXEBOT = load_robot("axebot")
TURNING = AXEBOT.replace(body=AXEBOT.body.replace(rotating_frame=True))


def logs(robot):
    return tuple(
        noisy(simulate(robot, dt=0.01, voltage=excitation(4.0, 100.0, seed)), seed).replace(source=f"{seed}.csv")
        for seed in (1, 2)
    )


@pytest.mark.parametrize("robot", [AXEBOT, TURNING], ids=["exact", "implicit"])
@pytest.mark.parametrize("groups", [None, ("a", "b")], ids=["alone", "joint"])
def test_the_rows_of_an_engine_add_up_to_its_sums(robot, groups):
    fit = Fit.of(list(logs(robot)), robot, OutputError(), groups)
    solver = fit.solver(None)
    start = solver.problem.start()
    point = type(start)(start.values * 1.02 + 1e-4, start.states)
    variance = np.linspace(1.0, 2.0, len(solver.problem.columns))
    weighting = Weighting(variance)
    count = len(solver.problem.parameters)
    for piece, rows, sums in zip(
        solver.problem.pieces, solver.engine.residuals(point), solver.engine.sums(point, weighting), strict=True
    ):
        mine = added(piece, solver.problem.columns, rows, weighting, count)
        assert np.array_equal(mine.number, sums.number)
        assert np.allclose(mine.square, sums.square, rtol=1e-10)
        assert np.allclose(mine.grad, sums.grad, rtol=1e-8, atol=1e-9 * np.abs(sums.grad).max())
        assert np.allclose(mine.info, sums.info, rtol=1e-8, atol=1e-9 * np.abs(sums.info).max())
