"""The dead zone with its interval, against the closed form of the paper's robot and its std by hand."""

import json

import numpy as np
import pytest
from scipy.stats import norm

from omnidyn.errors import InputError
from omnidyn.model.friction import DirectionFriction, Friction
from omnidyn.model.known.dead_zone import dead_zone
from omnidyn.model.known.told import with_correlation
from omnidyn.model.robot import Prior
from omnidyn.model.robot_file import load_robot

AXEBOT = load_robot("axebot")
Z = norm.ppf(0.975)
C = [f"friction.axes.coulomb[{axis}]" for axis in range(3)]
R, K_T = "motor.resistance_ohm", "motor.torque_constant_Nm_A"
# V = C r R/(l K_t n): n = 2 cos 30 deg, 1 + 1/4 + 1/4, and 3 b for the moment.
CLOSED = np.array([2.2, 1.5, 0.099]) * 0.035 * 1.69 / (19.0 * 0.0059) / [np.sqrt(3.0), 1.5, 0.3]


def known(robot=AXEBOT, origin="given", **std):
    return robot.replace(priors={key: Prior(std=each, origin=origin) for key, each in std.items()})


def relative_std(row):
    low, high = row.scale_interval
    return np.log(high / low) / (2.0 * Z)


def test_volts_and_duty_are_the_closed_form():
    found = dead_zone(AXEBOT)
    assert [row.axis for row in found.rows] == ["x", "y", "yaw"]
    np.testing.assert_allclose([row.scale for row in found.rows], CLOSED, rtol=1e-12)
    np.testing.assert_allclose([row.duty for row in found.rows], CLOSED / 6.0, rtol=1e-12)
    assert found.band is None
    assert found.rows[0].scale_interval is None


def test_the_std_by_hand():
    """d ln V = d ln C + d ln R - d ln K_t, C and R correlated by -0.6."""
    c, r, k = 0.05, 0.08, 0.03
    robot = known(**{C[0]: c * 2.2, R: r * 1.69, K_T: k * 0.0059})
    robot = with_correlation(robot, [C[0], R], [[1.0, -0.6], [-0.6, 1.0]])
    x, y, yaw = dead_zone(robot, draws=1000).rows
    assert relative_std(x) == pytest.approx(np.sqrt(c**2 + r**2 + k**2 - 1.2 * c * r), rel=0.04)
    assert relative_std(y) == pytest.approx(np.hypot(r, k), rel=0.04)
    assert relative_std(yaw) == pytest.approx(np.hypot(r, k), rel=0.04)
    assert np.sqrt(np.prod(x.scale_interval)) == pytest.approx(CLOSED[0], rel=0.01)


def test_over_direction_the_band_is_that_of_the_axis_that_holds():
    """Along x only C_x counts, along y only C_y."""
    found = dead_zone(known(**{C[0]: 0.11, C[1]: 0.015}), draws=1000)
    for angle, share in ((0.0, 0.05), (90.0, 0.01)):
        k = int(np.argmin(abs(found.directions - np.radians(angle))))
        assert np.log(found.band.high[k] / found.band.low[k]) == pytest.approx(2 * Z * share, rel=0.04)
    assert (found.band.low <= found.voltage).all()
    assert (found.band.high >= found.voltage).all()


def test_a_supply_counts_in_the_duty_alone():
    robot = known(origin="guess", **{"drive.supply_V": 0.6}).replace(
        drive=AXEBOT.drive.replace(kind="duty", supply=12.0)
    )
    found = dead_zone(robot)
    low, high = found.rows[0].duty_interval
    assert found.rows[0].duty == pytest.approx(CLOSED[0] / 12.0)
    assert np.log(high / low) == pytest.approx(2 * Z * 0.05, rel=0.05)
    assert found.rows[0].scale_interval == pytest.approx((CLOSED[0], CLOSED[0]), rel=1e-9)
    assert found.full_of == "supply"
    words = found.summary()
    assert "the duty rests on guesses: drive.supply_V (4.9 %" in " ".join(words.split())
    assert "it rests on guesses" not in words


