"""A Run as a DataFrame: the columns of its file; without pandas one line that says what to install."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import MissingExtraError

RUN = omnidyn.Run(
    t=np.array([0.0, 0.1, 0.2]),
    voltage=np.arange(9.0).reshape(3, 3),
    supply=np.array([12.0, np.nan, 11.0]),
    source="log.csv",
    warnings=("a doubt",),
)
COLUMNS = ["u1_V", "u2_V", "u3_V", "supply_V"]


def test_without_pandas_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(MissingExtraError, match=r'needs pandas; pip install "omnidyn\[arrays\]"') as caught:
        RUN.to_dataframe()
    assert caught.value.exit_code == 6


def test_what_pandas_is_given(monkeypatch):
    """The call, also where pandas is not installed: a frame of columns, over an index of times."""

    class Frame:
        def __init__(self, columns, index):
            self.columns, self.index, self.attrs = columns, index, {}

    fake = SimpleNamespace(DataFrame=Frame, Index=lambda values, name: (values, name))
    monkeypatch.setitem(sys.modules, "pandas", fake)
    frame = RUN.to_dataframe()
    assert list(frame.columns) == COLUMNS
    np.testing.assert_array_equal(frame.columns["u2_V"], RUN.voltage[:, 1])
    np.testing.assert_array_equal(frame.index[0], RUN.t)
    assert frame.index[1] == "t_s"
    units = {"t_s": "s", **dict.fromkeys(COLUMNS, "V")}
    assert frame.attrs == {"source": "log.csv", "warnings": ["a doubt"], "units": units}


def test_a_real_frame():
    pytest.importorskip("pandas")
    frame = RUN.to_dataframe()
    assert list(frame.columns) == COLUMNS
    assert frame.index.name == "t_s"
    assert frame["u3_V"].tolist() == [2.0, 5.0, 8.0]
    assert frame["supply_V"].isna().tolist() == [False, True, False]


@pytest.mark.parametrize("name", ["frame.csv", "frame.parquet"])
def test_what_pandas_writes_is_a_run_file(tmp_path, name):
    pytest.importorskip("pandas")
    path = tmp_path / name
    run = omnidyn.simulate(omnidyn.load_robot("axebot"), np.tile([0.0, 2.0, -2.0], (20, 1)), 0.02)
    write = {"frame.csv": "to_csv", "frame.parquet": "to_parquet"}[name]
    getattr(run.to_dataframe(), write)(path)
    again = omnidyn.read_log(str(path))
    np.testing.assert_array_equal(again.twist, run.twist)
    np.testing.assert_array_equal(again.voltage, run.voltage)
