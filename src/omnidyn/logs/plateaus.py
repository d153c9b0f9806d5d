"""Steady windows of a run, and one point per window: what the steady-state identification is made from.

A window lies between two gaps, within a hold: a stretch over which the commands stand still. Its start-up is cut off
where the standard error of what remains is least: MSER, K. P. White, Simulation 69, 323 (1997), here for all measured
channels at once; an end that differs (the robot brakes) is cut off in the same way. Where no command comes in steps,
windows of fixed length are taken instead. A window whose second half differs from its first is not steady and left out.
What is left of a transient in a window is told by the mean rate of change of its speeds; mass times that is no
friction.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice, pairwise

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.errors import InputError
from omnidyn.logs.segments import segments
from omnidyn.model.frames import world_to_body
from omnidyn.run import Run
from omnidyn.sensors import FROM_START
from omnidyn.statistics import HUBER_CLIP, autocorrelation_time, robust_mean, robust_std

MIN_ROWS, MIN_DURATION = 12, 0.4  # [s]
WINDOW = 0.5  # [s] length where no command comes in steps
SAME_COMMAND = 0.01  # of the largest command: a change by less is none
STEPWISE = 0.05  # a command that changes in more than this share of the rows does not come in steps
START_SHARE, END_SHARE = 0.5, 0.25  # at most so much of a hold is cut off
SAFETY = 3  # times what MSER cuts: it leaves a transient as large as the noise of one window, which many do not average
DEAD_SHARE = 0.05  # of what the speeds tell: an angle that turns less is dead
ENDS = 2.0  # [s] at either end of a hold: a start-up, or a braking, is looked for there where it is cut in pieces
DRIFT_ERRORS, DRIFT_SHARE = 4.0, 0.1  # halves that differ by more than both are not steady

CUBIC, CLIPPINGS = 3, 3  # degree of the curve through the speeds of a window; times that its spikes are clipped

COMMANDS = ("wheel_speed_command", "twist_command", "duty", "voltage")
ANGLE, SPEED = "differences of wheel_angle", "wheel_speed"


@dataclass(frozen=True, eq=False)
class Plateau:
    """One steady window of a run, as one point.

    rows: where it stands in the run. start, end: its times [s]. mean, std: channel of Run -> robust mean and its
    standard error, SI, shape (columns,) or (); of wheel_speed, and of twist where only a pose was logged, from
    differences over the window. speed_from: where wheel_speed comes from, "" where there is none.
    hold: number of its hold in the run; a gap may cut one into several windows. count: rows used.
    rate, rate_std: "wheel_speed" and "twist", where there are any -> mean rate of change over the window and its
    standard error, SI per s, shape (columns,).
    """

    rows: slice
    start: float
    end: float
    mean: Mapping[str, FloatArray]
    std: Mapping[str, FloatArray]
    speed_from: str = ""
    hold: int = 0
    count: int = 0
    rate: Mapping[str, FloatArray] = field(default_factory=dict)
    rate_std: Mapping[str, FloatArray] = field(default_factory=dict)


def find_plateaus(run: Run, *, start: float | None = None, end: float | None = None) -> tuple[Plateau, ...]:
    """The steady windows of a run, in order, one point each.

    start, end: instead of looking for steady rows, take these shares of each hold (0.4 and 0.95:
    from 40 % to 95 % of its rows). Returns no window where none is long enough and steady.
    Raises InputError when only one of the two is given, or when they are not 0 <= start < end <= 1.
    """
    return tuple(_plateaus(run, _fixed(start, end)))


def first_plateaus(run: Run, limit: int) -> tuple[Plateau, ...]:
    """The first steady windows of a run, as `find_plateaus` finds them: no more than are asked for."""
    return tuple(islice(_plateaus(run, None), limit))


def _plateaus(run: Run, shares: tuple[float, float] | None) -> Iterator[Plateau]:
    angle, run_segments = live_angle(run), segments(run.t, usual=run.step)
    for number, hold in enumerate(holds(run)):
        for segment in _between_gaps(run_segments, _share(hold, *shares) if shares else hold):
            rows = segment if shares else _settled(run, segment, angle)
            if rows is not None and _long_enough(run, rows) and (shares or _is_steady(run, rows, angle)):
                yield replace(_plateau(run, rows, angle), hold=number)


def held_pieces(run: Run, *, start: float | None = None, end: float | None = None) -> list[slice]:
    """Rows of pieces of `WINDOW` seconds into which the holds of a run are cut, without their start-up and braking.

    start, end: as in `find_plateaus`. Whether a piece is steady is not asked: a floor that changes changes speeds, too.
    """
    fixed, angle, run_segments, found = _fixed(start, end), live_angle(run), segments(run.t, usual=run.step), []
    for hold in holds(run):
        for segment in _between_gaps(run_segments, _share(hold, *fixed) if fixed else hold):
            rows = segment if fixed else _settled(run, segment, angle, ENDS)
            if rows is not None and _long_enough(run, rows):
                count = max(round(float(run.t[rows.stop - 1] - run.t[rows.start]) / WINDOW), 1)
                edges = np.linspace(rows.start, rows.stop, count + 1).round().astype(int).tolist()
                found += [slice(first, last) for first, last in pairwise(edges) if last - first > 1]
    return found


def pool(plateaus: Sequence[Plateau]) -> tuple[Plateau, ...]:
    """One point per hold: the windows of a run between which a gap lies, averaged by their rows."""
    holds: dict[int, list[Plateau]] = {}
    for plateau in plateaus:
        holds.setdefault(plateau.hold, []).append(plateau)
    return tuple(windows[0] if len(windows) == 1 else _pooled(windows) for windows in holds.values())


def _pooled(windows: Sequence[Plateau]) -> Plateau:
    first, last = windows[0], windows[-1]
    weight = np.array([window.count for window in windows], dtype=float)
    weight /= weight.sum()
    mean, rate = (_averaged([getattr(window, part) for window in windows], weight) for part in ("mean", "rate"))
    std, rate_std = (_error([getattr(window, part) for window in windows], weight) for part in ("std", "rate_std"))
    rows, count = slice(first.rows.start, last.rows.stop), sum(window.count for window in windows)
    return replace(first, rows=rows, end=last.end, mean=mean, std=std, count=count, rate=rate, rate_std=rate_std)


def _averaged(parts: Sequence[Mapping[str, FloatArray]], weight: FloatArray) -> dict[str, FloatArray]:
    """What all windows have, averaged."""
    names = [name for name in parts[0] if all(name in part for part in parts)]
    return {name: np.tensordot(weight, np.stack([part[name] for part in parts]), 1) for name in names}


def _error(parts: Sequence[Mapping[str, FloatArray]], weight: FloatArray) -> dict[str, FloatArray]:
    """The standard error of that average."""
    squares = _averaged([{name: value**2 for name, value in part.items()} for part in parts], weight**2)
    return {name: np.sqrt(square) for name, square in squares.items()}


def _plateau(run: Run, rows: slice, angle: FloatArray | None) -> Plateau:
    mean, std, t = {}, {}, run.t[rows]
    speeds = {name: (t, values[rows]) for name, values in run.channels.items() if name in ("wheel_speed", "twist")}
    for name, values in run.channels.items():
        if name not in FROM_START:
            mean[name], std[name] = robust_mean(values[rows])
    speed_from = SPEED if "wheel_speed" in mean else ""
    if angle is not None and len(sample_rows := _seen(angle[rows])) > 1:
        at, turned = t[sample_rows], angle[rows][sample_rows]
        mean["wheel_speed"], std["wheel_speed"] = _rate(at, turned)
        speeds["wheel_speed"] = _middle(at), np.diff(turned, axis=0) / np.diff(at)[:, None]
        speed_from = ANGLE
    if run.twist is None and run.pose is not None and len(sample_rows := _seen(run.pose[rows])) > 1:
        at, pose = t[sample_rows], run.pose[rows][sample_rows]
        mean["twist"], std["twist"] = _body_rate(at, pose)
        speeds["twist"] = _middle(at), _body_steps(pose) / np.diff(at)[:, None]
    rates = {name: _rate_of_change(*speed) for name, speed in speeds.items()}
    return Plateau(
        rows,
        float(t[0]),
        float(t[-1]),
        mean,
        std,
        speed_from,
        count=rows.stop - rows.start,
        rate={name: rate[0] for name, rate in rates.items()},
        rate_std={name: rate[1] for name, rate in rates.items()},
    )


def live_angle(run: Run) -> FloatArray | None:
    """The angles of the wheels, None where none were logged or where one stands still while its wheel turns."""
    if run.wheel_angle is None or run.wheel_speed is None:
        return run.wheel_angle
    for angle, speed in zip(run.wheel_angle.T, run.wheel_speed.T, strict=True):
        finite = np.isfinite(speed)
        speed_path = np.sum(np.abs(speed[finite][:-1]) * np.diff(run.t[finite]))
        if np.sum(np.abs(np.diff(angle[np.isfinite(angle)]))) < DEAD_SHARE * speed_path:
            return None
    return run.wheel_angle


def _seen(values: FloatArray) -> IntArray:
    """The rows in which all columns were measured."""
    return np.flatnonzero(np.isfinite(values).all(axis=1))


def _middle(t: FloatArray) -> FloatArray:
    return 0.5 * (t[1:] + t[:-1])


def holds(run: Run) -> list[slice]:
    """The stretches of a run over which the commands that come in steps stand still, in order; a gap may lie in one.

    Where no command comes in steps: windows of `WINDOW` seconds between gaps.
    """
    changes = command_changes(run)
    if changes is None:
        return [window for segment in segments(run.t, usual=run.step) for window in _cut(run.t, segment)]
    cuts = np.flatnonzero(changes)
    return [slice(int(a), int(b)) for a, b in zip([0, *cuts], [*cuts, len(run)], strict=True) if b > a]


def _between_gaps(run_segments: Sequence[slice], hold: slice) -> list[slice]:
    """A hold cut at the gaps of the run."""
    pieces = [slice(max(p.start, hold.start), min(p.stop, hold.stop)) for p in run_segments]
    return [segment for segment in pieces if segment.stop > segment.start]


def command_changes(run: Run) -> BoolArray | None:
    """Rows with another command than the row before; None where no command comes in steps."""
    changes, stepwise = np.zeros(len(run), dtype=bool), False
    if len(run) < 2:
        return None
    for name in COMMANDS:
        values = run.channels.get(name)
        if values is None or not np.isfinite(values).any():
            continue
        bound = SAME_COMMAND * float(np.nanmax(np.abs(values)))
        steps = (np.abs(np.diff(values, axis=0)) > bound).any(axis=1)
        if steps.mean() <= STEPWISE:
            changes[1:] |= steps
            stepwise = True
    return changes if stepwise else None


def _cut(t: FloatArray, segment: slice) -> list[slice]:
    """A segment in windows of fixed length."""
    number = ((t[segment] - t[segment.start]) // WINDOW).astype(int)
    edges = segment.start + np.flatnonzero(np.diff(number, prepend=-1, append=number[-1] + 1))
    return [slice(int(a), int(b)) for a, b in pairwise(edges)]


def _fixed(start: float | None, end: float | None) -> tuple[float, float] | None:
    if start is None and end is None:
        return None
    if start is None or end is None or not 0.0 <= start < end <= 1.0:
        raise InputError("not a share of the rows", got=f"start {start}, end {end}", expected="0 <= start < end <= 1")
    return start, end


def _share(hold: slice, start: float, end: float) -> slice:
    n = hold.stop - hold.start
    return slice(hold.start + int(start * n), hold.start + int(end * n))


def _long_enough(run: Run, rows: slice) -> bool:
    n = rows.stop - rows.start
    return n >= MIN_ROWS and bool(run.t[rows.stop - 1] - run.t[rows.start] >= MIN_DURATION)


def _responses(run: Run, rows: slice, angle: FloatArray | None) -> FloatArray:
    """What shows whether the robot has settled: speeds, else currents; robust z-scores, spikes clipped. (n, k)."""
    speed = run.wheel_speed if run.wheel_speed is not None else run.twist
    parts = [_in_every_row(run.t[rows], part[rows]) for part in (speed, run.current) if part is not None]
    if angle is not None:
        rates = np.diff(_in_every_row(run.t[rows], angle[rows]), axis=0) / np.diff(run.t[rows])[:, None]
        parts = [np.concatenate([rates[:1], rates]), *parts[0 if speed is None else 1 :]]
    if not parts:
        return np.zeros((rows.stop - rows.start, 0))
    table = np.concatenate(parts, axis=1)
    table = table[:, np.isfinite(table).all(axis=0)]
    middle = np.median(table, axis=0)
    spread = robust_std(table, middle, axis=0)
    spread = np.where(spread > 0.0, spread, np.std(table, axis=0))
    moving = spread > 0.0
    return np.clip((table[:, moving] - middle[moving]) / spread[moving], -5.0, 5.0)


def _in_every_row(t: FloatArray, values: FloatArray) -> FloatArray:
    """What a sensor with a clock of its own says in the rows between: only to look for the end of a transient.

    A column that was measured too seldom stays blank, as does one that ends early.
    """
    if np.isfinite(values).all():
        return values
    filled = values.copy()
    for column, column_samples in zip(filled.T, values.T, strict=True):
        finite = np.isfinite(column_samples)
        if finite.sum() >= MIN_ROWS:
            column[:] = np.interp(t, t[finite], column_samples[finite])
    return filled


def _settled(run: Run, hold: slice, angle: FloatArray | None, ends: float = np.inf) -> slice | None:
    """The hold without its start-up, and without an end that differs, each looked for within so many seconds."""
    if not _long_enough(run, hold):
        return None
    scores = _responses(run, hold, angle)
    t = run.t[hold]
    head, tail = np.searchsorted(t, t[0] + ends, "right"), np.searchsorted(t, t[-1] - ends)
    first = min(SAFETY * _truncation(scores[:head], START_SHARE), int(START_SHARE * head))
    last = _truncation(scores[max(first, tail) :][::-1], END_SHARE)
    last = min(SAFETY * last, int(END_SHARE * (len(scores) - tail)))
    return slice(hold.start + first, hold.stop - last)


def _truncation(scores: FloatArray, share: float) -> int:
    """How many rows at the start to leave out: the least sum over the columns of var(rest) / len(rest)."""
    n = len(scores)
    if not scores.size:
        return 0
    counts = np.arange(n, 0, -1)[:, None]
    totals = np.cumsum(scores[::-1], axis=0)[::-1]
    squares = np.cumsum(scores[::-1] ** 2, axis=0)[::-1]
    error = ((squares / counts - (totals / counts) ** 2) / counts).sum(axis=1)
    return int(np.argmin(error[: max(1, int(share * n) + 1)]))


def _is_steady(run: Run, rows: slice, angle: FloatArray | None) -> bool:
    """Whether the halves agree in the speeds, as far as their noise allows to tell."""
    speed = run.wheel_speed if run.wheel_speed is not None else run.twist
    half = (rows.start + rows.stop) // 2
    halves = slice(rows.start, half), slice(half, rows.stop)
    if angle is not None:
        sample_rows = [part.start + _seen(angle[part]) for part in halves]
        if min(map(len, sample_rows)) < 2:
            return False
        pairs = [_rate(run.t[part], angle[part]) for part in sample_rows]
    elif speed is not None:
        pairs = [robust_mean(speed[part]) for part in halves]
    else:
        return True
    (first, a), (second, b) = pairs
    difference, size = np.abs(second - first), float(np.nan_to_num(np.abs(first + second)).max()) / 2.0
    drifts = (difference > DRIFT_ERRORS * np.hypot(a, b)) & (difference > DRIFT_SHARE * size)
    return not bool(drifts.any())


def _rate(t: FloatArray, angle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean rate over a window from its two ends, with the standard error of the mean of the single steps."""
    steps = np.diff(angle, axis=0) / np.diff(t)[:, None]
    return (angle[-1] - angle[0]) / (t[-1] - t[0]), robust_mean(steps)[1]