def test_what_it_rests_on_is_named_and_what_it_does_not_is_not():
    robot = AXEBOT.replace(
        priors={
            R: Prior(std=0.3, origin="guess"),
            K_T: Prior(origin="guess"),
            "body.mass_kg": Prior(std=0.5, origin="guess"),
            C[0]: Prior(std=0.1, origin="identified"),
        }
    )
    found = dead_zone(robot)
    assert [each.key for each in found.rests_on] == [R, C[0], K_T]
    assert found.guesses == (R, K_T)
    words = " ".join(found.summary().split())
    assert f"it rests on guesses: {R} (19 % by its std), {K_T} (no std: in no interval)" in words
    assert any(R in warning.numbers["keys"] for warning in found.document().warnings)
    assert json.loads(json.dumps(found.to_dict(), allow_nan=False))["rests_on"][0]["key"] == R


def test_a_std_of_what_it_does_not_follow_from_gives_no_interval():
    found = dead_zone(known(**{"body.mass_kg": 0.1}))
    assert found.rows[0].scale_interval == pytest.approx((CLOSED[0], CLOSED[0]))
    assert "the intervals are empty: no number that the dead zone follows from has a std" in found.summary()


def test_one_axis_of_unknown_friction_leaves_the_others_alone():
    """A draw in which yaw has no friction left: x and y must not give way for it, by rounding."""
    for robot in (AXEBOT, load_robot("mecanum"), AXEBOT.replace(body=AXEBOT.body.replace(rotating_frame=True))):
        x, y, yaw = dead_zone(known(robot, **{C[2]: 1.0})).rows
        assert x.scale_interval == pytest.approx((x.scale, x.scale), rel=1e-5)
        assert y.scale_interval == pytest.approx((y.scale, y.scale), rel=1e-5)
        assert yaw.scale_interval[0] < 1e-3 < yaw.scale < yaw.scale_interval[1]


def test_friction_of_another_shape():
    """A disc of 1.8 +- 0.09 N: the same 5 % in every direction."""
    disc = AXEBOT.replace(friction=Friction(direction=DirectionFriction(coulomb=(1.8, 1.8), yaw_coulomb=0.1)))
    keys = [f"friction.direction.coulomb[{k}]" for k in range(2)]
    robot = with_correlation(known(disc, **dict.fromkeys(keys, 0.09)), keys, np.ones((2, 2)))
    found = dead_zone(robot)
    np.testing.assert_allclose(np.log(found.band.high / found.band.low), 2 * Z * 0.05, rtol=0.1)
    assert found.rows[2].scale_interval == pytest.approx((found.rows[2].scale,) * 2, rel=1e-5)


def test_a_robot_that_may_never_move():
    robot = AXEBOT.replace(motor=AXEBOT.motor.replace(current_limit=0.4, electrical="quasi-static"))
    found = dead_zone(known(robot, **{C[0]: 0.5}), [[0.0, 1.0, -1.0]])
    assert found.rows[0].scale_interval[1] == np.inf
    assert "to never" in found.summary()
    assert json.loads(json.dumps(found.to_dict(), allow_nan=False))["dead_zone"][0]["interval_V"][1] is None


def test_a_pattern_of_the_wrong_width_is_refused():
    with pytest.raises(InputError, match=r"wrong voltage pattern; got \(1, 2\); expected one entry per wheel \(3\)"):
        dead_zone(AXEBOT, [1.0, 2.0])


def test_directions_of_ones_own_and_what_moves():
    """Forward and sideways are the axes x and y: their directions give the same volts as their patterns."""
    zone = dead_zone(load_robot("axebot"), directions=[0.0, np.pi / 2.0])
    np.testing.assert_allclose(zone.voltage, [zone.rows[0].scale, zone.rows[1].scale], rtol=1e-12)
    assert zone.patterns.shape == (2, 3)
    np.testing.assert_allclose(zone.patterns[0], [0.0, 1.0, -1.0], atol=1e-12)
    ahead = np.array([0.99, 1.01])[:, None] * zone.voltage[0] * zone.patterns[0]
    assert zone.moving_axes(ahead).tolist() == [[False] * 3, [True, False, False]]
