"""Run files: to the last bit and back, and nothing half-written."""

import re
import sys
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from omnidyn import load_robot, simulate, write_run
from omnidyn.errors import InputError, MissingExtraError
from omnidyn.logs.run_file import read_run, run_to_csv
from omnidyn.run import CHANNELS, LARGEST_SIZE, Run

HEADER = (
    "t_s,u1_V,u2_V,u3_V,d1_duty,d2_duty,d3_duty,i1_A,i2_A,i3_A,a1_rad,a2_rad,a3_rad,w1_rad_s,w2_rad_s,w3_rad_s,"
    "w1_cmd_rad_s,w2_cmd_rad_s,w3_cmd_rad_s,vx_m_s,vy_m_s,omega_rad_s,"
    "vx_cmd_m_s,vy_cmd_m_s,omega_cmd_rad_s,x_m,y_m,heading_rad,supply_V,f1_N,f2_N,f3_N"
)


def full_run(n=5, seed=1):
    draw = np.random.default_rng(seed).normal
    wheel = {name: draw(size=(n, 3)) for name in CHANNELS if CHANNELS[name] == "wheel"}
    axis = {name: draw(size=(n, 3)) for name in ("twist", "twist_command", "pose")}
    return Run(t=np.arange(n) * 0.1, **wheel, **axis, supply=draw(size=n))


def bits(run):
    return {
        field.name: None if (value := getattr(run, field.name)) is None else value.tobytes()
        for field in fields(run)
        if field.name not in ("source", "warnings")
    }


def test_the_columns_are_those_of_the_design():
    assert run_to_csv(full_run()).splitlines()[0] == HEADER


def test_it_reads_back_to_the_last_bit(tmp_path):
    run = full_run(200)
    write_run(run, tmp_path / "run.csv")
    assert bits(read_run(tmp_path / "run.csv")) == bits(run)


def test_a_simulation_reads_back_to_the_last_bit(tmp_path):
    run = simulate(load_robot("axebot"), [[0.0, 3.0, -3.0]] * 300 + [[1.0, 0.3, -6.0]] * 300, 1e-3)
    write_run(run, tmp_path / "run.csv")
    assert bits(read_run(tmp_path / "run.csv")) == bits(run)


@given(arrays(float, (4, 3), elements=st.floats(-LARGEST_SIZE, LARGEST_SIZE)))
def test_every_float_of_a_run_survives(tmp_path_factory, values):
    path = tmp_path_factory.mktemp("run") / "run.csv"
    run = Run(t=[0.0, 1e-9, 0.1, 1e12], pose=values)
    write_run(run, path)
    assert bits(read_run(path)) == bits(run)


def test_a_missing_value_is_an_empty_cell(tmp_path):
    run = Run(t=[0.0, 1.0], twist=[[1.0, np.nan, -0.0], [np.nan] * 3])
    assert run_to_csv(run) == "t_s,vx_m_s,vy_m_s,omega_rad_s\n0.0,1.0,,-0.0\n1.0,,,\n"
    write_run(run, tmp_path / "run.csv")
    back = read_run(tmp_path / "run.csv")
    assert np.array_equal(back.twist, run.twist, equal_nan=True)
    assert np.signbit(back.twist[0, 2])


def test_time_alone_is_a_run(tmp_path):
    write_run(Run(t=[0.0, 0.5]), tmp_path / "run.csv")
    assert list(read_run(tmp_path / "run.csv").channels) == []


@pytest.mark.parametrize("wheels", [1, 4, 12])
def test_any_number_of_wheels(tmp_path, wheels):
    run = Run(t=[0.0, 1.0], current=np.arange(2.0 * wheels).reshape(2, wheels))
    write_run(run, tmp_path / "run.csv")
    assert np.array_equal(read_run(tmp_path / "run.csv").current, run.current)


@pytest.mark.parametrize("value", [np.inf, -np.inf, 1e308, -1.1e20])
def test_a_number_that_no_sensor_gives_is_refused_with_its_row(value):
    message = f"pose: no sensor gives such a number; got {value:.4g} in row 1; expected at most 1e+20 in size, or NaN"
    with pytest.raises(InputError, match=re.escape(message)):
        Run(t=[0.0, 1.0], pose=[[np.nan, 0.0, 0.0], [0.0, value, np.nan]])
    assert Run(t=[0.0], supply=[np.copysign(LARGEST_SIZE, value)]).supply[0] == np.copysign(LARGEST_SIZE, value)


@pytest.mark.parametrize("t", [[0.0, np.inf], [-np.inf, 0.0], [0.0, 1e21]])
def test_so_is_a_time(t):
    with pytest.raises(InputError, match="t: no sensor gives such a number"):
        Run(t=t)


