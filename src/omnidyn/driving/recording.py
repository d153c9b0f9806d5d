"""What was sent and what was measured, as a log: on the clock of the drive, each input from when it was sent."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.driving.connection import Command, Measured
from omnidyn.errors import InputError
from omnidyn.identification.live.rows import part
from omnidyn.run import LARGEST_SIZE, Run
from omnidyn.sensors import AXIS, CHANNELS, SCALAR, WHEEL

TICK = 1e-6  # [s]: times that are nearer are one row


class DriveRecording:
    """Inputs and measurements of a drive, as they come. wheels: how many there are."""

    def __init__(self, wheels: int) -> None:
        self._widths = {name: {WHEEL: wheels, AXIS: 3, SCALAR: 1}[kind] for name, kind in CHANNELS.items()}
        self._sent: list[tuple[float, tuple[float, ...]]] = []
        self._measured: list[Measured] = []
        # Of the clock of the drive and that of the robot: of the measurement that came fastest
        self._difference = np.inf
        self._told, self._told_until = (0, 0), -np.inf

    def sent(self, now: float, command: Command) -> None:
        """A command that was sent."""
        self._sent.append((now, command.inputs))

    def measured(self, now: float, measured: Measured) -> None:
        """A measurement that came; those before the first command are kept, and left out of the log.

        Raises InputError for one that no log can hold.
        """
        if not np.isfinite(measured.t):
            raise InputError("not a time", got=measured.t, expected="seconds of its own clock", where="a measurement")
        for name, value in measured.channels.items():
            if name not in self._widths:
                raise InputError("no such channel", got=name, expected=", ".join(CHANNELS), where="a measurement")
            if np.shape(value) != (self._widths[name],):
                shape, expected = np.shape(value), f"({self._widths[name]},)"
                raise InputError("a wrong shape", got=str(shape), expected=expected, where=f"a measurement: {name}")
        self._difference = min(self._difference, now - measured.t)
        self._measured.append(measured)

    def time_of(self, measured: Measured) -> float:
        """When it was measured, on the clock of the drive, as far as the line lets it be known."""
        return measured.t + self._difference

    def run(self, channel: str, source: str) -> Run | None:
        """The log; None where nothing was driven. channel: of the inputs."""
        if len(self._sent) < 2:
            return None
        return self._rows(0, 0, channel, source)

    def new_rows(self, channel: str, source: str) -> Run | None:
        """What came since it was asked last, as rows that follow those; None for nothing. channel: of the inputs."""
        if len(self._sent) < 2:
            return None
        run = self._rows(max(self._told[0] - 1, 0), self._told[1], channel, source)
        self._told = (len(self._sent), len(self._measured))
        fresh = np.flatnonzero(run.t > self._told_until)
        if not fresh.size:
            return None
        self._told_until = float(run.t[-1])
        return part(run, int(fresh[0]), len(run))

    def _rows(self, first_sent: int, first_measured: int, channel: str, source: str) -> Run:
        """The log from these on."""
        commands, came = self._sent[first_sent:], self._measured[first_measured:]
        start = self._sent[0][0]
        sent = _ticks([t - start for t, _ in commands])
        measured = _ticks([self.time_of(one) - start for one in came])
        kept = (measured >= sent[0]) & (measured >= np.maximum.accumulate(measured))
        ticks = np.unique(np.concatenate([sent, measured[kept]]))
        inputs = np.array([values for _, values in commands])
        rows: dict[str, Any] = {channel: inputs[np.searchsorted(sent, ticks, side="right") - 1]}
        found = [(int(tick), one) for tick, one, keep in zip(measured, came, kept, strict=True) if keep]
        for name in dict.fromkeys(name for _, one in found for name in one.channels):
            values = [(tick, one.channels[name]) for tick, one in found if name in one.channels]
            rows[name] = _column(name, values, ticks)
        if channel == "duty" and np.isfinite(rows.get("supply", np.nan)).any():
            rows["supply"] = _held(rows["supply"])
        return Run(t=ticks * TICK, source=source, **rows)


def _ticks(times: Sequence[float]) -> np.ndarray:
    return np.rint(np.array(times, dtype=float) / TICK).astype(np.int64)


def _column(name: str, values: list[tuple[int, FloatArray]], ticks: np.ndarray) -> FloatArray:
    """A channel on the rows of the log, NaN where it was not measured, or as no sensor gives it."""
    width = len(values[0][1])
    rows = np.full((len(ticks), width), np.nan)
    rows[np.searchsorted(ticks, [tick for tick, _ in values])] = [value for _, value in values]
    rows[np.abs(rows) > LARGEST_SIZE] = np.nan
    return rows[:, 0] if CHANNELS[name] == SCALAR else rows


def _held(values: FloatArray) -> FloatArray:
    """Each value until the next one; the first one before it too."""
    finite = np.flatnonzero(np.isfinite(values))
    places = np.maximum(np.searchsorted(finite, np.arange(len(values)), side="right") - 1, 0)
    return values[finite[places]]
