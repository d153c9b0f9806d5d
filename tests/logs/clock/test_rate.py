"""A file without a time, and the rate of its rows."""

import numpy as np
import pytest

from omnidyn import read_log
from omnidyn.errors import InputError
from omnidyn.logs.read_log import LogOptions, iter_logs, recorded_log
from tests.support.codes import said


def written(tmp_path, header="duty_%,speed_rad_s", rows=40, odd=None):
    lines = [f"{k % 7},{0.5 * k}" if k != odd else "1,2,3" for k in range(rows)]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([*([header] if header else []), *lines]) + "\n")
    return path


def test_row_k_is_at_k_over_the_rate(tmp_path):
    run = read_log(written(tmp_path), rate=500.0)
    assert np.array_equal(run.t, np.arange(40) / 500.0)
    assert np.array_equal(run.wheel_speed[:, 0], 0.5 * np.arange(40))
    assert "time was made of the rate: 500 rows a second" in said(run.warnings)


def test_in_pieces_it_goes_on(tmp_path):
    logs = list(iter_logs(written(tmp_path), options=LogOptions(rate=50.0), rows=16))
    assert len(logs) == 3
    assert np.array_equal(np.concatenate([log.t for log in logs]), np.arange(40) / 50.0)


def test_a_row_that_is_left_out_has_its_time(tmp_path):
    log = recorded_log(written(tmp_path, odd=11), options=LogOptions(rate=10.0, skip_bad_rows=True))
    assert log.t.tolist() == [k / 10.0 for k in range(40) if k != 11]


def test_without_it_the_refusal_names_it(tmp_path):
    words = r"cannot tell the time of the rows.*\(`column` t=COLUMN:s\), or how many rows a second: `rate` HZ"
    with pytest.raises(InputError, match=words):
        read_log(written(tmp_path))


@pytest.mark.parametrize("rate", [0.0, -50.0, float("nan"), float("inf")])
def test_what_is_no_rate_is_refused(tmp_path, rate):
    with pytest.raises(InputError, match=r"rate: not a rate; got .*; expected rows per second, above 0"):
        read_log(written(tmp_path), rate=rate)


@pytest.mark.parametrize("header", ["t_s,w1_rad_s", "Time (s),w1_rad_s", "t_now,w1_rad_s"])
def test_a_log_with_a_time_takes_no_rate(tmp_path, header):
    lines = [f"{0.01 * k:.2f},{k}" for k in range(40)]
    (tmp_path / "timed.csv").write_text("\n".join([header, *lines]))
    words = r"the log has a time already; got the column .*, and `rate`; .*; leave `rate` out"
    with pytest.raises(InputError, match=words):
        read_log(tmp_path / "timed.csv", rate=50.0)


def test_a_column_t_that_is_no_time_stays(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("t,w1_rad_s\n" + "\n".join(f"{20 + k % 3},{k}" for k in range(40)))
    log = recorded_log(path, options=LogOptions(rate=50.0))
    assert log.columns.columns["t"].name == "t (rate)"
    assert log.t[-1] == 39.0 / 50.0
