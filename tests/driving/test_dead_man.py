"""The robot's side of the dead-man stop: which command acts, whatever the line does to it."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from omnidyn.driving.connection import Command
from omnidyn.driving.dead_man import DeadMan

HOLD = 0.125


def started(now=10.0, sent=3.0):
    """A robot whose clock is 7 s ahead, in session 5."""
    dead_man = DeadMan(2)
    assert dead_man.take(now, Command(5, 0, sent, 0.0, (0.0, 0.0)))
    return dead_man


def test_a_command_acts_until_its_hold_is_over():
    dead_man = started()
    assert dead_man.take(10.5, Command(5, 1, 3.5, HOLD, (1.0, -1.0)))
    assert dead_man.acting(10.62) == (1.0, -1.0)
    assert dead_man.acting(10.626) == (0.0, 0.0)


def test_late_old_strange_and_short_commands_are_dropped():
    dead_man = started()
    assert dead_man.take(10.5, Command(5, 3, 3.5, HOLD, (1.0, 1.0)))
    assert not dead_man.take(10.51, Command(5, 3, 3.51, HOLD, (1.0, 1.0)))  # twice
    assert not dead_man.take(10.51, Command(5, 2, 3.49, HOLD, (1.0, 1.0)))  # overtaken
    assert not dead_man.take(10.51, Command(4, 9, 3.51, HOLD, (1.0, 1.0)))  # of another session
    assert not dead_man.take(10.51, Command(5, 4, 3.51, HOLD, (1.0,)))  # of another robot
    assert not dead_man.take(11.0, Command(5, 5, 3.80, HOLD, (1.0, 1.0)))  # 200 ms late
    assert dead_man.number == 3


def test_a_late_command_counts_from_when_it_was_sent():
    dead_man = started()
    assert dead_man.take(10.6, Command(5, 1, 3.5, HOLD, (1.0, 1.0)))  # 100 ms late
    assert dead_man.acting(10.624) == (1.0, 1.0)
    assert dead_man.acting(10.626) == (0.0, 0.0)


def test_a_clock_that_goes_back_switches_off():
    dead_man = started()
    assert dead_man.take(10.5, Command(5, 1, 3.5, HOLD, (1.0, 1.0)))
    assert dead_man.acting(10.4) == (0.0, 0.0)
    assert dead_man.acting(10.5) == (0.0, 0.0)  # and it stays off


@given(
    st.lists(st.tuples(st.integers(1, 30), st.floats(0.0, 2.0), st.floats(0.0, 3.0)), max_size=30),
    st.floats(-1e3, 1e3),
)
def test_nothing_acts_longer_than_its_hold_after_it_was_sent(arrivals, ahead):
    """Any order, any delay beyond that of the first greeting."""
    dead_man = started(ahead, 0.0)
    events = sorted((sent + delay, number, sent) for number, sent, delay in arrivals)
    for arrival, number, sent in events:
        dead_man.take(ahead + arrival, Command(5, number, sent, HOLD, (1.0, 1.0)))
    for moment in np.linspace(0.0, 6.0, 50):
        if any(dead_man.acting(ahead + moment)):
            assert any(sent <= moment + 1e-9 <= sent + HOLD + 2e-9 for _, _, sent in events)
