"""Hypothesis strategies: robots, wheels and voltages of every kind the exact engine serves, and some it does not."""

from __future__ import annotations

from hypothesis import assume
from hypothesis import strategies as st

from omnidyn.errors import InputError
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import Wheels
from tests.support.robots import random_robot, robot_of

SMALL = st.floats(-3.0, 3.0, allow_subnormal=False)


def volts(wheels: int, limit: float = 6.0) -> st.SearchStrategy[list[float]]:
    """One row of millivolts: zeros and equal voltages come up often."""
    one = st.integers(int(-limit * 1000), int(limit * 1000)).map(lambda mv: mv / 1000) | st.just(0.0)
    return st.lists(one, min_size=wheels, max_size=wheels)


@st.composite
def any_wheels(draw) -> Wheels:
    """3 to 8 wheels anywhere, each with its own radius, distance and roller angle."""
    count = draw(st.integers(3, 8))

    def each(low, high):
        return draw(st.lists(st.floats(low, high), min_size=count, max_size=count))

    try:
        return Wheels(
            azimuth_deg=each(-360.0, 360.0),
            robot_radius=each(0.05, 0.5),
            wheel_radius=each(0.02, 0.1),
            roller_angle_deg=each(-60.0, 60.0),
        )
    except InputError:  # they happen not to push in every direction
        assume(False)


@st.composite
def any_robot(draw, spread: float = 0.5) -> Robot:
    """Table 3 with every number changed, 3 to 6 evenly spaced wheels, breakaway 1 to 1.5 coulomb."""
    return robot_of(random_robot(draw(st.integers(0, 10**6)), spread))
