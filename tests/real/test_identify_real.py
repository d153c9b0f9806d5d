"""Steady-state identification on real robots: the numbers of the data's README reproduced, or beaten and said so."""

from dataclasses import replace

import numpy as np
import pytest

from omnidyn.identification.identify import identify
from omnidyn.identification.methods import MotorLine, SteadyState
from omnidyn.identification.steady.line import fit_line
from omnidyn.identification.steady.moment import moments
from omnidyn.identification.steady.operating_points import force_points
from omnidyn.identification.steady.shapes import SHAPES, fit_shape, rms_and_error
from omnidyn.model.robot_file import load_robot
from tests.support import real_logs as logs

ROBOTINO = load_robot("robotino")
SHARE = (0.4, 0.95)  # rows that the README's numbers are from

# README: force along travel [N], its standard error, run-to-run standard deviation.
TRAVEL = {
    "gray 0.1": (39.27, 0.30, 2.51),
    "gray 0.2": (39.15, 0.28, 2.38),
    "gray 0.3": (39.37, 0.28, 2.35),
    "green 0.1": (35.55, 0.25, 1.49),
}
# README: left-out error of the full vector [N], for the same four groups.
LOO = {
    "box": (16.33, 16.34, 16.28, 15.58),
    "wheel": (12.33, 11.83, 11.93, 10.25),
    "wheels": (12.51, 12.01, 11.86, 10.61),
    "wheel+roller": (6.13, 6.28, 6.27, 5.88),
    "disc": (4.14, 3.82, 3.85, 1.98),
    "disc+wheel": (4.18, 3.85, 3.88, 1.96),
    "ellipse-plain": (2.53, 2.06, 2.30, 1.92),
}
# README: left-out error along travel [N], of shapes fitted along travel.
ALONG = {
    "box": (3.42, 3.60, 3.39, 3.86),
    "wheel": (3.08, 3.11, 2.97, 2.03),
    "wheels": (2.39, 2.40, 2.35, 1.73),
    "wheel+roller": (2.52, 2.44, 2.37, 1.58),
    "disc": (2.53, 2.40, 2.37, 1.51),
    "disc+wheel": (2.56, 2.42, 2.40, 1.52),
    "ellipse-plain": (1.29, 0.96, 1.12, 0.81),
}


@pytest.fixture(scope="session")
def runs(data):
    return logs.robotino_groups(data)


@pytest.fixture(scope="session")
def points(runs):
    light = logs.without_mass(ROBOTINO)
    return {name: force_points(own, light, speed="set", window=SHARE) for name, own in runs.items()}


@pytest.mark.parametrize("group", [*TRAVEL])
@pytest.mark.some(2)
def test_force_along_travel_as_in_the_readme(points, group):
    along, (mean, error, deviation) = points[group].along, TRAVEL[group]
    assert len(along) == (36 if group == "green 0.1" else 72)
    assert np.mean(along) == pytest.approx(mean, abs=0.02)
    assert np.std(along, ddof=1) / np.sqrt(len(along)) == pytest.approx(error, abs=0.01)
    assert np.std(along, ddof=1) == pytest.approx(deviation, abs=0.02)


@pytest.mark.parametrize("group", [*TRAVEL])
def test_windows_found_by_themselves_agree(runs, group):
    along, (mean, error, deviation) = force_points(runs[group], ROBOTINO, speed="set").along, TRAVEL[group]
    assert abs(np.mean(along) - mean) < 1.1 * error
    assert np.std(along, ddof=1) < 1.1 * deviation


@pytest.mark.parametrize("shape", [*LOO])
def test_left_out_errors_as_in_the_readme(points, shape):
    """The README takes sgn of set speeds of 4e-9 m/s, the rounding of its file; so here the same is taken as motion."""
    for k, own in enumerate(points.values()):
        fit = fit_shape(SHAPES[shape], ROBOTINO, replace(own, still=0.0 * own.still), has_yaw=False, robust=False)
        assert rms_and_error((fit.error**2).sum(axis=1), fit.fold)[0] == pytest.approx(LOO[shape][k], abs=0.06)


