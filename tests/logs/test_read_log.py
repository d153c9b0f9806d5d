"""From a file to a Run: units, gears, signs, clocks, blanks and latencies, each against numbers worked out by hand."""

import numpy as np
import pytest

from omnidyn import load_robot
from omnidyn.errors import InputError
from omnidyn.findings.check import check_blocks
from omnidyn.logs.log import component
from omnidyn.logs.read_log import LogOptions, iter_logs, read_log, recorded_log
from omnidyn.logs.run_file import write_run
from omnidyn.run import Run
from tests.support.codes import codes, said


def write(tmp_path, text, name="log.csv"):
    path = tmp_path / name
    path.write_text(text, "utf-8")
    return path


def test_units_are_converted(tmp_path):
    path = write(tmp_path, "t,w1,i1,u1,yaw\nms,rpm,mA,V,deg\n0,60,1500,3,180\n10,-30,0,2,90\n")
    run = read_log(path)
    np.testing.assert_allclose(run.t, [0.0, 0.01])
    np.testing.assert_allclose(run.wheel_speed, [[2 * np.pi], [-np.pi]])
    np.testing.assert_allclose(run.current, [[1.5], [0.0]])
    np.testing.assert_allclose(run.pose[:, 2], [np.pi, np.pi / 2])
    assert np.isnan(run.pose[:, :2]).all()


def test_speeds_of_the_motor_shaft_are_divided_by_the_gear(tmp_path):
    path = write(tmp_path, "t_s,motor1_rpm,motor2_rpm,motor3_rpm\n0,600,0,-600\n0.1,600,0,-600\n")
    run = read_log(path, load_robot("axebot"))
    np.testing.assert_allclose(run.wheel_speed[0], np.array([600, 0, -600]) * 2 * np.pi / 60 / 19)
    assert any("no robot is given" in words for words in said(read_log(path).warnings))


def test_a_run_file_is_a_log(tmp_path):
    """The same numbers as `read_run` gives."""
    rng = np.random.default_rng(3)
    run = Run(t=np.arange(50) * 0.01, voltage=rng.normal(size=(50, 3)), twist=rng.normal(size=(50, 3)))
    write_run(run, tmp_path / "run.csv")
    read = read_log(tmp_path / "run.csv")
    assert (read.t == run.t).all()
    assert (read.voltage == run.voltage).all()
    assert (read.twist == run.twist).all()
    assert said(read.warnings) == ()


def test_heading_is_unwrapped(tmp_path):
    path = write(tmp_path, "t_s,heading_rad,x_m\n0,6.2,0\n0.1,0.1,0\n0.2,,0\n0.3,6.1,0\n0.4,6.1,0\n")
    np.testing.assert_allclose(read_log(path).pose[:, 2], [6.2, 0.1 + 2 * np.pi, np.nan, 6.1, 6.1])


def test_a_heading_that_counts_turns_keeps_them_over_missing_rows(tmp_path):
    """It turns on by 3.4 rad, more than half a turn, while a camera sees nothing."""
    heading = [*np.arange(0.0, 2.1, 0.4), *[np.nan] * 8, *np.arange(5.4, 7.1, 0.4)]
    rows = [f"{0.1 * k:.1f},{'' if np.isnan(angle) else round(angle, 1)},0" for k, angle in enumerate(heading)]
    path = write(tmp_path, "\n".join(["t_s,heading_rad,x_m", *rows, ""]))
    np.testing.assert_allclose(read_log(path).pose[:, 2], heading)


def test_epoch_time_keeps_its_digits(tmp_path):
    path = write(tmp_path, "t_ns,w1_rad_s\n1700000000000000000,1\n1700000000010000000,2\n1700000000020000000,3\n")
    run = read_log(path)
    np.testing.assert_allclose(run.t, [0.0, 0.01, 0.02], atol=1e-6)
    assert any("counted from an epoch" in words for words in said(run.warnings))


