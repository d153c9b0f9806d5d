"""What an identification came to, in a sentence: a good model, a half-good one, a bad one."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest

from omnidyn.attempts import Attempts
from omnidyn.document import in_clauses, sentence
from omnidyn.findings.finding import Finding, Verdict
from omnidyn.identification.estimate import Correlation, Estimate
from omnidyn.identification.identification import After, Identification
from omnidyn.identification.identify import identify
from omnidyn.identification.lack_of_fit import LackOfFit
from omnidyn.identification.methods import OutputError, SteadyState
from omnidyn.identification.motors.motor_verdict import motors_verdict
from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.identification.verdict import fit_verdict, fits_verdict, steady_verdict
from omnidyn.model.keys import BOX
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.simulate import simulate
from omnidyn.statement import ERROR, Statement
from tests.support.axebot_logs import excitation, noisy_draw
from tests.support.codes import codes

AXEBOT = load_robot("axebot")


def followed_by(fits, validations=None):
    """What makes that which follows a fit."""
    return lambda: After(fits, validations or {}, (), (), Attempts())


class Score(NamedTuple):
    rmse: float
    fit_percent: float | None
    whiteness: float | None = 0.0


def estimate(std, kind: Any = OutputErrorEstimate, **more) -> Any:
    """An estimate of the paper's six numbers, each 2, with these standard errors."""
    names = BOX[: len(std)]
    return kind(
        robot=AXEBOT,
        value=dict.fromkeys(names, 2.0),
        std=dict(zip(names, std, strict=True)),
        ci95={name: (2.0 - 2.0 * s, 2.0 + 2.0 * s) for name, s in zip(names, std, strict=True)},
        correlation=Correlation(names, np.eye(len(names))),
        degrees_of_freedom=dict.fromkeys(names, 100),
        **more,
    )


def beside(scores, which="fitted") -> Any:
    return SimpleNamespace(scores={which: scores}, statement=lambda: Statement("held_out_noise"))


GOOD = {"w1": Score(0.1, 97.0), "w2": Score(0.1, 99.0)}
BAD = {"w1": Score(9.0, -50.0)}


def said(*statements):
    """Statements as sentences."""
    return " ".join(sentence(str(each)) for each in statements)


def test_a_good_fit():
    fit = estimate([0.02, 0.18, 0.02, 0.02, 0.02, 0.02])
    assert said(fit_verdict(fit, beside(GOOD, "held out"))) == (
        "On logs held out the model follows wheel speeds within 3 %, as well as the noise allows; all 6 numbers are "
        "known, the widest (viscous friction sideways) within 18 %."
    )
    other_floor = beside(GOOD, "held out")
    other_floor.statement = lambda: Statement("held_out_misfit", numbers={"chi2": 9.0, "fitted_too": False})
    assert said(fit_verdict(fit, other_floor)).startswith(
        "On logs held out the model follows wheel speeds within 3 %, but its errors are 3 times the noise: something "
        "differs between the logs; "
    )
    assert fit.verdict == "All 6 numbers are known, the widest (viscous friction sideways) within 18 %."


def test_a_half_good_fit():
    fit = estimate([0.02, 1.8, np.inf, 0.02, 0.02, 0.02], unidentifiable=(BOX[2],))
    scores = GOOD | {"heading": Score(1.2, -20.0)}
    assert said(fit_verdict(fit, beside(scores))) == (
        "On the fitted logs the model follows wheel speeds within 3 %, but heading not at all (rms error 1.2 rad); "
        "4 of 6 numbers are known, the widest (viscous friction forward) within 2 %; not known: "
        "viscous friction sideways and viscous friction turning."
    )


