"""The ladder on logs of the simulator of wrong_worlds, which shares no code with the engines that fit them."""

import json
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.wrong_worlds.kinds import by_name
from benchmarks.wrong_worlds.log import SPEEDS, logged, right_case, robot_of, truths
from omnidyn.document import plain
from omnidyn.identification.identify import identify
from omnidyn.identification.lack_of_fit import Remedy
from omnidyn.identification.ladder import Ladder, Rung
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.fit import Fit
from omnidyn.identification.output_error.linear.free_run import margins_of
from omnidyn.identification.output_error.memory.autoregression import AutoRegression
from omnidyn.identification.structure.ladder.climb import offered
from omnidyn.identification.structure.ladder.held_out import Errors, errors
from omnidyn.model.robot_file import load_robot, save_robot
from omnidyn.report.fit_page import render_fit
from omnidyn.statement import quoted
from tests.support.axebot_logs import excitation, noisy
from tests.support.codes import codes

SEED = 91  # of no log of a benchmark, nor of their pilots
FREE = ("friction",)


def world(name, size, seed=SEED, sensor=SPEEDS, rate=50.0, seconds=20.0):
    """(log, robot file of an owner who does not know, friction as it is) of a kind of wrong world."""
    case = by_name(name).make(right_case(seed).setup_but(sensor=sensor, memory=0.0, rate=rate, seconds=seconds), size)
    return logged(case, seed), robot_of(case.told), truths(case.told, case.told.shape)


@pytest.fixture(scope="module")
def turning():
    """(what the ladder makes of a log of a frame that turns, friction as it is)."""
    run, robot, true = world("turning frame", 1.0)
    return identify(run, robot, OutputError(free=FREE, ladder=True)), true


def climbed(name, size, **options):
    run, robot, true = world(name, size)
    return identify(run, robot, OutputError(free=FREE, ladder=True, **options)).estimate, true


def held(estimate, true):
    return sum(low <= true[name] <= high for name in true for low, high in [estimate.ci95[name]])


def test_a_right_world_takes_no_step():
    run, robot, _ = world("mass", 0.0)
    estimate = identify(run, robot, OutputError(free=FREE, ladder=True)).estimate
    plain = identify(run, robot, OutputError(free=FREE)).estimate
    assert (estimate.ladder.rungs, estimate.ladder.end.code) == ((), "only_noise")
    assert plain.ladder is None
    assert estimate.value == plain.value
    assert "ladder" not in plain.to_dict()


@pytest.mark.parametrize(
    "name, size, key",
    [
        ("weak motor", 0.064, "motor.torque_constant_Nm_A[1]"),
        ("fade", 0.05, "fade"),
    ],
)
@pytest.mark.some(1)
def test_what_is_missing_is_switched_on_and_then_nothing_is(name, size, key):
    assert_switched_on(*climbed(name, size), key)


def test_a_frame_that_turns_is_switched_on_and_then_nothing_is(turning):
    found, true = turning
    assert_switched_on(found.estimate, true, "body.rotating_frame")


def assert_switched_on(estimate, true, key):
    (step,) = estimate.ladder.taken
    assert key in (step.key, *step.same_as)
    assert step.gain > step.gain_std > 0.0
    assert step.bic < 0.0
    assert not estimate.lack_of_fit.found
    assert held(estimate, true) >= 5


@pytest.mark.long  # that such a frame is taken is tested above, of speeds
def test_no_ladder_ends_calm_on_a_fit_that_its_answer_finds_wrong():
    """Of counts: a fit that takes errors for white leaves drifts, and what looks wild; one that knows their memory
    finds the forces of a turning frame, as the answer without the ladder does."""
    seed = 134_004
    case = by_name("turning frame").make(right_case(seed), 0.39462)
    run, robot = logged(case, seed), robot_of(case.told)
    assert identify(run, robot, OutputError(free=FREE)).lack_of_fit.causes[0].key == "body.rotating_frame"
    best = identify(run, robot, OutputError(free=FREE, ladder=True)).estimate
    assert [rung.key for rung in best.ladder.taken] == ["body.rotating_frame"]


