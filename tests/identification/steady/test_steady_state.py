"""fit_steady_state: what it takes, what it refuses, and every warning it utters."""

import numpy as np
import pytest
from scipy import stats

from omnidyn.errors import InputError, InsufficientDataError, UnsupportedError
from omnidyn.identification.steady.steady_state import fit_steady_state
from omnidyn.logs.steady_table import SteadyTable
from omnidyn.model.friction import AxesFriction, WheelFriction
from omnidyn.model.robot import Prior
from omnidyn.model.robot_file import load_robot, parse_robot, robot_to_toml
from omnidyn.statement import quoted
from tests.support.codes import codes

ROBOT = load_robot("axebot")
SPEED = np.array([0.2, 0.5, 0.8, 1.1, -0.3, -0.9])
NOISE = np.array([0.01, -0.02, 0.015, -0.005, 0.01, -0.01])


def line(axis="x", speed=SPEED, b=0.94, c=2.2, noise=NOISE, **more):
    speed = np.asarray(speed, dtype=float)
    return SteadyTable(axis, speed, b * speed + c * np.sign(speed) + noise[: len(speed)], **more)


def both(one, other):
    return SteadyTable(
        [*one.axis, *other.axis], np.concatenate([one.speed, other.speed]), np.concatenate([one.force, other.force])
    )


def warned(fit, code, subject="x"):
    """The one warning of this code."""
    (found,) = [warning for warning in fit.warnings if (warning.code, warning.subject) == (code, subject)]
    return found


def test_exact_points_give_exact_numbers():
    fit = fit_steady_state(ROBOT, line(b=1.25, c=2.5, speed=[0.25, 0.5, 1.0, -2.0], noise=np.zeros(4)))
    assert fit.value["friction.axes.viscous[0]"] == pytest.approx(1.25, rel=1e-14)
    assert fit.value["friction.axes.coulomb[0]"] == pytest.approx(2.5, rel=1e-14)
    assert fit.std["friction.axes.viscous[0]"] < 1e-13
    assert parse_robot(robot_to_toml(fit.robot)) == fit.robot  # a std of 0 or nearly so does no harm


def test_axes_without_data_keep_their_friction_and_say_so():
    fit = fit_steady_state(ROBOT, line("y", b=1.0, c=1.0))
    assert fit.robot.friction.axes.viscous[::2] == ROBOT.friction.axes.viscous[::2]
    assert fit.robot.friction.axes.coulomb[::2] == ROBOT.friction.axes.coulomb[::2]
    assert set(fit.value) == {"friction.axes.viscous[1]", "friction.axes.coulomb[1]"}
    assert [warning.subject for warning in fit.warnings if warning.code == "axis_without_data"] == ["x", "yaw"]


# ---- warnings ----------------------------------------------------------------------------


def test_two_degrees_of_freedom_or_fewer_are_told_with_the_t_factor():
    one, two = (warned(fit_steady_state(ROBOT, line(speed=SPEED[:rows])), "few_degrees") for rows in (3, 4))
    assert "1 degree of freedom (3 rows, 2 parameters): the 95 % interval reaches 12.7 standard" in str(one)
    assert (two.numbers["degrees"], two.numbers["quantile"]) == (2, pytest.approx(4.30, abs=0.01))
    assert "few_degrees" not in codes(fit_steady_state(ROBOT, line(speed=SPEED[:5])).warnings)


def test_an_interval_that_contains_zero():
    fit = fit_steady_state(ROBOT, line(b=0.001))
    low, high = fit.ci95["friction.axes.viscous[0]"]
    assert low < 0.0 < high
    assert warned(fit, "interval_contains_zero", "friction.axes.viscous[0]").numbers == {"ci95": (low, high)}


def test_a_negative_estimate_is_at_bound_not_silently_clamped():  # BAD_INPUTS 30
    fit = fit_steady_state(ROBOT, line(b=-0.5))
    assert fit.at_bound == ("friction.axes.viscous[0]",)
    assert fit.robot.friction.axes.viscous[0] == 0.0
    low, high = fit.ci95["friction.axes.viscous[0]"]
    assert low == 0.0 < high
    bound = warned(fit, "coefficient_at_bound", "friction.axes.viscous[0]")
    side = np.sign(SPEED)
    slope = stats.linregress(np.abs(SPEED), side * line(b=-0.5).force).slope
    assert bound.numbers == {"free": pytest.approx(slope), "high": high}
    assert "at bound" in fit.summary()
    assert fit.to_dict()["parameters"]["friction.axes.viscous[0]"]["at_bound"] is True
    assert parse_robot(robot_to_toml(fit.robot)) == fit.robot


