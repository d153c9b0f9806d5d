"""Steady-state identification of simulated logs whose friction is known."""

import numpy as np
import pytest

from omnidyn.errors import InputError, InsufficientDataError, UnsupportedError
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import SteadyState
from omnidyn.identification.steady.choice import choose_shape
from omnidyn.identification.steady.operating_points import force_points
from omnidyn.identification.steady.shapes import SHAPES, fit_shape
from omnidyn.model.friction import DirectionFriction, Friction
from omnidyn.model.robot_file import load_robot, parse_robot, robot_to_toml
from omnidyn.model.sliding import sliding_wrench
from omnidyn.run import Run
from tests.support.codes import codes
from tests.support.steady_logs import FRICTIONS, TRUTH, clean_runs, robot_with, spoiled, steady_voltage

AXEBOT = load_robot("axebot")
DIRECTIONS = range(0, 360, 15)
CLEAN: dict = {}


def clean(shape, speeds=(0.4,)):
    """Simulated once per shape."""
    if (shape, speeds) not in CLEAN:
        CLEAN[shape, speeds] = clean_runs(robot_with(shape), DIRECTIONS, speeds)
    return CLEAN[shape, speeds]


def noisy(shape, seed=0, **how):
    rng = np.random.default_rng(seed)
    return [spoiled(run, rng, **how) for run in clean(shape)]


@pytest.mark.parametrize("shape", [*FRICTIONS])
@pytest.mark.some(2)
def test_clean_logs_give_the_truth(shape):
    study = identify(clean(shape), AXEBOT, SteadyState(shape=shape)).study
    for key, value in TRUTH[shape].items():
        assert study.estimate.value[key] == pytest.approx(value, rel=2e-3)


@pytest.mark.parametrize("force_from", ["current", "voltage"])
def test_both_origins_of_the_force_agree_on_a_clean_log(force_from):
    study = identify(clean("ellipse"), AXEBOT, SteadyState(force_from=force_from, shape="ellipse")).study
    assert study.estimate.value["friction.direction.coulomb[0]"] == pytest.approx(2.4, rel=2e-3)
    assert study.points.force_from == force_from


@pytest.mark.parametrize("shape", [*FRICTIONS])
@pytest.mark.some(2)
def test_the_true_shape_is_chosen_and_its_intervals_hold_the_truth(shape):
    """Three draws of each; the benchmark does hundreds. No box is taken for a disc, and no disc for a box."""
    held = []
    for seed in range(3):
        study = identify(noisy(shape, seed), AXEBOT, SteadyState()).study
        assert study.choice.chosen == shape
        held += [low <= TRUTH[shape][key] <= high for key, (low, high) in study.estimate.ci95.items()]
    assert np.mean(held) >= 0.6


CHANCE = "a level for each wheel predicts directions left out better by chance, as in 8 of 360 right logs"


@pytest.mark.long
@pytest.mark.parametrize("draw", [pytest.param(51, marks=pytest.mark.xfail(reason=CHANCE, strict=True)), 53, 172])
def test_wheels_at_rest_do_not_decide_the_shape(draw):
    """Draws of the benchmark in which squared errors told a level per wheel, and a disc, from one level for all."""
    rng = np.random.default_rng(0)
    *_, runs = ([spoiled(run, rng) for run in clean("wheel")] for _ in range(draw + 1))
    assert identify(runs, AXEBOT, SteadyState()).study.choice.chosen == "wheel"


def test_a_disc_is_told_from_a_box_in_words():
    study = identify(noisy("disc"), AXEBOT, SteadyState()).study
    box = next(score for score in study.choice.scores if score.name == "box")
    assert box.told_apart
    assert (study.statements[0].code, study.statements[0].subject) == ("shape_chosen", "disc")
    (tied,) = [one for one in study.statements if one.code == "shapes_tied"]
    assert any(name.startswith("ellipse") for name in (tied.subject, *tied.numbers["shapes"]))


def test_the_robot_that_comes_back_has_the_friction_with_its_std_and_survives_its_file():
    study = identify(noisy("ellipse"), AXEBOT, SteadyState()).study
    back = parse_robot(robot_to_toml(study.estimate.robot))
    assert back.friction.direction.coulomb == pytest.approx((2.4, 1.6), rel=0.05)
    assert back.friction.axes.coulomb == (0.0, 0.0, 0.0)
    prior = back.priors["friction.direction.coulomb[0]"]
    assert prior.std == study.estimate.std["friction.direction.coulomb[0]"]
    assert prior.origin == "identified"
    assert prior.source.startswith("steady state, 24 runs, 24 steady points")


