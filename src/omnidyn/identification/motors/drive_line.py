"""What a motor needs to turn: slope, dead band and inertia, from windows in integral form (drive_windows.py).

    mean u = k (mean w) + c (mean sgn w) + m (change of w / length)

A mean speed has an error too: the sum of r^2 / (s^2 + k^2 speed_std^2) is minimised over k, c, m, as `steady/line.py`
does, with s^2 such that the sum is the degrees of freedom (what the speeds cannot explain). Where the speeds are sharp
this is least squares of u; where they are noisy it is least squares of w, and the slope is not flattened by the noise.
Intervals are by moving-block bootstrap over the windows: H. R. Kuensch, Ann. Stat. 17, 1217 (1989).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from omnidyn.errors import InsufficientDataError
from omnidyn.identification.motors.drive_windows import WHEEL, DriveWindows, drive_windows
from omnidyn.model.robot import Robot
from omnidyn.run import Run
from omnidyn.statistics import (
    autocorrelation_time,
    central_interval,
    drawn_times,
    errors_in_variables,
    huber_weight,
    t_quantile,
)

FloatArray = NDArray[np.float64]

NAMES = ("slope", "dead_band", "inertia")
DRAWS, SEED, BLOCK = 1000, 20121, 3
ITERATIONS, SETTLED = 200, 1e-8
HUBER = 2.5
MIN_WINDOWS = 6
ALIKE = 1e-3  # share of a column that the others leave over: below it they say the same
LEVEL = 0.95


@dataclass(frozen=True, eq=False)
class DriveLine:
    """The line of one motor, or of all. Units: that of the input per rad/s, that of the input, and input s^2/rad.

    motor: "1", "2", ... or "all". value, std, ci95, ci90: "slope", "dead_band", "inertia" -> number, standard error, 95
    and 90 % interval; NaN for one that the data do not determine. gain: 1/slope, with gain_std and gain95 [rad/s per
    unit]. rest: largest input under which it stayed at rest, NaN where it never rested. rmse: of the input.
    one_way: it turned one way only, so a dead band and an offset of the input are one. windows: how many.
    """

    motor: str
    unit: str
    value: Mapping[str, float]
    std: Mapping[str, float]
    ci95: Mapping[str, tuple[float, float]]
    ci90: Mapping[str, tuple[float, float]]
    gain: float
    gain_std: float
    gain95: tuple[float, float]
    rest: float
    rmse: float
    one_way: bool
    windows: int

    @property
    def dead_band_seen(self) -> bool:
        """Whether the interval of the dead band lies above 0, and that of the slope too: else there is no line."""
        return self.ci95["dead_band"][0] > 0.0 and self.ci95["slope"][0] > 0.0


@dataclass(frozen=True, eq=False)
class DriveStudy:
    """Lines of the motors, the last for all together where there are several; what they say, and doubts, in words."""

    lines: tuple[DriveLine, ...]
    windows: DriveWindows
    statements: tuple[str, ...]
    warnings: tuple[str, ...]


def fit_drive_lines(
    runs: Sequence[Run],
    *,
    kind: str = "",
    speed: str = WHEEL,
    robot: Robot | None = None,
    length: float | None = None,
    steady: bool = False,
    share: tuple[float, float] | None = None,
    draws: int = DRAWS,
) -> DriveStudy:
    """Fit slope, dead band and inertia of every motor, and of all together. Options: see `drive_windows`.

    Raises InsufficientDataError with fewer than six windows of a motor, InputError for a run without the channels.
    """
    windows = drive_windows(runs, kind=kind, speed=speed, robot=robot, length=length, steady=steady, share=share)
    motors = [int(motor) for motor in np.unique(windows.motor)]
    lines = [fit_drive_line(windows, motor, draws=draws) for motor in motors]
    if len(motors) > 1:
        lines.append(fit_drive_line(windows, None, draws=draws))
    return DriveStudy(tuple(lines), windows, tuple(_statement(line) for line in lines), tuple(_doubts(windows, lines)))


def fit_drive_line(windows: DriveWindows, motor: int | None = None, *, draws: int = DRAWS) -> DriveLine:
    """The line of one motor (its number from 0), or of all. Raises InsufficientDataError below six windows."""
    put_in, speed, speed_std, side, change, block = windows.of(motor)
    block = block.astype(np.int64)
    blocks = np.unique(block)
    if len(blocks) < MIN_WINDOWS:
        raise InsufficientDataError(
            "too few windows for a line with intervals", got=f"{len(blocks)} windows of {windows.length:g} s",
            expected=f"{MIN_WINDOWS} or more in which the motor turns", remedy="record longer",
        )  # fmt: skip
    design = np.stack([speed, side, change], axis=1)
    used = _columns(design, windows.settled)
    fit = _fit(design[:, used], put_in, speed_std)
    drawn = _bootstrap(design[:, used], put_in, speed_std, fit, block, draws, windows.settled)
    value, std, ci95, ci90 = {}, {}, {}, {}
    for k, name in enumerate(NAMES):
        own = used.index(k) if k in used else None
        value[name] = float(fit.parameters[own]) if own is not None else float("nan")
        spread = drawn[:, own] if own is not None else np.array([np.nan])
        std[name] = _robust_std(spread)
        ci95[name], ci90[name] = central_interval(spread, LEVEL), central_interval(spread, 0.9)
    gains = 1.0 / drawn[:, 0]
    residual = put_in - design[:, used] @ fit.parameters
    return DriveLine(
        motor="all" if motor is None else str(motor + 1), unit=windows.unit, value=value, std=std, ci95=ci95, ci90=ci90,
        gain=1.0 / value["slope"], gain_std=_robust_std(gains), gain95=central_interval(gains, LEVEL),
        rest=float(np.fmax.reduce(windows.rest if motor is None else windows.rest[[motor]])),
        rmse=float(np.sqrt(np.mean(residual**2))), one_way=bool(np.abs(side.sum()) > 0.98 * np.abs(side).sum()),
        windows=len(blocks),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Fit:
    parameters: FloatArray
    extra: float  # variance of the input that the errors of the speeds do not explain
    weight: FloatArray


def _columns(design: FloatArray, settled: bool) -> list[int]:
    """The columns that can be told: no inertia where the speed never changes or start-ups were left out; no dead band
    where the others say as much as it, at one speed or under one input (then k w + m w' is constant).
    """
    size = np.abs(design).max(axis=0)
    others = [0] if settled or size[2] <= 1e-9 * size[0] else [0, 2]
    side, rest = design[:, 1], design[:, others]
    left = side - rest @ np.linalg.lstsq(rest, side, rcond=None)[0]
    told = float(left @ left) > ALIKE * float(side @ side)
    return sorted([*others, 1]) if told else others


def _fit(design: FloatArray, put_in: FloatArray, speed_std: FloatArray) -> _Fit:
    """The line, the extra variance (Mandel and Paule 1982), and Huber's weights, in turn until they settle."""
    weight, extra = np.ones(len(put_in)), float(np.var(put_in)) + 1e-30
    parameters = _york(design[None], put_in[None], speed_std[None], extra, weight[None])[0]
    for _ in range(20):
        residual = put_in - design @ parameters
        error = (parameters[0] * speed_std) ** 2
        extra = _extra_variance(residual, error, weight, design.shape[1])
        size = np.abs(residual) / np.sqrt(extra + error + 1e-300)
        weight = huber_weight(size, HUBER)
        new = _york(design[None], put_in[None], speed_std[None], extra, weight[None])[0]
        if np.abs(new - parameters).max() <= SETTLED * np.abs(new).max():
            break
        parameters = new
    return _Fit(parameters, extra, weight)


def _extra_variance(residual: FloatArray, error: FloatArray, weight: FloatArray, count: int) -> float:
    """s^2 >= 0 with sum w r^2 / (s^2 + error) = degrees of freedom; bisected."""
    freedom = max(float(weight.sum()) - count, 1.0)

    def excess(variance: float) -> float:
        return float(np.sum(weight * residual**2 / (variance + error + 1e-300))) - freedom

    if excess(0.0) <= 0.0:
        return 0.0
    low, high = 0.0, float(np.sum(residual**2)) + 1e-30
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) > 0.0 else (low, middle)
    return high


