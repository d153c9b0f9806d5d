"""Steady windows: where they are known, the windows must be there, and nowhere else."""

import numpy as np
import pytest

from omnidyn.errors import InputError
from omnidyn.logs.plateaus import ANGLE, SPEED, find_plateaus, holds, live_angle, pool
from omnidyn.run import Run

DT, TAU = 0.02, 0.15


def staircase(levels=(2.0, 4.0, -3.0), seconds=2.0, noise=0.0, seed=0, tau=TAU):
    """A motor that follows its command with a time constant; the truth of each step is its level."""
    rng, n = np.random.default_rng(seed), round(seconds / DT)
    command = np.repeat(levels, n).astype(float)[:, None]
    speed, now = np.zeros_like(command), 0.0
    for k, target in enumerate(command[:, 0]):
        speed[k] = now
        now += (target - now) * (1.0 - np.exp(-DT / tau))
    speed = speed + noise * rng.standard_normal(speed.shape)
    return Run(t=np.arange(len(command)) * DT, wheel_speed=speed, wheel_speed_command=command)


def test_one_window_per_step_without_its_start_up():
    found = find_plateaus(staircase(noise=0.05))
    assert [each.hold for each in found] == [0, 1, 2]
    for each, level in zip(found, (2.0, 4.0, -3.0), strict=True):
        assert each.start - 2.0 * each.hold > 2.0 * TAU
        assert abs(each.mean["wheel_speed"][0] - level) < 4.0 * each.std["wheel_speed"][0] + 0.01


def test_many_windows_leave_no_bias_behind():
    """What is left of the start-ups must be small beside the error of a mean over many windows."""
    errors, told = [], []
    for seed in range(40):
        (each,) = find_plateaus(staircase((2.0,), noise=0.2, seed=seed))
        errors.append(each.mean["wheel_speed"][0] - 2.0)
        told.append(each.std["wheel_speed"][0])
    assert abs(np.mean(errors)) < 3.0 * np.std(errors) / np.sqrt(40)
    assert np.std(errors) == pytest.approx(np.mean(told), rel=0.35)


def test_spikes_and_quantisation_do_not_move_a_window():
    run = staircase((2.0,), noise=0.3)
    speed = np.round(run.wheel_speed / 0.5) * 0.5
    speed[::37] = 80.0
    (each,) = find_plateaus(run.replace(wheel_speed=speed))
    assert each.mean["wheel_speed"][0] == pytest.approx(2.0, abs=0.12)


def test_no_window_reaches_over_a_gap_and_pooling_joins_them():
    run = staircase((2.0,), seconds=4.0, noise=0.05)
    keep = (run.t < 1.8) | (run.t > 2.4)
    run = Run(t=run.t[keep], wheel_speed=run.wheel_speed[keep], wheel_speed_command=run.wheel_speed_command[keep])
    found = find_plateaus(run)
    assert len(found) == 2
    assert found[0].end < 1.8
    assert found[1].start > 2.4
    (whole,) = pool(found)
    assert whole.count == found[0].count + found[1].count
    weighted = sum(each.count * each.mean["wheel_speed"][0] for each in found) / whole.count
    assert whole.mean["wheel_speed"][0] == pytest.approx(weighted, rel=1e-12)


def test_a_speed_that_still_drifts_is_no_plateau():
    t = np.arange(200) * DT
    drifting = Run(t=t, wheel_speed=t[:, None], wheel_speed_command=np.ones((200, 1)))
    assert find_plateaus(drifting) == ()


def test_a_stretch_that_is_too_short_gives_nothing():
    assert find_plateaus(staircase(seconds=0.3)) == ()


def test_without_a_stepped_command_windows_have_a_fixed_length():
    rng = np.random.default_rng(5)
    run = Run(
        t=np.arange(300) * DT, duty=0.3 + 0.05 * rng.standard_normal((300, 1)), wheel_speed=np.full((300, 1), 2.0)
    )
    lengths = [run.t[each.stop - 1] - run.t[each.start] for each in holds(run)[:-1]]
    assert lengths
    assert np.allclose(lengths, 0.48, atol=0.021)


def test_the_angle_is_finer_than_a_quantised_speed():
    t = np.arange(200) * DT
    run = Run(t=t, wheel_angle=0.7 * t[:, None], wheel_speed=np.where(t[:, None] % 0.1 < 0.05, 2.8, 0.0))
    each = find_plateaus(run, start=0.0, end=1.0)[0]
    assert each.speed_from == ANGLE
    assert each.mean["wheel_speed"][0] == pytest.approx(0.7, rel=1e-12)


def test_an_angle_that_stands_still_while_its_wheel_turns_is_not_used():
    """As in the Robotino's motor files, where the position of every motor reads 0."""
    run = staircase().replace(wheel_angle=np.zeros((300, 1)))
    assert live_angle(run) is None
    assert find_plateaus(run)[0].speed_from == SPEED


def test_the_twist_comes_from_a_pose_that_turns():
    """A robot that drives straight ahead in its own frame while it turns: v_x = 0.5 m/s, omega = 1 rad/s."""
    t = np.arange(400) * 0.005
    pose = np.stack([0.5 * np.sin(t), 0.5 * (1.0 - np.cos(t)), t], axis=1)
    each = find_plateaus(Run(t=t, pose=pose), start=0.0, end=1.0)[0]
    assert each.mean["twist"] == pytest.approx([0.5, 0.0, 1.0], abs=1e-5)


@pytest.mark.parametrize("shares", [(0.4, None), (0.9, 0.4), (-0.1, 0.5), (0.0, 1.5)])
def test_wrong_shares_are_refused(shares):
    with pytest.raises(InputError, match=r"not a share of the rows; got start .*expected 0 <= start < end <= 1"):
        find_plateaus(staircase(), start=shares[0], end=shares[1])


def test_given_shares_are_taken_as_they_are():
    found = find_plateaus(staircase(), start=0.4, end=0.95)
    assert [(each.rows.start, each.rows.stop) for each in found] == [(40, 95), (140, 195), (240, 295)]