@pytest.mark.parametrize("form", ["2026-11-20T10:00:{}", "2026-11-20 10:00:{}+02:00", "2026-11-20T10:00:{}Z"])
def test_dates_are_a_clock(tmp_path, form):
    rows = "".join(f"{form.format(s)},{k}\n" for k, s in enumerate(("00.500", "00.750", "01.000")))
    run = read_log(write(tmp_path, "timestamp,w1_rad_s\n" + rows))
    np.testing.assert_allclose(run.t, [0.0, 0.25, 0.5], atol=1e-9)
    assert any("timestamp holds dates" in words for words in said(run.warnings))
    with pytest.raises(InputError, match=r"log.csv:5, column timestamp: not a date; got noon"):
        read_log(write(tmp_path, "timestamp,w1_rad_s\n" + rows + "noon,4\n"))


def test_time_that_goes_back_is_refused_or_sorted(tmp_path):
    path = write(tmp_path, "t_s,w1_rad_s\n0,1\n0.2,3\n0.1,2\n0.3,4\n")
    with pytest.raises(InputError, match=r"log.csv:4: time goes back; got 0.1 s after 0.2 s \(1 times\)"):
        read_log(path)
    run = read_log(path, sort=True)
    np.testing.assert_array_equal(run.wheel_speed[:, 0], [1, 2, 3, 4])
    assert any("rows were sorted" in words for words in said(run.warnings))


def test_time_that_stands_still_is_refused(tmp_path):
    path = write(tmp_path, "t_s,w1_rad_s\n1,1\n1,2\n1,3\n")
    with pytest.raises(InputError, match=r"time stands still; got t = 1 s in all 3 rows"):
        read_log(path)


def test_repeated_stamps_and_padding_are_left_out_in_words(tmp_path):
    path = write(tmp_path, "t_s,w1_rad_s\n0,1\n0.1,2\n0.1,9\n0.2,3\n0.3,4\n0,0\n0,0\n0,0\n")
    run = read_log(path)
    np.testing.assert_array_equal(run.wheel_speed[:, 0], [1, 2, 3, 4])
    assert any("3 of 8 rows at the end repeat one row" in words for words in said(run.warnings))
    assert any("1 of 5 rows repeat the time of the row before" in words for words in said(run.warnings))


def test_rows_without_numbers_are_left_out_up_to_a_fifth(tmp_path):
    rows = [f"{k * 0.1},{k},{k}" for k in range(10)]
    rows[4] = "nan,nan,nan"
    run = read_log(write(tmp_path, "t_s,w1_rad_s,w2_rad_s\n" + "\n".join(rows)))
    assert len(run) == 9
    rows[1:4] = ["nan,nan,nan"] * 3
    with pytest.raises(InputError, match=r"4 of 10 rows hold no time or no number; got first in line 3"):
        read_log(write(tmp_path, "t_s,w1_rad_s,w2_rad_s\n" + "\n".join(rows)))


def test_a_log_on_change_holds_commands_and_makes_nothing_up(tmp_path):
    text = "t_s,u1_V,w1_rad_s,supply_V\n0,1,,9\n0.1,,10,9\n0.2,,,9\n0.3,2,,9\n0.4,,40,9\n0.5,,,9\n"
    run = read_log(write(tmp_path, text))
    np.testing.assert_array_equal(run.voltage[:, 0], [1, 1, 1, 2, 2, 2])
    np.testing.assert_array_equal(run.wheel_speed[:, 0], [np.nan, 10, np.nan, np.nan, 40, np.nan])
    note = next(warning for warning in run.warnings if warning.code == "on_change")
    assert (note.subject, note.numbers["held"], round(100 * note.numbers["blank"])) == ("u1", True, 67)
    late = read_log(write(tmp_path, text), latency={"w": 0.1})
    np.testing.assert_allclose(late.wheel_speed[:, 0], [10, np.nan, np.nan, 40, np.nan, np.nan])


