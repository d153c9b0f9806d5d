"""A run in the rows of one of its sensors: inputs exact, what others gave on the line, nothing in gaps."""

import numpy as np
import pytest

from omnidyn.logs.sensor_rows import on_clock_of, on_clock_of_wheels
from omnidyn.run import Run

STEP = 0.02


def run_of(offset, rows=300, step=STEP, jitter=0.0):
    """Voltage at k STEP, held, a new one in every row; the speed, 3 t, so much later."""
    rng = np.random.default_rng(4)
    inputs = np.arange(rows) * STEP
    speeds = np.arange(int(rows * STEP / step)) * step + offset
    speeds = speeds + jitter * rng.normal(size=len(speeds))
    t = np.unique(np.concatenate([inputs, speeds]))
    volts = np.arange(rows)[np.searchsorted(inputs, t, side="right") - 1].astype(float)
    speed = np.where(np.isin(t, speeds), 3.0 * t, np.nan)
    amps = np.where(np.isin(t, inputs), 5.0 * t, np.nan)
    return Run(t=t, voltage=volts[:, None], wheel_speed=speed[:, None], current=amps[:, None])


@pytest.mark.parametrize("offset", [3e-6, 3e-3, 0.009, 0.011, 0.019])
def test_an_input_is_what_holds_longest_in_a_row(offset):
    run = on_clock_of_wheels(run_of(offset))
    np.testing.assert_allclose(run.t, np.arange(300) * STEP + offset)
    np.testing.assert_array_equal(run.wheel_speed[:, 0], 3.0 * run.t)
    np.testing.assert_allclose(run.voltage[:-1, 0], np.arange(299) + (offset > 0.5 * STEP))
    np.testing.assert_allclose(run.current[:-1, 0], 5.0 * run.t[:-1], atol=1e-12)


def test_inputs_of_another_rate_are_means_over_a_row():
    """12 rows a second beside 50 voltages: none of them is lost."""
    run = on_clock_of_wheels(run_of(1e-3, step=1.0 / 12.0))
    means = [np.mean(np.floor((a + (np.arange(9000) + 0.5) / 9000 / 12.0) / STEP)) for a in run.t[:50]]
    np.testing.assert_allclose(run.voltage[:50, 0], means, atol=1e-3)


def test_what_holds_is_exact():
    run = run_of(3e-3, step=1.0 / 30.0)
    held = on_clock_of_wheels(run.replace(voltage=np.full((len(run), 1), 0.1 + 0.2)))
    assert (held.voltage == 0.1 + 0.2).all()


def test_a_run_whose_sensors_share_their_stamps_is_left_as_it_is():
    t = np.arange(50) * STEP
    speed = np.where(np.arange(50)[:, None] == 7, np.nan, 1.0)
    run = Run(t=t, wheel_speed=speed, voltage=np.ones((50, 1)))
    assert on_clock_of(run, "wheel_speed") is run
    assert on_clock_of(run_of(3e-3).replace(pose=None), "pose").voltage is not None


def test_nothing_stands_in_a_gap_of_another_sensor():
    run = run_of(3e-3)
    amps = np.where((run.t[:, None] > 2.0) & (run.t[:, None] < 3.0), np.nan, run.current)
    found = on_clock_of_wheels(run.replace(current=amps))
    out = np.isnan(found.current[:, 0])
    np.testing.assert_array_equal(found.t[:-1][out[:-1]].round(3), np.arange(2.003, 2.99, STEP).round(3))