@pytest.mark.parametrize("shape", [*ALONG])
def test_left_out_errors_along_travel_as_in_the_readme(points, shape):
    for k, own in enumerate(points.values()):
        fit = fit_shape(SHAPES[shape], ROBOTINO, own, has_yaw=False, robust=False, aim="along")
        assert rms_and_error(fit.along_error**2, fit.fold)[0] == pytest.approx(ALONG[shape][k], abs=0.015)


@pytest.mark.parametrize("shape", ["box", "wheel", "wheels", "wheel+roller", "disc", "ellipse-plain"])
def test_speeds_that_are_none_make_every_shape_better_or_no_worse(points, shape):
    """What 4e-9 m/s is not taken for motion gains."""
    for k, own in enumerate(points.values()):
        fit = fit_shape(SHAPES[shape], ROBOTINO, own, has_yaw=False, robust=False)
        assert rms_and_error((fit.error**2).sum(axis=1), fit.fold)[0] < LOO[shape][k] + 0.025


def test_no_run_over_one_floor_changes_but_one_in_a_hundred(runs):
    found, tested = moments([run for group in runs.values() for run in group], ROBOTINO, "current")
    assert len(tested) == 252
    assert len(found) <= 2


@pytest.mark.parametrize("shape", ["ellipse-plain+wheel", "ellipse-plain+wheels"])
def test_levels_at_the_wheels_beside_the_plain_ellipse_are_no_worse_and_better_on_green(points, shape):
    """Beside the README's best shape, which has no levels at the wheels."""
    ours = []
    for own in points.values():
        fit = fit_shape(SHAPES[shape], ROBOTINO, own, has_yaw=False, robust=False)
        ours.append(rms_and_error((fit.error**2).sum(axis=1), fit.fold)[0])
    assert (np.array(ours) < np.array(LOO["ellipse-plain"]) + 0.025).all()
    assert ours[-1] < LOO["ellipse-plain"][-1] - 0.05


def test_the_ellipse_of_each_floor(points):
    for group, values in (("gray 0.1", (42.5, 36.1)), ("green 0.1", (36.0, 35.1))):
        fit = fit_shape(SHAPES["ellipse-plain"], ROBOTINO, points[group], has_yaw=False, robust=False)
        assert fit.level == pytest.approx(values, abs=0.15)


def test_b_of_the_gray_floor_is_not_identifiable(runs, points):
    """F = C + B v with the speed of the wheels, by the line of the paper: -0.02 +- 2.02 N s/m, 39.27 +- 0.38 N."""
    gray = [group for group in TRAVEL if group.startswith("gray")]
    speed = np.concatenate([force_points(runs[group], ROBOTINO, window=SHARE).speed for group in gray])
    line = fit_line(speed, np.concatenate([points[group].along for group in gray]))
    assert line.free == pytest.approx([-0.02, 39.27], abs=0.15)
    assert line.std == pytest.approx([2.02, 0.38], abs=0.04)
    low, high = line.ci95[0]
    assert low <= 0.0 <= high


@pytest.fixture(scope="session")
def study(runs):
    every = [(run, group.split()[0]) for group, own in runs.items() for run in own]
    return identify(
        [run for run, _ in every], ROBOTINO, SteadyState(speed="set"), groups=[name for _, name in every]
    ).study


def test_one_call_tells_the_story_of_both_floors(study):
    """Green: fitted to every second direction, levels of each wheel predict the others within 1.66 N, one level of all
    within 1.84 N, none within 2.24 N; fitted to all directions, blocks of these say so too."""
    assert study.choice.of("gray") == "ellipse-plain"
    assert study.choice.of("green") == "ellipse-plain+wheels"
    assert study.choice.score.loo < 2.5
    order = [score.name for score in study.choice.scores]
    for better, worse in (("ellipse", "disc"), ("disc", "wheel+roller"), ("wheel+roller", "wheel"), ("wheel", "box")):
        assert order.index(better) < order.index(worse)
    box = next(score for score in study.choice.scores if score.name == "box")
    assert box.told_apart
    assert box.loo > 6.0 * study.choice.score.loo