def test_a_sensor_that_is_out_for_long_is_no_log_on_change(tmp_path):
    rows = [f"{0.1 * k:.1f},{k % 5},{'' if 40 <= k < 80 else k}" for k in range(100)]
    path = write(tmp_path, "t_s,u1_V,w1_rad_s\n" + "\n".join(rows))
    run, log = read_log(path), recorded_log(path)
    assert "on_change" not in codes(run.warnings)
    filled = log.aligned("wheel_speed", log.channels["wheel_speed"], [])
    np.testing.assert_array_equal(np.isnan(filled[:, 0]), (np.arange(100) >= 40) & (np.arange(100) < 80))


def test_a_command_that_is_out_for_long_is_not_held(tmp_path):
    rows = [f"{0.1 * k:.1f},{'' if 40 <= k < 80 else k % 5},{k}" for k in range(100)]
    run = read_log(write(tmp_path, "t_s,u1_V,w1_rad_s\n" + "\n".join(rows)))
    assert "on_change" not in codes(run.warnings)
    np.testing.assert_array_equal(np.isnan(run.voltage[:, 0]), (np.arange(100) >= 40) & (np.arange(100) < 80))


def test_a_command_on_change_is_held_however_long(tmp_path):
    rows = [f"{0.1 * k:.1f},{k / 10 if k % 3 == 0 and not 40 <= k < 80 else ''},{k}" for k in range(121)]
    run = read_log(write(tmp_path, "t_s,u1_V,w1_rad_s\n" + "\n".join(rows)))
    (note,) = [warning for warning in run.warnings if warning.code == "on_change"]
    assert (note.subject, note.numbers["held"], round(100 * note.numbers["blank"])) == ("u1", True, 77)
    np.testing.assert_array_equal(run.voltage[39:82, 0], [3.9] * 42 + [8.1])


def test_a_log_on_change_has_gaps_too(tmp_path):
    """The line is drawn between the measurements on change, not across the time when there was none."""
    rows = [f"{0.1 * k:.1f},{k % 5},{'' if 40 <= k < 80 or k % 3 else k}" for k in range(121)]
    log = recorded_log(write(tmp_path, "t_s,u1_V,w1_rad_s\n" + "\n".join(rows)))
    words: list[str] = []
    filled = log.aligned("wheel_speed", log.channels["wheel_speed"], words)[:, 0]
    known = (np.arange(121) <= 39) | (np.arange(121) >= 81)
    np.testing.assert_array_equal(np.isfinite(filled), known)
    np.testing.assert_allclose(filled[known], np.arange(121)[known])
    (note,) = words
    assert (note.code, note.subject, note.numbers["held"]) == ("on_change", "w1", False)


def test_rows_of_one_time_that_fill_each_other_s_blanks_are_one_row(tmp_path):
    """Every topic writes a row of its own; the battery stands in both, with the same number."""
    text = "t_s,u1_V,w1_rad_s,supply_V\n" + "".join(f"0.{k},{k},,9\n0.{k},,{10 * k},9\n" for k in range(6))
    run = read_log(write(tmp_path, text))
    np.testing.assert_allclose(run.t, 0.1 * np.arange(6))
    np.testing.assert_array_equal(run.voltage[:, 0], np.arange(6))
    np.testing.assert_array_equal(run.wheel_speed[:, 0], 10 * np.arange(6))
    assert any("6 of 12 rows fill the blanks of a row of the same time: joined to it" in w for w in said(run.warnings))


def test_rows_of_one_time_that_contradict_each_other_are_not_joined(tmp_path):
    text = "t_s,u1_V,w1_rad_s\n0,1,10\n0,2,\n0.1,1,10\n0.1,1,10\n0.2,1,10\n"
    run = read_log(write(tmp_path, text))
    np.testing.assert_array_equal(run.voltage[:, 0], [1, 1, 1])
    assert any("2 of 5 rows repeat the time of the row before" in words for words in said(run.warnings))


