"""The line fit against independent formulas, and whether its 95 % intervals cover in 95 % of the draws."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy import optimize, stats

from omnidyn.errors import InsufficientDataError
from omnidyn.identification.steady.line import fit_line

SPEED = np.array([-1.2, -0.8, -0.3, 0.25, 0.5, 0.9, 1.1])
B, C = 0.94, 2.2
DRAWS = 2000


def truth(speed):
    return B * speed + C * np.sign(speed)


def test_weights_are_those_of_a_scaled_least_squares():
    random = np.random.default_rng(3)
    std = np.array([0.02, 0.05, 0.1, 0.2, 0.05, 0.1, 0.03])
    force = truth(SPEED) + std * random.standard_normal(7)
    line = fit_line(SPEED, force, None, std)
    design = np.stack([SPEED, np.sign(SPEED)], axis=1) / std[:, None]
    solution, square, *_ = np.linalg.lstsq(design, force / std)
    covariance = np.linalg.inv(design.T @ design)
    assert line.level == pytest.approx(solution, rel=1e-10)
    assert line.covariance == pytest.approx(covariance * square[0] / 5, rel=1e-9)
    assert line.reduced_chi2 == pytest.approx(square[0] / 5, rel=1e-9)
    assert line.quantile == stats.t.ppf(0.975, 5)
    exact = fit_line(SPEED, force, None, std, absolute_std=True)
    assert exact.covariance == pytest.approx(covariance, rel=1e-9)
    assert exact.quantile == pytest.approx(1.959964, abs=1e-6)


def test_weights_that_are_all_equal_change_nothing():
    force = truth(SPEED) + 0.1 * np.random.default_rng(4).standard_normal(7)
    plain, weighted = fit_line(SPEED, force), fit_line(SPEED, force, None, np.full(7, 0.03))
    assert weighted.level == pytest.approx(plain.level, rel=1e-10)
    assert weighted.ci95 == pytest.approx(plain.ci95, rel=1e-9)


def test_speed_std_minimises_the_effective_variance():
    """Against a general minimiser, and against the same problem told otherwise: the true speeds are unknowns too."""
    random = np.random.default_rng(5)
    speed_std, force_std = np.full(7, 0.15), np.linspace(0.05, 0.2, 7)
    speed = SPEED + speed_std * random.standard_normal(7)
    force = truth(SPEED) + force_std * random.standard_normal(7)
    line = fit_line(speed, force, speed_std, force_std)

    def cost(p):
        return np.sum((force - p[0] * speed - p[1] * np.sign(speed)) ** 2 / (force_std**2 + p[0] ** 2 * speed_std**2))

    best = optimize.minimize(cost, [1.0, 2.0], method="Nelder-Mead", options={"xatol": 1e-10, "fatol": 1e-14})
    assert line.converged
    assert line.level == pytest.approx(best.x, rel=1e-6)

    def misfit(p):
        true_speed = p[2:]
        return np.concatenate([(force - truth_of(p, true_speed)) / force_std, (speed - true_speed) / speed_std])

    def truth_of(p, true_speed):
        return p[0] * true_speed + p[1] * np.sign(speed)

    result = optimize.least_squares(misfit, [1.0, 2.0, *speed], xtol=1e-15, ftol=1e-15, gtol=1e-15)
    assert line.level == pytest.approx(result.x[:2], rel=1e-6)


def coverage(make, absolute=False, draws=DRAWS):
    """Share of draws in which the intervals of B and C hold the truth."""
    hits = np.zeros(2)
    for seed in range(draws):
        line = fit_line(*make(np.random.default_rng(seed)), absolute_std=absolute)
        hits += (line.ci95[:, 0] <= [B, C]) & (line.ci95[:, 1] >= [B, C])
    return hits / draws


# Four standard errors of a share of 0.95 in 2000 draws are 0.0195; three are 0.0146.
NEAR = pytest.approx(0.95, abs=0.0146)
STD = np.array([0.02, 0.05, 0.1, 0.2, 0.05, 0.1, 0.03])


def equal_noise(random):
    return SPEED, truth(SPEED) + 0.1 * random.standard_normal(7)


def four_rows(random):
    speed = np.array([0.1, 0.37, 0.74, 1.08])
    return speed, truth(speed) + 0.05 * random.standard_normal(4)


def known_ratio(random):
    return SPEED, truth(SPEED) + 3.0 * STD * random.standard_normal(7), None, STD  # 3: a scale nobody knows


def known_std(random):
    return SPEED, truth(SPEED) + STD * random.standard_normal(7), None, STD


def noisy_speed(random):
    speed = np.repeat(SPEED, 4)
    speed_std, force_std = np.full(28, 0.05), np.tile(STD, 4)
    measured = speed + speed_std * random.standard_normal(28)
    return measured, truth(speed) + force_std * random.standard_normal(28), speed_std, force_std


@pytest.mark.parametrize(
    "make, absolute",
    [
        (equal_noise, False),
        (four_rows, False),
        (known_ratio, False),
        (known_std, False),
        (known_std, True),
    ],
)
@pytest.mark.some(2)
def test_the_intervals_cover_as_often_as_they_say(make, absolute):
    assert coverage(make, absolute) == NEAR


def test_the_intervals_cover_with_noisy_speeds_too():
    """First-order theory: a little less than 95 % is to be expected, and no more than a little."""
    share = coverage(noisy_speed, absolute=True, draws=1000)
    assert (share > 0.92).all()
    assert (share < 0.97).all()


def test_noisy_speeds_do_not_flatten_the_slope():
    """Ordinary least squares is too flat by the share of noise in the speeds; the effective variance is not."""
    random = np.random.default_rng(6)
    speed = random.uniform(0.5, 1.5, 20000)
    measured, force = speed + 0.1 * random.standard_normal(20000), truth(speed) + 0.05 * random.standard_normal(20000)
    plain = fit_line(measured, force)
    right = fit_line(measured, force, np.full(20000, 0.1), np.full(20000, 0.05))
    assert plain.level[0] == pytest.approx(B / (1 + 0.01 * 12), rel=0.01)  # variance of the speeds: 1/12
    assert right.level[0] == pytest.approx(B, rel=0.01)


# ---- bounds ---------------------------------------------------------------------------------------------


def test_a_falling_line_has_no_negative_viscous_friction():
    speed, force = np.array([0.2, 0.5, 0.8, 1.1]), np.array([2.4, 2.3, 2.3, 2.1])
    line = fit_line(speed, force)
    assert line.at_bound.tolist() == [True, False]
    assert line.free[0] == pytest.approx(stats.linregress(speed, force).slope, rel=1e-10)
    assert line.level == pytest.approx([0.0, force.mean()], rel=1e-12)
    half = line.quantile * line.std
    assert line.ci95[0].tolist() == [0.0, half[0]]
    assert line.ci95[1] == pytest.approx([min(line.free[1] - half[1], 2.275), line.free[1] + half[1]])


def test_a_steep_line_has_no_negative_coulomb_friction():
    speed, force = np.array([0.2, 0.5, 0.8, 1.1]), np.array([0.1, 0.52, 0.9, 1.35])
    line = fit_line(speed, force)
    assert line.at_bound.tolist() == [False, True]
    assert line.level == pytest.approx([speed @ force / (speed @ speed), 0.0], rel=1e-12)


def test_forces_of_the_wrong_sign_leave_no_friction():
    line = fit_line(np.array([0.2, 0.5, 0.8]), np.array([-0.1, -0.3, -0.3]))
    assert line.level.tolist() == [0.0, 0.0]
    assert line.at_bound.tolist() == [True, True]


def test_at_a_bound_the_intervals_still_cover():
    """A robot without viscous friction: half of the draws end at the bound, at least 95 % must hold 0."""
    speed, hits, ends = np.abs(SPEED), np.zeros(2), 0
    for seed in range(DRAWS):
        line = fit_line(speed, C + 0.1 * np.random.default_rng(seed).standard_normal(7))
        hits += (line.ci95[:, 0] <= [0.0, C]) & (line.ci95[:, 1] >= [0.0, C])
        ends += line.at_bound[0]
    assert 0.45 < ends / DRAWS < 0.55
    assert (hits / DRAWS >= 0.935).all()


speeds = st.tuples(st.floats(0.01, 2.0), st.sampled_from([-1.0, 1.0])).map(np.prod)
rows = st.lists(st.tuples(speeds, st.floats(-5, 5), st.floats(0.01, 1.0)), min_size=3, max_size=12)


@given(rows)
def test_the_bounded_line_is_the_best_within_the_bounds(points):
    speed, force, std = (np.array(column) for column in zip(*points, strict=True))
    assume(np.ptp(np.abs(speed)) > 1e-2)
    line = fit_line(speed, force, None, std)
    design = np.stack([speed, np.sign(speed)], axis=1) / std[:, None]
    expected, _ = optimize.nnls(design, force / std)
    size = np.linalg.norm(force / std)
    assert np.linalg.norm(design @ (line.level - expected)) <= 1e-6 * size + 1e-12
    assert (line.ci95[:, 0] <= line.level).all()
    assert (line.level <= line.ci95[:, 1]).all()


@given(rows, st.floats(1e-3, 1e3), st.floats(1e-3, 1e3))
def test_units_of_speed_and_force_do_not_matter(points, speed_unit, force_unit):
    speed, force, std = (np.array(column) for column in zip(*points, strict=True))
    assume(np.ptp(np.abs(speed)) > 1e-2)
    one = fit_line(speed, force, None, std)
    other = fit_line(speed * speed_unit, force * force_unit, None, std * force_unit)
    scale = np.array([force_unit / speed_unit, force_unit])
    tolerance = 1e-8 * (np.abs(one.free).max() + one.std.max()) * scale.max()
    assert other.free == pytest.approx(one.free * scale, rel=1e-6, abs=tolerance)
    assert other.std == pytest.approx(one.std * scale, rel=1e-6, abs=tolerance)


def test_one_point_that_outweighs_all_others_is_no_line():
    with pytest.raises(InsufficientDataError, match="the line is not determined; got one point outweighs all others"):
        fit_line(np.array([0.1, 0.5, 1.0]), np.array([1.0, 2.0, 3.0]), None, np.array([1e-9, 1e6, 1e6]))
