"""A Run as an xarray Dataset: one variable a channel, over time and wheel or axis, with its unit."""

from __future__ import annotations

from typing import Any

import numpy as np

from omnidyn.errors import MissingExtraError
from omnidyn.run import CHANNELS, SCALAR, UNITS, WHEEL, Run

TIME, WHEELS, AXES = "time", "wheel", "axis"
NAMES = {"twist": ("vx", "vy", "omega"), "twist_command": ("vx", "vy", "omega"), "pose": ("x", "y", "heading")}
AXIS_NAMES = ["x", "y", "yaw"]


def to_xarray(run: Run) -> Any:
    """A Dataset: a variable for each channel, with dimensions time, and wheel (from 1) or axis (x, y, yaw).

    Units stand in the `units` of each variable, those of axes one after the other; source and warnings in the
    attributes of the Dataset. Raises MissingExtraError where xarray is not installed.
    """
    try:
        import xarray  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise MissingExtraError("a Dataset needs xarray", remedy='pip install "omnidyn[arrays]"') from None
    variables: dict[str, Any] = {}
    coordinates: dict[str, Any] = {TIME: (TIME, run.t, {"units": "s"})}
    for name, values in run.channels.items():
        kind = CHANNELS[name]
        second = {WHEEL: (WHEELS,), SCALAR: ()}.get(kind, (AXES,))
        about: dict[str, Any] = {"units": UNITS[name]}
        if name in NAMES:
            about["components"] = list(NAMES[name])
        variables[name] = ((TIME, *second), values, about)
        if kind == WHEEL:
            coordinates[WHEELS] = (WHEELS, np.arange(1, values.shape[1] + 1), {})
        elif kind != SCALAR:
            coordinates[AXES] = (AXES, AXIS_NAMES, {})
    return xarray.Dataset(variables, coordinates, {"source": run.source, "warnings": [*map(str, run.warnings)]})
