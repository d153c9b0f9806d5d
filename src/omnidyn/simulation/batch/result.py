"""What a batch of robots did: at its end, at samples on the way, or in statistics of all steps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.statement import Statement


class BatchState(NamedTuple):
    """Where n robots are: twist [m/s, m/s, rad/s] and pose [m, m, rad], shape (n, 3); pose is None where none is kept.

    failed (n,): robots that cannot go on; their numbers are NaN until they are reset.
    """

    twist: FloatArray
    pose: FloatArray | None
    failed: BoolArray


class Statistics(NamedTuple):
    """Over the ends of all steps, robot by robot: of rows, or of their substeps. Shape (n, 3) each."""

    mean: FloatArray
    rms: FloatArray
    least: FloatArray
    largest: FloatArray


@dataclass(frozen=True, eq=False, repr=False)
class BatchRun:
    """What n robots did under rows of commands.

    end: the state after the last row. engines: name of an engine -> number of robots that it moved.
    t [s], shape (samples,), the start included; twists, poses: at these times, shape (n, samples, 3); None unless
    `every` was given. twist_statistics, pose_statistics: None unless `statistics` was.
    warnings: what may make its numbers wrong.
    """

    end: BatchState
    engines: Mapping[str, int]
    t: FloatArray | None = None
    twists: FloatArray | None = None
    poses: FloatArray | None = None
    twist_statistics: Statistics | None = None
    pose_statistics: Statistics | None = None
    warnings: tuple[Statement, ...] = ()

    def __repr__(self) -> str:
        engines = ", ".join(f"{count} by the {name}" for name, count in self.engines.items())
        return f"<BatchRun of {len(self.end.failed)} robots: {engines}; {int(self.end.failed.sum())} failed>"
