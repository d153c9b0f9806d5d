"""What results say of one subject never excludes itself: statements of real fits, by their codes, not words."""

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.blind.log import robot_of
from benchmarks.wrong_worlds.world import BOX, ELLIPSE, World
from omnidyn import MotorFit, MotorLine, OutputError, SteadyState, identify, load_robot, simulate
from omnidyn.statement import PLACES, Statement
from tests.identification.motors.test_agree import loop, sweep
from tests.identification.motors.test_steady_curve import bent, levels, log
from tests.support.axebot_logs import excitation, noisy_draw
from tests.support.constant_speeds import ROUND, once
from tests.support.held_axis import axis, run_of, stairs

ANSWERS = {"motors_start", "starts_both_ways", "motors_without_dead_band", "motors_no_line", "dead_bands_hardly_known"}
NO_ANSWER = {"no_motor_answers", "motors_not_answering"}
HAS_BAND = {"motors_start", "starts_both_ways", "dead_band_seen", "line_meets_zero", "start_seen"}
MAY_HAVE_BAND = HAS_BAND | {"dead_band_hardly_known", "dead_bands_hardly_known"}
NO_BAND = {"motors_without_dead_band", "dead_band_rejected", "dead_band_not_needed", "dead_band_negative"}
NOT_KNOWN = {"dead_band_bounded", "slope_may_be_zero"}
OF_A_LINE = {"motor_line", "slopes_differ_by_direction", "motor_held_out_blocks", "held_out_no_better", "line_bends"}
MISFITS = {f"misfit_{name}" for name in ("unexplained", "without_law", "with_rivals", "nearest_cause", "likely_cause")}
CALM = {"only_noise", "unrelated_residuals"}

EXCLUSIVE = (  # of each pair not both, of one subject
    (NO_ANSWER, ANSWERS | HAS_BAND | {"motor_held_out_blocks"}),
    (NO_BAND | NOT_KNOWN, MAY_HAVE_BAND),
    ({"speed_no_line", "motors_no_line"}, OF_A_LINE | NO_BAND | {"dead_bands_apart"}),
    (CALM, MISFITS | {"misfit_small", "slow_errors", "misfit_of_output"}),
    ({"misfit_small"}, MISFITS | {"guessed_numbers", "missing_cause", "wide_by_misfit"}),
    ({"model_does_not_follow", "not_followed_at_all", "outputs_missed"}, {"numbers_known", "follows"}),
    ({"noise_unknown"}, {"noise_level", "beyond_noise"}),
    ({"latency_like_zero"}, {"late_by_rows", "implausible_latency"}),
    ({"no_lack_of_fit"}, {"no_shape_fits"}),
    ({"changes_not_tested"}, {"changes_within_run"}),
    ({"held_out_noise"}, {"held_out_misfit", "held_out_colour"} | MISFITS),
    ({"given_predicts_better"}, {"plain_predicts_better", "size_fitted"}),
)


def said_of(statements, parents=()):
    """(subject, code, numbers) of each statement, those inside of others too, of each motor by itself."""
    for statement in statements:
        numbers = statement.numbers
        names = [place for places in numbers.get(PLACES, ()) for place in places] + [statement.subject]
        names += [name for name in numbers.get("motors", ()) if isinstance(name, str)]
        subjects = {" ".join(name.split()[:2]) for name in names if name.startswith("motor ")} or {*parents} or {""}
        for subject in subjects:
            if not (statement.code == "motor_held_out_blocks" and numbers.get("written", 0.0) > 0.5):  # of noise
                yield subject, statement.code, numbers
        inner = [part for value in numbers.values() for part in (value if isinstance(value, tuple) else (value,))]
        yield from said_of([part for part in inner if isinstance(part, Statement)], subjects)


def of_result(found):
    """All that a result says."""
    if found.study is not None and hasattr(found.study, "motors"):
        study = found.study
        return [study.verdict, *study.statements, *study.warnings]
    said = [*found.outcome(), *found.warnings, *found.advice]
    for fit in found.fits.values():
        said += [*fit.lack_of_fit.statements(), *([fit.held_out.statement()] if fit.held_out else [])]
    return [*said, *(found.study.statements if found.study is not None else ())]


