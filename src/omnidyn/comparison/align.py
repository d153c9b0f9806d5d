"""align: by how much the clock of a second log must be moved so that it shows the same motion as the first.

    offset = argmax over s of sum_c integral x_c(t) y_c(t - s) dt

x_c, y_c: component c of both logs, without its mean, over its spread: the cross-correlation (matched filter) of
G. L. Turin, IRE Trans. Inf. Theory 6, 311 (1960). The part of a step comes from a parabola through the correlation
coefficients of the overlap there and one step beside: the ends of a log, which have no counterpart, do not pull them.
Both logs are smoothed in the same way first: a step in a log is then as wide as some rows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.fft import irfft, rfft
from scipy.fft import next_fast_len
from scipy.ndimage import uniform_filter1d

from omnidyn.arrays import FloatArray
from omnidyn.clocks import samples, usual_step
from omnidyn.document import Document, Table, plain
from omnidyn.errors import InsufficientDataError
from omnidyn.logs.channels import components, place
from omnidyn.run import CHANNELS, SENSORS, Run, as_run
from omnidyn.statement import NOTE, WARNING, Statement, as_verdict

MAX_POINTS = 2**23  # of a grid that both logs are put on
SMOOTH_STEPS = 5  # of the slower log, over which both are averaged, twice
LEAST_ALIKE = 0.7  # correlation below which two logs hardly show one motion
LARGEST_RIVAL = 0.9  # of the correlation, that another offset may reach: a motion that repeats itself fits at several
RATES_MEASURED = ("twist", "wheel_speed")
RATES = {"heading": "omega", "a": "w"}  # what the slope of a component is, by its letters


@dataclass(frozen=True)
class Alignment:
    """Where a second log stands on the clock of a first.

    offset: to be added to the times of the second [s]. correlation: of both, where they overlap, -1 to 1. overlap: how
    long they do [s]. rival_offset, rival: the best of the other offsets, and its correlation; -1 where there is none.
    components: that both have, by which they were aligned. first, second: where they come from.
    """

    offset: float
    correlation: float
    overlap: float
    rival_offset: float
    rival: float
    components: tuple[str, ...]
    first: str = ""
    second: str = ""

    @property
    def is_alike(self) -> bool:
        """Whether both logs show one motion."""
        return self.correlation >= LEAST_ALIKE

    @property
    def is_unique(self) -> bool:
        """Whether no other offset fits nearly as well."""
        return self.rival < LARGEST_RIVAL * self.correlation

    @property
    def verdict(self) -> Statement:
        """By how much the second log is later, or that the two hardly show one motion."""
        numbers = {name: getattr(self, name) for name in ("offset", "correlation", "overlap", "components", "first")}
        if not self.is_alike:
            return Statement("logs_unlike", WARNING, self.second, numbers)
        if not self.is_unique:
            numbers |= {"rival_offset": self.rival_offset, "rival": self.rival}
            return Statement("logs_aligned_in_several_ways", WARNING, self.second, numbers)
        return Statement("logs_aligned", NOTE, self.second, numbers)

    def document(self) -> Document:
        """The offset in a sentence, and as values."""
        data = plain({**as_verdict(self.verdict), **vars(self)})
        cells = f"{self.offset:.6f}", f"{self.correlation:.3f}", f"{self.overlap:.4g}", " ".join(self.components)
        heads = "offset [s]", "correlation", "overlap [s]", "by"
        return Document(
            [Table(heads, [cells])],
            data,
            () if self.is_alike and self.is_unique else (self.verdict,),
            verdict=self.verdict,
        )


def align(first: Run, second: Run) -> Alignment:
    """The offset of the clock of a second log, by the motion that both show (see the formula above).

    Sensors that both have tell it; commands only where they have no sensor in common, for these jump between rows.
    Raises InsufficientDataError where nothing that both recorded changes.

    >>> import numpy as np, omnidyn
    >>> volts = np.repeat(np.random.default_rng(0).uniform(-5.0, 5.0, (20, 3)), 40, axis=0)
    >>> run = omnidyn.simulate(omnidyn.load_robot("axebot"), volts, dt=0.01)
    >>> tracker = omnidyn.Run(t=run.t + 100.0, twist=run.twist)
    >>> round(omnidyn.align(run, tracker).offset, 3)
    -100.0
    """
    runs = as_run(first), as_run(second)
    signals = [_signals(run) for run in runs]
    names = _common(*signals)
    steps = [max(usual_step(t) for t, _ in (of_run[name] for name in names)) for of_run in signals]
    length = sum(float(run.t[-1] - run.t[0]) for run in runs)
    step = max(min(steps), length / MAX_POINTS)
    width = max(1, round(SMOOTH_STEPS * max(steps) / step))
    grids = [np.arange(run.t[0], run.t[-1] + 0.5 * step, step) for run in runs]
    x, y = (
        np.array([_on_grid(*of_run[name], grid, width) for name in names])
        for of_run, grid in zip(signals, grids, strict=True)
    )
    k, rivals = _best_shifts(x, y)
    (before, _), (peak, overlap), (after, _) = (_alike(x, y, shift) for shift in (k - 1, k, k + 1))
    bend = before - 2.0 * peak + after
    shift = k + (0.5 * (before - after) / bend if bend < 0.0 else 0.0)
    begin = float(grids[0][0] - grids[1][0])
    rival, other = max(((_alike(x, y, one)[0], one) for one in rivals), default=(-1.0, k))
    first_name, second_name = runs[0].source or "the first log", runs[1].source or "the second log"
    return Alignment(
        begin + shift * step, peak, overlap * step, begin + other * step, rival, names, first_name, second_name
    )


Signals = dict[str, tuple[FloatArray, FloatArray]]


def _signals(run: Run) -> Signals:
    """Component -> (times, values) of all that change; an angle gives its rate, where that was not recorded."""
    signals: Signals = {}
    for channel, values in run.channels.items():
        columns = values.reshape(len(run), -1)
        for name, column in zip(components(channel, columns.shape[1]), columns.T, strict=True):
            t, values = samples(run.t, column)
            if len(t) > 2 and np.ptp(values) > 0.0:
                signals[name] = t, values
    for name in [*signals]:
        letters = name.rstrip("0123456789")
        if letters in RATES:
            t, angle = signals[name]
            signals.setdefault(RATES[letters] + name[len(letters) :], (t, np.gradient(angle, t)))
    return signals


def _common(first: Signals, second: Signals) -> tuple[str, ...]:
    """Names of what both have: rates of sensors, else other sensors, else commands. Raises InsufficientDataError."""
    both = {name: location[0] for name in first if name in second and (location := place(name))}
    for wanted in (RATES_MEASURED, SENSORS, CHANNELS):
        if names := tuple(name for name, channel in both.items() if channel in wanted):
            return names
    raise InsufficientDataError(
        "two logs without anything in common cannot be aligned",
        got=f"{', '.join(first) or 'nothing'}; {', '.join(second) or 'nothing'}",
        expected="a component that both recorded, and that changes",
    )


def _on_grid(t: FloatArray, values: FloatArray, grid: FloatArray, width: int) -> FloatArray:
    """A signal on a grid, smooth, without its mean, over its spread. Shape of the grid, less `width` at both ends."""
    smooth = np.interp(grid, t, values)
    smooth = (smooth - smooth.mean()) / max(float(smooth.std()), np.finfo(float).tiny)
    for _ in range(2):
        smooth = uniform_filter1d(smooth, width, mode="nearest")
    return smooth[width:-width] if len(smooth) > 4 * width else smooth


def _best_shifts(x: FloatArray, y: FloatArray) -> tuple[int, list[int]]:
    """Steps by which y has to be moved to be most like x, and the next best to each side, beyond where both are unlike.

    Shapes (components, n) and (components, m).
    """
    size = int(next_fast_len(x.shape[1] + y.shape[1] - 1, real=True) or 0)
    spectra = (rfft(one, size) * np.conj(rfft(other, size)) for one, other in zip(x, y, strict=True))
    spectrum = np.sum(list(spectra), axis=0)
    products = irfft(spectrum, size)
    products = np.concatenate([products[size - y.shape[1] + 1 :], products[: x.shape[1]]])  # from the least shift on
    k, least = int(np.argmax(products)), y.shape[1] - 1
    unlike = np.flatnonzero(products <= 0.0)
    sides = products[: unlike[unlike < k].max(initial=0)], products[unlike[unlike > k].min(initial=len(products)) :]
    begins = 0, len(products) - len(sides[1])
    rivals = [begin + int(np.argmax(side)) for begin, side in zip(begins, sides, strict=True) if len(side)]
    return k - least, [one - least for one in rivals]


def _alike(x: FloatArray, y: FloatArray, shift: int) -> tuple[float, int]:
    """(correlation of all components together where x and the moved y overlap, steps of the overlap)."""
    begin, end = max(0, shift), min(x.shape[1], y.shape[1] + shift)
    x, y = (part - part.mean(axis=1, keepdims=True) for part in (x[:, begin:end], y[:, begin - shift : end - shift]))
    power = float((x**2).sum() * (y**2).sum())
    return (float((x * y).sum()) / power**0.5 if power > 0.0 else 0.0), end - begin
