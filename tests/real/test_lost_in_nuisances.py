"""Where automatic nuisances leave nothing to tell of the robot, the answer does without them, and says so."""

import pytest

from benchmarks import real_nuisances, udea
from omnidyn.errors import InsufficientDataError
from omnidyn.identification.output_error.fit import Fit
from omnidyn.identification.whole_logs import fit_output_error
from omnidyn.run import Run
from tests.support import real_logs as logs


@pytest.fixture(scope="module")
def turning(data):
    """Half of a recording of the udea robot that turns on the spot, seen by a camera."""
    whole = logs.udea_turning(data)[1]
    cut = udea.part(whole, slice(len(whole) // 2, None))
    return Run(t=cut.t, duty=cut.duty, pose=cut.pose, source="half")


def test_a_dead_band_and_a_gain_leave_what_both_make_together(turning):
    """Errors of a heading that add up tell of what an endless memory hid: the friction, though hardly."""
    fit = fit_output_error(turning, real_nuisances._udea())
    assert "friction.axes.coulomb[2]" not in fit.unidentifiable
    assert "dead band and Coulomb friction, which trade with each other" in fit.summary()


def test_the_answer_does_without_a_dead_band_and_a_gain(turning, monkeypatch):
    """Where nothing is left to tell beside them, which logs decide, and here the test does."""
    plain = Fit.answer

    def answer(fit, solution, progress=None):
        if "gain" in solution.solver.problem.names:
            raise InsufficientDataError("these logs tell no number of the robot")
        return plain(fit, solution, progress)

    monkeypatch.setattr(Fit, "answer", answer)
    fit = fit_output_error(turning, real_nuisances._udea())
    assert [*fit.nuisances] == ["latency.heading"]
    assert any(words == "beside dead_band and gain these logs tell no number of the robot: not fitted"
               for words in fit.warnings)  # fmt: skip
    assert "friction.axes.coulomb[2]" not in fit.unidentifiable
