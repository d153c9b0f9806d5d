"""Speeds that a recorder made of the positions in the same log, and those that were measured."""

from dataclasses import replace

import numpy as np
import pytest

from omnidyn.findings.check import check
from omnidyn.logs.log import Log
from omnidyn.model.frames import world_to_body
from omnidyn.simulation.simulate import simulate
from tests.support.pushed_logs import clean_log

TICK = 2.0 * np.pi / 2048.0
STEP = 0.01


def counted(log):
    """Angles of the wheels as an encoder counts them."""
    turned = np.cumsum(np.vstack([np.zeros((1, 3)), log.channels["wheel_speed"][:-1] * STEP]), axis=0)
    return np.floor(turned / TICK) * TICK


def late(rate, rows):
    """The mean of the last `rows` rates, from where there are so many."""
    return np.stack([rate[max(0, k - rows + 1) : k + 1].mean(axis=0) for k in range(len(rate))])


def low_passed(rate, share):
    out = np.zeros_like(rate)
    for k in range(1, len(rate)):
        out[k] = out[k - 1] + share * (rate[k] - out[k - 1])
    return out


def back(angle):
    return np.vstack([np.zeros((1, angle.shape[1])), np.diff(angle, axis=0)]) / STEP


MADE = {
    "centred": lambda angle: np.gradient(angle, STEP, axis=0),
    "backward": back,
    "mean of four": lambda angle: late(back(angle), 4),
    "low-pass": lambda angle: low_passed(back(angle), 0.25),
}


@pytest.mark.parametrize(
    ("made", "words", "rows"),
    [
        (
            "centred",
            "w1, w2 and w3 are centred differences, from the row before to the row after, of a1, a2 and a3",
            0.0,
        ),
        ("backward", "w1, w2 and w3 are differences to the row before of a1, a2 and a3", 0.5),
        ("mean of four", "w1, w2 and w3 are differences over 4 rows back of a1, a2 and a3", 2.0),
        ("low-pass", "w1, w2 and w3 are low-passed differences (time constant 30 ms) of a1, a2 and a3", 3.5),
    ],
)
def test_speeds_of_wheels_made_of_counts(log, robot, with_channels, made, words, rows):
    angle = counted(log)
    (found,) = check(with_channels(wheel_angle=angle, wheel_speed=MADE[made](angle)), robot).of("filtered")
    assert str(found) == words
    assert found.severity == "note"
    assert found.numbers["rows_late"] == pytest.approx(rows, abs=0.05)
    assert found.remedy_text


def test_speeds_over_the_floor_made_of_a_pose(log, robot, with_channels):
    """Motion capture that gives a speed: forward and sideways are the path's, turned by the heading."""
    pose = log.channels["pose"]
    rate = np.gradient(pose, STEP, axis=0)
    twist = np.einsum("kij,kj->ki", world_to_body(pose[:, 2]), rate)
    (made,) = check(with_channels(twist=twist), robot).of("filtered")
    assert str(made).startswith("vx, vy and omega are centred differences")
    assert str(made).endswith("of x, y and heading")


def test_a_log_with_gaps_in_time_shows_it_too(log, robot, with_channels):
    angle = counted(log)
    broken = with_channels(wheel_angle=angle, wheel_speed=MADE["backward"](angle))
    kept = np.r_[0:300, 420:900, 1000:1500]
    channels = {name: values[kept] for name, values in broken.channels.items()}
    (found,) = check(replace(broken, t=broken.t[kept], lines=broken.lines[kept], channels=channels), robot).of(
        "filtered"
    )
    assert "differences to the row before" in str(found)


@pytest.mark.parametrize("seed", range(4))
def test_what_was_measured_is_not_called_filtered(robot, seed):
    """A sensor of its own, with noise or without any, beside counts and a pose; and speeds made of the angles alone."""
    log = clean_log(robot, seed=seed)
    assert not check(log, robot).of("filtered")
    angle = counted(log)
    assert not check(replace(log, channels=log.channels | {"wheel_angle": angle}), robot).of("filtered")
    bare = {name: values for name, values in log.channels.items() if name not in ("wheel_speed", "twist", "pose")}
    assert not check(replace(log, channels=bare | {"wheel_angle": angle}), robot).of("filtered")


def test_two_things_that_rest_are_not_alike_for_that(log, robot, with_channels):
    """A camera's path, smoothed, beside a turn rate that it says nothing of, both 0 for most of the time."""
    t = log.t
    heading = 0.4 * np.exp(-(((t - 8.0) / 0.4) ** 2)) + 1e-16 * np.sin(t)
    rate = np.where(np.abs(t - 12.0) < 1.5, np.sin(4.0 * t), 1e-17)
    pose = np.column_stack([log.channels["pose"][:, :2], heading])
    twist = np.column_stack([log.channels["twist"][:, :2], rate])
    assert not check(with_channels(pose=pose, twist=twist), robot).of("filtered")


@pytest.mark.parametrize("step", [0.002, 0.01, 0.05])
def test_a_run_without_noise_is_not_called_filtered(robot, step):
    """Exact speeds come near to any difference of exact positions, and are none."""
    rng = np.random.default_rng(0)
    volts = np.repeat(rng.uniform(-6.0, 6.0, (40, 3)), max(1, round(0.5 / step)), axis=0)
    run = simulate(robot, volts, step)
    turned = np.cumsum(np.vstack([np.zeros((1, 3)), 0.5 * (run.wheel_speed[1:] + run.wheel_speed[:-1]) * step]), axis=0)
    channels = {"voltage": run.voltage, "wheel_speed": run.wheel_speed, "twist": run.twist, "pose": run.pose}
    for angle in (turned, np.floor(turned / TICK) * TICK):
        log = Log(run.t, channels | {"wheel_angle": angle}, np.arange(len(run)) + 2, source="run.csv")
        assert not check(log, robot).of("filtered")
