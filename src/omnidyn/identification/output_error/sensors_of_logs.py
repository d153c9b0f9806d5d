"""What logs show of the sensors that made them: counts of encoders, a camera, a gyroscope. Controllers take it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.clocks import usual_step
from omnidyn.errors import InputError
from omnidyn.identification.output_error.problem.record import Record
from omnidyn.model.log_effects import LogEffects
from omnidyn.model.wheels import Wheels, twist_from_wheel_speed
from omnidyn.run import Run
from omnidyn.sensors import SENSORS
from omnidyn.statistics import robust_std

LEAST_POSES, LEAST_NOISE = 50, 1e-4  # [1], [m] std: poses with less are counted, or of a simulation
LONGEST_STEP = 3.5  # usual steps from one pose to the next: what is longer is a gap
# What moves smoothly has small third differences; those of noise have sqrt(1 + 9 + 9 + 1) times its std.
THIRD_OF_NOISE = np.sqrt(20.0)
LEAST_GYRO_NOISE = 1e-6  # [rad/s] std: omega with less is of a simulation
CLEARLY = 1.25  # times the square of the bias: what a fit leaves of omega beyond that is noise
SPIKE = 8.0  # times the robust std of omega about the median of its neighbours: no noise of a gyroscope
AROUND = 5  # samples whose median is what a spike stands out of
LATENESS = np.arange(-5, 16)  # rows by which a gyroscope may be later than the heading
HELD_SHARE = 0.05  # of the values of a gyroscope that may last shorter than others, if each is held for several rows
MOST_ALIKE = 0.98  # correlation of the heading with the time, beyond which a bias is a slightly other size of the robot


def sensors_shown(records: Sequence[Record], wheels: Wheels, noise: Mapping[str, float]) -> dict[str, float]:
    """Fields of `LogEffects` that the logs show. noise: std of what a fit leaves of each column."""
    runs = [record.run for record in records if record.run is not None]
    shown = _poses(runs) | _counts(records) | _gyroscope(runs, wheels, noise.get("twist[2]"))
    return {name: value for name, value in shown.items() if _is_possible(name, value)}


def _is_possible(name: str, value: float) -> bool:
    """Whether a file can hold it: a sensor beyond that, such as a pose each 20 s, is none that a controller has."""
    try:
        LogEffects().replace(**{name: value})
    except InputError:
        return False
    return True


def _poses(runs: Sequence[Run]) -> dict[str, float]:
    """Rate and noise of new poses, and from row to row; nothing where there are few poses, or none that is noisy."""
    seconds, thirds, rows_apart = [], [], []
    for run in runs:
        if run.pose is None:
            continue
        rows = np.isfinite(run.pose).all(axis=1)
        t, poses = run.t[rows], run.pose[rows]
        is_new = np.append(True, (np.diff(poses, axis=0) != 0.0).any(axis=1))[: len(t)]
        t, poses = t[is_new], poses[is_new]
        seconds.append(np.diff(t))
        if not _is_stamped(run, np.asarray(rows)):
            rows_apart.append(usual_step(run.t))
        thirds.append(np.diff(np.column_stack([poses[:, :2], np.unwrap(poses[:, 2])]), n=3, axis=0))
    if sum(map(len, thirds)) < LEAST_POSES:
        return {}
    std = [float(robust_std(column)) / THIRD_OF_NOISE for column in np.concatenate(thirds).T]
    place = float(np.sqrt(np.mean(np.square(std[:2]))))
    if place < LEAST_NOISE:
        return {}
    steps = np.concatenate(seconds)
    return {
        "pose_rate": float(1.0 / np.mean(steps[steps <= LONGEST_STEP * np.median(steps)])),
        "pose_noise": place,
        "heading_noise": float(std[2]),
    } | ({"row": float(np.median(rows_apart))} if rows_apart else {})


def _is_stamped(run: Run, rows: BoolArray) -> bool:
    """Whether poses have times of their own, and waited for no row: other sensors are there, and in none of their rows.

    rows: those with a pose, shape (n,).
    """
    others = [values for name in SENSORS if name != "pose" and (values := getattr(run, name)) is not None]
    return bool(others) and not any(np.isfinite(values[rows]).any() for values in others)


def _counts(records: Sequence[Record]) -> dict[str, float]:
    """Counts in a turn of a wheel, where angles or speeds are taken as such; nothing elsewhere."""
    ticks = [tick for record in records for tick in record.ticks if tick > 0.0]
    return {"encoder_counts": float(2.0 * np.pi / np.median(ticks))} if ticks else {}


def has_gyroscope(run: Run | None) -> bool:
    """Whether omega comes from a gyroscope: it was measured, and no speed along x or y."""
    if run is None or run.twist is None:
        return False
    along, across, turning = (bool(np.isfinite(column).any()) for column in run.twist.T)
    return turning and not along and not across


def _gyroscope(runs: Sequence[Run], wheels: Wheels, left: float | None = None) -> dict[str, float]:
    """Noise of a sample of the gyroscope, and its bias; nothing where logs have none, or none that is noisy.

    left: std of what a fit leaves of omega, its bias among it. Where the robot speeds up within few samples, their
    third differences are more than noise; where the model is wrong, so is what it leaves: the smaller counts.
    """
    thirds, biases = [], []
    for run in runs:
        if has_gyroscope(run):
            t, twist = run.samples("twist")
            omega = twist[:, 2]
            thirds.append(np.diff(omega[_is_sample(omega)], n=3))
            biases += _bias(t, _without_spikes(omega), run, wheels)
    if sum(map(len, thirds)) < LEAST_POSES:
        return {}
    noise = float(robust_std(np.concatenate(thirds))) / THIRD_OF_NOISE
    bias_square = float(np.mean(np.square(biases))) if biases else 0.0
    if left is not None and left**2 > CLEARLY * bias_square:
        noise = min(noise, float(np.sqrt(left**2 - bias_square)))
    if noise < LEAST_GYRO_NOISE:
        return {}
    return {"gyro_noise": noise} | ({"gyro_bias": float(np.sqrt(bias_square))} if biases else {})


def _is_sample(omega: FloatArray) -> BoolArray:
    """Which rows show a new sample: those where omega changes, if it is held for two rows or more; else all."""
    is_new = np.append(True, np.diff(omega) != 0.0)[: len(omega)]
    lasts = np.diff(np.flatnonzero(is_new))
    is_held = len(lasts) >= LEAST_POSES and np.quantile(lasts, HELD_SHARE) >= 2.0
    return np.asarray(is_new if is_held else np.ones(len(omega), bool))


def _without_spikes(omega: FloatArray) -> FloatArray:
    """Omega, with what stands out of the median of its neighbours put on the line between those."""
    if len(omega) < AROUND:
        return omega
    padded = np.pad(omega, AROUND // 2, mode="edge")
    apart = omega - np.median(np.lib.stride_tricks.sliding_window_view(padded, AROUND), axis=1)
    std = float(robust_std(apart[apart != 0.0])) if (apart != 0.0).any() else 0.0
    usual = np.flatnonzero(np.abs(apart) <= SPIKE * std)
    return np.asarray(np.interp(np.arange(len(omega)), usual, omega[usual]))


def _bias(t: FloatArray, omega: FloatArray, run: Run, wheels: Wheels) -> list[float]:
    """By how much omega of a gyroscope is off [rad/s]; empty where nothing else tells the heading, or not apart.

    Added up, it is the heading by wheels or poses, times a share that may be off as the size of the robot may, and the
    bias times the time, and less what it is late by times omega. After a gap the sum starts anew.
    """
    heading_by_time = _heading(run, wheels)
    if heading_by_time is None:
        return []
    steps = np.diff(t)
    is_gap = steps > LONGEST_STEP * np.median(steps)
    turned = np.append(0.0, np.cumsum(np.where(is_gap, 0.0, 0.5 * (omega[1:] + omega[:-1]) * steps)))
    part = np.append(0, np.cumsum(is_gap))
    turned = _without_means(turned, part)
    best = (np.inf, 0.0, 0.0)  # (mean square of what remains, bias, correlation of the heading with the time)
    for lateness in np.median(steps) * LATENESS:
        heading = np.interp(t - lateness, *heading_by_time)
        columns = _without_means(np.column_stack([t, heading, omega]), part)
        size = float(np.linalg.norm(columns[:, 0]) * np.linalg.norm(columns[:, 1]))
        alike = abs(float(columns[:, 0] @ columns[:, 1])) / size if size > 0.0 else 0.0
        numbers = np.linalg.lstsq(columns, turned)[0]
        best = min(best, (float(np.mean(np.square(turned - columns @ numbers))), float(numbers[0]), alike))
    return [best[1]] if best[2] <= MOST_ALIKE else []


def _without_means(values: FloatArray, part: IntArray) -> FloatArray:
    """Values less their mean over each part of the log."""
    less = values.copy()
    for number in range(int(part[-1]) + 1):
        less[part == number] -= values[part == number].mean(axis=0)
    return less


def _heading(run: Run, wheels: Wheels) -> tuple[FloatArray, FloatArray] | None:
    """(times [s], heading [rad]) by counts, else by poses, else by speeds of the wheels; None without any."""
    for channel in ("wheel_angle", "pose", "wheel_speed"):
        t, values = run.samples(channel)
        rows = np.isfinite(values).all(axis=1) if values.ndim == 2 else np.zeros(len(t), bool)
        t, values = t[rows], values[rows]
        if len(t) < 2:
            continue
        if channel == "pose":
            return t, np.unwrap(values[:, 2])
        heading = twist_from_wheel_speed(wheels, values)[:, 2]
        if channel == "wheel_speed":
            heading = np.append(0.0, np.cumsum(0.5 * (heading[1:] + heading[:-1]) * np.diff(t)))
        return t, heading
    return None
