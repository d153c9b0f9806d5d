"""The runs behind the figures, against the model by hand and the printed tables."""

import numpy as np
import pytest

from omnidyn.paper.experiments import DT, dead_zone_ramps, step_responses, table1_runs
from tests.paper import printed


@pytest.fixture(scope="module")
def steps(axebot):
    return step_responses(axebot)


@pytest.fixture(scope="module")
def ramps(axebot):
    return dead_zone_ramps(axebot)


def test_nine_steps(steps):
    assert [[step.level for step in steps[axis]] for axis in printed.AXES] == [[2, 3, 4]] * 3
    measured = {axis: [step.measured_speed for step in steps[axis]] for axis in printed.AXES}
    assert measured == {"x": [0.37, 0.74, 1.08], "y": [None, 0.42, 0.75], "yaw": [8.04, None, None]}


@pytest.mark.parametrize("axis", printed.AXES)
def test_steps_rise_exponentially_to_their_settled_speed(steps, axis):
    """v(t) = v_inf (1 - e^(-a t)), written out."""
    column = printed.AXES.index(axis)
    rate = -np.diag(printed.eq_13()[0])[column]
    for step in steps[axis]:
        settled = printed.settled(step.voltage)[column]
        assert step.settled_speed == pytest.approx(settled, rel=1e-12)
        wanted = settled * -np.expm1(-rate * step.run.t)
        np.testing.assert_allclose(step.run.twist[:, column], wanted, atol=1e-12)
        assert (np.delete(step.run.twist, column, axis=1) == 0.0).all()
        assert (step.run.voltage == step.voltage).all()


@pytest.mark.parametrize("axis", printed.AXES)
def test_table_1_runs_have_what_fig_2_shows(axebot, axis):
    runs = table1_runs(axebot)[axis]
    assert len(runs) == 4
    for run, level in zip(runs, printed.LEVEL[axis], strict=True):
        volts = level * np.array(printed.PATTERN[axis])
        assert (run.voltage == volts).all()
        np.testing.assert_allclose(run.current[0], volts / printed.R_A, rtol=1e-14)
        np.testing.assert_allclose(run.twist[-1], printed.settled(volts), rtol=1e-4)


@pytest.mark.parametrize("axis", printed.AXES)
def test_ramps_leave_rest_at_breakaway(ramps, axis):
    """Exactly 0 up to the breakaway voltage, moving right after: the first sample beyond it."""
    ramp, column = ramps[axis], printed.AXES.index(axis)
    assert len(ramp.scale) == len(ramp.run)
    np.testing.assert_allclose(np.outer(ramp.scale, ramp.pattern), ramp.run.voltage, atol=1e-15)
    moving = ramp.run.twist[:, column] != 0.0
    first = int(np.argmax(moving))
    assert moving[first:].all()
    assert ramp.scale[first - 2] <= ramp.breakaway_voltage < ramp.scale[first - 1]
    assert round(ramp.breakaway_voltage, 3) == {"x": 0.670, "y": 0.528, "yaw": 0.174}[axis]
    assert ramp.printed_voltage == {"x": 1.0, "y": 1.0, "yaw": 0.3}[axis]
    assert ramp.scale[-1] > ramp.printed_voltage
    assert ramp.run.t[1] == DT
