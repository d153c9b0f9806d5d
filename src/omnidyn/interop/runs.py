"""A Run from a data frame with the columns of a run file, or from an xarray Dataset as `to_xarray` makes it."""

from __future__ import annotations

from typing import Any

import numpy as np

from omnidyn.arguments import is_number
from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.interop.dataset import TIME
from omnidyn.logs.run_file import run_of_columns
from omnidyn.run import CHANNELS, Run
from omnidyn.statement import Statement, statements

REMEDY = "write it to CSV and read it with omnidyn.read_log, which knows names and units of other columns"


def run_of(frame: Any) -> Run:
    """The Run in a data frame or a Dataset, to the last bit what `to_dataframe` or `to_xarray` made of it.

    A data frame has the columns of a run file: t_s (or as its index), u1_V, w1_rad_s, vx_m_s, ... A Dataset has
    channels as variables. Raises InputError for other columns, for what is no number, for times that do not increase.
    """
    if hasattr(frame, "data_vars"):
        return _of_dataset(frame)
    attributes = getattr(frame, "attrs", {})
    columns = {str(name): _numbers(str(name), frame[name]) for name in frame.columns}
    index = getattr(frame, "index", None)
    if "t_s" not in columns and index is not None and index.name == "t_s":
        columns = {"t_s": _numbers("t_s", index), **columns}
    source = attributes.get("source") or f"a {type(frame).__module__.partition('.')[0]} data frame"
    return run_of_columns(columns, source, _statements(attributes.get("warnings")), REMEDY)


def _of_dataset(dataset: Any) -> Run:
    unknown = sorted(str(name) for name in dataset.data_vars if name not in CHANNELS)
    if unknown or TIME not in dataset.coords:
        raise InputError(
            "not the variables of a run",
            got=", ".join(unknown) or f"no coordinate {TIME}",
            expected=f"{TIME}, and some of {', '.join(CHANNELS)}",
            remedy="name them like Run.to_xarray() does",
        )
    channels = {}
    for name, variable in dataset.data_vars.items():
        dimensions = [dimension for dimension in variable.dims if dimension != TIME]
        channels[str(name)] = _numbers(str(name), variable.transpose(TIME, *dimensions))
    return Run(
        t=_numbers(TIME, dataset.coords[TIME]),
        source=str(dataset.attrs.get("source", "an xarray Dataset")),
        warnings=_statements(dataset.attrs.get("warnings")),
        **channels,
    )


def _statements(value: Any) -> tuple[Statement, ...]:
    return statements(map(str, value)) if isinstance(value, list | tuple) else ()


def _numbers(name: str, values: Any) -> FloatArray:
    """Values as float64; what is missing is NaN. Raises InputError for words, dates and truth values."""
    plain = values.to_numpy()
    if plain.dtype.kind not in "fiu" and not _only_missing_and_numbers(plain):
        raise InputError("not numbers", got=f"{plain.dtype}", expected="numbers", where=f"column {name}")
    if plain.dtype.kind == "O":
        plain = np.array([np.nan if value is None or value != value else value for value in plain.ravel()], dtype=float)
    numbers = np.array(plain, dtype=float)
    if np.isinf(numbers).any():
        raise InputError(
            "an infinite value", got="inf", expected="a number, or NaN where missing", where=f"column {name}"
        )
    return numbers


def _only_missing_and_numbers(values: Any) -> bool:
    return values.dtype.kind == "O" and all(value is None or is_number(value) for value in values.ravel())
