"""Series: signals over time in a folder, and the few numbers of them that a picture of so many pixels shows.

Of a stretch with more rows than pixels the least and the largest value of each pixel is sent: no spike is lost.
Blocks of BLOCK rows are reduced once, when the signals are written, so that a picture of millions of rows costs little.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from omnidyn.arrays import FloatArray

BLOCK = 64  # rows
MAX_WIDTH = 8192  # pixels
META = "meta.json"
SERIES = "series"  # the folder in which a job writes the one series that it has
SHOWN = np.float32  # numbers of a picture: fine for any number of pixels, at half the bytes


def write_series(
    folder: Path, t: FloatArray, panels: Sequence[Mapping[str, Any]], values: NDArray[np.floating], **more: Any
) -> None:
    """Write signals to a new folder.

    Args:
        folder: that is made.
        t: times [s], shape (rows,); shown from the largest so far, where they go back or are missing.
        panels: each with a title, a unit and the names of its signals.
        values: of all signals in the order of the panels, shape (signals, rows).
        more: what a page needs beside them.
    """
    folder.mkdir(parents=True)
    time = shown_times(t)
    np.save(folder / "t.npy", time)
    shown = values.astype(SHOWN, copy=False)
    np.save(folder / "values.npy", shown)
    edges = np.arange(0, len(time), BLOCK)
    np.save(folder / "least.npy", np.fmin.reduceat(shown, edges, axis=1))
    np.save(folder / "largest.npy", np.fmax.reduceat(shown, edges, axis=1))
    meta = {"panels": panels, "begin": float(time[0]), "end": float(time[-1]), "rows": len(time), **more}
    (folder / META).write_text(json.dumps(meta), "utf-8")


def shown_times(t: FloatArray) -> FloatArray:
    """Times that never go back, for a picture: the largest so far. Shape (rows,)."""
    finite = np.where(np.isfinite(t), t, -np.inf)
    times = np.maximum.accumulate(finite)
    first = times[np.isfinite(times)]
    return np.where(np.isfinite(times), times, first[0] if first.size else 0.0)


class Series:
    """Signals that were written to a folder; the arrays stay on disk."""

    def __init__(self, folder: Path) -> None:
        self.meta = json.loads((folder / META).read_text("utf-8"))
        names = ("t", "values", "least", "largest")
        arrays = (np.load(folder / f"{name}.npy", mmap_mode="r", allow_pickle=False) for name in names)
        self._t, self._values, self._least, self._largest = arrays

    def frame(self, begin: float, end: float, width: int) -> bytes:
        """What a picture of a stretch of time shows, as bytes: a head in JSON, then float32.

        The head: begin [s], to which times are relative, signals, points, and the rows behind them. Then times
        (points,), then for each signal least and largest values (2, points). width: pixels.
        """
        width = max(2, min(int(width), MAX_WIDTH))
        rows = len(self._t)
        first = max(0, int(np.searchsorted(self._t, begin)) - 1)
        last = min(rows, int(np.searchsorted(self._t, end, side="right")) + 1)
        t, least, largest = self._reduced(first, max(last, first + 1), width)
        head = json.dumps({"begin": begin, "signals": len(least), "points": len(t), "rows": last - first}).encode()
        head += b" " * (-(len(head) + 4) % 4)
        both = np.stack([least, largest], axis=1)
        return struct.pack("<I", len(head)) + head + (t - begin).astype("<f4").tobytes() + both.astype("<f4").tobytes()

    def _reduced(self, first: int, last: int, width: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Times, least and largest values of at most about so many points. Shapes (points,), (signals, points)."""
        if last - first <= 2 * width:
            values = np.asarray(self._values[:, first:last])
            return np.asarray(self._t[first:last]), values, values
        if last - first > 4 * BLOCK * width:
            low, high, per = first // BLOCK, -(-last // BLOCK), BLOCK
            least, largest = self._least, self._largest
        else:
            low, high, per = first, last, 1
            least = largest = self._values
        edges = np.unique(np.linspace(low, high, width + 1).astype(int))[:-1]
        rows = np.minimum(edges * per, len(self._t) - 1)
        return (
            np.asarray(self._t[rows]),
            np.fmin.reduceat(least[:, low:high], edges - low, axis=1),
            np.fmax.reduceat(largest[:, low:high], edges - low, axis=1),
        )