def test_a_row_at_rest_used_as_a_sliding_point():
    points = both(line(speed=SPEED[:4]), SteadyTable("x", [0.0], [2.3]))
    assert warned(fit_steady_state(ROBOT, points, rest_use="line"), "rest_as_sliding").numbers == {"rows": 1}
    assert warned(fit_steady_state(ROBOT, points, rest_use="ignore"), "rest_not_used").numbers == {"rows": 1}


def test_one_speed_only_is_no_line():
    fit = fit_steady_state(ROBOT, both(line("y"), line("x", speed=[0.5, 0.5, -0.5, 0.5], noise=np.zeros(4))))
    assert warned(fit, "axis_at_one_speed").numbers == {"speed": 0.5, "sum": pytest.approx(2.67, abs=0.01)}
    assert fit.robot.friction.axes.viscous[0] == ROBOT.friction.axes.viscous[0]


def test_force_against_the_motion():  # BAD_INPUTS 23
    points = line()
    unsigned = points.replace(force=np.abs(points.force))
    assert warned(fit_steady_state(ROBOT, unsigned), "axis_against_motion").numbers == {"wrong": 2, "rows": 6}


def test_scatter_that_contradicts_the_std_given():
    small = line(force_std=np.full(6, 0.001))
    words = str(warned(fit_steady_state(ROBOT, small), "scatter_contradicts_std"))
    assert "scatter 15 times as much as their std says; the intervals follow the scatter itself" in words
    absolute = warned(fit_steady_state(ROBOT, small, absolute_std=True), "scatter_contradicts_std")
    assert absolute.numbers["absolute_std"]
    right = fit_steady_state(ROBOT, line(force_std=np.full(6, 0.015)))
    assert "scatter_contradicts_std" not in codes(right.warnings)


def test_an_iteration_that_does_not_settle_is_told(monkeypatch):
    monkeypatch.setattr("omnidyn.identification.steady.line.MAX_ITERATIONS", 2)
    points = line(force_std=np.full(6, 0.015), speed_std=np.full(6, 0.2))
    assert warned(fit_steady_state(ROBOT, points), "speed_std_not_settled")


def test_notes_of_the_points_become_warnings():
    note = "numbers have a decimal comma"
    assert quoted(note) in fit_steady_state(ROBOT, line(notes=(note,))).warnings


# ---- breakaway ------------------------------------------------------------------------------------------


def with_breakaway(*levels):
    old = ROBOT.friction.axes
    friction = AxesFriction(viscous=old.viscous, coulomb=old.coulomb, breakaway=levels)
    return ROBOT.replace(friction=ROBOT.friction.replace(axes=friction))


def test_a_breakaway_below_the_new_coulomb_friction_is_raised():
    fit = fit_steady_state(with_breakaway(2.3, 1.8, 0.1), line(c=2.6))
    new = fit.robot.friction.axes
    assert new.breakaway == (new.coulomb[0], 1.8, 0.1)
    assert warned(fit, "breakaway_raised", "friction.axes.breakaway[0]").numbers == {"before": 2.3}


def test_a_breakaway_above_it_stays():
    fit = fit_steady_state(with_breakaway(3.0, 1.8, 0.1), line())
    assert fit.robot.friction.axes.breakaway == (3.0, 1.8, 0.1)
    assert warned(fit, "breakaway_kept", "friction.axes.breakaway[0]").numbers == {"level": 3.0}


def test_slow_rows_count_as_rest_below_rest_speed():
    points = both(line(), SteadyTable("x", [0.004, -0.003], [1.0, -2.9]))
    fit = fit_steady_state(ROBOT, points, rest_speed=(0.005, 0.0, 0.0))
    assert fit.value == fit_steady_state(ROBOT, line()).value
    assert fit.robot.friction.axes.breakaway[0] == fit.lower_bound["friction.axes.breakaway[0]"] == 2.9


