"""Runs, estimates and comparisons as data frames of pandas or polars, with their units.

pandas holds source, warnings and units in `attrs`; polars has no place for them: there units are a column of a table,
and the ends of the names of a Run.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from omnidyn.campaigns.results import Campaign
from omnidyn.comparison.result import Comparison
from omnidyn.comparison.traces import unit as component_unit
from omnidyn.errors import InputError, MissingExtraError
from omnidyn.identification.estimate import Estimate
from omnidyn.identification.identification import Identification
from omnidyn.logs.run_file import run_columns, unit_of_column
from omnidyn.model.keys import unit
from omnidyn.run import Run

PANDAS, POLARS = "pandas", "polars"
LIBRARIES = (PANDAS, POLARS)
INSTALL = 'pip install "omnidyn[arrays]"'
METRICS = ("samples", "rmse", "max", "bias", "fit_percent", "vaf", "whiteness", "lag")


def to_dataframe(value: Run | Estimate | Identification | Comparison | Campaign, library: str = PANDAS) -> Any:
    """A data frame. Of a Run: columns u1_V, w1_rad_s, vx_m_s, ... over t_s; NaN where a value is missing.

    Of an Estimate: a row for each number, with value, std, its 95 % interval and unit. Of a Comparison: a row for each
    robot and component. Of a Campaign: a row for each sample. library: "pandas" or "polars". In pandas source,
    warnings and units stand in `attrs`.
    Raises MissingExtraError where the library is not installed, InputError for another one.
    """
    if library not in LIBRARIES:
        raise InputError(
            "no such library of data frames", got=library, expected=" or ".join(LIBRARIES), where="library"
        )
    module = _library(library)
    if isinstance(value, Run):
        return _of_run(value, module, library)
    if isinstance(value, Campaign):
        table = value.dataset().to_table()
        return table.to_pandas() if library == PANDAS else module.from_arrow(table)
    if isinstance(value, Identification):
        columns, attributes = _of_groups(value)
    elif isinstance(value, Estimate):
        columns, attributes = _of_estimate(value)
    else:
        columns, attributes = _of_comparison(value)
    frame = module.DataFrame(columns)
    if library == PANDAS:
        frame.attrs |= attributes
    return frame


def _library(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError:
        raise MissingExtraError(f"a data frame needs {name}", remedy=INSTALL) from None


def _of_run(run: Run, module: Any, library: str) -> Any:
    columns = run_columns(run)
    if library == POLARS:
        return module.DataFrame({name: np.ascontiguousarray(values) for name, values in columns.items()})
    units = {name: unit_of_column(name) for name in columns}
    index = module.Index(columns.pop("t_s"), name="t_s")
    frame = module.DataFrame(columns, index=index)
    frame.attrs |= {"source": run.source, "warnings": [*map(str, run.warnings)], "units": units}
    return frame


def _of_groups(result: Identification) -> tuple[Mapping[str, list[Any]], dict[str, Any]]:
    """The rows of all groups, with a column for the group where there are several."""
    if len(result.groups) == 1:
        return _of_estimate(result.estimate)
    if not result.groups:
        raise InputError("a study of motors has no data frame", expected="an identification of friction")
    tables = {group: _of_estimate(estimate) for group, estimate in result.groups.items()}
    names = [group for group, (columns, _) in tables.items() for _ in columns["parameter"]]
    first = next(iter(tables.values()))[0]
    columns = {name: [cell for columns, _ in tables.values() for cell in columns[name]] for name in first}
    return {"group": names, **columns}, {
        "warnings": [w for _, attributes in tables.values() for w in attributes["warnings"]]
    }


def _of_estimate(estimate: Estimate) -> tuple[Mapping[str, list[Any]], dict[str, Any]]:
    names = list(estimate.value)
    unknown = set(estimate.unidentifiable)
    determined = [name not in unknown for name in names]
    columns = {
        "parameter": names,
        "value": [float(estimate.value[name]) for name in names],
        "std": [float(estimate.std[name]) if k else np.nan for name, k in zip(names, determined, strict=True)],
        "low": [float(estimate.ci95[name][0]) if k else np.nan for name, k in zip(names, determined, strict=True)],
        "high": [float(estimate.ci95[name][1]) if k else np.nan for name, k in zip(names, determined, strict=True)],
        "unit": [unit(name) for name in names],
    }
    attributes = {
        "robot": estimate.robot.name,
        "method": estimate.method,
        "data": estimate.data,
        "warnings": [*map(str, estimate.warnings)],
        "units": dict(zip(names, columns["unit"], strict=True)),
    }
    return columns, attributes


def _of_comparison(comparison: Comparison) -> tuple[Mapping[str, list[Any]], dict[str, Any]]:
    rows = [
        (robot, name, metrics) for robot in comparison.robots for name, metrics in comparison.overall[robot].items()
    ]
    columns: dict[str, list[Any]] = {
        "robot": [robot for robot, _, _ in rows],
        "component": [name for _, name, _ in rows],
        "unit": [component_unit(name) for _, name, _ in rows],
    }
    for metric in METRICS:
        values = [getattr(metrics, metric) for _, _, metrics in rows]
        columns[metric] = values if metric == "samples" else [np.nan if v is None else float(v) for v in values]
    units = {
        "fit_percent": "%",
        "vaf": "%",
        "whiteness": "1",
        "lag": "s",
        "rmse": "unit",
        "max": "unit",
        "bias": "unit",
    }
    return columns, {"warnings": [*map(str, comparison.warnings)], "units": units}
