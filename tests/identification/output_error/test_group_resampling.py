"""Groups: bootstrap and profile against the sandwich, the likelihood and the truth; the engine on other pieces."""

import numpy as np
import pytest

from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.engines.engine import Weighting
from omnidyn.identification.output_error.fit import Fit
from omnidyn.identification.output_error.joint import join
from omnidyn.identification.output_error.solve.progress import FitProgress
from omnidyn.model.keys import BOX, Key
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import coloured, excitation, noisy_draw
from tests.support.codes import codes
from tests.support.grouped import shared

AXEBOT = load_robot("axebot")
TORQUE, COULOMB, MASS = "motor.torque_constant_Nm_A", "friction.axes.coulomb[0]", "body.mass_kg"
QUIET = {"nuisances": (), "start": "rest"}


def floors(runs, noise=noisy_draw):
    """As many runs of 6 s at 50 Hz on a smooth floor and on a rough one: (runs, groups)."""
    found, names = [], []
    for g, (name, level) in enumerate((("smooth", 2.2), ("rough", 2.6))):
        robot = Key.parse(COULOMB).set(AXEBOT, level)
        for k in range(runs):
            log = simulate(robot, excitation(6.0, 50.0, seed=10 * g + k), 0.02)
            found.append(noise(log, 10 * g + k))
            names.append(name)
    return found, names


@pytest.fixture(scope="module")
def drawn():
    """Ten runs a floor whose noise remembers (0.9 from row to row at 50 Hz): by sandwich, and by 100 draws."""
    runs, names = floors(10, coloured)
    how = {"free": ["friction"], **QUIET}
    plain = identify(runs, AXEBOT, OutputError(covariance="sandwich", **how), groups=names)
    return plain, identify(runs, AXEBOT, OutputError(bootstrap=100, **how), groups=names), (runs, names, how)


def test_a_bootstrap_is_as_wide_as_the_sandwich(drawn):
    """Two ways to the same: 100 draws know a std within 7 %, ten runs within 24 %, the sandwich about as well."""
    plain, again, _ = drawn
    ratio = []
    for group, estimate in plain.groups.items():
        ratio += [again.groups[group].std[key] / estimate.std[key] for key in BOX]
    ratio += [b.std / a.std for a, b in zip(plain.differences, again.differences, strict=True)]
    assert np.exp(np.mean(np.log(ratio))) == pytest.approx(1.0, abs=0.2)
    assert min(ratio) > 0.5
    assert max(ratio) < 2.0


def test_values_stay_and_intervals_hold_them(drawn):
    plain, again, _ = drawn
    for group, estimate in plain.groups.items():
        assert again.groups[group].value == estimate.value
    for d in again.differences:
        assert d.low < d.difference < d.high
        assert d.low <= (0.4 if d.key == COULOMB else 0.0) + 1.5 * d.std
    assert next(d for d in again.differences if d.key == COULOMB).differs


def test_the_same_draws_again(drawn):
    _, _, (runs, names, how) = drawn
    first, second = (identify(runs, AXEBOT, OutputError(bootstrap=20, **how), groups=names) for _ in range(2))
    assert first.differences == second.differences
    for group in first.groups:
        assert first.groups[group].ci95 == second.groups[group].ci95


def test_each_group_needs_runs_to_draw_from():
    runs, names = floors(5)
    with pytest.raises(InsufficientDataError, match="too few runs for a bootstrap; got 4 in rough; expected 5"):
        identify(runs[:-1], AXEBOT, OutputError(bootstrap=5, **QUIET), groups=names[:-1])


def test_a_profile_of_a_number_that_is_all_but_linear_is_the_interval_of_the_information():
    """White noise and much of it: 2 F is a parabola, so that both intervals are the same."""
    runs, names = floors(2)
    plain = identify(runs, AXEBOT, OutputError(free=["friction", TORQUE], covariance="white", **QUIET), groups=names)
    how = {"free": ["friction", TORQUE], "profile": [COULOMB, TORQUE], "covariance": "white", **QUIET}
    profiled = identify(runs, AXEBOT, OutputError(**how), groups=names)
    for group, estimate in plain.groups.items():
        for key in (COULOMB, TORQUE):
            np.testing.assert_allclose(
                profiled.groups[group].ci95[key], estimate.ci95[key], atol=0.2 * estimate.std[key]
            )
    ends = [e.ci95[TORQUE] for e in profiled.groups.values()]
    assert ends[0] == ends[1]
    for ours, first in zip(profiled.differences, plain.differences, strict=True):
        assert ((ours.low, ours.high) != (first.low, first.high)) == (ours.key == COULOMB)
        np.testing.assert_allclose((ours.low, ours.high), (first.low, first.high), atol=0.2 * first.std)
    with pytest.raises(InputError, match=r"profile: not a free number; got body\.mass_kg"):
        identify(runs, AXEBOT, OutputError(profile=[MASS], **QUIET), groups=names)


