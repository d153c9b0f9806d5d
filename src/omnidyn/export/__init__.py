"""Export: a robot in the files of other tools. `omnidyn.export.KIND(robot)` gives them as text.

contract: the contract of a kind, and Export, what it gives. kinds: which there are. features: what a robot may have,
and what each kind does with it. spelling: numbers and names as the formats want them.
robot_json: the robot itself. code/: steps and controllers as C, an FMU. feedforward/: kS, kV, kA.
bodies/: MuJoCo, URDF, SDF. ros/: ROS 2. drives/: a program that a robot drives by itself.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from omnidyn.export.kinds import KINDS, maker, python_name

if TYPE_CHECKING:
    from omnidyn.export.contract import Export

__all__ = ["KINDS", *map(python_name, KINDS)]  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Callable[..., Export]:
    kinds = {python_name(kind): kind for kind in KINDS}
    if name not in kinds:
        raise AttributeError(f"module 'omnidyn.export' has no attribute {name!r}")
    return maker(kinds[name])


def __dir__() -> list[str]:
    return sorted(__all__)
