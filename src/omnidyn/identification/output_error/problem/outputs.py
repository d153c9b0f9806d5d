"""What of a Run a fit is made to: columns of outputs, the ticks of those that are counts, and what is left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.errors import InputError
from omnidyn.identification.output_error.problem.differences import Differences, added_up
from omnidyn.identification.output_error.problem.redundant import redundant
from omnidyn.model.robot import Robot
from omnidyn.run import Run
from omnidyn.statement import NOTE, WARNING, Statement
from omnidyn.statistics import find_tick

OUTPUTS = ("twist", "wheel_speed", "current", "heading", "position", "wheel_angle")
POSE, PARTS = "pose", ("heading", "position")
SPEEDS = ("twist", "wheel_speed")
LOG = "log"  # what a log without a name is called
TRAVEL = ("heading", "position", "wheel_angle")


@dataclass(frozen=True, eq=False)
class Outputs:
    """columns: (channel, index) each; values (rows, C); ticks (C,): of counts [rad], 0 for others.

    notes: what was decided on the way.

    unused: what was measured and is not fitted, and why. lost (rows,): rows before which a wheel may have
    turned by any angle, None where nothing was added up.
    """

    columns: tuple[tuple[str, int], ...]
    values: FloatArray
    ticks: tuple[float, ...]
    notes: tuple[Statement, ...]
    unused: tuple[Statement, ...]
    lost: BoolArray | None = None


def outputs_of(
    run: Run, robot: Robot, wanted: Sequence[str] | None, tick_rad: float | None, counted: Differences | None = None
) -> Outputs:
    """wanted: names of OUTPUTS, "pose" for two of them; None for all that the log has and that do not say it twice.

    tick_rad: of the angles of the wheels; None: found in the log; 0: they are taken like any other output.
    counted: what the wheel speeds are differences of: they are fitted as angles.
    Raises InputError for an unknown name and for a log without any of them.
    """
    wanted = wanted if wanted is None else [each for name in wanted for each in (PARTS if name == POSE else (name,))]
    unknown = [name for name in wanted or () if name not in OUTPUTS]
    if unknown:
        raise InputError("no such output", got=unknown[0], expected=", ".join((*OUTPUTS, POSE)), where="outputs")
    found = {name: value for name in OUTPUTS if (value := _measured(run, name)) is not None}
    unused = [Statement("output_not_asked", NOTE, name) for name in found if wanted is not None and name not in wanted]
    if wanted is not None:
        found = {name: value for name, value in found.items() if name in wanted}
    if not found:
        raise InputError(
            "the log has no output to fit", got=", ".join(run.channels) or "no channels",
            expected=", ".join(wanted or OUTPUTS), where=run.source,
        )  # fmt: skip
    found, notes = _without_doubles(run, robot, found, wanted is not None)
    found, given, lost = _counted(run, found, counted, notes)
    if "position" in found and "heading" not in found:  # where the robot faces at the start is fitted all the same
        found["heading"] = np.full((len(run), 1), np.nan)
    found = {name: found[name] for name in OUTPUTS if name in found}
    columns = tuple((name, i) for name, value in found.items() for i in range(value.shape[1]))
    ticks = tuple(
        0.0 if name != "wheel_angle" else float(given[i]) if given is not None else _tick(found[name][:, i], tick_rad)
        for name, i in columns
    )  # fmt: skip
    values = next(iter(found.values())) if len(found) == 1 else np.hstack(list(found.values()))
    return Outputs(columns, np.ascontiguousarray(values), ticks, tuple(notes), tuple(unused), lost)


def _measured(run: Run, name: str) -> FloatArray | None:
    """The channel of an output, None where nothing of it was measured."""
    if name in PARTS:
        value = None if run.pose is None else run.pose[:, 2:] if name == "heading" else run.pose[:, :2]
    else:
        value = getattr(run, name)
    return value if value is not None and np.isfinite(value).any() else None


def _without_doubles(
    run: Run, robot: Robot, found: dict[str, FloatArray], asked: bool
) -> tuple[dict[str, FloatArray], list[Statement]]:
    """Without outputs that are computed from another one; where they were asked for, with a warning instead."""
    if not found.keys() & set(TRAVEL) and not set(SPEEDS) <= found.keys():
        return found, []
    notes = []
    for name, source in redundant(run, robot).items():
        if name not in found or source not in found:
            continue
        both = {"output": name, "computed_from": source}
        if asked:
            notes.append(Statement("same_data_twice", WARNING, run.source or LOG, both))
        else:
            found = {key: value for key, value in found.items() if key != name}
            notes.append(Statement("nothing_new", NOTE, run.source or LOG, both))
    return found, notes


def _counted(
    run: Run, found: dict[str, FloatArray], counted: Differences | None, notes: list[Statement]
) -> tuple[dict[str, FloatArray], FloatArray | None, BoolArray | None]:
    """(the outputs, speeds that are differences of counts as angles; ticks of these, rows before which one is lost)."""
    if counted is None or "wheel_speed" not in found or "wheel_angle" in found:
        return found, None, None
    tick = {"tick": float(np.median(counted.ticks))}
    if counted.why is not None:
        notes.append(Statement("counts_as_readings", NOTE, run.source or LOG, tick | {"why": counted.why}))
        return found, None, None
    angle, lost = added_up(run, counted)
    notes.append(Statement("counts_added_up", NOTE, run.source or LOG, tick))
    return (
        {name: value for name, value in found.items() if name != "wheel_speed"} | {"wheel_angle": angle},
        counted.ticks,
        lost,
    )


def _tick(values: FloatArray, given: float | None) -> float:
    return find_tick(values) if given is None else given