def test_a_bad_fit():
    assert said(fit_verdict(estimate([0.02] * 6), beside(BAD))) == (
        "On the fitted logs the model does not follow: wheel speeds not at all (rms error 9 rad/s): "
        "its numbers are not usable until it does."
    )
    lost = estimate([0.02] * 6, not_followed=("wheel_speed[0]",))
    assert lost.verdict == "The model does not follow wheel_speed[0]: its numbers are not usable until it does."
    assert fit_verdict(lost, beside(GOOD)).numbers["known"] is None


def test_no_number_is_known():
    fit = estimate([2.0] * 6)
    assert fit.verdict == (
        "No number is known: not viscous friction forward, viscous friction sideways, viscous friction turning, "
        "Coulomb friction forward and 2 more."
    )
    assert estimate([0.02], Estimate).verdict == "Viscous friction forward is known within 2 %."


def test_a_number_whose_interval_holds_0_is_not_known():
    """Few rows: the interval reaches 12.7 standard errors to each side."""
    fit = estimate([0.02, 0.18, 0.02])
    wide = replace(fit, ci95=fit.ci95 | {BOX[1]: (2.0 - 12.7 * 0.18, 2.0 + 12.7 * 0.18)})
    assert wide.verdict == (
        "2 of 3 numbers are known, the widest (viscous friction forward) within 2 %; not known: viscous friction "
        "sideways."
    )
    far = replace(fit, ci95=fit.ci95 | {BOX[1]: (0.2, 20.0)})  # of a number with a logarithm
    assert not far.is_known(BOX[1])
    assert far.half_width(BOX[1]) == pytest.approx(4.95)
    bound = replace(fit, value=fit.value | {BOX[1]: 0.0}, ci95=fit.ci95 | {BOX[1]: (0.0, 0.3)}, at_bound=(BOX[1],))
    assert not bound.is_known(BOX[1])
    assert bound.verdict.endswith("within 2 %; not known: viscous friction sideways.")


def test_what_misses_next_to_nothing_does_not_stand_first():
    small = LackOfFit(True, {"wheel_speed[0]": 0.2}, {}, (), (), {}, missed=0.002)
    fit = replace(estimate([0.02] * 6), study=lambda: SimpleNamespace(lack_of_fit=small))
    assert codes(fits_verdict({"": fit}, {})) == ["not_compared", "misfit_small"]
    large = replace(fit, study=lambda: SimpleNamespace(lack_of_fit=replace(small, missed=0.2)))
    assert codes(fits_verdict({"": large}, {})) == ["misfit_unexplained", "not_compared"]


def test_groups_faults_and_interrupts_are_said():
    verdicts = [Verdict((Finding("wrapped", ERROR, "i1", {"bits": 16}),))]
    fits = {"all": estimate([0.02] * 6)}
    assert said(*fits_verdict(fits, {}, verdicts)).startswith(
        "The log has an error that must be corrected first: i1 is near 0 or near 2^16"
    )
    both = said(*fits_verdict({"oak": fits["all"], "felt": fits["all"]}, {"oak": beside(GOOD)}, cut=True))
    assert both.startswith(
        "Cut short: the numbers are the best so far, not the final ones. Oak: on the fitted logs the model follows "
        "wheel speeds within 3 %"
    )
    assert "Felt: all 6 numbers are known" in both


def test_the_sentence_stands_first():
    run = noisy_draw(simulate(AXEBOT, excitation(10.0), 0.01), 1)
    found = identify(run, AXEBOT)
    text = found.document().to_text(400)
    assert text.splitlines()[0] == in_clauses(found.verdict)[0]
    assert found.verdict.startswith("On the fitted logs the model follows speed over the ground within ")
    assert "numbers are known" in found.verdict
    assert "Coulomb friction turning" in text
    assert "nuisance:" not in text.splitlines()[-1]
    assert text.count("\nstd error: ") == 1


# ---- steady state -----------------------------------------------------------------------------------------


