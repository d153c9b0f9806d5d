"""One sensor counts once: an odometry that is computed from the wheels is found, its mean of some rows too."""

import numpy as np
import pytest

from omnidyn.identification.output_error.problem.outputs import outputs_of
from omnidyn.identification.output_error.problem.redundant_channels import is_wheel_odometry, redundant
from omnidyn.model.wheels import twist_from_wheel_speed, wheel_speed
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import voltages
from tests.support.codes import codes


@pytest.fixture(scope="module")
def measured(axebot):
    """A drive of 20 s, and its wheels with noise."""
    rng = np.random.default_rng(5)
    run = simulate(axebot, voltages(rng, 20.0), 0.01)
    speed = wheel_speed(axebot.wheels, run.twist) + rng.normal(0.0, 0.3, (len(run), 3))
    return Run(t=run.t, voltage=run.voltage, wheel_speed=speed), run.twist


def mean_of(values, rows):
    kernel = np.ones(rows) / rows
    return np.column_stack([np.convolve(column, kernel)[: len(column)] for column in values.T])


@pytest.mark.parametrize("rows", [1, 4, 10])
@pytest.mark.parametrize("gain", [1.0, 0.97])
def test_odometry_of_the_wheels_is_found(axebot, measured, rows, gain):
    run, _ = measured
    twist = gain * mean_of(twist_from_wheel_speed(axebot.wheels, run.wheel_speed), rows)
    assert redundant(run.replace(twist=twist), axebot) == {"twist": "wheel_speed"}


def low_pass(values, poles, cutoff=0.1):
    from scipy.signal import butter, lfilter

    return lfilter(*butter(poles, cutoff), values, axis=0)


@pytest.mark.parametrize("poles", [1, 2])
@pytest.mark.parametrize("each", [1, 5])
def test_odometry_through_a_low_pass_is_found(axebot, measured, poles, each):
    """In single precision; of each row of the wheels, or of each fifth, as a driver publishes it."""
    run, _ = measured
    twist = low_pass(twist_from_wheel_speed(axebot.wheels, run.wheel_speed), poles).astype(np.float32).astype(float)
    twist[np.arange(len(twist)) % each != 0] = np.nan
    assert redundant(run.replace(twist=twist), axebot) == {"twist": "wheel_speed"}


@pytest.mark.parametrize("noise", [0.0, 1e-6, 1e-3, 0.02])
@pytest.mark.parametrize("poles", [0, 1, 2])
@pytest.mark.parametrize("each", [1, 5])
def test_a_filtered_sensor_of_its_own_is_kept(axebot, measured, noise, poles, each):
    """Motion capture, smoothed: its own past tells nearly all of it, the wheels' errors nothing."""
    run, true = measured
    twist = true + np.random.default_rng(1).normal(0.0, 1.0, true.shape) * noise
    twist = low_pass(twist, poles) if poles else twist
    twist[np.arange(len(twist)) % each != 0] = np.nan
    assert not is_wheel_odometry(run.replace(twist=twist), axebot)


def test_odometry_with_stamps_of_its_own_is_found(axebot, measured):
    """Each fourth row, half a row later than the wheels it was made of."""
    run, _ = measured
    twist = twist_from_wheel_speed(axebot.wheels, run.wheel_speed)[::4]
    t = np.sort(np.concatenate([run.t, run.t[::4] + 0.005]))
    rows, own = np.searchsorted(t, run.t), np.searchsorted(t, run.t[::4] + 0.005)
    speed, late = (np.full((len(t), 3), np.nan) for _ in range(2))
    speed[rows], late[own] = run.wheel_speed, twist
    both = Run(t=t, voltage=np.zeros((len(t), 3)), wheel_speed=speed, twist=late)
    assert is_wheel_odometry(both, axebot)


def test_a_sensor_of_its_own_is_kept(axebot, measured):
    run, true = measured
    for noise in (0.0, 1e-3, 0.02):
        twist = true + np.random.default_rng(1).normal(0.0, noise, true.shape)
        assert not is_wheel_odometry(run.replace(twist=twist), axebot)


def test_where_the_wheels_show_no_noise_nothing_is_told(axebot, measured):
    run, true = measured
    exact = run.replace(wheel_speed=wheel_speed(axebot.wheels, true), twist=true)
    assert not is_wheel_odometry(exact, axebot)


def test_it_is_left_out_of_the_fit_and_said(axebot, measured):
    run, _ = measured
    both = run.replace(twist=twist_from_wheel_speed(axebot.wheels, run.wheel_speed))
    found = outputs_of(both, axebot, None, None)
    assert {channel for channel, _ in found.columns} == {"wheel_speed"}
    (note,) = found.notes
    assert (note.code, note.numbers) == ("nothing_new", {"output": "twist", "computed_from": "wheel_speed"})
    asked = outputs_of(both, axebot, ["twist", "wheel_speed"], None)
    assert "same_data_twice" in codes(asked.notes)
