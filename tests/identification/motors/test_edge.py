"""The instant at which a speed leaves zero, or reaches it, of noisy rows whose law is known in closed form."""

import numpy as np
import pytest

from omnidyn.identification.motors.starts_and_stops import edge_interval

T = np.linspace(0.0, 0.79, 80)
LAG, RATE, AT = 0.05, 2.0, 0.4
TRIES = np.sort(np.concatenate([T, 0.5 * (T[1:] + T[:-1])]))


def leaves(jump):
    """A ramp of the input from 0.4 s on, a jump of the drive at the start: w = g (jump F(1) + RATE F(t - AT))."""
    s = np.maximum(T - AT, 0.0)
    decay = 1.0 - np.exp(-s / LAG)
    return jump * decay + RATE * (s - LAG * decay)


def reaches():
    """Backwards in time from rest: lag w' + w = RATE (AT - LAG - t) has w = RATE (AT - t) as a solution."""
    return RATE * np.maximum(AT - T, 0.0)


def share(speed, put_in, stop, noise, draws):
    held, width = [], []
    for seed in range(draws):
        noisy = speed + noise * np.random.default_rng(seed).standard_normal(len(T))
        first, last = edge_interval(
            T, put_in, noisy, TRIES, lags=[0.5 * LAG, LAG, 2.0 * LAG], stop=stop, least_std=0.0, risk=0.05
        )
        held.append(first - 0.005 <= AT <= last + 0.005)  # the grid of instants
        width.append(last - first)
    return np.mean(held), np.mean(width)


@pytest.mark.parametrize("jump", [0.0, 0.3], ids=["creeps off", "jumps off"])
def test_the_interval_holds_the_start(jump, draws):
    held, width = share(leaves(jump), RATE * T, False, 0.02, draws(200))
    assert held >= 0.92
    assert width < 0.15


def test_the_interval_holds_the_stop(draws):
    held, width = share(reaches(), RATE * (1.0 - T), True, 0.02, draws(200))
    assert held >= 0.92
    assert width < 0.1


def test_without_noise_it_is_the_instant():
    """An input that is held from row to row, against its closed form in continuous time: half a row."""
    first, last = edge_interval(T, RATE * T, leaves(0.3), TRIES, lags=[LAG], stop=False, least_std=0.0, risk=0.05)
    assert AT - 0.011 <= first <= last <= AT + 0.011
