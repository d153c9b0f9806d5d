"""Which column is the time, whatever stands before or behind the word; and which is not."""

import numpy as np
import pytest

from omnidyn.logs.columns.guess import guess_columns
from omnidyn.logs.read_log import load_log
from tests.logs.columns.test_guess import ROWS, clock, table_of
from tests.support.codes import said


@pytest.mark.parametrize(
    ("name", "step", "unit"),
    [
        ("t_now", 0.02, "s"),
        ("log_t", 0.02, "s"),
        ("motor_time_ms", 20.0, "ms"),
        ("Elapsed", 0.02, "s"),
        ("timestamp_us", 2e4, "us"),
        ("ros_time", 0.02, "s"),
        ("uptime", 20.0, "ms"),
        ("TIME_NOW", 0.02, "s"),
        ("motorTime", 0.02, "s"),
        ("log time", 0.02, "s"),
        ("wheel1_t", 0.02, "s"),
        ("time since start", 0.02, "s"),
        ("Zeit", 0.02, "s"),
        ("elapsed_time_seconds", 0.02, "s"),
        ("/log/t_now", 0.02, "s"),
        ("ms", 20.0, "ms"),
        ("us", 2e4, "us"),
        ("s", 0.02, "s"),
        ("seconds", 0.02, "s"),
        ("loop_ms", 20.0, "ms"),
        ("aika_ms", 20.0, "ms"),
        ("runtime", 0.02, "s"),
    ],
)
def test_a_time_may_have_words_about_it(tmp_path, name, step, unit):
    columns = guess_columns(table_of(tmp_path, {name: clock(step), "w1_rad_s": 1.0}))
    assert (columns.columns["t"].name, columns.columns["t"].unit) == (name, unit)
    assert said(columns.doubts) == ()


@pytest.mark.parametrize("name", ["time_left", "on_time", "temp_t", "time_diff", "motor_t"])
@pytest.mark.parametrize("values", [20.0 + np.sin(np.arange(ROWS)), 100.0 - clock(1.0)])
def test_what_only_has_the_word_is_no_time(tmp_path, name, values):
    assert guess_columns(table_of(tmp_path, {"t_s": clock(0.01), name: values})).columns["t"].name == "t_s"
    assert "t" not in guess_columns(table_of(tmp_path, {name: values, "w1_rad_s": 1.0})).columns


def test_a_plain_time_comes_before_one_with_words(tmp_path):
    columns = guess_columns(table_of(tmp_path, {"imu_stamp_s": clock(0.02), "motor_t": clock(0.02), "t": clock(0.01)}))
    assert columns.columns["t"].name == "imu_stamp_s"  # an imu is a body, as before
    columns = guess_columns(table_of(tmp_path, {"motor_t": clock(0.02), "time": clock(0.01)}))
    assert columns.columns["t"].name == "time"


def test_nanoseconds_since_1970_keep_their_steps(tmp_path):
    path = tmp_path / "log.csv"
    rows = [f"{1_700_000_000_000_000_000 + 10_000_000 * k},{k}" for k in range(50)]
    path.write_text("\n".join(["timestamp,w1_rad_s", *rows]))
    assert load_log(path).t == pytest.approx(np.arange(50) / 100.0, abs=3e-7)


@pytest.mark.parametrize(
    "head",
    [
        "x-axis,1,2\nsecond,Volt,Ampere",
        "x-axis,1,2\ns,V,A",
        "TIME,CH1,CH2\ns,V,A",
        "Time,Channel A,Channel B\n(s),(V),(A)\n",
        "Time (s),CH1 (V),CH2 (A)",
        "Zeit,Kanal 1,Kanal 2\n[s],[V],[A]",
    ],
)
def test_the_channels_of_an_oscilloscope_are_no_numbers_of_wheels(tmp_path, head):
    path = tmp_path / "scope.csv"
    rows = [f"{-0.1 + 0.01 * k:+.3E},{6 - k / 10:+.3E},{k / 10:+.3E}" for k in range(60)]
    path.write_text("\n".join([head, *rows]))
    log = load_log(path)
    assert log.t == pytest.approx(-0.1 + 0.01 * np.arange(60))
    assert log.channels["voltage"][:, 0] == pytest.approx(6.0 - np.arange(60) / 10.0)
    assert log.channels["current"][:, 0] == pytest.approx(np.arange(60) / 10.0)


def test_two_channels_of_one_kind_are_asked_about(tmp_path):
    path = tmp_path / "scope.csv"
    path.write_text("x-axis,1,2\ns,V,V\n" + "\n".join(f"{0.01 * k:.2f},{k},{k}" for k in range(60)))
    assert said(load_log(path).columns.doubts) == (
        "1, 2 look like u1, but no number says which wheel each is (say `column` u1=1 and so on): not taken",
    )
