"""Draws of robots that may be meant, against the moments and intervals that they must have."""

import numpy as np
import pytest
from scipy.stats import norm

from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.keys import Key
from omnidyn.model.known.told import with_correlation
from omnidyn.model.known.uncertainty import QuantileTails, effects, interval_of, plausible
from omnidyn.model.robot import Prior
from omnidyn.model.robot_file import load_robot, robot_to_toml

AXEBOT = load_robot("axebot")
C_X, R, K_T = "friction.axes.coulomb[0]", "motor.resistance_ohm", "motor.torque_constant_Nm_A"
Z = norm.ppf(0.975)


def told(robot=AXEBOT, **std):
    return robot.replace(priors={key: Prior(std=each) for key, each in std.items()})


def drawn(robots, *keys):
    return np.array([[Key.parse(key).get(robot) for key in keys] for robot in robots])


def test_the_draws_have_the_std_and_the_correlation_of_the_file():
    robot = with_correlation(told(**{C_X: 0.11, R: 0.05}), [C_X, R], [[1.0, -0.7], [-0.7, 1.0]])
    values = np.log(drawn(plausible(robot, 4000, seed=3), C_X, R))
    np.testing.assert_allclose(values.mean(axis=0), np.log([2.2, 1.69]), atol=2e-4)
    np.testing.assert_allclose(values.std(axis=0), [0.11 / 2.2, 0.05 / 1.69], rtol=0.01)
    assert np.corrcoef(values.T)[0, 1] == pytest.approx(-0.7, abs=0.03)


def test_everything_else_stays_as_it_is():
    robot = told(**{C_X: 0.11})
    for draw in plausible(robot, 5):
        assert Key.parse(C_X).set(draw, 2.2) == robot


def test_a_hundred_draws_give_the_interval_of_one_number():
    robot = told(**{R: 0.169})
    low, high = interval_of(robot, lambda each: each.motor.resistance)
    np.testing.assert_allclose(np.log([low, high]), np.log(1.69) + np.array([-Z, Z]) * 0.1, rtol=1e-12)


def test_the_interval_of_a_product_is_that_of_both():
    robot = with_correlation(told(**{R: 0.169, K_T: 0.0006}), [R, K_T], [[1.0, 0.5], [0.5, 1.0]])
    relative = np.array([0.1, 0.0006 / 0.0059])
    std = np.sqrt(relative[0] ** 2 + relative[1] ** 2 - 2 * 0.5 * relative[0] * relative[1])
    low, high = interval_of(robot, lambda each: each.motor.resistance / each.motor.torque_constant, 400)
    assert np.log(high / low) == pytest.approx(2 * Z * std, rel=0.05)


def test_what_is_known_together_alone_stays_known():
    """C R / K_t to 0.1 %, each to 30 %: a friction that is drawn as it is, not as its logarithm, would lose it."""
    relative = {C_X: 0.3 * 2.2, R: 0.3 * 1.69}
    robot = with_correlation(told(**relative), [C_X, R], [[1.0, -0.999995], [-0.999995, 1.0]])
    values = drawn(plausible(robot, 300), C_X, R).prod(axis=1)
    assert values.std() / values.mean() < 0.002
    assert drawn(plausible(robot, 300), R).std() > 0.4


def test_one_seed_is_one_list_of_robots():
    robot = told(**{C_X: 0.3, R: 0.1})
    assert plausible(robot, 7) == plausible(robot, 7)
    assert plausible(robot, 7) != plausible(robot, 7, seed=1)


def test_a_friction_that_may_be_zero_stays_above_it():
    robot = told(**{C_X: 3.0, "friction.axes.viscous[1]": 2.0})
    values = drawn(plausible(robot, 200), C_X, "friction.axes.viscous[1]")
    assert (values > 0.0).all()
    assert 0.15 < (values[:, 0] < 1e-3).mean() < 0.3  # P(z < -2.2/3) = 0.23
    assert values[:, 0].max() > 6.0


def test_what_must_be_positive_is_whatever_its_std():
    values = drawn(plausible(told(**{"body.mass_kg": 1e9, R: 1e-9}), 200), "body.mass_kg", R)
    assert ((values > 0.0) & np.isfinite(values)).all()


