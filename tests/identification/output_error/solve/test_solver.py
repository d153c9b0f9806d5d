"""The descent: what it asks the engine for."""

from omnidyn.identification.output_error.engines.exact import ExactEngine
from omnidyn.identification.output_error.problem.motion import motion
from omnidyn.identification.output_error.problem.record import record
from omnidyn.identification.whole_logs import fit_output_error
from omnidyn.model import dynamics, statespace
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import excitation, noisy_draw


def test_a_fit_marches_through_no_point_twice(axebot, monkeypatch):
    """Two starts, two steps, and once more for the intervals: the better start is not marched through again."""
    asked, marched = [], ExactEngine.sums

    def sums(engine, point, weighting):
        asked.append((point.values.tobytes(), weighting.mode))
        return marched(engine, point, weighting)

    monkeypatch.setattr(ExactEngine, "sums", sums)
    log = noisy_draw(simulate(axebot, excitation(20.0), 0.01), 0)
    found = fit_output_error(log, axebot, start="rest", nuisances=())
    assert found.converged
    assert len(asked) == len(set(asked))


def test_a_fit_derives_the_motors_twice_at_most(axebot, monkeypatch):
    """Whether the robot is exact, and what the kernels take; the friction is put beside these."""
    derived, wrench = [], dynamics.drive_wrench

    def drive_wrench(*given):
        derived.append(given)
        return wrench(*given)

    monkeypatch.setattr(statespace, "drive_wrench", drive_wrench)
    log = noisy_draw(simulate(axebot, excitation(20.0), 0.01), 0)
    derived.clear()
    fit_output_error(log, axebot, start="rest", nuisances=())
    assert len(derived) == 2 * 2  # braking and driving


def test_what_an_axis_held_is_asked_only_where_one_stood_still(axebot):
    log = noisy_draw(simulate(axebot, excitation(20.0), 0.01), 0)
    assert motion([record(log, axebot)], axebot).moved.all()
    assert not motion([record(log, axebot)], axebot).held.any()
    assert log.twist is not None
    still = log.replace(twist=log.twist * [1.0, 0.0, 1.0])
    found = motion([record(still, axebot)], axebot)
    assert found.moved.tolist() == [True, False, True]
    assert found.held[1] > 1.0