def test_viscous_friction_on_gray_is_said_not_to_be_identifiable(study):
    (level,) = study.viscous["gray"]
    assert level.low <= 0.0 <= level.high
    assert level.std < 1.0  # 2.02 in the README, which does not take the direction out
    assert study.viscous["green"] == ()
    assert any(
        one.code == "viscous_not_identifiable" and one.numbers["places"] == (("gray",),) for one in study.statements
    )


def test_the_floors_differ_and_it_says_by_how_much(runs):
    """README: Cx 42.5 and 36.0 N, Cy 36.1 and 35.1 N, of the floors at 0.1 m/s."""
    every = [(run, group.split()[0]) for group, own in runs.items() for run in own]
    asked = SteadyState(speed="set", shape="ellipse-plain")
    study = identify([run for run, _ in every], ROBOTINO, asked, groups=[name for _, name in every]).study
    found = {each.key: each for each in study.differences}
    assert found["friction.direction.coulomb[0]"].differs
    assert found["friction.direction.coulomb[0]"].difference == pytest.approx(-6.5, abs=0.7)
    assert found["friction.direction.coulomb[1]"].difference == pytest.approx(-1.0, abs=0.9)


def test_free_motors(data):
    """README: |i| = 0.159+-0.004 + (3.9+-0.3)e-4 |w| at the motor; Coulomb 0.170, 0.142, 0.164 A."""
    study = identify(logs.robotino_motors(data), None, MotorLine(input="current", steady=True)).study
    lines = {line.motor: line for line in study.motors}
    assert lines[None].value["dead_band"] == pytest.approx(0.159, abs=0.005)
    assert lines[None].value["slope"] / 16.0 == pytest.approx(3.9e-4, abs=0.3e-4)
    for motor, coulomb in ((0, 0.170), (1, 0.142), (2, 0.164)):
        assert lines[motor].value["dead_band"] == pytest.approx(coulomb, abs=0.004)
        assert lines[motor].dead_band_seen


def test_the_dead_zone_of_the_stairs_is_not_identifiable(data):
    """README: slope 0.429+-0.073 (rad/s)/%, zero crossing -1.75 %, 90 % -14..+4.8."""
    study = identify(logs.udea_stairs(data), None, MotorLine()).study
    line = study.motors[-1]
    assert 1.0 / line.value["slope"] == pytest.approx(0.429, abs=0.073)
    assert -14.0 < line.value["dead_band"] < 4.8
    low, high = np.quantile(line.draws["dead_band"], [0.05, 0.95])
    assert low < -1.75 < high
    assert not any(each.dead_band_seen for each in study.motors)
    for one in study.statements:  # of one motor held-out blocks are predicted as well without
        words = ("dead band not identifiable here", "no dead band is kept", "no start from rest was seen")
        assert any(part in str(one) for part in words)


def test_the_motors_of_a_robot_that_turns_on_the_spot(data):
    """README: u = (1.96+-0.09) w + (0.85+-0.54) sgn w, slope 0.51 (rad/s)/%; the speed from the heading."""
    robot, run = logs.udea_turning(data)
    line = identify([run], robot, MotorLine(speed="ground")).motors[-1]
    assert line.value["slope"] == pytest.approx(1.96, abs=0.09)
    assert line.value["dead_band"] == pytest.approx(0.85, abs=0.54)
    assert line.std["dead_band"] == pytest.approx(0.54, rel=0.3)
    assert 1.0 / line.value["slope"] == pytest.approx(0.51, abs=0.03)


def test_no_friction_is_invented_on_the_bench(data):
    """The negative control: Coulomb 0.35+-0.24 mV, that is none; 0.05509 V/(turn/s)."""
    study = identify(logs.odrive(data, ("step", "chirp")), None, MotorLine()).study
    (line,) = study.motors
    assert not line.dead_band_seen
    low, high = line.ci95["dead_band"]
    assert low <= 0.35e-3 <= high
    assert high < 0.03 * 0.25  # of the voltage of the step
    assert line.value["slope"] * 2.0 * np.pi == pytest.approx(0.05509, rel=0.01)


def test_noise_whose_input_is_not_in_the_log_is_not_replayed(data):
    windows = identify(logs.odrive(data, ("step", "chirp", "noise")), None, MotorLine()).study.windows
    assert windows.unresolved > 10
