"""Angles of a wheel that come in blocks: they go on over full counters, settings and blanks."""

import numpy as np
import pytest

from omnidyn.logs.clock.block_angles import BlockAngle

T = 0.01 * np.arange(2000)
TURNED = np.cumsum(50.0 * np.sin(T) * np.sign(np.sin(3.0 * T))) * 0.01  # with steps of up to 100 rad/s
PERIOD = 100.53


@pytest.mark.parametrize("block", [1, 3, 50])
@pytest.mark.parametrize("at", [1200, 1201, 1234])  # at the start of a block, a row later, within one
@pytest.mark.some(4)
def test_the_angle_goes_on_over_what_a_counter_does(block, at):
    def error(readings, t=T):
        wheel = BlockAngle((2.0 * np.pi, PERIOD))
        parts = [wheel.going_on(t[k : k + block], readings[k : k + block]) for k in range(0, len(t), block)]
        return float(np.nanmax(np.abs(np.concatenate(parts) - TURNED))), wheel.resets

    blanks = np.random.default_rng(0).random(len(T)) < 0.1
    assert error(TURNED) == (0.0, 0)
    assert error(np.where(blanks, np.nan, TURNED)) == (0.0, 0)
    assert error(TURNED, T + 0.004 * np.random.default_rng(1).normal(size=len(T))) == (0.0, 0)  # stamps that jitter
    assert error((TURNED + 0.5 * PERIOD) % PERIOD - 0.5 * PERIOD) == (pytest.approx(0.0, abs=1e-9), 0)
    wrong, resets = error(np.where(np.arange(len(T)) > at, TURNED - 70.0, TURNED))
    assert resets == 1
    assert wrong < 0.02  # the wheel may change its speed meanwhile
