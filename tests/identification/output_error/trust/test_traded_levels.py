"""Levels of which only one number is told, against the ellipse in closed form."""

import numpy as np
import pytest

from omnidyn.identification.output_error.trust.levels import trade

ANYWHERE = lambda place: 0.1 < place.q < 10.0  # noqa: E731
LIMIT = 4.0


def slant(angle, width, low=None):
    """Costs of levels (q s, s / q) where starts of force 1 at one angle tell at which size they begin, to a share
    `width`, from `low` on where given: flat inside, far too much outside, as a likelihood that jumps."""

    def cost(place):
        x, y = place.q * place.s, place.s / place.q
        size = np.hypot(np.cos(angle) / x, np.sin(angle) / y) ** -1.0
        return 0.0 if (-width if low is None else low) < np.log(size) < width else 60.0

    return cost


def levels(places):
    return np.array([(place.q * place.s, place.s / place.q) for place in places]).T


@pytest.mark.parametrize("angle", [0.6, np.pi / 4.0, 1.1])
@pytest.mark.parametrize("width", [0.0007, 0.004, 0.03])
def test_a_ridge_is_walked_as_far_as_it_goes(angle, width):
    """x >= cos, y >= sin is all that a slant tells of each: the ellipse's asymptotes."""
    walk = trade(slant(angle, width), LIMIT, ANYWHERE)
    x, y = levels(walk.edges)
    np.testing.assert_allclose([x.min(), y.min()], [np.cos(angle), np.sin(angle)], rtol=0.02 + 2.0 * width)
    assert min(x.max(), y.max()) > 5.0
    assert sorted(place.q > 1.0 for place in walk.lost_places) == [False, True]


@pytest.mark.parametrize("low", [-0.05, -0.02])
def test_it_begins_anywhere_on_a_broad_one(low):
    """At its upper edge."""
    walk = trade(slant(np.pi / 4.0, 0.0005, low), LIMIT, lambda place: 0.97 < place.q < 1.03)
    reached = np.log([place.s for place in walk.edges if abs(place.q - 1.0) < 0.01])
    np.testing.assert_allclose([reached.min(), reached.max()], [low, 0.0005], atol=0.006)


@pytest.mark.parametrize("width", [0.004, 0.01, 0.017, 0.03])
def test_two_slants_tell_both(width):
    """Where another slant tells the other number, the ridge ends where both do."""
    one, other = slant(0.6, width), slant(1.0, width)
    walk = trade(lambda place: one(place) + other(place), LIMIT, ANYWHERE)
    x, y = levels(walk.edges)
    sides = np.array([[np.cos(a) ** 2, np.sin(a) ** 2] for a in (0.6, 1.0)])
    corners = [np.linalg.solve(sides, np.exp(2.0 * width * np.array(c))) ** -0.5 for c in ((1, -1), (-1, 1))]
    low, high = np.min(corners, axis=0), np.max(corners, axis=0)
    np.testing.assert_allclose([x.min(), y.min()], low, rtol=0.012)
    np.testing.assert_allclose([x.max(), y.max()], high, rtol=0.012)
    assert np.all([x.min(), y.min()] <= low)  # it ends outside
    assert np.all([x.max(), y.max()] >= high)
    assert not walk.lost_places


def test_fits_are_counted():
    """Both ways of a ridge of .07 % cost less than 700 fits."""
    tried, cost = [], slant(np.pi / 4.0, 0.0007)
    trade(lambda place: tried.append(place) or cost(place), LIMIT, ANYWHERE)
    assert len(tried) < 700