def study(loo, ties=(), std=0.02) -> Any:
    """A disc of 10 N, which misses `loo` N in a direction that was left out."""
    one = SimpleNamespace(name="disc", words="equal in all directions", loo=loo, told_apart=not ties)
    scores = [one, *(SimpleNamespace(name=name, told_apart=False) for name in ties)]
    choice = SimpleNamespace(score=one, scores=scores, chosen="disc", own={}, error=loo)
    return SimpleNamespace(
        choice=choice,
        travel={"all": SimpleNamespace(mean=10.0)},
        points=SimpleNamespace(wrench=np.array([[10.0, 0.0, 0.0], [0.0, -10.0, 0.0]])),
        estimates={"all": estimate([std] * 6, Estimate)},
        lack_of_fit={},
        moments=(),
        untested=(),
    )


def test_a_good_shape():
    assert said(*steady_verdict(study(0.5))) == (
        "Friction along travel is 10 N; its shape, disc, predicts the force in a direction "
        "that was left out within 5 %; all 6 numbers are known, the widest (viscous friction forward) within 2 %."
    )


def test_a_shape_that_others_equal():
    words = said(*steady_verdict(study(2.0, ["ellipse", "box"])))
    assert "within 20 %; as good, as far as these data tell: ellipse and box; " in words


def test_no_shape_fits():
    assert said(*steady_verdict(study(7.0))) == (
        "No shape of friction explains the forces: the best, disc, misses 7 N of 10 N in a direction that was left out."
    )
    found = Identification(SteadyState(), {"all": estimate([0.02] * 6, Estimate)}, followed_by({}), study=study(7.0))
    assert found.verdict.startswith("Failed: no shape of friction explains the forces: the best, disc, misses 7 N")
    assert found.verdict.endswith("the numbers are not usable until that is corrected.")
    assert replace(found, study=study(0.5)).failures == ()


def test_what_the_verdict_calls_meaningless_is_a_failure():
    """The sentence said that the numbers mean nothing, and `failures` was empty: exit 0."""
    lost = estimate([0.02] * 6, not_followed=("wheel_speed[0]",))
    found = Identification(OutputError(), {"all": lost}, followed_by({"all": lost}))
    assert [*map(str, found.failures)] == ["the model does not follow wheel_speed[0]"]
    scores = SimpleNamespace(scores={"fitted": BAD}, not_followed=lambda noise: {})
    well = {"all": estimate([0.02] * 6)}
    hardly = replace(found, groups=well, follow=followed_by(well, {"all": scores}))
    assert [*map(str, hardly.failures)] == ["the model does not follow: wheel speeds not at all (rms error 9 rad/s)"]


# ---- motors -----------------------------------------------------------------------------------------------


def motor(number, band=0.5, seen=True, slope=(0.1, 0.2)) -> Any:
    return SimpleNamespace(
        motor=number,
        warnings=(),
        name="all motors" if number is None else f"motor {number + 1}",
        unit="V",
        dead_band_seen=seen,
        dead_band_needed=False,
        offset_seen=False,
        answers=slope[0] > 0.0,
        value={"dead_band": band},
        ci95={"slope": slope},
    )


@pytest.mark.parametrize(
    "motors, words",
    [
        ([motor(0, 0.52), motor(1, 0.61), motor(None)], "All 2 motors start at 0.52 to 0.61 V."),
        (
            [motor(0, 0.5), motor(1, seen=False)],
            "Motor 1 starts at 0.5 V; motor 2 answers too, and shows no dead band.",
        ),
        ([motor(0, seen=False), motor(1, seen=False)], "All 2 motors answer, and show no dead band."),
        (
            [motor(0), motor(1, seen=False, slope=(-0.1, 0.2))],
            "Motor 1 starts at 0.5 V; motor 2 is not seen to answer to the input.",
        ),
        (
            [motor(0, seen=False, slope=(-0.1, 0.2))],
            "No motor is seen to answer to its input: the speed of motor 1 does not go with it.",
        ),
    ],
)
def test_motors(motors, words):
    assert said(motors_verdict(motors)) == words