def test_a_prior_of_a_whole_list_goes_to_its_items():
    robot = ROBOT.replace(priors={"friction.axes.coulomb": Prior(std=0.2, source="datasheet")})
    fit = fit_steady_state(robot, line())
    assert fit.robot.priors["friction.axes.coulomb[1]"] == Prior(std=0.2, source="datasheet")
    assert fit.robot.priors["friction.axes.coulomb[0]"].origin == "identified"
    assert parse_robot(robot_to_toml(fit.robot)) == fit.robot


# ---- refusals -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("speed", [[0.5], [0.5, 1.0]])
def test_too_few_rows_say_how_many_are_needed(speed):  # BAD_INPUTS 4
    with pytest.raises(
        InsufficientDataError, match=rf"axis x: too few rows .*; got {len(speed)} usable rows; expected 3 or more"
    ):
        fit_steady_state(ROBOT, line(speed=speed))


def test_two_rows_do_when_their_std_is_known():
    fit = fit_steady_state(ROBOT, line(speed=[0.5, 1.0], force_std=[0.05, 0.05]), absolute_std=True)
    assert fit.std["friction.axes.viscous[0]"] == pytest.approx(0.05 * np.sqrt(2) / 0.5, rel=1e-12)
    assert fit.degrees_of_freedom["friction.axes.viscous[0]"] == 0


def test_a_robot_that_never_moved_gives_a_bound_only():  # BAD_INPUTS 27
    points = SteadyTable(["x", "x", "yaw"], [0, 0, 0], [1.0, -2.0, 0.05])
    with pytest.raises(InsufficientDataError, match=r"never moved.*axis x holds at least 2 N; axis yaw"):
        fit_steady_state(ROBOT, points)
    assert InsufficientDataError.exit_code == 4


@pytest.mark.parametrize(
    "options, words",
    [
        ({"rest_use": "maybe"}, "rest: unknown use of rows at rest; got maybe; expected bound or line or ignore"),
        ({"rest_speed": (0.1, 0.1)}, "rest_speed: cannot tell rest from motion; .*three speeds"),
        ({"rest_speed": (0.1, -0.1, 0.0)}, "rest_speed: cannot tell rest from motion"),
        ({"absolute_std": True}, "absolute_std needs the std of the forces"),
    ],
)
def test_wrong_options(options, words):
    with pytest.raises(InputError, match=words):
        fit_steady_state(ROBOT, line(), **options)


def test_friction_elsewhere_would_count_twice():
    robot = ROBOT.replace(friction=ROBOT.friction.replace(wheels=WheelFriction(coulomb=0.5)))
    with pytest.raises(
        UnsupportedError, match=r"friction on the body axes only; got axebot with friction elsewhere too"
    ):
        fit_steady_state(robot, line())


def test_friction_beyond_any_robot_is_not_put_into_one():
    points = both(line("y"), SteadyTable("x", [1e-9, 2e-9, 3e-9], [1.0, 2.0, 3.0]))
    fit = fit_steady_state(ROBOT, points)
    assert warned(fit, "axis_beyond_any_robot").numbers == {"level": pytest.approx(1e9)}


# ---- coverage through the whole function ----------------------------------------------------------------


@pytest.mark.long
def test_coverage_of_the_whole_fit():
    """600 draws with weights, three axes each: 95 % within three standard errors of a share (0.005)."""
    names = ["x"] * 5 + ["y"] * 5 + ["yaw"] * 5
    speed = np.tile([0.2, 0.5, 0.8, 1.1, -0.9], 3) * np.repeat([1, 1, 8], 5)
    b, c = np.repeat(ROBOT.friction.axes.viscous, 5), np.repeat(ROBOT.friction.axes.coulomb, 5)
    std = np.tile([0.01, 0.03, 0.02, 0.05, 0.02], 3) * np.repeat([1, 1, 0.1], 5)
    hits = []
    for seed in range(600):
        noise = std * np.random.default_rng(seed).standard_normal(15)
        fit = fit_steady_state(ROBOT, SteadyTable(names, speed, b * speed + c * np.sign(speed) + noise, force_std=std))
        for axis in range(3):
            for key, true in (("viscous", ROBOT.friction.axes.viscous), ("coulomb", ROBOT.friction.axes.coulomb)):
                low, high = fit.ci95[f"friction.axes.{key}[{axis}]"]
                hits.append(low <= true[axis] <= high)
    assert np.mean(hits) == pytest.approx(0.95, abs=0.015)