def test_the_robot_that_is_written_is_the_fitted_one(turning, tmp_path):
    estimate = turning[0].estimate
    save_robot(estimate.robot, tmp_path / "robot.toml")
    again = load_robot(str(tmp_path / "robot.toml"))
    assert again.body.rotating_frame
    assert again.friction.axes.coulomb == pytest.approx(estimate.robot.friction.axes.coulomb)


def test_another_shape_takes_the_place_of_the_one_given():
    """An ellipse under the file of a box: the levels of the truth, and no box is left."""
    run, robot, _ = world("ellipse", 0.3)
    estimate = identify(run, robot, OutputError(free=FREE, ladder=True)).estimate
    assert [rung.key for rung in estimate.ladder.taken] == ["friction.direction"]
    assert not any(estimate.robot.friction.axes.coulomb)
    case = by_name("ellipse").make(right_case(SEED), 0.3)
    true = {f"friction.direction.coulomb[{k}]": case.world.coulomb[k] for k in range(2)}
    assert held(estimate, true) == 2


def test_a_limit_far_from_the_fit_is_found():
    """So many rows are at it that no first step sees it; the fit with it does."""
    estimate, true = climbed("current limit", 0.85)
    assert [rung.key for rung in estimate.ladder.taken] == ["motor.current_limit_A"]
    assert held(estimate, true) >= 5


def test_what_the_log_cannot_tell_apart_is_said_and_each_is_fitted():
    """Worn wheels look like a stronger supply."""
    estimate, _ = climbed("wheel radius", 0.1)
    step = estimate.ladder.taken[0]
    group = {step.key, *step.same_as}
    assert {"gain", "wheels.wheel_radius_m"} <= group
    rungs = [rung for rung in estimate.ladder.rungs if rung.step == 1 and rung.key in group]
    assert len({rung.key for rung in rungs}) >= 2
    assert max(rung.bic for rung in rungs if rung.why is None or rung.why.code != "pays_less") - step.bic < 6.0
    assert "ladder_alternatives" in codes(estimate.warnings)


def test_a_pull_in_the_room_is_taken_as_one_of_these_logs():
    estimate, _ = climbed("umbilical", 2.3, nuisances=("latency",))  # by default it is fitted from the start
    assert [rung.key for rung in estimate.ladder.taken] == ["tilt"]
    assert estimate.robot.log.tilt == pytest.approx((2.3, 0.0), abs=0.1)


@pytest.mark.long  # that it is not offered is tested below
def test_what_no_robot_file_holds_is_said_and_not_taken():
    run, robot, _ = world("sag", 0.2)
    estimate = identify(run, robot, OutputError(free=FREE, ladder=True)).estimate
    assert estimate.ladder.taken == ()
    assert codes(estimate.ladder.end.numbers["causes"]) == ["looks_like"]
    assert estimate.lack_of_fit.found


def test_a_remedy_says_what_it_would_change():
    """A first step goes most of the way to what the fit with it then finds, in standard errors of all numbers."""
    run, robot, _ = world("mass", 0.2)
    without = identify(run, robot, OutputError(free=FREE)).estimate
    best = next(each for each in without.lack_of_fit.remedies if each.key == "body.mass_kg")
    with_it = identify(run, robot, OutputError(free=(*FREE, "body.mass_kg"))).estimate
    far = []
    for name, (now, then) in best.changes.items():
        assert now == pytest.approx(without.value[name], rel=1e-3)
        far.append([(each - with_it.value[name]) / with_it.std[name] for each in (now, then)])
    before, after = np.linalg.norm(far, axis=0)
    assert after < 0.5 * before


def test_words_of_a_change():
    remedy = Remedy(
        "gain", quoted("gain 1.1"), 0.1, 0.01, changes={"body.mass_kg": (2.0, 2.5), "body.inertia_kg_m2": (1.0, 1.0)}
    )
    assert remedy.largest_changes() == {"changed": ("body.mass_kg",), "before": (2.0,), "after": (2.5,)}
    assert Remedy("gain", quoted("gain 1.1"), 0.1, 0.01).largest_changes()["changed"] == ()


