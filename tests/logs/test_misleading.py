"""What readers said of logs and was not so: clocks, steps of time, rows cut off, columns and units."""

import numpy as np
import pytest

from omnidyn.errors import InputError
from omnidyn.findings.check import check
from omnidyn.logs.read_log import LogOptions, iter_logs, read_log, recorded_log
from omnidyn.logs.readers.read_table import iter_tables, read_table
from omnidyn.model.robot_file import load_robot
from tests.support.codes import said

VOLTS = "u1_V,u2_V,u3_V"


def text(head, rows):
    return f"{head},{VOLTS}\n" + "".join(f"{each},1,{k % 7},-2\n" for k, each in enumerate(rows))


# ---- milliseconds without leading zeros -----------------------------------------------------------------


def bare(seconds):
    """19:18:19.82 for 82 ms, as printf("%02d:%02d:%02d.%d") writes it."""
    whole, ms = divmod(round(seconds * 1000), 1000)
    return f"{19 + whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}.{ms}"


def test_milliseconds_without_leading_zeros_are_understood(write):
    seconds = 1118.0 + 0.0591 * np.arange(400)
    path = write(text("time", map(bare, seconds)))
    run = read_log(path)
    np.testing.assert_allclose(run.t, seconds - seconds[0], atol=1e-3)
    assert any("milliseconds without leading zeros" in words for words in said(run.warnings))
    pieces = list(iter_logs(path, rows=100))
    np.testing.assert_allclose(np.concatenate([piece.t for piece in pieces]), run.t, atol=1e-9)


def test_tenths_of_a_second_stay_what_they_are(write):
    run = read_log(write(text("time", [f"12:00:{k // 4:02d}{('', '.25', '.5', '.75')[k % 4]}" for k in range(100)])))
    np.testing.assert_allclose(run.t, 0.25 * np.arange(100), atol=1e-9)


def test_a_clock_that_goes_back_over_and_over_is_not_to_be_sorted(write):
    path = write(text("t_s", [f"{k // 10}.{k % 10 * 100}" if k % 10 else f"{k // 10}.90" for k in range(200)]))
    with pytest.raises(InputError, match=r"time goes back; .*do not sort the rows") as error:
        read_log(path)
    assert "`sort`" not in str(error.value)
    (finding,) = check(recorded_log(path)).of("time_back")
    assert "do not sort the rows" in finding.remedy_text


# ---- a column of steps ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name, step",
    [("dt", 0.02), ("dt_s", 0.02), ("dt_ms", 20.0), ("delta_t", 0.02), ("loop_time_ms", 20.0), ("Δt", 0.02)],
)
def test_a_column_of_step_times_is_summed_up(write, name, step):
    steps = step * (1.0 + 0.05 * (np.arange(300) % 3))
    path = write(text(name, [f"{each:.6g}" for each in steps]))
    run = read_log(path)
    size = 0.02 / step
    np.testing.assert_allclose(run.t, size * (np.cumsum(steps) - steps[0]), atol=1e-6)
    assert any("it is summed up" in words for words in said(run.warnings))
    pieces = list(iter_logs(path, rows=64))
    np.testing.assert_allclose(np.concatenate([piece.t for piece in pieces]), run.t, atol=1e-9)


def test_a_clock_beside_steps_is_the_clock(write):
    run = read_log(write(text("t_s,dt", [f"{0.01 * k:.2f},0.02" for k in range(100)])))
    np.testing.assert_allclose(run.t, 0.01 * np.arange(100), atol=1e-9)


def test_a_clock_that_is_called_dt_is_a_clock(write):
    run = read_log(write(text("dt_s", [f"{0.01 * k:.2f}" for k in range(100)])), columns={"t": "dt_s:s"})
    np.testing.assert_allclose(run.t, 0.01 * np.arange(100), atol=1e-9)


# ---- a last row that was cut off ------------------------------------------------------------------------


