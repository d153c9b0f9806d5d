"""Run files: a Run as CSV or Parquet, to the last bit.

    t_s,u1_V..,d1_duty..,i1_A..,a1_rad..,w1_rad_s..,w1_cmd_rad_s..,vx_m_s,vy_m_s,omega_rad_s,
    vx_cmd_m_s,vy_cmd_m_s,omega_cmd_rad_s,x_m,y_m,heading_rad,supply_V,f1_N..

A channel that was not measured has no columns. In CSV a missing value is an empty cell, and numbers are written with
the shortest digits that read back as the same float. In Parquet a missing value is NaN, and each column has its unit.
Source and warnings of a Run are not in the file.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from omnidyn.arguments import check_order
from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.files import check_output, write_atomic
from omnidyn.logs.channels import components, si_suffix
from omnidyn.logs.mat_file import columns_to_mat
from omnidyn.logs.mcap_run import import_mcap, run_to_mcap
from omnidyn.logs.readers.parquet import SUFFIXES, import_pyarrow, parquet_bytes
from omnidyn.logs.readers.read_table import READERS, read_table
from omnidyn.logs.table.table import FileTable
from omnidyn.run import CHANNELS, SCALAR, Run, as_run
from omnidyn.statement import Statement, statements
from omnidyn.units import DUTY, known_unit, parse_unit

_SUFFIXES = (
    "rad_s",
    "m_s",
    "duty",
    "rad",
    "V",
    "A",
    "m",
    "N",
    "s",
)  # as channels.si_suffix gives them, long before short
_SHEETS = frozenset((".xlsx", ".xls", ".xlsm", ".ods"))
_OTHER_SUFFIXES = _SHEETS | frozenset(
    (
        ".npz",
        ".npy",
        ".hdf",
        ".ulg",
        ".json",
        ".toml",
        ".html",
        ".pdf",
        ".png",
        ".svg",
        ".pkl",
        ".pickle",
        ".feather",
        ".arrow",
        ".zip",
        ".gz",
        ".bz2",
        ".xz",
        ".zst",
    )
)
MCAP, MAT = ".mcap", ".mat"
_READ = {suffix for reader in READERS for suffix in reader.suffixes} - {*SUFFIXES, MCAP, MAT}  # and not written
_UNIT_OF_DUTY = ("duty", "-", "1")


def columns_of(channel: str, wheels: int) -> list[str]:
    """Names of the columns of a channel, such as u1_V, u2_V, u3_V."""
    return [f"{component}_{si_suffix(component)}" for component in components(channel, wheels)]


def write_run(run: Run, path: str | os.PathLike, force: bool = False) -> Path:
    """Write a run, whole or not at all: as its name ends: .parquet, .mcap (ROS 2), .mat, else CSV.

    Raises InputError when the file exists (unless `force`) or cannot be written, and MissingExtraError for Parquet
    without pyarrow, for MCAP without mcap.
    """
    check_order("write_run(run, path)", (run, Run), (path, (str, os.PathLike)))
    run = as_run(run)
    check_format(path)
    check_output(path, force)
    return write_atomic(path, _content(run, Path(path).suffix.lower()), force)


def _content(run: Run, suffix: str) -> str | bytes:
    """The run in the format of a name that ends so."""
    if suffix == MCAP:
        return run_to_mcap(run)
    if suffix == MAT:
        return columns_to_mat(run_columns(run))
    return run_to_parquet(run) if suffix in SUFFIXES else run_to_csv(run)


def check_format(path: str | os.PathLike) -> None:
    """Raises InputError for the name of another format, and MissingExtraError for a Parquet file without pyarrow."""
    suffix = Path(path).suffix.lower()
    if suffix in SUFFIXES:
        import_pyarrow(str(path))
    if suffix == MCAP:
        import_mcap(str(path))
    if suffix in _OTHER_SUFFIXES | _READ:
        raise InputError(
            "a run is not written in this format",
            got=suffix,
            expected=".csv, .parquet, .mcap or .mat",
            remedy="spreadsheets open CSV" if suffix in _SHEETS else "",
            where=str(path),
        )


def run_to_parquet(run: Run) -> bytes:
    """The run as a Parquet file. Raises MissingExtraError without pyarrow."""
    columns = run_columns(run)
    return parquet_bytes(columns, {name: unit_of_column(name) for name in columns})


def run_to_csv(run: Run) -> str:
    """The run as the text of a run file."""
    columns = run_columns(run)
    rows = zip(*map(_cells, columns.values()), strict=True)
    return ",".join(columns) + "\n" + "\n".join(map(",".join, rows)) + "\n"


def run_columns(run: Run) -> dict[str, FloatArray]:
    """Every column of the file of a run by name, in its order; t_s is the first. Shape (samples,) each."""
    columns = {"t_s": run.t}
    for channel, values in run.channels.items():
        values = values.reshape(len(run), -1)
        columns |= zip(columns_of(channel, values.shape[1]), values.T, strict=True)
    return columns


def _cells(values: FloatArray) -> list[str]:
    """A column as text: repr keeps every bit, NaN is an empty cell."""
    return ["" if value != value else repr(value) for value in values.tolist()]


def read_run(path: str | os.PathLike) -> Run:
    """Read a run file, CSV or Parquet: the same numbers, to the last bit, that `write_run` wrote.

    The order of the columns does not matter, a channel needs all of its columns, a blank cell is NaN. `source` of the
    Run is the path, its `warnings` say what the reader had to decide.
    Raises InputError for any other column or unit, a missing or decreasing time, and all that `read_table` refuses.
    """
    table = read_table(path)
    wheels = _wheel_count(table.names)
    names_of = {channel: columns_of(channel, wheels) for channel in CHANNELS}
    table.check_names(["t_s"], [name for names in names_of.values() for name in names])
    refuse_other_units(table)
    channels: dict[str, Any] = {
        channel: _complete(
            {name: table.numbers(name, missing=True) for name in names if name in table.names},
            channel,
            names,
            table.source,
        )
        for channel, names in names_of.items()
    }
    time = table.numbers("t_s")
    bad_steps = np.flatnonzero(~(np.diff(time) > 0.0))
    if bad_steps.size:
        row = int(bad_steps[0]) + 1
        got = f"{time[row]:.17g} after {time[row - 1]:.17g}"
        raise table.fault(row, "t_s", "time does not increase", got, "increasing times")
    return Run(t=time, **channels, source=str(path), warnings=statements(table.notes))


def run_of_columns(
    columns: Mapping[str, FloatArray], source: str, warnings: tuple[Statement, ...] = (), remedy: str = ""
) -> Run:
    """The Run of columns in memory that are named as in a run file. Shape (samples,) each, NaN where missing.

    Raises InputError for another column, a channel that is not complete, and a time that does not increase.
    """
    wheels = _wheel_count(tuple(columns))
    names_of = {channel: columns_of(channel, wheels) for channel in CHANNELS}
    allowed_names = {"t_s", *(name for names in names_of.values() for name in names)}
    strange = [name for name in columns if name not in allowed_names]
    if strange or "t_s" not in columns:
        raise InputError(
            "not the columns of a run",
            got=", ".join(strange[:5]) or "no column t_s",
            expected="t_s, u1_V, w1_rad_s, vx_m_s, ...",
            remedy=remedy,
            where=source,
        )
    channels: dict[str, Any] = {
        channel: _complete(columns, channel, names, source) for channel, names in names_of.items()
    }
    return Run(t=columns["t_s"], source=source, warnings=warnings, **channels)


def _complete(columns: Mapping[str, FloatArray], channel: str, names: list[str], source: str) -> FloatArray | None:
    """A channel from its columns, None where there are none of them. Raises InputError where some are missing."""
    present = [name for name in names if name in columns]
    if not present:
        return None
    if len(present) < len(names):
        absent = [name for name in names if name not in present]
        raise InputError(
            f"the channel {channel} is not complete",
            got=", ".join(present),
            expected=", ".join(names),
            remedy=f"add {', '.join(absent)}",
            where=source,
        )
    values = np.stack([columns[name] for name in names], axis=1)
    return values[:, 0] if CHANNELS[channel] == SCALAR else values


def refuse_other_units(table: FileTable) -> None:
    """Raises InputError where a unit given in a row or a bracket is not the one in the name of the column."""
    for name, text in table.units.items():
        name_unit, table_unit = parse_unit(unit_of_column(name)), known_unit(text)
        if (
            text not in _UNIT_OF_DUTY
            if name_unit.quantity == DUTY
            else table_unit is None or table_unit[1:] != name_unit[1:]
        ):
            raise InputError(
                "the row of units contradicts the name",
                got=text,
                expected=name_unit.text,
                remedy="convert the column",
                where=f"{table.source}, column {name}",
            )


def unit_of_column(name: str) -> str:
    """The unit in the name of a column: "rad/s" of w1_rad_s, w1_cmd_rad_s."""
    return next(suffix for suffix in _SUFFIXES if name.endswith(f"_{suffix}")).replace("_", "/")


def _wheel_count(names: Sequence[str]) -> int:
    """The highest number of a wheel in the names of the columns; no more than there are columns."""
    numbered = (re.fullmatch(r"[udiaw](\d{1,4})_\w+", name, re.ASCII) for name in names)
    return min(max((int(match[1]) for match in numbered if match), default=0), len(names))
