"""What of a Run a fit is made to: columns of outputs, the ticks of those that are counts, and what is left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.errors import InputError
from omnidyn.identification.output_error.problem.differences import Differences, added_up
from omnidyn.identification.output_error.problem.redundant_channels import redundant
from omnidyn.model.robot import Robot
from omnidyn.run import Run
from omnidyn.sensors import COUNTED, MEASURED, OUTPUTS, PREDICTED, TABLE, TRAVEL
from omnidyn.statement import NOTE, WARNING, Statement
from omnidyn.statistics import find_tick

SPEEDS = ("twist", "wheel_speed")
LOG = "log"  # what a log without a name is called


@dataclass(frozen=True, eq=False)
class Outputs:
    """columns: (channel, index) each; values (rows, C); ticks (C,): of counts [rad], 0 for others.

    notes: what was decided on the way.

    unused_notes: what was measured and is not fitted, and why. lost (rows,): rows before which a wheel may have
    turned by any angle, None where nothing was added up.
    """

    columns: tuple[tuple[str, int], ...]
    values: FloatArray
    ticks: tuple[float, ...]
    notes: tuple[Statement, ...]
    unused_notes: tuple[Statement, ...]
    lost: BoolArray | None = None


def outputs_of(
    run: Run,
    robot: Robot,
    wanted_names: Sequence[str] | None,
    tick_rad: float | None,
    count_differences: Differences | None = None,
) -> Outputs:
    """wanted_names: names of OUTPUTS, "pose" for two of them; None for all that the log has and that do not say it
    twice.

    tick_rad: of the angles of the wheels; None: found in the log; 0: they are taken like any other output.
    count_differences: what the wheel speeds are differences of: they are fitted as angles.
    Raises InputError for an unknown name and for a log without any of them.
    """
    wanted_names = (
        wanted_names
        if wanted_names is None
        else [part for name in wanted_names for part in (TABLE[name].outputs if name in TABLE else (name,))]
    )
    unknown = [name for name in wanted_names or () if name not in OUTPUTS]
    if unknown:
        raise InputError(
            "no such output", got=unknown[0], expected=", ".join(dict.fromkeys((*OUTPUTS, *PREDICTED))), where="outputs"
        )
    values_by_output = {name: value for name in OUTPUTS if (value := _measured(run, name)) is not None}
    unused_notes = [
        Statement("output_not_asked", NOTE, name)
        for name in values_by_output
        if wanted_names is not None and name not in wanted_names
    ]
    if wanted_names is not None:
        values_by_output = {name: value for name, value in values_by_output.items() if name in wanted_names}
    if not values_by_output:
        raise InputError(
            "the log has no output to fit",
            got=", ".join(run.channels) or "no channels",
            expected=", ".join(wanted_names or OUTPUTS),
            where=run.source,
        )
    values_by_output, notes = _without_doubles(run, robot, values_by_output, wanted_names is not None)
    values_by_output, given_tick, lost_rows = _counted(run, values_by_output, count_differences, notes)
    if (
        "position" in values_by_output and "heading" not in values_by_output
    ):  # where the robot faces at the start is fitted all the same
        values_by_output["heading"] = np.full((len(run), 1), np.nan)
    values_by_output = {name: values_by_output[name] for name in OUTPUTS if name in values_by_output}
    columns = tuple((name, i) for name, value in values_by_output.items() for i in range(value.shape[1]))
    ticks = tuple(
        0.0
        if name not in COUNTED
        else float(given_tick[i])
        if given_tick is not None
        else _tick(values_by_output[name][:, i], tick_rad)
        for name, i in columns
    )
    values = (
        next(iter(values_by_output.values()))
        if len(values_by_output) == 1
        else np.hstack(list(values_by_output.values()))
    )
    return Outputs(columns, np.ascontiguousarray(values), ticks, tuple(notes), tuple(unused_notes), lost_rows)


def _measured(run: Run, name: str) -> FloatArray | None:
    """The channel of an output, None where nothing of it was measured."""
    channel, columns = MEASURED[name]
    value = getattr(run, channel)
    return value[:, columns] if value is not None and np.isfinite(value[:, columns]).any() else None


def _without_doubles(
    run: Run, robot: Robot, values_by_output: dict[str, FloatArray], is_asked: bool
) -> tuple[dict[str, FloatArray], list[Statement]]:
    """Without outputs that are computed from another one; where they were asked for, with a warning instead."""
    if not values_by_output.keys() & set(TRAVEL) and not set(SPEEDS) <= values_by_output.keys():
        return values_by_output, []
    notes = []
    for name, source in redundant(run, robot).items():
        if name not in values_by_output or source not in values_by_output:
            continue
        output_pair = {"output": name, "computed_from": source}
        if is_asked:
            notes.append(Statement("same_data_twice", WARNING, run.source or LOG, output_pair))
        else:
            values_by_output = {key: value for key, value in values_by_output.items() if key != name}
            notes.append(Statement("nothing_new", NOTE, run.source or LOG, output_pair))
    return values_by_output, notes


def _counted(
    run: Run, values_by_output: dict[str, FloatArray], count_differences: Differences | None, notes: list[Statement]
) -> tuple[dict[str, FloatArray], FloatArray | None, BoolArray | None]:
    """(the outputs, speeds that are differences of counts as angles; ticks of these, rows before which one is lost)."""
    rate = next((name for name in values_by_output if TABLE[MEASURED[name][0]].integral), "")
    if count_differences is None or not rate or TABLE[rate].integral in values_by_output:
        return values_by_output, None, None
    tick = {"tick": float(np.median(count_differences.ticks))}
    if count_differences.reason is not None:
        notes.append(Statement("counts_as_readings", NOTE, run.source or LOG, tick | {"why": count_differences.reason}))
        return values_by_output, None, None
    angle, lost = added_up(run, count_differences)
    notes.append(Statement("counts_added_up", NOTE, run.source or LOG, tick))
    return (
        {name: value for name, value in values_by_output.items() if name != rate} | {TABLE[rate].integral: angle},
        count_differences.ticks,
        lost,
    )


def _tick(values: FloatArray, given_tick: float | None) -> float:
    return find_tick(values) if given_tick is None else given_tick
