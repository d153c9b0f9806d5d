"""What of a Run a fit is made to: columns of outputs, the ticks of those that are counts, and what is left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError, UnsupportedError
from omnidyn.identification.output_error.kernel.counts import find_tick
from omnidyn.identification.output_error.problem.redundant import redundant
from omnidyn.model.motor import DYNAMIC
from omnidyn.model.robot import Robot
from omnidyn.run import Run
from omnidyn.simulation.exact.march import why_not_exact

OUTPUTS = ("twist", "wheel_speed", "current", "heading", "position", "wheel_angle")
POSE, PARTS = "pose", ("heading", "position")
EXACT_ONLY = ("position", "wheel_angle")  # what the implicit engine has no slopes of
TRAVEL = ("heading", "position", "wheel_angle")


@dataclass(frozen=True, eq=False)
class Outputs:
    """columns: (channel, index) each; values (rows, C); ticks (C,): of counts [rad], 0 for others; notes in words."""

    columns: tuple[tuple[str, int], ...]
    values: FloatArray
    ticks: tuple[float, ...]
    notes: tuple[str, ...]


def outputs_of(
    run: Run, robot: Robot, wanted: Sequence[str] | None, tick_rad: float | None, looped: bool = False
) -> Outputs:
    """wanted: names of OUTPUTS, "pose" for two of them; None for all that the log has and that do not say it twice.

    tick_rad: of the angles of the wheels; None: found in the log; 0: they are taken like any other output. looped:
    whether set speeds drive the robot; neither this nor an implicit robot is fitted to positions and angles.
    Raises InputError for an unknown name and for a log without any of them.
    """
    wanted = wanted if wanted is None else [each for name in wanted for each in (PARTS if name == POSE else (name,))]
    unknown = [name for name in wanted or () if name not in OUTPUTS]
    if unknown:
        raise InputError("no such output", got=unknown[0], expected=", ".join((*OUTPUTS, POSE)), where="outputs")
    found = {name: value for name in OUTPUTS if (value := _measured(run, name)) is not None}
    if wanted is not None:
        found = {name: value for name, value in found.items() if name in wanted}
    elif found.keys() & set(EXACT_ONLY) and (looped or why_not_exact(robot) or robot.motor.electrical == DYNAMIC):
        found = {name: value for name, value in found.items() if name not in EXACT_ONLY}
    if not found:
        raise InputError(
            "the log has no output to fit", got=", ".join(run.channels) or "no channels",
            expected=", ".join(wanted or OUTPUTS), where=run.source,
        )  # fmt: skip
    found, notes = _without_doubles(run, robot, found, wanted is not None)
    if "position" in found and "heading" not in found:  # where the robot faces at the start is fitted all the same
        found["heading"] = np.full((len(run), 1), np.nan)
    found = {name: found[name] for name in OUTPUTS if name in found}
    columns = tuple((name, i) for name, value in found.items() for i in range(value.shape[1]))
    ticks = tuple(_tick(found[name][:, i], tick_rad) if name == "wheel_angle" else 0.0 for name, i in columns)
    values = next(iter(found.values())) if len(found) == 1 else np.hstack(list(found.values()))
    return Outputs(columns, np.ascontiguousarray(values), ticks, tuple(notes))


def _measured(run: Run, name: str) -> FloatArray | None:
    """The channel of an output, None where nothing of it was measured."""
    if name in PARTS:
        value = None if run.pose is None else run.pose[:, 2:] if name == "heading" else run.pose[:, :2]
    else:
        value = getattr(run, name)
    return value if value is not None and np.isfinite(value).any() else None


def _without_doubles(
    run: Run, robot: Robot, found: dict[str, FloatArray], asked: bool
) -> tuple[dict[str, FloatArray], list[str]]:
    """Without outputs that are computed from another one; where they were asked for, with a warning instead."""
    if not found.keys() & set(TRAVEL):
        return found, []
    notes = []
    for name, source in redundant(run, robot).items():
        if name not in found or source not in found:
            continue
        same = (
            "its wheel speeds are differences of its wheel angles" if name == "wheel_speed"
            else f"its {name} is the integral of its own {source.replace('_', ' ')}"
        )  # fmt: skip
        if asked:
            notes.append(f"{same}: the same data count twice, and the intervals are too narrow")
        else:
            found = {key: value for key, value in found.items() if key != name}
            notes.append(f"{same}: the {name.replace('_', ' ')} says nothing new and is not fitted")
    return found, notes


def _tick(values: FloatArray, given: float | None) -> float:
    return find_tick(values) if given is None else given


def refuse_exact_only(columns: Sequence[tuple[str, int]], where: str) -> None:
    """Raises UnsupportedError for outputs that only the exact engine knows."""
    found = sorted({name for name, _ in columns} & set(EXACT_ONLY))
    if found:
        raise UnsupportedError(
            "this output is fitted by the exact engine only", got=", ".join(found), where=where,
            expected=", ".join(name for name in OUTPUTS if name not in EXACT_ONLY),
            remedy="leave it out of the outputs; twist, wheel speeds and heading tell of the same motion",
        )  # fmt: skip
