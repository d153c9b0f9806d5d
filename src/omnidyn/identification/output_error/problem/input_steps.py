"""In which steps the inputs of a log are written: what was applied may lie half a step beside what stands there."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.problem.record import Record

LEVELS = 12  # of different size, from which on it is no chance that all are whole steps
PARTS = 4  # of the least difference of two levels, of which the step may be one
WHOLE = 0.02  # of a step, by which a level may be beside it: the text of a log is rounded, too
LEAST = 1e-3  # of the largest input, below which a step does not matter
SAME = 1e-6  # of the largest input: what is nearer is the same, written otherwise
FEW = 200  # inputs, which tell soon of most logs that theirs are in no steps


def as_logged(record: Record) -> FloatArray:
    """The inputs as they were written: voltages [V], or else duties. Shape (rows, W).

    A limit would make a level of its own of them, and a supply that is logged a change of every row.
    """
    run = record.run
    if run is None or record.set_point is not None:
        return record.voltage
    return next((each for each in (run.voltage, run.duty) if each is not None), record.voltage)


def input_steps(record: Record) -> FloatArray:
    """The step of the voltage of each wheel [V], that of a duty times the supply; 0 where there is none. (W,)."""
    run = record.run
    if run is None or record.set_point is not None:
        return np.zeros(record.voltage.shape[1])
    inputs = as_logged(record)
    steps = np.array([_step(column) for column in inputs.T])
    if run.voltage is not None or run.duty is None or not steps.any():
        return steps
    driven = np.abs(inputs) > 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        supply = np.median(np.abs(record.voltage / inputs)[driven & np.isfinite(record.voltage)])
    return steps * float(supply)


def _step(column: FloatArray) -> float:
    """The step of one input, by the levels that it holds: all are whole steps."""
    changed = np.flatnonzero(np.diff(column) != 0.0) + 1
    if len(changed) < LEVELS:
        return 0.0
    held = np.abs(column[changed])
    held = held[np.isfinite(held)]
    largest = float(held.max(initial=0.0))
    if _apart(held[:FEW], largest).min(initial=largest) < LEAST * largest:  # nor are those of all of them further apart
        return 0.0
    levels, apart = np.unique(np.concatenate([[0.0], held])), _apart(held, largest)
    if len(apart) < LEVELS:
        return 0.0
    for parts in range(1, PARTS + 1):
        step = float(apart.min()) / parts
        if step < LEAST * largest:
            return 0.0
        beside = np.abs(levels / step - np.round(levels / step))
        if beside.max() <= WHOLE:
            return step
    return 0.0


def _apart(held: FloatArray, largest: float) -> FloatArray:
    """The differences of levels, 0 among them."""
    apart = np.diff(np.sort(np.concatenate([[0.0], held])))
    return apart[apart > SAME * largest]