def test_the_best_so_far_is_what_the_state_says_and_the_same_again():
    """Cut after two better states; the numbers are those of the second one, to the last bit."""
    runs, names = floors(2)
    found = []
    for _ in range(2):
        joint, states = Fit.of(runs, AXEBOT, OutputError(free=["friction", TORQUE], **QUIET), names), []

        def listen(report, kept=states):
            kept += [report.state] if report.state is not None else []
            if len(kept) == 2:
                raise KeyboardInterrupt

        progress = FitProgress(listen)
        with pytest.raises(KeyboardInterrupt):
            joint.solve(progress)
        found.append(joint.answer(progress.best))
        values = dict(zip(states[-1].problem.names, states[-1].point.values, strict=True))
        for group, estimate in found[-1].estimates.items():
            assert "interrupted" in codes(estimate.warnings)
            assert estimate.value[TORQUE] == values[TORQUE]
            assert estimate.value[COULOMB] == values[f"{COULOMB}@{group}"]
    assert found[0].differences == found[1].differences
    assert found[0].estimates["rough"].ci95 == found[1].estimates["rough"].ci95


def test_logs_with_other_channels_in_another_order():
    """Draws may begin with a log of other channels; each residual must still meet the noise of its own channel."""
    runs, names = floors(2)
    robot = Key.parse(COULOMB).set(AXEBOT, 2.6)
    wheels = simulate(robot, excitation(6.0, 50.0, seed=5), 0.02)
    runs[3] = wheels.replace(twist=None, pose=None, current=None)
    joint = Fit.of(runs, AXEBOT, OutputError(free=["friction"], **QUIET), names)
    groups = joint.groups
    engine = join(groups, [group.problem() for group in groups], BOX)
    problem = engine.problem
    order = [3, 0, 2, 1]
    other = engine.on(
        type(problem)(problem.robot, problem.parameters, problem.robot_count, tuple(problem.pieces[k] for k in order))
    )
    point = problem.start()
    moved = type(point)(point.values, tuple(point.states[k] for k in order))
    first = engine.sums(point, Weighting(np.ones(len(problem.columns))))
    again = other.sums(moved, Weighting(np.ones(len(other.problem.columns))))
    for place, k in enumerate(order):
        assert [other.problem.columns[c] for c in again[place].columns] == [
            problem.columns[c] for c in first[k].columns
        ]
        np.testing.assert_array_equal(again[place].square, first[k].square)


def test_floors_of_a_robot_of_the_implicit_engine():
    """An ellipse on two floors: friction along the direction of travel, each floor its own, the mass shared."""
    robot, runs = load_robot("robotino"), []
    robot = robot.replace(drive=load_robot("axebot").drive)
    keys = ["friction.direction.coulomb[0]", "friction.direction.coulomb[1]"]
    rng = np.random.default_rng(3)
    true = {"gray": 36.0, "green": 31.0}
    for level in true.values():
        own = Key.parse(keys[0]).set(robot, level)
        volts = 2.0 * excitation(5.0, 20.0, seed=3)
        run = simulate(own, volts, 0.05)
        noise = 0.005 * rng.standard_normal(run.twist.shape)
        runs.append(run.replace(twist=run.twist + noise, wheel_speed=None, current=None, pose=None))
    study = identify(runs, robot, OutputError(free=[*keys, MASS], per_free=keys[:1], **QUIET), groups=[*true])
    (difference,) = study.differences
    assert shared(study) == {keys[1], MASS}
    assert difference.difference == pytest.approx(-5.0, abs=4.0 * difference.std)
    assert difference.std < 0.5
