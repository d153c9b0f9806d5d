"""convert --split: a file for each recording, and none is replaced unasked."""

import numpy as np

from omnidyn import read_log
from tests.support.counted import write_columns


def restarted(here):
    """A board that was started again after 300 rows."""
    t = np.concatenate([0.8 + 0.02 * np.arange(300), 0.6 + 0.02 * np.arange(200)])
    return write_columns(here / "log.csv", "t_s,u1_V,w1_rad_s", t, np.ones(500), np.arange(500.0))


def test_each_recording_becomes_a_file(here, call):
    restarted(here)
    code, _, err = call("convert", "log.csv", "out.csv", "--split")
    assert code == 0
    assert "wrote out_1.csv" in err
    assert "wrote out_2.csv" in err
    assert not (here / "out.csv").exists()
    first, second = read_log(here / "out_1.csv"), read_log(here / "out_2.csv")
    np.testing.assert_array_equal(first.wheel_speed[:, 0], np.arange(300.0))
    np.testing.assert_array_equal(second.wheel_speed[:, 0], np.arange(300.0, 500.0))


def test_no_file_is_replaced_unasked(here, call):
    restarted(here)
    (here / "out_2.csv").write_text("mine")
    code, _, err = call("convert", "log.csv", "out.csv", "--split")
    assert code == 3
    assert "out_2.csv: the file exists already; use --force" in err
    assert (here / "out_2.csv").read_text() == "mine"
    assert not (here / "out_1.csv").exists()
    assert call("convert", "log.csv", "out.csv", "--split", "--force")[0] == 0
    assert (here / "out_2.csv").read_text() != "mine"


def test_no_input_is_replaced(here, call):
    restarted(here).rename(here / "out_1.csv")
    before = (here / "out_1.csv").read_bytes()
    code, _, err = call("convert", "out_1.csv", "out.csv", "--split", "--force")
    assert code == 3
    assert "the result would replace its own input" in err
    assert (here / "out_1.csv").read_bytes() == before


def test_two_logs_in_one_file_are_split_where_time_goes_back(here, call):
    t = np.concatenate([100.0 + 0.02 * np.arange(300), 103.0 + 0.02 * np.arange(300)])
    write_columns(here / "log.csv", "t_s,w1_rad_s", t, np.arange(600.0))
    code, _, err = call("convert", "log.csv", "out.csv")
    assert code == 3
    assert "(`convert` with --split)" in err
    assert call("convert", "log.csv", "out.csv", "--split")[0] == 0
    assert len(read_log(here / "out_2.csv")) == 300


def test_one_recording_is_one_file(here, call):
    t = 0.02 * np.arange(300)
    write_columns(here / "log.csv", "t_s,w1_rad_s", t, np.sin(t))
    code, _, err = call("convert", "log.csv", "out.csv", "--split")
    assert code == 0
    assert "wrote out.csv" in err
    assert "it is one recording" in err
