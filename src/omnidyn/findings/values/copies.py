"""Components of one channel that are equal to the last digit: one accumulator was logged in the place of two."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.log_under_check import MIN_ROWS, LogUnderCheck
from omnidyn.findings.signal.reference import MEASUREMENTS, expected_wheel_speed
from omnidyn.findings.signal.robust import quantum, rest_level, white_noise
from omnidyn.logs.channels import components
from omnidyn.sensors import COUNTED, SENSORS
from omnidyn.statement import ERROR, NOTE

MEASURED = tuple(name for name in SENSORS if name != "pose")
VALUES = 20  # different ones, at least: fewer may agree by chance
OPPOSITE = -0.9  # correlation of two that turn against each other
DIFFERENT = 0.1  # of the larger of two inputs, by which they differ
BEYOND = 3.0  # times what an expected speed misses the logged one by, its noise
NOISY = 1e-3  # of the largest value: so much noise is never the same twice


def check_copies(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """An error where their motors were given different inputs, or where both have one noise; they are masked then.

    A note where nothing says that they should differ: wheels of a simulated robot that drives straight turn alike.
    """
    findings, original = list[Finding](), work  # pairs are judged by all that was logged, not by what one before left
    if len(work) < MIN_ROWS:
        return findings, work
    for channel in MEASURED:
        values = original.get(channel)
        if values is None or (channel == "wheel_speed" and work.derived_speed):
            continue
        names = components(channel, values.shape[1])
        for j, k in combinations(range(values.shape[1]), 2):
            if not _are_equal(values[:, j], values[:, k]):
                continue
            reason = _reason(original, channel, j, k)
            numbers = {"reason": reason}
            findings.append(Finding("equal", ERROR if reason else NOTE, f"{names[j]} {names[k]}", numbers))
            for masked in (channel, "wheel_speed") if reason and work.derived_speed else (channel,) * bool(reason):
                work = work.masked(masked, j, work.everywhere).masked(masked, k, work.everywhere)
    return findings, work


def _are_equal(one: FloatArray, other: FloatArray) -> bool:
    """Whether both hold the same numbers wherever both were recorded, and many different ones."""
    finite = np.isfinite(one) & np.isfinite(other)
    return (
        bool(finite.sum() >= MIN_ROWS and (one[finite] == other[finite]).all()) and len(np.unique(one[finite])) > VALUES
    )


def _are_all_equal(values: FloatArray) -> bool:
    """Whether all components are, as those of a robot that turns in place."""
    return all(_are_equal(values[:, 0], values[:, k]) for k in range(1, values.shape[1]))


def _drive_apart(inputs: FloatArray, j: int, k: int, alike: bool) -> bool:
    """Whether inputs differ, and should turn two wheels apart. alike: whether all wheels turned alike.

    Inputs that have more in common than they differ by turn a robot in place, where friction holds it against the rest.
    """
    if not _differ(inputs, j, k):
        return False
    common = np.nanmean(inputs, axis=1, keepdims=True)
    return not alike or bool(np.nansum((inputs - common) ** 2) > np.nansum(common**2) * inputs.shape[1])


def _reason(work: LogUnderCheck, channel: str, j: int, k: int) -> str:
    """Why two components cannot be equal, a reason of `telling`; "" where they may."""
    if channel != "twist":
        speed, alike = work.get("wheel_speed"), _are_all_equal(work.channels[channel])
        for name in ("voltage", "duty", "wheel_speed_command"):
            inputs = work.get(name)
            if inputs is not None and _drive_apart(inputs[_turning(speed, j, len(inputs))], j, k, alike):
                return name
        expected = expected_wheel_speed(work, without="wheel_speed") if channel != "current" else None
        is_measured = expected is not None and expected[0] in MEASUREMENTS
        if (
            expected is not None
            and _drive_apart(expected[1], j, k, alike and not is_measured)
            and _beyond_noise(expected[1], speed, j, k)
        ):
            return expected[0]
    values = work.channels[channel][:, j]
    largest = float(np.nanmax(np.abs(values)))
    return "noise" if channel not in COUNTED and not quantum(values) and white_noise(values) > NOISY * largest else ""


def _differ(values: FloatArray | None, j: int, k: int) -> bool:
    """Whether two columns differ, over a twentieth of the rows or more, and not by their sign alone.

    Two wheels that turn against each other are equal where the sign of one is wrong: their wiring says that.
    """
    if values is None or max(j, k) >= values.shape[1]:
        return False
    pair = values[np.isfinite(values[:, [j, k]]).all(axis=1)][:, [j, k]]
    if len(pair) < MIN_ROWS:
        return False
    one, other = pair.T
    if one @ other < OPPOSITE * np.linalg.norm(one) * np.linalg.norm(other):
        return False
    apart, size = np.quantile(np.abs(one - other), 0.95), np.quantile(np.abs(pair), 0.95)
    return bool(apart > DIFFERENT * size > 0.0)


def _turning(speed: FloatArray | None, j: int, rows: int) -> BoolArray:
    """Rows in which a wheel turns, all where no speed was logged: friction holds wheels that get different voltages."""
    if speed is None or j >= speed.shape[1]:
        return np.ones(rows, dtype=bool)
    return np.abs(speed[:, j]) > rest_level(speed[:, j])


def _beyond_noise(expected: FloatArray, speed: FloatArray | None, j: int, k: int) -> bool:
    """Whether two expected speeds differ by more than their noise: by what the better of them misses the logged one.

    speed: as logged, of any scale and sign. A robot that only spins turns its wheels alike, whatever a camera scatters.
    """
    if speed is None or max(j, k) >= min(speed.shape[1], expected.shape[1]):
        return True
    logged = np.isfinite(speed[:, j]) & np.isfinite(expected[:, [j, k]]).all(axis=1)
    one, pair = speed[logged, j], expected[logged][:, [j, k]]
    if not one.any():
        return True
    misses = np.abs(pair - np.outer(one, one @ pair / (one @ one)))
    return bool(np.quantile(np.abs(pair[:, 0] - pair[:, 1]), 0.95) > BEYOND * np.quantile(misses, 0.95, axis=0).min())