def _york(
    design: FloatArray, put_in: FloatArray, speed_std: FloatArray, extra: float, weight: FloatArray
) -> FloatArray:
    """Least sum of w r^2 / (s^2 + k^2 speed_std^2), for many draws at once. design: (draws, n, p). Returns (draws, p).

    A ridge keeps draws apart that determine no line.
    """
    scale = np.sqrt(np.mean(design**2, axis=1)) + 1e-300

    def solve(matrix: FloatArray, right: FloatArray) -> FloatArray:
        matrix = matrix / (scale[:, :, None] * scale[:, None, :])
        matrix += 1e-12 * np.trace(matrix, axis1=1, axis2=2)[:, None, None] * np.eye(matrix.shape[1])
        return np.linalg.solve(matrix, (right / scale)[:, :, None])[:, :, 0] / scale

    return errors_in_variables(
        design, put_in, extra, speed_std**2, solve, weight=weight, tolerance=SETTLED, most=ITERATIONS
    ).parameters


def _bootstrap(
    design: FloatArray, put_in: FloatArray, speed_std: FloatArray, fit: _Fit, block: NDArray[np.int64], draws: int,
    settled: bool,
) -> FloatArray:  # fmt: skip
    """Parameters of fits to windows drawn anew, in blocks of neighbours. Shape (draws, p).

    A block is twice as long as the residuals remember, and three windows at least, one where each is a step of its own.
    The draws are widened as Student's t is, for a bootstrap of few blocks is too narrow.
    """
    blocks, own = np.unique(block, return_inverse=True)
    residual = np.bincount(own, put_in - design @ fit.parameters) / np.bincount(own)
    memory = int(np.ceil(2.0 * autocorrelation_time(residual)))
    length = min(max(1 if settled else BLOCK, memory), max(1, len(blocks) // 2))
    times = drawn_times(len(blocks), length, draws, np.random.default_rng(SEED))
    found = []
    for part in np.array_split(times, max(1, draws * len(put_in) // 100_000)):
        weight = fit.weight * part[:, own]
        shape = (len(part), *design.shape)
        found.append(
            _york(
                np.broadcast_to(design, shape), np.broadcast_to(put_in, shape[:2]),
                np.broadcast_to(speed_std, shape[:2]), fit.extra, weight,
            )
        )  # fmt: skip
    drawn = np.concatenate(found)
    freedom = max(len(blocks) / length - design.shape[1], 1.0)
    wider = np.sqrt(1.0 + design.shape[1] / freedom) * t_quantile(int(max(freedom, 1))) / t_quantile(10**6)
    return fit.parameters + wider * (drawn - fit.parameters)


def _robust_std(values: FloatArray) -> float:
    """Half the width of the middle 68 %: a few wild draws of a line that is hardly determined do not count."""
    low, high = central_interval(values, 0.6827)
    return 0.5 * (high - low)


def _statement(line: DriveLine) -> str:
    low, high = line.ci95["dead_band"]
    head = "all motors" if line.motor == "all" else f"motor {line.motor}"
    slope = f"slope {line.gain:.3g} +- {line.gain_std:.2g} (rad/s)/{line.unit}"
    band = f"{line.value['dead_band']:.3g} +- {line.std['dead_band']:.2g} {line.unit}, 95 % [{low:.3g}, {high:.3g}]"
    if line.dead_band_seen:
        what = "dead band or offset (it turned one way only)" if line.one_way else "dead band"
        return f"{head}: {slope}; {what} {band}"
    if np.isnan(low):
        return (
            f"{head}: {slope}, any dead band included: it had one speed or one input only, so they cannot be told apart"
        )
    if high < 0.0:
        return (
            f"{head}: {slope}; dead zone not identifiable here: the line meets speed 0 at {band}, below 0, and no "
            "friction does that; the input has an offset, or the speeds are wrong"
        )
    if low > 0.0:
        return f"{head}: {slope}, which may as well be 0: dead zone not identifiable here ({band})"
    return (
        f"{head}: {slope}; dead zone not identifiable here: {band} contains 0; it is at most {max(high, 0.0):.3g} "
        f"{line.unit}, and none is needed"
    )


def _doubts(windows: DriveWindows, lines: Sequence[DriveLine]) -> list[str]:
    found = []
    if windows.unresolved:
        found.append(
            f"{windows.unresolved} windows were left out: their input changes so much from row to row that what the "
            "motor got is not in the log"
        )
    if windows.resting:
        found.append(f"{windows.resting} windows at rest, wholly or in part, were left out")
    if windows.every > 1:
        found.append(f"the logs are long: one window in {windows.every} was used")
    if any(line.one_way for line in lines):
        found.append("a motor turned one way only: a dead band and an offset of the input cannot be told apart")
    return found
