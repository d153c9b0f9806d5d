"""What other tools of Python read and give: functions on a Run, so that run.py knows none of them.

dataframe: pandas and polars, of a Run, an Estimate, a Comparison. dataset: xarray. runs: a Run from any of these.
systems: python-control. gymnasium: environments. kinds: which files of other tools are read as a robot; robot_json,
urdf, mjcf: how; parts: a robot from masses and axles.
lerobot: a robot of LeRobot as a connection of `drive`.
mjcf_parts: what is read of a MuJoCo model.
dataset: a Run as an xarray Dataset.
"""

from __future__ import annotations

import importlib
from typing import Any

_HOME = {
    "LeRobotConnection": "omnidyn.interop.lerobot",
    "import_robot": "omnidyn.interop.kinds",
    "linear_system": "omnidyn.interop.systems",
    "nonlinear_system": "omnidyn.interop.systems",
    "run_of": "omnidyn.interop.runs",
    "to_dataframe": "omnidyn.interop.dataframe",
    "to_xarray": "omnidyn.interop.dataset",
}

__all__ = [*_HOME]  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'omnidyn.interop' has no attribute {name!r}")
    return getattr(importlib.import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
