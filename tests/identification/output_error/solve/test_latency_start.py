"""Where a fit of a late log begins: numbers far off do not choose its latency."""

import pytest

import omnidyn
from benchmarks.identification.live import LATE, RATE, logs
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.fit import Fit
from tests.support.axebot_logs import TRUTH, with_friction

AXEBOT = omnidyn.load_robot("axebot")
QUESTION = OutputError(free=("friction", "motor.resistance_ohm"), nuisances=("latency", "push"))


@pytest.fixture(scope="module")
def counted():
    """Counts of wheels by an exact simulator of its own, 20 ms late."""
    return logs("encoder differences", range(4), 30.0)[1::2]


@pytest.mark.parametrize("factor", [0.4, 2.0])
@pytest.mark.parametrize("number", [0, 1])
@pytest.mark.some(2)
def test_counts_that_are_late_are_fitted_from_friction_far_off(counted, number, factor):
    wrong = with_friction(AXEBOT, [factor * value for value in TRUTH.values()])
    solution = Fit.of([counted[number]], wrong, QUESTION).solve()
    found = dict(zip(solution.solver.problem.names, solution.state.point.values.tolist(), strict=True))
    assert found["latency.wheel_angle"] == pytest.approx(LATE / RATE, abs=2e-4)
    assert all(found[name] == pytest.approx(value, rel=0.01) for name, value in TRUTH.items())