def test_blocks_held_out_by_a_step_are_those_that_a_fit_without_them_misses():
    """The squared error of tenths of a log, by fits that really never saw them; friction at rest has kinks."""
    run, robot, _ = world("turning frame", 0.3)
    question = OutputError(free=FREE, nuisances=())
    whole = Fit.of(run, robot, question).solve()
    variance = float(whole.state.variance[0])
    memory = [AutoRegression(np.zeros(0), variance, len(run))] * 3
    by_step = errors(whole, memory, margins_of([whole])).held_out
    rows = len(run)
    block = np.minimum(np.arange(rows) * 10 // rows, 9)
    for k in (0, 4, 9):
        seen = run.wheel_speed.copy()
        seen[block == k] = np.nan
        point = Fit.of(run.replace(wheel_speed=seen), robot, question).solve().state.point
        (residual, _, _), *_ = whole.solver.engine.residuals(point)
        assert np.nansum(residual[:, block == k] ** 2) / variance == pytest.approx(by_step[k], rel=0.01)


def test_more_numbers_must_pay_for_themselves():
    fewer, more = Errors(np.full(10, 10.0), 99.0, 100, 6), Errors(np.full(10, 10.0), 99.0, 100, 7)
    assert more.bic() - fewer.bic() == pytest.approx(np.log(100.0))
    assert more.bic(20) - more.bic() == pytest.approx(2.0 * np.log(20.0))
    better = replace(more, held_out=np.full(10, 9.0))
    comparison = better.beside(fewer)
    assert (comparison.better, comparison.gain) == (10, pytest.approx(0.1))
    assert fewer.size == pytest.approx(1.0)


def test_remedies_that_are_worth_a_fit():
    def remedy(key, *same, offered=True):
        return Remedy(key, key, 0.1, 0.01, same, offered=offered, chi2=10.0)

    class Lack:
        remedies = (
            remedy("sag", offered=False),
            remedy("gain", "motor.resistance_ohm"),
            remedy("fade", "heat"),
            remedy("change"),
            remedy("body.mass_kg"),
            remedy("body.inertia_kg_m2"),
            remedy("motor.resistance_ohm", "gain"),
        )

    assert [each.key for each in offered(Lack)] == [
        "gain",
        "body.mass_kg",
        "body.inertia_kg_m2",
        "motor.resistance_ohm",
    ]


def test_the_page_and_the_values_for_machines_have_every_model_that_was_fitted(turning):
    found, _ = turning
    assert found.verdict.startswith("The ladder took the forces of a turning frame; then ")
    told = found.document()
    data = json.loads(json.dumps(plain(told.data), allow_nan=False))["ladder"]
    assert [rung["taken"] for rung in data["rungs"]][:2] == [True, True]
    assert data["rungs"][0]["words"] == "as it is"
    assert "held-out error" in told.to_text()
    page = render_fit(found, {"omnidyn": "0", "command": "", "inputs": []})
    assert "What was switched on, step by step" in page
    assert "the forces of a turning frame" in page


def test_a_model_that_follows_nothing_is_not_mended():
    robot = load_robot("axebot")
    run = noisy_of(robot)
    twist = run.twist * [1.0, 1.0, -1.0]  # the gyroscope upside down
    estimate = identify(run.replace(wheel_speed=None, twist=twist), robot, OutputError(ladder=True)).estimate
    assert estimate.ladder.rungs == ()
    assert estimate.ladder.end.code == "mend_first"


def noisy_of(robot):
    from omnidyn.simulation.simulate import simulate

    return noisy(simulate(robot, dt=0.01, voltage=excitation(20.0, 100.0, 3)), 3)


def test_a_step_whose_place_another_took_is_gone():
    first = Rung(1, "gain", quoted("gain 1.1"), 7, 1.1, taken=True)
    second = Rung(2, "fade", quoted("fade 0.1"), 7, 1.0, taken=True)
    assert Ladder((first, second), quoted("end")).taken == (first, second)
    assert Ladder((first, replace(second, instead=True)), quoted("end")).taken == (replace(second, instead=True),)


def test_a_cell_that_has_no_number_is_empty():
    rung = Rung(1, "gain", quoted("gain"), 0, np.nan, np.nan, np.nan, np.nan, why=quoted("why"))
    ladder = Ladder((rung,), quoted("end"))
    assert ladder.table().rows[0][3:7] == ("", "", "", "")
    assert ladder.statement().code == "ladder_no_step"