@pytest.mark.parametrize(
    ("names", "size"),
    [
        (("header.stamp.sec", "header.stamp.nanosec"), 1e9),
        (("secs", "nsecs"), 1e9),
        (("tv_sec", "tv_usec"), 1e6),
        (("Stamp_Seconds", "Stamp_Nanoseconds"), 1e9),
    ],
)
def test_seconds_and_the_rest_of_a_second_are_one_time(tmp_path, names, size):
    times = 1_764_000_000 + np.array([0, 0.25, 0.5, 0.75, 1.0, 1.25])
    cells = [f"{int(t)},{round((t - int(t)) * size)},{k}" for k, t in enumerate(times)]
    run = read_log(write(tmp_path, "\n".join([f"{names[0]},{names[1]},w1_rad_s", *cells])))
    np.testing.assert_array_equal(run.t, times - times[0])
    assert any(f"t is {names[0]} + {1 / size:g} {names[1]}" in words for words in said(run.warnings))
    one = read_log(tmp_path / "log.csv", columns={"t": f"{names[0]}:s"})
    np.testing.assert_array_equal(one.t, [0.0, 1.0])  # one count a second, where the map says so


def test_what_is_no_rest_of_a_second_is_not_added(tmp_path):
    path = write(tmp_path, "sec,nsec,w1_rad_s\n1,1000000000,1\n2,2000000000,2\n3,3000000000,3\n")
    with pytest.raises(InputError, match="cannot tell the time of the rows"):
        read_log(path)


def test_a_latency_is_taken_out(tmp_path):
    """A ramp recorded 0.1 s late: at its true time it stands one row earlier."""
    rows = "\n".join(f"{0.1 * k:.1f},{k}" for k in range(6))
    run = read_log(write(tmp_path, "t_s,w1_rad_s\n" + rows), latency={"w": 0.1})
    np.testing.assert_allclose(run.wheel_speed[:, 0], [1, 2, 3, 4, 5, np.nan])
    with pytest.raises(InputError, match="no such channel to delay; got i"):
        read_log(write(tmp_path, "t_s,w1_rad_s\n" + rows), latency={"i": 0.1})


def test_a_latency_between_rows_makes_rows_of_its_own_and_changes_no_number(tmp_path):
    rows = "\n".join(f"{0.1 * k:.1f},{k},{10 * k}" for k in range(6))
    run = read_log(write(tmp_path, "t_s,u1_V,w1_rad_s\n" + rows), latency={"w": 0.03})
    known = np.isfinite(run.wheel_speed[:, 0])
    np.testing.assert_allclose(run.t[known], 0.1 * np.arange(1, 6) - 0.03)
    np.testing.assert_array_equal(run.wheel_speed[known, 0], 10 * np.arange(1, 6))
    np.testing.assert_allclose(run.t[~known], 0.1 * np.arange(6))
    np.testing.assert_array_equal(run.voltage[:, 0], [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5])
    assert any("w1 was moved back by its latency of 0.03 s" in words for words in said(run.warnings))


def test_a_battery_holds_what_was_measured(tmp_path):
    run = read_log(write(tmp_path, "t_s,u1_V,supply_V\n0,1,12\n0.1,1,\n0.2,1,\n0.3,1,11\n0.4,1,\n"))
    np.testing.assert_array_equal(run.supply, [12, 12, 12, 11, 11])


def test_unsigned_currents_get_the_sign_of_the_command(tmp_path):
    text = "t_s,i1_A,i2_A,i3_A,w1_cmd_rad_s,w2_cmd_rad_s,w3_cmd_rad_s\n0,1,2,3,5,-5,0\n0.1,1,2,3,-5,5,1\n"
    run = read_log(write(tmp_path, text), current_unsigned=True)
    np.testing.assert_array_equal(run.current, [[1, -2, 0], [-1, 2, 3]])
    assert recorded_log(write(tmp_path, text), None, LogOptions(current_unsigned=True)).current_unsigned
    alone = write(tmp_path, "t_s,i1_A\n0,1\n0.1,2\n", "alone.csv")
    with pytest.raises(InputError, match="cannot give unsigned currents a sign"):
        read_log(alone, current_unsigned=True)