def agree(statements):
    said = [*said_of(statements)]
    for subject in {subject for subject, _, _ in said}:
        codes = {code for of, code, _ in said if of == subject}
        for some, others in EXCLUSIVE:
            assert not (codes & some and codes & others), (subject, codes & some, codes & others)
        bounds = [
            numbers["high"] for of, _, numbers in said if of == subject and isinstance(numbers.get("high"), float)
        ]
        assert not [bound for bound in bounds if bound < 0.0]
        bands = [
            numbers["ci95"]
            for of, code, numbers in said
            if of == subject and (code == "dead_band_seen" or (code == "start_seen" and numbers["sharp"]))
        ]
        if not codes & {"dead_bands_apart", "offset_as_friction"}:  # which says that they exclude each other, or why
            assert not bands or max(low for low, _ in bands) <= min(high for _, high in bands), (subject, bands)


def deaf(seed):
    put_in = stairs(seed)
    return run_of(put_in, 0.0 * put_in, noise=0.5)


def ramp_that_sticks():
    """It sets off at .8 V, and once it turns no dead band is left: u = .5 w."""
    put_in = np.concatenate([np.linspace(0.0, 2.0, 2000), np.linspace(2.0, 0.2, 1000)])
    speed, w = [], 0.0
    for u in put_in.tolist():
        speed.append(w)
        w = w + (u / 0.5 - w) * (1.0 - math.exp(-0.005 / 0.05)) if w > 0.0 or u > 0.8 else 0.0
    return run_of(put_in, np.array(speed), noise=0.005)


MOTORS = {
    "one step": lambda: loop([200], 1, 4.0),
    "one quiet step": lambda: loop([200], 2, 0.5),
    "four steps": lambda: loop([100, 250, 60, 200], 3, 4.0),
    "sweep": sweep,
    "bent": lambda: log(bent, levels(1)),
    "dead band": lambda: run_of(stairs(0), axis(stairs(0))[1]),
    "none": lambda: run_of(stairs(1), axis(stairs(1), band=0.0)[1]),
    "offset": lambda: run_of(stairs(2), axis(stairs(2), offset=0.09)[1]),
    "noisy": lambda: run_of(stairs(3), axis(stairs(3))[1], noise=0.5),
    "ramp": lambda: run_of(np.linspace(0.0, 1.2, 3000), axis(np.linspace(0.0, 1.2, 3000))[1], noise=0.005),
    "sticky ramp": ramp_that_sticks,
    "deaf": lambda: deaf(5),
}


LONG = {"one quiet step", "four steps", "bent", "noisy", "sticky ramp"}  # their free runs: of each kind one is left


@pytest.mark.parametrize("name", MOTORS)
@pytest.mark.some(4)
def test_of_motors(name):
    agree(of_result(identify([MOTORS[name]()], None, MotorLine())))


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.long] if name in LONG else []) for name in MOTORS]
)
def test_of_motors_by_free_runs(name):
    agree(of_result(identify([MOTORS[name]()], None, MotorFit())))


def axebot_fit(seed, **changes):
    robot = load_robot("axebot")
    told_robot = robot.replace(body=robot.body.replace(**changes)) if changes else robot
    return identify(noisy_draw(simulate(robot, excitation(10.0), 0.01), seed), told_robot, OutputError())


@pytest.mark.parametrize(
    "fit",
    [lambda: axebot_fit(1), lambda: axebot_fit(2, mass=2.1), lambda: axebot_fit(3, rotating_frame=True)],
    ids=["right", "heavy", "frame"],
)
@pytest.mark.some(2)
def test_of_whole_logs(fit):
    agree(of_result(fit()))


@pytest.mark.parametrize("factor", [1.0, 1.25])
@pytest.mark.parametrize("told", [BOX, ELLIPSE])
@pytest.mark.some(2)
def test_of_constant_speeds(told, factor):
    """A box of friction, told as it is and as an ellipse, on one floor and on two."""
    world = World(shape=BOX, **ROUND)
    run = once(102, world, 20, swept=True, change=17.6, factor=factor)
    agree(of_result(identify([run], robot_of(replace(world, shape=told)), SteadyState())))


def test_pairs_that_exclude_each_other_are_refused():
    """The test itself: what was said of one step, and of a sweep."""
    parts = (Statement("motors_start", numbers={"motors": ("motor 1",), "levels": (25.8,)}),)
    verdict = Statement("motors_answer", numbers={"parts": parts})
    band = Statement("dead_band_rejected", numbers={"high": 2.7})
    with pytest.raises(AssertionError, match="dead_band_rejected"):
        agree([verdict, Statement("motor_line", subject="motor 1", numbers={"dead_band": band})])
    with pytest.raises(AssertionError, match="no_motor_answers"):
        agree(
            [
                Statement("no_motor_answers", numbers={"motors": ("motor 1",)}),
                Statement("motor_held_out_blocks", subject="motor 1"),
            ]
        )
    with pytest.raises(AssertionError):
        agree([Statement("dead_band_rejected", numbers={"high": -2.7})])