@pytest.mark.parametrize("rest", ["25.0,1", "25.0", '25.0,"1', "25.0,1,"])
@pytest.mark.parametrize("rows", [50, 10_000])
def test_a_last_row_cut_in_mid_write_is_left_out(write, rest, rows):
    whole = "t_s,x_m,y_m,heading_rad\n" + "".join(f"{k / 10},{k},{2 * k},0\n" for k in range(250))
    path = write(whole + rest)
    pieces = list(iter_tables(path, rows))
    assert sum(map(len, pieces)) == 250
    assert "line 252, the last one, ends in the middle of a row: it was left out" in said(read_table(path).notes)
    with pytest.raises(InputError, match=":252: "):
        read_table(write(whole + rest + "\n"))


def test_a_row_cut_off_in_the_middle_of_a_file_is_refused(write):
    with pytest.raises(InputError, match=":3: row 2 has another number of cells"):
        read_table(write("t_s,x_m\n0,1\n0.1\n0.2,3"))


# ---- bytes that are no text -----------------------------------------------------------------------------


def test_random_bytes_are_called_what_they_are(write):
    content = b"x" + np.random.default_rng(0).bytes(5000)
    with pytest.raises(InputError, match="not a text file; got bytes that are no text") as error:
        read_table(write(content))
    assert "zero" not in str(error.value)


@pytest.mark.parametrize("size", [60, 200, 5000])
def test_random_bytes_without_zeros_are_no_text_either(write, size):
    """They were said to lack a separator, or a row. What the file begins with is told, in hex."""
    content = np.random.default_rng(1).integers(1, 256, size).astype(np.uint8).tobytes()
    with pytest.raises(InputError, match="not a text file; got bytes that are no text") as error:
        read_table(write(content))
    assert f"it begins with {content[:8].hex(' ')}" in str(error.value)
    assert "export it as CSV" in str(error.value)


@pytest.mark.parametrize(
    "encoding, name", [("latin-1", "Geschwindigkeit Räder"), ("gbk", "速度"), ("shift-jis", "速度"), ("utf-8", "速度")]
)
def test_text_in_any_encoding_is_text(write, encoding, name):
    """A control character in it (a form feed, a colour of a terminal) makes no noise of it."""
    table = read_table(write(f"t_s,{name}\n0,1\n0.1,2\n0.2,3\n".encode(encoding)))
    assert len(table) == 3
    table = read_table(write(f"# \x1b[0m{name}\nt_s,x_m\n0,1\n0.1,2\n0.2,3\n".encode(encoding)))
    assert len(table) == 3


def test_zero_bytes_in_text_are_zero_bytes(write):
    rows = "".join(f"{k},{k}\n" for k in range(500)).encode()
    with pytest.raises(InputError, match="got zero bytes in it"):
        read_table(write(b"t_s,x_m\n" + rows + bytes(100) + rows))


# ---- columns and units ----------------------------------------------------------------------------------


def three(names, rows=60):
    return f"t_s,{names}\n" + "".join(f"{k / 50},{13 * k},{17 * k},{7 * k}\n" for k in range(rows))


def test_a_column_that_is_mapped_is_no_longer_called_not_taken(write):
    path = write(three("speed_m1 [m/s],speed_m2 [m/s],speed_m3 [m/s]"))
    plain = said(recorded_log(path).columns.doubts)
    assert any("speed_m1, speed_m2, speed_m3" in words for words in plain)
    one = said(recorded_log(path, options=LogOptions(overrides=("w1=speed_m1:rad/s",))).columns.doubts)
    assert any("speed_m2, speed_m3" in words for words in one)
    assert not any("speed_m1" in words for words in one)


def test_the_speed_of_a_rim_is_called_that(write):
    (words,) = said(recorded_log(write(three("speed_m1 [m/s],speed_m2 [m/s],speed_m3 [m/s]"))).columns.doubts)
    assert "m/s is the speed of its rim: name the robot, whose radius of the wheels makes rad/s of it" in words
    assert "`assume`" not in words
    (words,) = said(recorded_log(write(three("v1_m_s,v2_m_s,v3_m_s"))).columns.doubts)
    assert words.startswith("v1_m_s, v2_m_s, v3_m_s look like w1, w2, w3, but m/s is the speed of its rim")


