"""sample: the covariance and the ranges come out again; the struct of arrays is that of its robots."""

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.model.correlation import key_correlation
from omnidyn.model.keys import Key
from omnidyn.model.known.uncertainty import plausible
from omnidyn.model.robot import Prior
from omnidyn.simulation.batch.parameters import batch_parameters

ROBOT = omnidyn.load_robot("axebot")
KEYS = ("friction.axes.coulomb[0]", "friction.axes.viscous[0]", "motor.torque_constant_Nm_A")


def known(robot, stds, matrix):
    """A robot with these std and correlations."""
    return robot.replace(
        priors={key: Prior(std=std) for key, std in zip(KEYS, stds, strict=True)},
        correlation=key_correlation(KEYS, np.array(matrix)),
    )


MATRIX = [[1.0, -0.8, 0.3], [-0.8, 1.0, 0.0], [0.3, 0.0, 1.0]]


def test_draws_have_the_std_and_the_correlations():
    robot = known(ROBOT, (0.1, 0.05, 0.0002), MATRIX)
    drawn = omnidyn.sample(robot, 20_000, rng=1)
    assert drawn.keys == KEYS
    logs = np.log(drawn.values)
    np.testing.assert_allclose(logs.std(axis=0), [0.1 / 2.2, 0.05 / 0.94, 0.0002 / 0.0059], rtol=0.02)
    np.testing.assert_allclose(np.corrcoef(logs.T), MATRIX, atol=0.02)


def test_the_arrays_are_those_of_the_robots_it_makes():
    robot = known(ROBOT, (0.3, 0.1, 0.001), MATRIX)
    drawn = omnidyn.sample(robot, 50, rng=2)
    robots = list(drawn)
    assert [r.friction for r in robots] == [r.friction for r in plausible(robot, 50, seed=2)]
    for values, truth in zip(drawn.parameters, batch_parameters(robots), strict=True):
        np.testing.assert_array_equal(values, truth)


@pytest.mark.parametrize("name", ["axebot", "lekiwi", "mecanum", "four-wheel"])
def test_ranges_and_factors(name):
    robot = omnidyn.load_robot(name)
    factors = {
        key: (0.5, 2.0)
        for key in (
            "friction",
            "body.inertia_kg_m2",
            "motor.resistance_ohm",
            "motor.torque_constant_Nm_A",
            "motor.emf_constant_Vs_rad",
        )
    }
    if not (robot.motor.rotor_inertia or robot.wheels.wheel_inertia):
        factors |= {"motor.gear_ratio": (0.9, 1.1), "wheels.wheel_radius_m": (0.9, 1.1)}
    drawn = omnidyn.sample(robot, 40, ranges={"body.mass_kg": (1.0, 3.0)}, factors=factors)
    mass = drawn.values[:, drawn.keys.index("body.mass_kg")]
    assert 1.0 <= mass.min() < 1.2
    assert 2.8 < mass.max() <= 3.0
    for values, truth in zip(drawn.parameters, batch_parameters(list(drawn)), strict=True):
        np.testing.assert_array_equal(values, truth)
    assert drawn.robot(3).body.mass == mass[3]


def test_numbers_of_single_wheels_take_a_robot_each():
    drawn = omnidyn.sample(ROBOT, 5, factors={"wheels.robot_radius_m": (0.9, 1.1)})
    assert drawn.parameters is None
    voltage = np.full((30, 3), 2.0)
    run = omnidyn.simulate_batch(drawn, voltage, 0.01)
    single = omnidyn.simulate(drawn.robot(4), voltage, 0.01)
    assert np.abs(run.end.twist[4] - single.twist[-1]).max() < 1e-12


def test_a_sample_moves_as_its_robots_do():
    robot = known(omnidyn.load_robot("axebot"), (0.3, 0.1, 0.001), MATRIX)
    drawn, voltage = omnidyn.sample(robot, 100), np.full((50, 3), [1.0, 3.0, -2.0])
    arrays, robots = omnidyn.simulate_batch(drawn, voltage, 0.01), omnidyn.simulate_batch(list(drawn), voltage, 0.01)
    np.testing.assert_array_equal(arrays.end.twist, robots.end.twist)
    assert arrays.engines == robots.engines == {"exact engine, in blocks": 100}


def test_a_robot_of_a_sample_holds_the_numbers_that_were_drawn():
    drawn = omnidyn.sample(known(ROBOT, (0.3, 0.1, 0.001), MATRIX), 300, rng=4)
    for key, column in zip(map(Key.parse, KEYS), drawn.values.T, strict=True):
        np.testing.assert_array_equal([key.get(robot) for robot in drawn], column)


def test_what_a_large_std_becomes_is_said_the_median_stays():
    body = ROBOT.replace(priors={"body.mass_kg": Prior(std=1.0), KEYS[0]: Prior(std=2.2), KEYS[1]: Prior(std=0.2)})
    drawn = omnidyn.sample(body, 20_001, rng=1)
    mass, coulomb, viscous = (drawn.values[:, drawn.keys.index(key)] for key in ("body.mass_kg", *KEYS[:2]))
    for values, median, std in ((mass, 1.5, 1.0 / 1.5), (viscous, 0.94, 0.2 / 0.94)):
        assert np.median(values) == pytest.approx(median, rel=1e-3)
        assert np.log(values).std() == pytest.approx(std, rel=1e-3)
    assert mass.mean() == pytest.approx(1.5 * np.exp((1.0 / 1.5) ** 2 / 2.0), rel=5e-3)  # of a log-normal
    assert np.median(coulomb) == pytest.approx(2.2, rel=1e-3)
    assert coulomb.min() > 0.0
    assert f"log-normal, the value is the median: body.mass_kg, {KEYS[1]}" in repr(drawn)
    assert f"; normal: {KEYS[0]}" in repr(drawn)
    assert "; even: body.mass_kg>" in repr(omnidyn.sample(ROBOT, 5, factors={"body.mass_kg": (0.8, 1.2)}))


def test_draws_out_of_range_come_back_as_plausible_brings_them():
    robot = known(ROBOT, (0.1, 0.05, 0.02), MATRIX)  # torque constants of 1e-9 and less among them
    drawn = omnidyn.sample(robot, 3000, rng=3)
    far = int(np.argmin(drawn.values[:, 2]))
    low = drawn.robot(far).motor.torque_constant
    assert low >= 1e-9
    np.testing.assert_allclose(
        drawn.parameters.push[:, :, far], batch_parameters([drawn.robot(far)]).push[:, :, 0], rtol=1e-13
    )


def test_bad_calls_are_refused():
    with pytest.raises(InsufficientDataError, match="std"):
        omnidyn.sample(ROBOT.replace(priors={}), 10)
    with pytest.raises(InputError, match="not a range"):
        omnidyn.sample(ROBOT, 10, ranges={"body.mass_kg": (2.0, 1.0)})
    with pytest.raises(InputError, match=r"mass_kg"):
        omnidyn.sample(ROBOT, 10, ranges={"body.mass_kg": (-2.0, 1.0)})
    with pytest.raises(InputError, match="each number once"):
        omnidyn.sample(ROBOT, 10, ranges={"body.mass_kg": (1.0, 2.0)}, factors={"body.mass_kg": (0.9, 1.1)})
    with pytest.raises(InputError, match="an estimate, or a robot"):
        omnidyn.sample("axebot", 10)
    with pytest.raises(InputError, match="strange number"):
        omnidyn.sample(ROBOT, 0)
