"""Times in two columns, as ROS writes them: header.stamp.sec and header.stamp.nanosec are one time in seconds.

And times that no recording holds, far from all others.
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.logs.channels import TIME
from omnidyn.logs.table.table import FileTable

_SECOND_WORDS = ("sec", "secs", "seconds")
_REST = {
    "nanoseconds": 1e-9,
    "nanosecs": 1e-9,
    "nanosec": 1e-9,
    "nsecs": 1e-9,
    "nsec": 1e-9,
    "microseconds": 1e-6,
    "usecs": 1e-6,
    "usec": 1e-6,
}
_NAME = re.compile(rf"(?P<stem>.*?)(?P<rest>{'|'.join(_REST)})", re.IGNORECASE | re.DOTALL)

MANY_STAMPS, ASTRAY_SHARE = 10, 0.01  # stamps of which some may be astray; the share that may be
LENGTHS = 10.0  # lengths of the recording: what is farther from its middle, and more than a day, is astray


def astray(stamps: FloatArray | IntArray, day: float) -> BoolArray:
    """Which of the stamps, shape (n,), are no time of their recording: a few far from the rest. day: in their unit."""
    if len(stamps) < MANY_STAMPS:
        return np.zeros(len(stamps), dtype=bool)
    times = stamps.astype(float)
    low, middle, high = np.quantile(times, [ASTRAY_SHARE, 0.5, 1.0 - ASTRAY_SHARE])
    stray = np.abs(times - middle) > max(abs(day), LENGTHS * float(high - low))
    return stray if stray.sum() <= max(1.0, ASTRAY_SHARE * len(stray)) else np.zeros(len(stray), dtype=bool)


def with_joined_stamp(table: FileTable) -> FileTable:
    """The table with a column t in front where whole seconds and the rest of a second stand in two columns.

    The first such pair counts. A table that has a column t stays as it is.
    """
    lower = {name.lower(): name for name in reversed(table.names)}
    for name in table.names if TIME not in lower else ():
        match = _NAME.fullmatch(name)
        stem = match["stem"].lower() if match else ""
        seconds = next((lower[stem + word] for word in _SECOND_WORDS if stem + word in lower), None) if match else None
        if match is None or seconds is None:
            continue
        whole_seconds, rest = table.columns[seconds], table.columns[name]
        size = _REST[match["rest"].lower()]
        if isinstance(whole_seconds, tuple) or isinstance(rest, tuple) or not _rest_of_a_second(rest * size):
            continue
        columns = {TIME: whole_seconds + size * rest, **table.columns}
        note = f"{TIME} is {seconds} + {size:g} {name}"
        units, names = {**table.units, TIME: "s"}, (TIME, *table.names)
        return replace(table, names=names, columns=columns, units=units, notes=(*table.notes, note))
    return table


def _rest_of_a_second(values: np.ndarray) -> bool:
    fractions = values[np.isfinite(values)]
    return bool(fractions.size) and float(fractions.min()) >= 0.0 and float(fractions.max()) < 1.0
