"""A Run as an xarray Dataset: one variable a channel, over time and wheel or axis, with its unit."""

from __future__ import annotations

from typing import Any

import numpy as np

from omnidyn.campaigns.folder import SAMPLE
from omnidyn.campaigns.results import Campaign
from omnidyn.campaigns.spec import GRID
from omnidyn.errors import MissingExtraError
from omnidyn.run import CHANNELS, SCALAR, UNITS, WHEEL, Run

TIME, WHEELS, AXES = "time", "wheel", "axis"
NAMES = {"twist": ("vx", "vy", "omega"), "twist_command": ("vx", "vy", "omega"), "pose": ("x", "y", "heading")}
AXIS_NAMES = ["x", "y", "yaw"]


def to_xarray(run: Run | Campaign) -> Any:
    """A Dataset: a variable for each channel, with dimensions time, and wheel (from 1) or axis (x, y, yaw).

    Units stand in the `units` of each variable, those of axes one after the other; source and warnings in the
    attributes of the Dataset. Of a campaign: a variable for each metric, over the samples or the levels of a grid.
    Raises MissingExtraError where xarray is not installed.
    """
    try:
        import xarray  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise MissingExtraError("a Dataset needs xarray", remedy='pip install "omnidyn[arrays]"') from None
    if isinstance(run, Campaign):
        return xarray.Dataset(*_of_campaign(run))
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


def _of_campaign(campaign: Campaign) -> tuple[dict[str, Any], dict[str, Any]]:
    """Variables and coordinates of a campaign."""
    spec, names = campaign.folder.spec, campaign.variables
    columns = {name: campaign.column(name) for name in (*names, *campaign.metrics)}
    if spec.sampling != GRID or not campaign.status.complete:
        samples = {SAMPLE: (SAMPLE, campaign.column(SAMPLE))} | {name: (SAMPLE, columns[name]) for name in names}
        return {name: (SAMPLE, columns[name]) for name in campaign.metrics}, samples
    grid = {name: columns[name].reshape(spec.levels) for name in columns}
    levels = {
        name: (name, np.moveaxis(grid[name], k, 0).reshape(spec.levels[k], -1)[:, 0]) for k, name in enumerate(names)
    }
    return {name: (names, grid[name]) for name in campaign.metrics}, levels
