"""Which column is the time, whatever stands before or behind the word; and which is not."""

import json

import numpy as np
import pytest

from omnidyn.cli import main
from omnidyn.logs.columns.guess import guess_columns
from omnidyn.logs.read_log import recorded_log
from omnidyn.logs.table.table import FileTable
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
    assert recorded_log(path).t == pytest.approx(np.arange(50) / 100.0, abs=3e-7)


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
    log = recorded_log(path)
    assert log.t == pytest.approx(-0.1 + 0.01 * np.arange(60))
    assert log.channels["voltage"][:, 0] == pytest.approx(6.0 - np.arange(60) / 10.0)
    assert log.channels["current"][:, 0] == pytest.approx(np.arange(60) / 10.0)


def test_two_channels_of_one_kind_are_asked_about(tmp_path):
    path = tmp_path / "scope.csv"
    path.write_text("x-axis,1,2\ns,V,V\n" + "\n".join(f"{0.01 * k:.2f},{k},{k}" for k in range(60)))
    assert said(recorded_log(path).columns.doubts) == (
        "1, 2 look like u1, but no number says which wheel each is (say `column` u1=1 and so on): not taken",
    )


# A time without a unit in rows of .1 ms to 10 s: right, or asked about; asked where nothing leaves one unit

SIZES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}


def unit_found(times, size, **columns):
    """The unit of times [s] that are written as so many of `size`; None where it is asked."""
    cells = {"time": times / size, **columns}
    table = FileTable(tuple(cells), cells, np.arange(len(times)) + 2, {}, "log.csv", "", ())
    guessed = guess_columns(table)
    assert ("t" in guessed.columns) != any("t" in open_doubt.components for open_doubt in guessed.doubts)
    return guessed.columns["t"].unit if "t" in guessed.columns else None


@pytest.mark.parametrize("seed", range(4))
def test_no_unit_of_time_is_wrong_in_silence(seed):
    """One unit is left by a clock since 1970, by a position beside its speed, or by the steps themselves."""
    rng, asked, clear = np.random.default_rng(seed), 0, 0
    for _ in range(150):
        step, count = 10.0 ** rng.uniform(-4.0, 1.0), int(rng.integers(50, 700))
        unit, hint = rng.choice(list(SIZES)), rng.choice(["none", "1970", "position", "heading"])
        start = 1.7e9 if hint == "1970" else rng.uniform(0.0, 30.0)
        times = start + np.cumsum(step * rng.uniform(0.9, 1.1, count))
        speed = rng.normal() + np.sin(0.05 * np.arange(count))
        columns = {"w1": speed + 0.02 * rng.normal(size=count)}
        moved = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2.0 * np.diff(times))])
        if hint == "position":
            columns |= {"a1": moved}
        if hint == "heading":
            columns |= {"omega": speed, "heading": moved, "vx": speed, "w1": 20.0 * speed}
        found = unit_found(times, SIZES[unit], **columns)
        assert found in (unit, None), (step, unit, hint)
        if hint != "none":
            clear, asked = clear + 1, asked + (found is None)
    assert asked <= 0.05 * clear


@pytest.mark.parametrize(("step", "rows", "unit"), [(0.002, 3700, "ms"), (0.005, 1500, "ms"), (0.01, 800, "ms")])
def test_a_log_that_would_last_for_hours_is_not_so_slow(step, rows, unit):
    assert unit_found(step * np.arange(rows), SIZES[unit], w1=np.sin(np.arange(rows))) == unit


@pytest.mark.parametrize("name", ["s_0999", "s_1001", "s_2", "ms_0999", "ms_1000", "ms_1100", "ms_2000"])
def test_slow_rows_are_asked_about_as_a_finding(tmp_path, capsys, name):
    """A sweep of a motor by a script, a row each second or two: it was read a thousand times too fast."""
    unit, step = name.split("_")
    step = {"0999": 0.999, "1000": 1.0, "1001": 1.001, "1100": 1.1, "2": 2.0, "2000": 2.0}[step]
    duty, path = 60.0 - np.arange(121), tmp_path / "sweep.csv"
    speed = np.sign(duty) * np.maximum(np.abs(duty) - 12.0, 0.0) / 1.6 * 9.5493
    times = (12.5 + step * np.arange(121)) / SIZES[unit]
    rows = [f"{t:.3f},{d:g},{w:.2f}" for t, d, w in zip(times, duty, speed, strict=True)]
    path.write_text("\n".join(["time,duty_pct,speed_rpm", *rows]) + "\n")
    assert main(["check", str(path), "--json"]) == 4
    (log,) = json.loads(capsys.readouterr().out)["logs"]
    (finding,) = log["findings"]
    other = {"s": "ms", "ms": "us"}[unit]
    assert (finding["code"], finding["severity"]) == ("not_taken", "error")
    assert f'--column "t=time:{unit}" or --column "t=time:{other}"' in finding["remedy"].replace("`column`", "--column")
    assert main(["check", str(path), "--column", f"t=time:{unit}"]) == 0


@pytest.mark.parametrize(("step", "units"), [(0.01, ("s",)), (10.0, ("s", "ms")), (2e7, ("ns",)), (1.0, ("UNIT",))])
def test_a_column_that_may_be_the_time_by_its_values_is_asked_about_in_the_units_that_it_may_have(
    tmp_path, step, units
):
    (doubt,) = guess_columns(table_of(tmp_path, {"c1": clock(step), "c2": 1.0})).doubts
    assert doubt.code == "clock_unit_unknown"
    assert doubt.declarations == tuple(("column", f"t=c1:{unit}") for unit in units)
