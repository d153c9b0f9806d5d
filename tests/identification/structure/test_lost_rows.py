"""Rows that are missing where an input changes: what they may hide is no misfit, and hides none that is larger. Logs by
the simulator of wrong_worlds, which shares no code with ours."""

import numpy as np
import pytest

from benchmarks.wrong_worlds.kinds import by_name
from benchmarks.wrong_worlds.log import AR, SPEEDS, TICKS, logged, right_case, robot_of
from benchmarks.wrong_worlds.score import drawn
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.linear.driven_motion import motions
from omnidyn.identification.output_error.linear.missing_inputs import losses, shown_by_losses
from omnidyn.identification.output_error.prepare import make_problem, read_records
from omnidyn.model.wheels import wheel_speed
from omnidyn.run import Run
from tests.support.codes import codes

WORDS = "rows that are missing where they change"


def without(run, rows):
    kept = np.delete(np.arange(len(run)), rows)
    return Run(run.t[kept], **{name: values[kept] for name, values in run.channels.items()})


def lacking(run, seed):
    """The log without 3 % of its rows."""
    return without(run, np.flatnonzero(np.random.default_rng(seed).random(len(run)) < 0.03))


def motion_of(run, robot):
    question = OutputError(start="rest", nuisances=())
    problem = make_problem(read_records([run], robot, question), robot, question)
    return motions(problem, problem.start())[0]


@pytest.mark.parametrize("late", [0, 1])
def test_what_a_lost_row_hides_is_what_is_off_without_it(late):
    """The row at which every wheel changed, or the one before it, is lost: half of the time between its neighbours, or
    none of it, was driven by the later voltage. At the last row of a log, too."""
    case = right_case(0).setup_but(sensor=SPEEDS, memory=0.0)
    robot = robot_of(case.told)
    run = logged(case, 0, noisy=False)
    changed = 1 + np.flatnonzero((np.diff(run.voltage, axis=0) != 0.0).all(axis=1))
    for at, end in ((changed[3], changed[3] + 60), (changed[5], changed[5] + 2)):
        whole = Run(run.t[:end], voltage=run.voltage[:end], wheel_speed=run.wheel_speed[:end])
        full, lost = motion_of(whole, robot), motion_of(without(whole, [at - late]), robot)
        seen = np.delete(full.twist, at - late, axis=0) - lost.twist
        (row,) = losses(lost.piece)
        assert lost.t[row] < run.t[at] < lost.t[row + 1] + 1e-9
        half = shown_by_losses(lost)[:, :, 1] * np.sqrt(3.0)
        expected = np.zeros_like(half) if late else half
        np.testing.assert_allclose(wheel_speed(robot.wheels, seen).T, expected, atol=1e-6 + 1e-3 * np.abs(half).max())
        assert np.abs(half).max() > 0.1


def test_what_is_no_loss():
    case = right_case(0).setup_but(sensor=SPEEDS, memory=0.0)
    run, robot = logged(case, 0, noisy=False), robot_of(case.told)
    held = np.flatnonzero(
        (run.voltage[1:-1] == run.voltage[2:]).all(axis=1) & (run.voltage[1:-1] == run.voltage[:-2]).all(axis=1)
    )
    assert not losses(motion_of(run, robot).piece).size
    assert not losses(motion_of(without(run, 1 + held[::97]), robot).piece).size  # nothing changed meanwhile
    own = np.sort(np.random.default_rng(0).uniform(0.0, 1.0, len(run))) * run.t[-1]
    uneven = Run(own, voltage=run.voltage, wheel_speed=run.wheel_speed)
    assert not losses(motion_of(uneven, robot).piece).size  # every change has a time of its own


@pytest.mark.parametrize(("seed", "sensor"), [(44, SPEEDS), (47, TICKS), (50, AR)])
@pytest.mark.some(1)
def test_what_lost_rows_explain_is_no_lack_of_fit(seed, sensor):
    """Right worlds, which were said to leave something out."""
    case = right_case(seed).setup_but(sensor=sensor, memory=0.8 if sensor == AR else 0.0)
    case = case if sensor == AR else case.setup_but(rate=50.0, seconds=20.0)
    lack = identify(lacking(logged(case, seed), seed), robot_of(case.told), OutputError(free="friction")).lack_of_fit
    assert not lack.found
    assert max(lack.rounded.values()) > 0.3
    assert "rounding_may_hide" in codes(lack.statements())


def test_losses_that_hid_nothing_say_nothing_of_the_one_that_did():
    """Each has all of its variance: three changes that came as the log has them, and a last one that came sooner."""
    case = right_case(98008).setup_but(sensor=TICKS, memory=0.0)
    run = logged(case, 98008)
    changed = 1 + np.flatnonzero((np.diff(run.voltage, axis=0) != 0.0).any(axis=1))
    end = changed[-1] + 2
    whole = Run(run.t[:end], voltage=run.voltage[:end], wheel_angle=run.wheel_angle[:end])
    lost = without(whole, [*(changed[[5, 12, -3]] - 1), changed[-1]])
    lack = identify(lost, robot_of(case.told), OutputError(free="friction")).lack_of_fit
    assert not lack.found
    assert max(lack.rounded.values()) > 0.3


def test_a_misfit_is_found_beside_lost_rows():
    """A fading battery, its numbers 6.9 standard errors off."""
    case, seed, _ = drawn(by_name("fade"), 6)
    lack = identify(lacking(logged(case, seed), seed), robot_of(case.told), OutputError(free="friction")).lack_of_fit
    assert lack.found
    assert lack.remedies[0].key == "fade"
