"""In which steps the inputs of a log are written: what was applied may lie half a step beside what stands there."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.problem.record import Record

LEVELS = 12  # of different size, from which on it is no chance that all are whole steps
PARTS = 4  # of the least difference of two levels, of which the step may be one
STEP_TOLERANCE = 0.02  # of a step, by which a level may be beside it: the text of a log is rounded, too
LEAST_STEP = 1e-3  # of the largest input, below which a step does not matter
LEVEL_TOLERANCE = 1e-6  # of the largest input: what is nearer is the same, written otherwise
SAMPLE_INPUTS = 200  # inputs, which tell soon of most logs that theirs are in no steps


def as_logged(record: Record) -> FloatArray:
    """The inputs as they were written: voltages [V], or else duties. Shape (rows, W).

    A limit would make a level of its own of them, and a supply that is logged a change of every row.
    """
    run = record.run
    if run is None or record.set_point is not None:
        return record.voltage
    return next(
        (input_columns for input_columns in (run.voltage, run.duty) if input_columns is not None), record.voltage
    )


def input_steps(record: Record) -> FloatArray:
    """The step of the voltage of each wheel [V], that of a duty times the supply; 0 where there is none. (W,)."""
    run = record.run
    if run is None or record.set_point is not None:
        return np.zeros(record.voltage.shape[1])
    inputs = as_logged(record)
    steps = np.array([_step(column) for column in inputs.T])
    if run.voltage is not None or run.duty is None or not steps.any():
        return steps
    driven_rows = np.abs(inputs) > 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        supply = np.median(np.abs(record.voltage / inputs)[driven_rows & np.isfinite(record.voltage)])
    return steps * float(supply)


def _step(column: FloatArray) -> float:
    """The step of one input, by the levels that it holds: all are whole steps."""
    change_rows = np.flatnonzero(np.diff(column) != 0.0) + 1
    if len(change_rows) < LEVELS:
        return 0.0
    held_levels = np.abs(column[change_rows])
    held_levels = held_levels[np.isfinite(held_levels)]
    largest = float(held_levels.max(initial=0.0))
    if (
        _apart(held_levels[:SAMPLE_INPUTS], largest).min(initial=largest) < LEAST_STEP * largest
    ):  # nor are those of all of them further apart
        return 0.0
    levels, level_steps = np.unique(np.concatenate([[0.0], held_levels])), _apart(held_levels, largest)
    if len(level_steps) < LEVELS:
        return 0.0
    for parts in range(1, PARTS + 1):
        step = float(level_steps.min()) / parts
        if step < LEAST_STEP * largest:
            return 0.0
        distance = np.abs(levels / step - np.round(levels / step))
        if distance.max() <= STEP_TOLERANCE:
            return step
    return 0.0


def _apart(held_levels: FloatArray, largest: float) -> FloatArray:
    """The differences of levels, 0 among them."""
    level_steps = np.diff(np.sort(np.concatenate([[0.0], held_levels])))
    return level_steps[level_steps > LEVEL_TOLERANCE * largest]
