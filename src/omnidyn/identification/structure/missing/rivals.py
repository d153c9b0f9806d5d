"""What robots do that no law of a robot file holds yet: rivals of the candidates, so that none stands in for them.

Where one of these explains more than all that is offered, the answer says what it looks like, and offers no remedy.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.linear.driven_motion import DrivenMotion
from omnidyn.identification.output_error.linear.workbench import Workbench
from omnidyn.identification.structure.missing.candidates import Candidate, Trial, as_it_is
from omnidyn.model.layout import N_AXES

Force = Callable[[DrivenMotion, float], FloatArray]
WAVES = (1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 9.0, 12.0, 24.0)  # a turn of a wheel


def unoffered() -> Iterator[Candidate]:
    """All of them."""
    for key, force, sizes in (
        ("friction one way", _one_way, (0.0,)),
        ("drag", _drag, (0.0,)),
        ("turns of the wheels", _waves, WAVES),
        ("sag", _sag, (0.0,)),
        ("heat", _heat, (0.0,)),
    ):
        yield Candidate(key, _tried(force, sizes), as_it_is("cause", key), is_offered=False)
    yield Candidate("filter", _filtered, as_it_is("cause", "filter"), is_offered=False)


def _tried(force: Force, sizes: tuple[float, ...]) -> Callable[[Workbench], list[Trial]]:
    def trials(bench: Workbench) -> list[Trial]:
        columns_by_size = bench.by_forces([lambda m, size=size: force(m, size) for size in sizes])
        return [Trial(columns, size) for columns, size in zip(columns_by_size, sizes, strict=True)]

    return trials


def _along_axes(values: FloatArray) -> FloatArray:
    """A force of its own on each axis, from sizes (n, 3)."""
    return np.eye(N_AXES) * values[:, None, :]


def _one_way(motion: DrivenMotion, _: float) -> FloatArray:
    return _along_axes((motion.twist != 0.0).astype(float))


def _drag(motion: DrivenMotion, _: float) -> FloatArray:
    return _along_axes(-motion.twist * np.abs(motion.twist))


def _waves(motion: DrivenMotion, count: float) -> FloatArray:
    g, turned_angles = motion.robot.wheels.wrench_matrix, motion.turned
    moving = (motion.twist @ g != 0.0).astype(float)
    waves = np.concatenate([np.cos(count * turned_angles) * moving, np.sin(count * turned_angles) * moving], axis=1)
    return waves[:, :, None] * np.concatenate([g, g], axis=1).T


def _sag(motion: DrivenMotion, _: float) -> FloatArray:
    draw = np.abs(motion.current).sum(axis=1, keepdims=True)
    return -((motion.voltage * draw) @ motion.robot.wheels.wrench_matrix.T)[:, None, :]


def _heat(motion: DrivenMotion, _: float) -> FloatArray:
    step = np.append(np.diff(motion.t), 0.0)[:, None]
    heat = np.cumsum(motion.current**2 * step, axis=0)
    return -((motion.current * heat) @ motion.robot.wheels.wrench_matrix.T)[:, None, :]


def _filtered(bench: Workbench) -> list[Trial]:
    """What a filter takes out beside the delay: the bend of every speed."""
    columns_by_piece = []
    for motion in bench.motions:
        level = motion.shown(motion.twist[:, None, :])
        bend = np.gradient(np.gradient(level, motion.t, axis=1), motion.t, axis=1)
        speed = np.array([name in ("twist", "wheel_speed") for name, _ in motion.piece.record.columns])
        columns_by_piece.append(np.where(speed[:, None, None], bend, 0.0))
    return [Trial(columns_by_piece)]