@pytest.mark.parametrize("unit", ["datetime64[ns]", "datetime64[s]", "timedelta64[ms]"])
def test_dates_are_no_seconds_and_the_remedy_makes_them_such(unit):
    t = np.array([0, 10, 30]).astype(unit)
    remedy = "t: dates are no seconds; got .*; expected seconds; write (t - t[0]) / np.timedelta64(1, 's')"
    with pytest.raises(InputError, match=re.escape(remedy).replace(r"\.\*", ".*")):
        Run(t=t)
    seconds = {"ns": 1e-9, "ms": 1e-3}.get(unit[-3:-1], 1.0)
    assert Run(t=(t - t[0]) / np.timedelta64(1, "s")).t == pytest.approx(seconds * np.array([0, 10, 30]))


@pytest.mark.parametrize("values", [["a", "b"], [[1.0, 2.0], [1.0]], [object()] * 2])
def test_what_holds_no_numbers_is_refused(values):
    with pytest.raises(InputError, match=r"supply: not numbers; got .*; expected numbers, shape"):
        Run(t=[0.0, 1.0], supply=values)


def test_an_existing_file_stays_unless_forced(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("mine")
    with pytest.raises(InputError, match=r"run\.csv: the file exists already; use `force`"):
        write_run(full_run(), path)
    assert path.read_text() == "mine"
    write_run(full_run(), path, force=True)
    assert path.read_text().startswith("t_s,")
    assert [file.name for file in tmp_path.iterdir()] == ["run.csv"]


@pytest.mark.parametrize("name", ["run.parquet", "run.PQ"])
def test_parquet_reads_back_to_the_last_bit(tmp_path, name):
    pytest.importorskip("pyarrow")
    run = full_run(200)
    write_run(run, tmp_path / name)
    assert (tmp_path / name).read_bytes()[:4] == b"PAR1"
    assert bits(read_run(tmp_path / name)) == bits(run)


def test_parquet_keeps_every_kind_of_float(tmp_path):
    pytest.importorskip("pyarrow")
    odd = np.array([np.nan, -0.0, 5e-324, LARGEST_SIZE, 0.1]).view(np.int64)
    odd[0] |= 7  # a NaN with a payload
    run = Run(t=np.arange(5.0), supply=odd.view(float))
    write_run(run, tmp_path / "run.parquet")
    assert bits(read_run(tmp_path / "run.parquet")) == bits(run)


def test_parquet_has_nan_and_no_null_and_the_units(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    write_run(Run(t=[0.0, 1.0], twist=[[1.0, np.nan, -0.0]] * 2), tmp_path / "run.parquet")
    table = parquet.read_table(tmp_path / "run.parquet")
    assert [column.null_count for column in table.columns] == [0, 0, 0, 0]
    assert [field.metadata[b"unit"] for field in table.schema] == [b"s", b"m/s", b"m/s", b"rad/s"]


def test_parquet_without_pyarrow_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(MissingExtraError, match=r"need pyarrow; pip install \"omnidyn\[logs\]\""):
        write_run(full_run(), tmp_path / "run.parquet")
    (tmp_path / "there.parquet").write_bytes(b"PAR1 and so on")
    with pytest.raises(MissingExtraError, match=r"there\.parquet: .*pip install \"omnidyn\[logs\]\""):
        read_run(tmp_path / "there.parquet")


@pytest.mark.parametrize("unit", ["rpm", "deg/s", "m/s", "N"])
def test_a_unit_that_contradicts_the_name_is_refused(tmp_path, unit):
    path = tmp_path / "run.csv"
    path.write_text(f"t_s,w1_rad_s\ns,[{unit}]\n0,1\n")
    with pytest.raises(
        InputError, match=rf"run\.csv, column w1_rad_s: .* contradicts the name; got {unit}; expected rad/s"
    ):
        read_run(path)


@pytest.mark.parametrize(
    "text, message",
    [
        ("t_s,vx_m_s,vy_m_s\n0,1,2\n", "channel twist is not complete; got vx_m_s, vy_m_s"),
        ("t_s,u1_V,u3_V\n0,1,2\n", "channel voltage is not complete; got u1_V, u3_V; expected u1_V, u2_V, u3_V"),
        ("t_s,u1_V,speed\n0,1,2\n", "unknown column; got speed"),
        ("t_s,u9999_V\n0,1\n", "unknown column; got u9999_V"),
        ("u1_V,u2_V\n0,1\n", "a column is missing"),
        ("t_s,supply_V\n0,1\n0,1\n", r"run.csv:3, column t_s: time does not increase; got 0 after 0"),
        ("t_s,supply_V\n0,1\n,1\n", r"run.csv:3, column t_s: a number is missing"),
        ("t_s,supply_V\n0,1e400\n", "not a finite number"),
        ("t_s,supply_V\n0,twelve\n", "not a number; got twelve"),
        ("t_s,supply_V\n", "no rows"),
        ("", "the file is empty"),
    ],
)
def test_bad_files_are_refused_by_name(tmp_path, text, message):
    path = tmp_path / "run.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_run(path)


def test_the_order_of_the_columns_does_not_matter(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("heading_rad,t_s,y_m,x_m\n3,0,2,1\n")
    assert read_run(path).pose.tolist() == [[1.0, 2.0, 3.0]]