def test_overrides_and_maps(tmp_path):
    path = write(tmp_path, "t_s,foo,bar\n0,1,2\n0.1,3,4\n")
    run = read_log(path, columns={"u1": "foo:mV", "w1": "-bar:rad/s"})
    np.testing.assert_allclose(run.voltage[:, 0], [1e-3, 3e-3])
    np.testing.assert_allclose(run.wheel_speed[:, 0], [-2, -4])
    (tmp_path / "map.toml").write_text('[t]\ncolumn = "t_s"\nunit = "s"\n[u1]\ncolumn = "nope"\nunit = "V"\n')
    with pytest.raises(InputError, match=r"the log has no column nope for u1; got t_s, foo, bar"):
        read_log(path, columns=tmp_path / "map.toml")


def test_a_log_without_a_clock_is_refused_with_a_remedy(tmp_path):
    path = write(tmp_path, "step,w1_rad_s\n0,1\n1,2\n2,3\n")
    with pytest.raises(InputError, match=r'cannot tell the time of the rows: .*`column` "t=step:UNIT"'):
        read_log(path)


def test_why_a_time_cannot_be_told_is_whole_and_a_name_that_is_nearly_right_is_known(tmp_path):
    """The reason ended in "...": its words were cut in the middle."""
    path = write(tmp_path, "timestep (8Hz),voltage (V),velocity (turns/s)\n0,1,2\n8,2,3\n16,2,3\n")
    with pytest.raises(InputError, match="neither its name nor a unit says that it is a time") as caught:
        read_log(path)
    assert "..." not in str(caught.value).partition("`column`")[0]
    with pytest.raises(InputError, match=r'no column timestep for t; .*; did you mean "timestep \(8Hz\)"\?'):
        read_log(path, columns={"t": "timestep:s"})


def test_words_where_numbers_are_needed_are_refused(tmp_path):
    path = write(tmp_path, "t_s,w1_rad_s,mode\n0,1,auto\n0.1,2,auto\n")
    assert len(read_log(path)) == 2  # a column of words that nobody needs
    with pytest.raises(InputError, match=r"log.csv:3, column w1_rad_s: not a number; got x"):
        read_log(write(tmp_path, "t_s,w1_rad_s\n0,1\n0.1,x\n"), columns={"w1": "w1_rad_s:rad/s"})


def test_more_wheels_than_the_robot_has_are_refused(tmp_path):
    path = write(tmp_path, "t_s,w1_rad_s,w2_rad_s,w3_rad_s,w4_rad_s\n0,1,2,3,4\n0.1,1,2,3,4\n")
    with pytest.raises(InputError, match="the log has more wheels than the robot; got 4 wheels; expected 3"):
        read_log(path, load_robot("axebot"))


def test_a_component_of_a_log(tmp_path):
    log = recorded_log(write(tmp_path, "t_s,w1_rad_s,yaw_rad\n0,1,2\n0.1,2,3\n"))
    np.testing.assert_array_equal(component(log, "w1"), [1, 2])
    np.testing.assert_array_equal(component(log, "heading"), [2, 3])
    assert component(log, "x") is None
    assert component(log, "u1") is None
    assert component(log, "nonsense") is None


@pytest.mark.parametrize(
    ("form", "separator"),
    [("20.11.2026 10:00:{}", ","), ("20.11.2026 9:59:{}", ";"), ("10:00:{}", ","), ("9:00:{}", ",")],
)
def test_german_dates_and_times_of_day_are_a_clock(tmp_path, form, separator):
    point = "," if separator == ";" else "."
    stamps = [form.format(s).replace(".250", f"{point}250") for s in ("00", "00.250", "01")]
    path = write(tmp_path, f"Uhrzeit{separator}w1_rad_s\n" + "".join(f"{s}{separator}1\n" for s in stamps))
    np.testing.assert_allclose(read_log(path).t, [0.0, 0.25, 1.0], atol=1e-9)