def test_every_draw_is_a_robot_that_a_file_may_hold():
    wheels = WheelFriction(coulomb=(0.7, 0.9, 1.1), coulomb_backward=1.0, breakaway=1.2, breakaway_backward=1.05)
    direction = DirectionFriction(coulomb=(2.2, 1.5), breakaway=(2.3, 1.5), yaw_coulomb=0.1, yaw_breakaway=0.1)
    axes = AxesFriction(viscous=(0.1,) * 3, coulomb=(1.0, 1.0, 0.1), breakaway=(1.0, 1.1, 0.1))
    robot = AXEBOT.replace(
        friction=Friction(axes=axes, direction=direction, wheels=wheels),
        motor=AXEBOT.motor.replace(gear_efficiency=0.9, voltage_drop=0.2),
    )
    levels = [f"friction.axes.coulomb[{k}]" for k in range(3)] + [f"friction.direction.coulomb[{k}]" for k in range(2)]
    levels += [f"friction.wheels.coulomb[{k}]" for k in range(3)]
    levels += ["friction.direction.yaw_coulomb", "friction.wheels.breakaway", "friction.wheels.coulomb_backward"]
    more = {"motor.gear_efficiency": 0.3, "motor.voltage_drop_V": 0.5, "wheels.azimuth_deg": 2.0, "body.mass_kg": 0.5}
    for draw in plausible(told(robot, **dict.fromkeys(levels, 1.0), **more), 60):
        assert type(draw).model_validate(draw.model_dump()) is not None
        robot_to_toml(draw)
        for part in (draw.motor, draw.wheels, draw.body, *draw.friction.laws):
            part.replace()  # raises where a number is out of range, or breakaway below coulomb
    assert (drawn([draw], "motor.gear_efficiency") <= 1.0).all()


def test_a_list_known_as_a_whole_is_drawn_entry_by_entry():
    values = drawn(plausible(told(**{"friction.axes.coulomb": 0.05}), 50), C_X, "friction.axes.coulomb[1]")
    assert abs(np.corrcoef(values.T)[0, 1]) < 0.5
    assert (values.std(axis=0) > 0.03).all()


def test_a_robot_without_std_has_nothing_to_draw():
    with pytest.raises(
        InsufficientDataError, match="nothing says how far the numbers of this robot may be off; got axe"
    ):
        plausible(AXEBOT)
    with pytest.raises(InputError, match="draws: strange number of draws; got 0; expected 1 to"):
        plausible(told(**{R: 0.1}), 0)


@pytest.mark.parametrize("count", [20, 39, 40, 41, 100, 257, 1000])
def test_the_ends_are_the_quantiles_of_all_results(count):
    results = np.random.default_rng(count).normal(size=(count, 3, 2))
    ends = QuantileTails(count)
    for each in results:
        ends.add(each)
    np.testing.assert_allclose(ends.interval, np.quantile(results, [0.025, 0.975], axis=0, method="hazen"))


def test_fewer_than_twenty_draws_have_no_interval():
    with pytest.raises(InputError, match="draws: too few draws for a 95 % interval; got 19; expected 20 or more"):
        interval_of(told(**{R: 0.1}), lambda each: each.motor.resistance, 19)


def test_infinity_is_a_result_and_nan_none():
    ends = QuantileTails(100)
    for k in range(100):
        ends.add(np.array([float(k), np.inf if k >= 90 else float(k), np.inf, np.nan if k == 50 else 1.0]))
    low, high = ends.interval
    np.testing.assert_allclose(low[:2], 2.0)
    np.testing.assert_array_equal([high[1], low[2], high[2]], np.inf)
    assert np.isnan([low[3], high[3]]).all()


def test_effects_are_those_of_each_number_alone():
    robot = told(**{R: 0.169, "body.mass_kg": 0.1})
    found = effects(robot, lambda each: each.motor.resistance / each.motor.torque_constant, [R, K_T, "body.mass_kg"])
    assert found[R] == pytest.approx(np.exp(0.1) - 1.0)
    assert found[K_T] == pytest.approx(1.0 - np.exp(-0.01))  # no std: by 1 %
    assert found["body.mass_kg"] == 0.0
