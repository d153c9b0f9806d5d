"""A Run as a pandas DataFrame: the columns of a run file, over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from omnidyn.errors import MissingExtraError
from omnidyn.logs.run_file import run_columns
from omnidyn.run import Run

if TYPE_CHECKING:
    from pandas import DataFrame  # pyright: ignore[reportMissingImports]


def to_dataframe(run: Run) -> DataFrame:
    """Columns u1_V, w1_rad_s, vx_m_s, ... over the index t_s; NaN where a value is missing.

    Source and warnings of the run stand in `attrs`. Raises MissingExtraError where pandas is not installed.
    """
    try:
        import pandas  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise MissingExtraError("a data frame needs pandas", remedy='pip install "omnidyn[arrays]"') from None
    columns = run_columns(run)
    index = pandas.Index(columns.pop("t_s"), name="t_s")
    frame = pandas.DataFrame(columns, index=index)
    frame.attrs |= {"source": run.source, "warnings": list(run.warnings)}
    return frame