@pytest.mark.parametrize("names", ["v{}_m_s", "speed_m{} [m/s]", "wheel{}_speed_m_s", "motor{}_vel_m_s", "v{}_mm_s"])
def test_the_speed_of_a_rim_is_that_of_the_wheel_times_its_radius(write, names):
    """It was left out, or taken for nothing. The gear has no part in it, whatever the name says."""
    robot = load_robot("axebot")
    log = recorded_log(write(three(",".join(names.format(k) for k in (1, 2, 3)))), robot)
    size = 1e-3 if "mm" in names else 1.0
    assert log.channels["wheel_speed"] == pytest.approx(size * np.outer(np.arange(60), [13, 17, 7]) / 0.035)
    assert not said(log.columns.doubts)
    assert sum("divided by the radius of the wheels" in note for note in said(log.notes)) == 1


def test_a_rim_may_be_given_by_hand(write):
    robot, path = load_robot("axebot"), write(three("p,q,r"))
    log = recorded_log(path, robot, LogOptions(overrides=("a1=p:mm", "w2=q:cm/s")))
    assert log.channels["wheel_angle"][:, 0] == pytest.approx(1e-3 * 13 * np.arange(60) / 0.035)
    assert log.channels["wheel_speed"][:, 1] == pytest.approx(1e-2 * 17 * np.arange(60) / 0.035)
    with pytest.raises(InputError, match=r"w2 is that of a rim: without its radius it is no angle; got q \[cm/s\]"):
        recorded_log(path, options=LogOptions(overrides=("w2=q:cm/s",)))
    with pytest.raises(InputError, match="what is in metres is of the rim, behind the gear; got w2: q"):
        recorded_log(path, robot, LogOptions(overrides=("w2=q:m/s@motor",)))
    with pytest.raises(InputError, match="u1 cannot have this unit; got m/s"):
        recorded_log(path, robot, LogOptions(overrides=("u1=p:m/s",)))


def test_an_assumed_unit_of_nothing_is_said(write):
    path = write(three("w1,w2,w3"))
    doubts = said(recorded_log(path, options=LogOptions(assume={"z": "rpm", "w": "rpm"})).columns.doubts)
    assert doubts == ("`assume` z=rpm is used for no column: there is none of this name or kind",)
    for fine in ({"w": "rpm"}, {"w2": "rpm"}):
        assert said(recorded_log(path, options=LogOptions(assume=fine)).columns.doubts) == ()


def test_counts_called_a1_are_taken_where_their_unit_is_said(write):
    path = write(three("a1,a2,a3"))
    log = recorded_log(path, options=LogOptions(assume={"a": "ticks/2000"}))
    assert [column.unit for key, column in log.columns.columns.items() if key != "t"] == ["ticks/2000"] * 3
    assert log.channels["wheel_angle"][10, 0] == pytest.approx(130 / 2000 * 2 * np.pi)
    assert log.columns.unused == ()
    assert recorded_log(path).columns.unused == ("a1", "a2", "a3")  # of accelerations nothing is assumed


def test_a_doubtful_column_is_listed_once(write):
    columns = recorded_log(write(three("speed_m1 [m/s],speed_m2 [m/s],mood"))).columns
    assert columns.unused == ("speed_m1", "speed_m2", "mood")
    assert columns.passed_over == ("mood",)


def test_a_unit_may_be_said_of_all_columns_of_one_name(tmp_path):
    """`--assume enc=ticks/1440` for enc1 .. enc3: what the user reads in the file, not what we call it."""
    path = tmp_path / "a.csv"
    path.write_text(
        "t_s,pwm_1,pwm_2,pwm_3,enc1,enc2,enc3\n" + "".join(f"{k / 50},9,0,{k},{k},0,{k}\n" for k in range(99))
    )
    by_name = recorded_log(path, options=LogOptions(assume={"enc": "ticks/1440", "pwm": "duty/255"}))
    by_letter = recorded_log(path, options=LogOptions(assume={"a": "ticks/1440", "d": "duty/255"}))
    for name in ("wheel_angle", "duty"):
        assert np.array_equal(by_name.channels[name], by_letter.channels[name])
    assert "assume" not in " ".join(said(by_name.columns.doubts))
