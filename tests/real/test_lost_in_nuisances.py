"""Where automatic nuisances leave nothing to tell of the robot, the answer does without them, and says so."""

import pytest

from benchmarks.real import real_nuisances, udea
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.run import Run
from tests.support import real_logs as logs


@pytest.fixture(scope="module")
def turning(data):
    """Half of a recording of the udea robot that turns on the spot, seen by a camera."""
    whole = logs.udea_turning(data)[1]
    cut = udea.part(whole, slice(len(whole) // 2, None))
    return Run(t=cut.t, duty=cut.duty, pose=cut.pose, source="half")


@pytest.mark.long
def test_the_answer_does_without_a_dead_band_and_a_gain(turning):
    robot = real_nuisances.udea_robot()
    fit = identify(turning, robot, OutputError()).estimate
    assert [*fit.nuisances] == ["latency.heading"]
    assert ("dead_band", "gain") in [each.numbers.get("nuisances") for each in fit.warnings]
    assert fit.converged
    assert "friction.axes.coulomb[2]" not in fit.unidentifiable