def test_yaw_friction_that_was_not_measured_stays_and_is_named():
    estimate = identify(noisy("disc"), AXEBOT, SteadyState()).estimate
    assert estimate.robot.friction.direction.yaw_coulomb == AXEBOT.friction.axes.coulomb[2]
    assert any(one.numbers == {"level": pytest.approx(0.099)} for one in estimate.warnings if one.code == "level_kept")


def test_turning_robots_give_yaw_friction():
    robot = robot_with("disc")
    runs = clean("disc") + [turning_run(robot, omega) for omega in (-4, -3, -2, -1.5, 1.5, 2, 3, 4)]
    study = identify(runs, AXEBOT, SteadyState(shape="disc")).study
    assert study.estimate.value["friction.direction.yaw_coulomb"] == pytest.approx(0.099, rel=0.01)
    assert study.estimate.value["friction.direction.coulomb"] == pytest.approx(2.0, rel=0.01)


def turning_run(robot, omega):
    from omnidyn.simulation.simulate import simulate

    voltage = np.tile(steady_voltage(robot, (0.0, 0.0, omega)), (200, 1))
    run = simulate(robot, voltage, 0.01, tol=1e-4)
    return run.replace(twist=None, pose=None, twist_command=np.tile([0.0, 0.0, omega], (201, 1)))


def test_viscous_friction_is_found_where_there_is_some():
    robot = AXEBOT.replace(friction=Friction(direction=DirectionFriction(coulomb=(2.0, 2.0), viscous=1.5)))
    rng = np.random.default_rng(3)
    runs = [spoiled(run, rng, between=0.02) for run in clean_runs(robot, DIRECTIONS, (0.15, 0.5))]
    study = identify(runs, AXEBOT, SteadyState()).study
    assert study.choice.chosen == "disc+viscous"
    low, high = study.estimate.ci95["friction.direction.viscous"]
    assert low <= 1.5 <= high
    assert "viscous_seen" in codes(study.statements)


def test_viscous_friction_that_the_data_do_not_show_is_bounded_in_words_and_left_at_0():
    rng = np.random.default_rng(4)
    runs = [spoiled(run, rng) for run in clean("disc", (0.3, 0.45))]
    study = identify(runs, AXEBOT, SteadyState()).study
    assert study.estimate.robot.friction.direction.viscous == 0.0
    (level,) = study.viscous["all"]
    assert level.low <= 0.0 <= level.high
    (words,) = [str(one) for one in study.statements if one.code == "viscous_not_identifiable"]
    assert "it is left at 0, B may be up to" in words


def test_groups_that_differ_and_groups_that_do_not():
    other = robot_with("disc").replace(
        friction=Friction(direction=DirectionFriction(coulomb=(2.6, 2.6), yaw_coulomb=0.099))
    )
    rng = np.random.default_rng(5)
    slick = [spoiled(run, rng) for run in clean("disc")]
    rough = [spoiled(run, rng) for run in clean_runs(other, DIRECTIONS)]
    again = [spoiled(run, rng) for run in clean("disc")]
    groups = ["slick"] * 24 + ["rough"] * 24 + ["again"] * 24
    study = identify(slick + rough + again, AXEBOT, SteadyState(shape="disc"), groups=groups).study
    found = {(each.first, each.second): each for each in study.differences}
    assert found["slick", "rough"].differs
    assert found["slick", "rough"].low <= 0.6 <= found["slick", "rough"].high
    assert not found["slick", "again"].differs
    assert any(not one.numbers["differs"] for one in study.statements if one.code == "group_difference")
    assert [*study.estimates] == ["slick", "rough", "again"]


@pytest.mark.parametrize("turns", ["first", "second"])
def test_groups_of_which_only_one_turns_are_compared_in_what_both_tell(turns):
    shape, robot = "disc", robot_with("disc")
    turning = [turning_run(robot, omega) for omega in (-4, -3, -2, -1.5, 1.5, 2, 3, 4)]
    runs, groups = clean(shape) + turning + clean(shape), ["first"] * 24 + [turns] * len(turning) + ["second"] * 24
    study = identify(runs, AXEBOT, SteadyState(shape=shape), groups=groups).study
    assert any("yaw" in key for key in study.estimates[turns].value)
    straight = study.estimates["second" if turns == "first" else "first"].value
    assert [each.key for each in study.differences] == list(straight)
    for each in study.differences:
        assert each.values == (study.estimates["first"].value[each.key], study.estimates["second"].value[each.key])
    study.document().to_text()


