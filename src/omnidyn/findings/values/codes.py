"""Cells that do not mean what they say: a number that stands for no value, and negative numbers read as unsigned."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.log_under_check import MIN_ROWS, LogUnderCheck
from omnidyn.logs.channels import place
from omnidyn.logs.columns.mapping import component_channel
from omnidyn.logs.log import MAX_MISSING
from omnidyn.sensors import BEHIND_GEAR
from omnidyn.statement import ERROR

CODES = frozenset((999, 9999, 99999, 999999, 32767, 32768, 65535, 2147483647, 2147483648, 4294967295))
FAR_RATIO = 3.0  # times all other values: what stands for no value lies so far out
WRAPS = (2.0**16, 2.0**32)  # a negative number of two or four bytes, read as unsigned, is so much too large
EITHER_SHARE = 0.01  # of the rows on either side of 0
Changed = tuple[list[Finding], LogUnderCheck, FloatArray]  # the findings, the work and the component without the fault
SIGNED = ("current", "wheel_speed", "voltage", "duty", "twist")


def check_codes(work: LogUnderCheck) -> tuple[list[Finding], LogUnderCheck]:
    """Findings on such cells; they are put right, or masked."""
    findings: list[Finding] = []
    if len(work) < MIN_ROWS:
        return findings, work
    for channel in work.channels:
        for component, values in work.sampled_columns(channel):
            new_findings, work, values = _wrapped(work, channel, component, values)
            also, work, _ = _placeholder(work, channel, component, values)
            findings += new_findings + also
    return findings, work


def _wrapped(work: LogUnderCheck, channel: str, component: str, values: FloatArray) -> Changed:
    """Values about 0 and values just below 2^16 (or 2^32), and nothing between."""
    size = _cell_size(work, component)
    cells = values / size
    wrap = next((size for size in WRAPS if 0.75 * size < np.nanmax(cells) < size), None)
    if channel not in SIGNED or wrap is None or np.nanmin(cells) < 0.0:
        return [], work, values
    with np.errstate(invalid="ignore"):
        low, high = cells < 0.25 * wrap, cells > 0.75 * wrap
        between = bool(((cells >= 0.25 * wrap) & (cells <= 0.75 * wrap)).any())
    if between or low.mean() < EITHER_SHARE or high.mean() < EITHER_SHARE:
        return [], work, values
    bits = round(np.log2(wrap))
    finding = Finding(
        "wrapped",
        ERROR,
        component,
        {"share": float(high.mean()), "bits": bits},
        rows=work.lines(high),
        count=int(high.sum()),
    )
    right = np.where(high, values - wrap * size, values)
    return [finding], _changed(work, channel, component, right), right


def _placeholder(work: LogUnderCheck, channel: str, component: str, values: FloatArray) -> Changed:
    """One number such as -999 or 65535 in some rows, far beyond everything else of its channel."""
    cells = values / _cell_size(work, component)
    size = np.abs(cells)
    top = float(np.nanmax(size))
    mask = size == top
    rest_level = float(np.max(size[~mask & np.isfinite(size)], initial=0.0))
    code = round(top) in CODES and abs(top - round(top)) <= 1e-9 * top
    if not code or mask.sum() < 2 or mask.mean() > MAX_MISSING or not 0.0 < FAR_RATIO * rest_level < top:
        return [], work, values
    cell = float(cells[np.flatnonzero(mask)[0]])
    finding = Finding(
        "placeholder",
        ERROR,
        component,
        {"cell": cell, "share": float(mask.mean()), "times": top / rest_level},
        rows=work.lines(mask),
        count=int(mask.sum()),
    )
    cleaned = np.where(mask, np.nan, values)
    return [finding], _changed(work, channel, component, cleaned), cleaned


def _changed(work: LogUnderCheck, channel: str, component: str, values: FloatArray) -> LogUnderCheck:
    column = work.channels[channel].copy()
    (column if column.ndim == 1 else column[:, place(component)[1]])[:] = values  # type: ignore[index]
    return work.replace(**{channel: column})


def _cell_size(work: LogUnderCheck, component: str) -> float:
    """What one of the file's units is in SI, gear and radius of the wheel included."""
    column = work.log.columns.columns.get(component)
    if column is None:
        return 1.0
    if work.robot is None or component_channel(component) not in BEHIND_GEAR:
        return column.factor
    return column.factor / column.divisor(work.robot, place(component)[1])  # type: ignore[index]
