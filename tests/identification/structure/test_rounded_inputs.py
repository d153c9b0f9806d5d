"""Inputs that are logged in steps: what they may have been rounded by is in the intervals, unless the log tells that
the motors took just these steps. Logs by the simulator of wrong_worlds, which shares no code with ours."""

import numpy as np
import pytest

from benchmarks.wrong_worlds.kinds import KINDS
from benchmarks.wrong_worlds.log import COUNTS, SPEEDS, logged, right_case, robot_of
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.linear.input_steps import input_steps
from omnidyn.identification.output_error.linear.rounded_inputs import beside_rounding
from omnidyn.identification.output_error.problem.record import record
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import NOISE, voltages
from tests.support.codes import codes
from tests.support.rounded_logs import a_fit, errors, rounded

AXEBOT = load_robot("axebot")


def test_voltages_that_were_rounded_are_in_the_intervals():
    """Steps of .3 V: without them intervals of these logs hold the truth in two of three."""
    found = [errors(seed, 0.3) for seed in range(4)]
    z = np.array([each for each, _ in found])
    assert (np.abs(z) < 1.96).mean() >= 0.92
    assert np.sqrt((z**2).mean()) > 0.5
    assert all("rounded_inputs" in codes(told) for _, told in found)


def test_a_supply_that_is_logged_makes_no_new_rounding_of_every_row():
    """A duty is held while its supply ripples: what was rounded off stays the same for as long as the duty does."""
    case = right_case(0).setup_but(sensor=SPEEDS, memory=0.0, rate=50.0)
    run, robot = logged(case, 7000), robot_of(case.told)
    duty, ripple = rounded(run.voltage / 12.0, 0.025), np.random.default_rng(1).normal(size=len(run.t))
    even, uneven = (
        identify(
            run.replace(voltage=None, duty=duty, supply=12.0 + size * ripple),
            robot,
            OutputError(nuisances=(), free="friction"),
        ).std
        for size in (0.0, 0.01)
    )
    assert [uneven[key] / even[key] for key in even] == pytest.approx([1.0] * len(even), abs=0.15)


@pytest.mark.parametrize(("seed", "step", "duties"), [(1, 0.1, True), (2, 0.3, False)])
def test_what_rounding_explains_is_no_lack_of_fit(seed, step, duties):
    """Right worlds, which were said to leave something out: it is told what is rounding, and what would cure it. In the
    last one inputs that came to 0 beside others, and commands that came to the same step, make much of it."""
    fit = a_fit(seed, step, duties=duties)
    lack = fit.lack_of_fit
    assert not lack.found
    assert not lack.beyond
    assert not fit.stability.found
    assert 0.02 < max(lack.rounded.values()) < 0.5
    assert any(
        "rounding of the inputs, or rows that are missing" in str(each) and "more digits" in str(each)
        for each in lack.statements()
    )
    assert lack.to_dict()["rounded_inputs"] == pytest.approx(dict(lack.rounded))


def test_what_the_first_order_of_rounding_is_off_by_is_no_evidence():
    """Counted angles add up what is rounded to thousands of times their noise, and its second order to several."""
    assert not a_fit(2, 0.3, sensor=COUNTS).lack_of_fit.found


def test_a_log_whose_inputs_are_not_rounded_says_nothing_of_it():
    lack = a_fit(0, 0.0).lack_of_fit
    assert not lack.rounded
    assert "rounding_may_hide" not in codes(lack.statements())


def test_a_misfit_beyond_rounding_is_found_with_its_cause():
    """An ellipse of friction under the file of a box, voltages in steps of .3 V."""
    ellipse = next(kind for kind in KINDS if kind.name == "ellipse")
    lack = a_fit(0, 0.3, lambda case: ellipse.make(case, 0.8)).lack_of_fit
    assert lack.found
    assert lack.remedies[0].key == ellipse.key
    assert lack.remedies[0].confident


def test_steps_that_the_motors_take_explain_nothing():
    exact = rounded(voltages(np.random.default_rng(5), 30.0), 0.3)
    lack = identify(a_log(exact, exact, 6), AXEBOT, OutputError(nuisances=())).lack_of_fit
    assert not lack.found
    assert max(lack.rounded.values()) < 0.01


def a_log(voltage, told, seed):
    run = simulate(AXEBOT, voltage[:-1], 0.01)
    twist = run.twist + np.random.default_rng(seed).normal(size=run.twist.shape) * NOISE
    return Run(t=run.t, voltage=told, twist=twist)


def test_motors_that_take_just_these_steps_cost_little(monkeypatch):
    """A log in which the loss of 0.3 V would show by itself: none does. Were all of it counted, intervals would be
    seven times as wide; steps that did lose something make them so."""
    exact = rounded(voltages(np.random.default_rng(5), 30.0), 0.3)
    with monkeypatch.context() as without:
        without.setattr(f"{beside_rounding.__module__}.input_steps", lambda one: np.zeros(3))
        fine = identify(a_log(exact, exact, 6), AXEBOT, OutputError(nuisances=())).estimate
    steps = identify(a_log(exact, exact, 6), AXEBOT, OutputError(nuisances=())).estimate
    wider = [steps.std[key] / fine.std[key] for key in steps.value]
    print(np.round(wider, 2))
    assert 1.05 < min(wider) < max(wider) < 1.5
    lost = voltages(np.random.default_rng(5), 30.0)
    off = identify(a_log(lost, rounded(lost, 0.3), 6), AXEBOT, OutputError(nuisances=())).estimate
    assert min(off.std[key] / steps.std[key] for key in off.value) > 3.0


def steps_of(**inputs):
    rows = len(next(iter(inputs.values())))
    run = Run(t=np.arange(rows) * 0.01, twist=np.zeros((rows, 3)) + np.linspace(0, 1, rows)[:, None], **inputs)
    return input_steps(record(run, AXEBOT))


def test_steps_are_told_by_many_levels_that_are_whole():
    volts = np.repeat(np.random.default_rng(1).uniform(-5.0, 5.0, (40, 3)), 10, axis=0)
    assert steps_of(voltage=volts).tolist() == [0.0, 0.0, 0.0]
    assert steps_of(voltage=rounded(volts, 0.1)) == pytest.approx([0.1] * 3)
    assert steps_of(voltage=rounded(1.5 * volts, 0.07)) == pytest.approx([0.07] * 3)  # some beyond the limit of 6 V
    assert steps_of(voltage=rounded(volts, 1e-4)).tolist() == [0.0] * 3  # the text of a log
    assert steps_of(voltage=rounded(volts, 2.5)).tolist() == [0.0] * 3  # levels that a person chose
    duty, supply = rounded(volts / 6.0, 1.0 / 255.0), np.full(len(volts), 12.0)
    assert steps_of(duty=duty, supply=supply) == pytest.approx([12.0 / 255.0] * 3)