def test_internal_forces_of_four_wheels_are_told():
    robot = load_robot("four-wheel")
    runs = clean_runs(robot, DIRECTIONS, (0.3,))
    against = np.array([1.0, -1.0, 1.0, -1.0])  # pushes nowhere: G @ against = 0 for wheels at 45 degrees
    assert np.abs(robot.wheels.wrench_matrix @ against).max() < 1e-12
    fighting = [run.replace(current=run.current + 0.2 * against) for run in runs]
    per_ampere = 19.0 * 0.0059 / 0.035
    study = identify(fighting, robot, SteadyState(shape="box", force_from="current")).study
    assert study.internal["all"] == pytest.approx(0.2 * per_ampere * 2.0, rel=0.01)
    assert "internal_force" in codes(study.statements)
    assert study.estimate.value["friction.axes.coulomb[0]"] == pytest.approx(
        identify(runs, robot, SteadyState(shape="box")).estimate.value["friction.axes.coulomb[0]"], rel=1e-9
    )


def test_one_wild_run_hardly_moves_the_answer():
    runs = noisy("disc")
    broken = [*runs[:5], runs[5].replace(current=runs[5].current * 4.0), *runs[6:]]
    value = identify(broken, AXEBOT, SteadyState(shape="disc")).estimate.value["friction.direction.coulomb"]
    assert value == pytest.approx(2.0, rel=0.04)
    plain = identify(broken, AXEBOT, SteadyState(shape="disc", robust=False)).study
    assert plain.estimate.value["friction.direction.coulomb"] > 2.15


def test_leaving_one_out_is_what_it_says():
    """Every direction by hand: a disc fitted to the other points by a plain mean along travel."""
    points = force_points(noisy("disc"), AXEBOT, speed="set")
    fit = fit_shape(SHAPES["disc"], AXEBOT, points, has_yaw=False, robust=False)
    way = points.twist[:, :2] / np.linalg.norm(points.twist[:, :2], axis=1)[:, None]
    along = (points.wrench[:, :2] * way).sum(axis=1)
    for k in range(len(points)):
        others = np.arange(len(points)) != k
        assert fit.error[k] == pytest.approx(points.wrench[k, :2] - along[others].mean() * way[k], abs=1e-9)
    scatter = np.std(along, ddof=1) / np.sqrt(len(along))  # the jackknife of a mean is its standard error
    assert fit.std[0] == pytest.approx(scatter, rel=1e-9)


def test_the_speed_that_was_used_is_stated():
    for speed, words in (("set", "set speed"), ("wheel", "speed of the wheels")):
        study = identify(noisy("disc"), AXEBOT, SteadyState(speed=speed)).study
        assert words in study.estimate.method
        assert words in study.document().to_text()


def test_the_summary_and_the_dictionary_hold_all_of_it():
    import json

    study = identify(noisy("disc"), AXEBOT, SteadyState()).study
    told = study.document()
    text, record = told.to_text(), told.data
    json.dumps(record)
    assert text.isascii()
    assert record["shape"] == "disc"
    assert {score["name"] for score in record["shapes"]} >= {"box", "disc", "ellipse", "wheel", "wheels"}
    for words in study.advice:
        assert str(words).split()[0] in text


# ---- what cannot be answered ----------------------------------------------------------------------------


def test_signs_that_are_lost_are_not_taken_for_friction():
    runs = [run.replace(current=-run.current) for run in noisy("disc")]
    with pytest.raises(
        InsufficientDataError, match=r"against the motion.*in 24 of 24 points.*check the sign of the cur"
    ):
        identify(runs, AXEBOT, SteadyState())


def test_a_robot_that_never_moved_only_bounds_friction():
    t = np.arange(200) * 0.01
    still = Run(t=t, current=np.full((200, 3), 0.1), wheel_speed=np.zeros((200, 3)))
    with pytest.raises(InsufficientDataError, match=r"never moved: it stayed inside its dead zone"):
        identify([still], AXEBOT, SteadyState())


def test_nothing_steady_is_said():
    t = np.arange(20) * 0.01
    short = Run(t=t, current=np.zeros((20, 3)), wheel_speed=np.ones((20, 3)))
    with pytest.raises(InsufficientDataError, match=r"no steady window was found.*hold each command longer"):
        identify([short], AXEBOT, SteadyState())