def test_a_time_of_day_may_pass_midnight(tmp_path):
    path = write(tmp_path, "time,w1_rad_s\n23:59:59.5,1\n00:00:00.0,2\n00:00:00.5,3\n")
    np.testing.assert_allclose(read_log(path).t, [0.0, 0.5, 1.0], atol=1e-9)
    with pytest.raises(InputError, match=r"time goes back; got -1 s after 0 s"):
        read_log(write(tmp_path, "time,w1_rad_s\n10:00:01,1\n10:00:00,2\n10:00:02,3\n"))


@pytest.mark.parametrize("form", ["{:.2f}", "2026-11-20T10:00:{:05.2f}", "10:00:{:05.2f}"])
def test_pieces_of_a_log_count_from_the_first_row_of_all(tmp_path, form):
    start = 1.7e9 if form == "{:.2f}" else 0.0
    rows = [f"{form.format(start + 0.25 * k)},{k}" for k in range(40)]
    path = write(tmp_path, "timestamp,w1_rad_s\n" + "\n".join(rows))
    pieces = list(iter_logs(path, rows=16, options=LogOptions(assume={"t": "s"})))
    assert len(pieces) == 3
    np.testing.assert_allclose(np.concatenate([piece.t for piece in pieces]), 0.25 * np.arange(40), atol=1e-6)
    assert not check_blocks(iter(pieces)).of("time_back")


@pytest.mark.parametrize(
    ("unit", "period", "step"),
    [("ms", 2.0**16, 10.0), ("us", 2.0**32, 1e4), ("ms", 2.0**32, 10.0), ("s", 86400.0, 0.01)],
)
def test_a_clock_whose_counter_is_full_goes_on(tmp_path, unit, period, step):
    counts = np.mod(period - 200.5 * step + step * np.arange(500), period)
    path = write(
        tmp_path, f"t_{unit},w1_rad_s\n" + "".join(f"{count!r},{k}\n" for k, count in enumerate(counts.tolist()))
    )
    run = read_log(path)
    size = {"s": 1.0, "ms": 1e-3, "us": 1e-6}[unit]
    np.testing.assert_allclose(np.diff(run.t), step * size, rtol=1e-4)
    assert any(f"starts over after {period:.6g} {unit}" in words for words in said(run.warnings))
    pieces = list(iter_logs(path, rows=150))
    np.testing.assert_allclose(np.concatenate([piece.t for piece in pieces]), run.t, rtol=1e-12)


def test_a_clock_that_counts_with_a_sign_goes_on(tmp_path):
    counts = np.mod(2**31 - 2_000_500 + 10_000 * np.arange(500) + 2**31, 2**32) - 2**31
    run = read_log(write(tmp_path, "t_us,w1_rad_s\n" + "".join(f"{count},1\n" for count in counts)))
    np.testing.assert_allclose(np.diff(run.t), 0.01, rtol=1e-9)


def test_two_logs_in_one_file_are_no_full_counter_but_lie_apart(tmp_path):
    t = [*np.arange(0, 500, 10), *np.arange(0, 500, 10)]
    run = read_log(write(tmp_path, "t_ms,w1_rad_s\n" + "".join(f"{each},1\n" for each in t)))
    np.testing.assert_allclose(run.t[[49, 50, 99]], [0.49, 1.49, 1.98])
    assert any("the time begins again in line 52, at 0 s after 0.49 s" in words for words in said(run.warnings))


@pytest.mark.parametrize(("option", "value"), [("assume", "d=duty/255"), ("assume", ["d=%"]), ("latency", 0.02)])
def test_options_that_are_dictionaries_say_so(tmp_path, option, value):
    path = write(tmp_path, "t_s,vx_m_s\n0,1\n0.1,1\n0.2,1\n")
    with pytest.raises(InputError, match=rf"{option}: not a dictionary; got .*; expected one such as {{'"):
        read_log(path, **{option: value})
