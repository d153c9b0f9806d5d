"""A log without header and time: each refusal names the option that leads on, and the last command works."""

import numpy as np
import pytest

from omnidyn import read_log

MAP = ("--column", "d1=c1:%", "--column", "w1=c2:rad/s")


@pytest.fixture
def log(here):
    """Half a turn of a motor that follows its duty at once: 0.1667 % s/rad above 2.92 %."""
    duty = 50.0 * np.abs(np.sin(np.arange(4000) * 0.002))
    speed = np.maximum(duty - 2.92, 0.0) / 0.1667
    np.savetxt(here / "serial.csv", np.column_stack([duty, speed]), delimiter=",", fmt="%.6g")
    return "serial.csv"


def test_the_refusals_lead_to_a_command_that_works(call, log):
    code, _, error = call("check", log)
    assert code == 3
    assert "or use --no-header" in error
    code, _, error = call("check", log, "--no-header")
    assert code == 3
    assert "or how many rows a second: --rate HZ" in error
    code, out, error = call("check", log, "--no-header", "--rate", "500", *MAP)
    assert code == 0
    assert "4000 rows, 7.998 s at 500 Hz" in out
    assert "time was made of the rate: 500 rows a second" in error


def test_info_and_convert_take_the_rate(call, log):
    code, out, _ = call("info", log, "--no-header", "--rate", "500", *MAP)
    assert code == 0
    assert "3 topics or columns, 7.998 s" in out
    assert call("convert", log, "out.csv", "--no-header", "--rate", "500", *MAP)[0] == 0
    assert np.array_equal(read_log("out.csv").t, np.arange(4000) / 500.0)
    code, _, error = call("check", "out.csv", "--rate", "500")
    assert code == 3
    assert "the log has a time already; got the column t_s, and --rate; expected one of the two" in error


def test_a_log_without_a_time_is_no_table_of_motors(call, log, here):
    (here / "named.csv").write_text("duty_%,speed_rad_s\n" + (here / log).read_text())
    code, _, error = call("identify", "named.csv", "--what", "motors")
    assert code == 3
    assert "a log without a time, and no table of steady points; got 4000 rows" in error