def test_too_few_directions_fit_no_shape():
    with pytest.raises(InsufficientDataError, match=r"no shape can be fitted.*drive in more directions"):
        identify(noisy("disc")[:1], AXEBOT, SteadyState())


def test_a_shape_for_comparison_cannot_be_asked_for():
    with pytest.raises(InsufficientDataError, match=r"a robot file cannot hold this shape.*got wheel.roller"):
        identify(noisy("disc"), AXEBOT, SteadyState(shape="wheel+roller"))


@pytest.mark.parametrize(
    "how, words",
    [
        ({"shape": "sphere"}, r"no such shape; got sphere; expected auto, box"),
        ({"speed": "light"}, r"no such speed; got light; expected wheel, set or ground"),
        ({"speed": "ground"}, r"lacks a channel; got .*; expected twist"),
        ({"force_from": "will"}, r"no such origin of the force; got will"),
    ],
)
def test_wrong_options_are_refused(how, words):
    with pytest.raises(InputError, match=words):
        identify(noisy("disc"), AXEBOT, SteadyState(**how))


def test_groups_need_a_name_for_every_run():
    with pytest.raises(InputError, match="groups need a name for every run; got 1 names for 24 runs"):
        identify(noisy("disc"), AXEBOT, SteadyState(), groups=["a"])


def test_a_run_without_forces_is_refused():
    t = np.arange(100) * 0.01
    with pytest.raises(InputError, match=r"no force can be had from this run; got wheel_speed"):
        identify([Run(t=t, wheel_speed=np.ones((100, 3)))], AXEBOT, SteadyState())


def test_a_duty_without_a_supply_is_refused():
    t = np.arange(100) * 0.01
    run = Run(t=t, wheel_speed=np.ones((100, 3)), duty=np.full((100, 3), 0.5))
    with pytest.raises(InputError, match=r"a duty needs the voltage of the supply"):
        identify([run], AXEBOT, SteadyState())


def test_another_number_of_wheels_is_refused():
    with pytest.raises(InputError, match=r"another number of wheels than the robot; got 3; expected 4"):
        identify(noisy("disc"), load_robot("four-wheel"), SteadyState())


def test_a_lossy_gear_is_refused():
    lossy = AXEBOT.replace(motor=AXEBOT.motor.replace(gear_efficiency=0.8))
    with pytest.raises(UnsupportedError, match="gear_efficiency below 1"):
        identify(noisy("disc"), lossy, SteadyState())


def test_a_plain_ellipse_beside_unequal_wheels_is_told_with_its_levels():
    """Currents by the formula: (Cx vx, Cy vy)/|v| of the floor, and a level at each wheel."""
    robot, rng = load_robot("robotino"), np.random.default_rng(0)
    floor, wheels, count, runs = np.array([42.0, 33.0]), np.array([2.0, 3.5, 1.0]), 60, []
    g, per_ampere = robot.wheels.wrench_matrix, 0.0514 * 16.0 / 0.040
    for angle in np.radians(np.arange(0.0, 360.0, 10.0) + 3.0):
        way = np.array([np.cos(angle), np.sin(angle), 0.0])
        push = np.linalg.pinv(g) @ np.append(floor * way[:2], 0.0) + wheels * np.sign(way @ g)
        twist = np.tile(0.2 * way, (count, 1))
        runs.append(
            Run(
                t=0.03 * np.arange(count),
                twist_command=twist,
                wheel_speed=twist @ g / 0.040 + 0.05 * rng.normal(size=(count, 3)),
                current=push / per_ampere + 0.1 * rng.normal(size=(count, 3)),
                source=f"{angle:.2f}",
            )
        )
    found = identify(runs, robot, SteadyState())
    assert found.study.choice.chosen == "ellipse-plain+wheels"
    estimate, truth = found.estimate, np.append(floor, wheels)
    values = np.array([*estimate.value.values()])
    assert values[:2] == pytest.approx(floor, rel=0.05)
    assert np.abs(values - truth).max() < 3.5 * max(estimate.std.values())
    assert estimate.robot.friction.direction.ellipse == "plain"
    assert np.abs(sliding_wrench(estimate.robot, [0.0, 0.2, 0.0])[1]) == pytest.approx(33.0 + 1.5 + 3.5, abs=1.5)


def test_unknown_shapes_are_never_chosen_alone():
    """A robot on slippery rollers: wheel+roller is best, and the words say that no robot file holds it."""
    points = force_points(noisy("disc"), AXEBOT, speed="set")
    choice = choose_shape(AXEBOT, points)
    assert SHAPES[choice.chosen].in_model