def _body_rate(t: FloatArray, pose: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean twist over a window from the pose: each step turned into the body frame of its middle."""
    turned = _body_steps(pose)
    return turned.sum(axis=0) / (t[-1] - t[0]), robust_mean(turned / np.diff(t)[:, None])[1]


def _body_steps(pose: FloatArray) -> FloatArray:
    """Each step of a pose in the body frame of its middle. Shape (n - 1, 3)."""
    heading = 0.5 * (pose[1:, 2] + pose[:-1, 2])
    return np.einsum("nij,nj->ni", world_to_body(heading), np.diff(pose, axis=0))


def _rate_of_change(t: FloatArray, speed: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean rate of change of each column over a window, (v(end) - v(start))/T, and its standard error.

    The ends are those of a cubic through all rows, spikes clipped: with Legendre's polynomials on -1 .. 1 it rises by
    2 (c_1 + c_3). The line of least squares does not tell it: it looks at the middle, a transient is at the start.
    0 and infinity for a column without enough numbers.
    """
    masks = [np.isfinite(column) for column in speed.T]
    rises = [_rise(t[finite], column[finite]) for finite, column in zip(masks, speed.T, strict=True)]
    rise, error = np.array(rises).reshape(-1, 2).T
    return rise / (t[-1] - t[0]), error / (t[-1] - t[0])


def _rise(t: FloatArray, speed: FloatArray) -> tuple[float, float]:
    """(v(end) - v(start), its standard error) of a cubic through one column."""
    if len(t) < MIN_ROWS:
        return 0.0, np.inf
    design = np.polynomial.legendre.legvander(2.0 * (t - t[0]) / (t[-1] - t[0]) - 1.0, CUBIC)
    inverse, ends = np.linalg.pinv(design), np.array([0.0, 2.0, 0.0, 2.0])
    clipped = speed
    for _ in range(CLIPPINGS):
        curve = design @ (inverse @ clipped)
        residual = speed - curve
        bound = HUBER_CLIP * float(robust_std(residual, 0.0)) or np.inf
        clipped = curve + np.clip(residual, -bound, bound)
    misfit = clipped - design @ (inverse @ clipped)
    spread = np.sqrt(misfit @ misfit / (len(t) - CUBIC - 1) * autocorrelation_time(misfit))
    return float(ends @ inverse @ clipped), float(spread * np.linalg.norm(ends @ inverse))
