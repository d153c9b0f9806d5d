"""What the tools of teams export is recognised: AdvantageScope, PlotJuggler, Road Runner."""

import numpy as np
import pytest

from omnidyn.errors import InputError
from omnidyn.logs.read_log import recorded_log
from omnidyn.logs.readers.read_table import read_table

T = np.arange(60) / 50 + 12.3


def test_a_list_of_advantagescope_is_a_topic_for_each_key(tmp_path):
    """CSV (List): Timestamp,Key,Value; a gyroscope at its own times, words and truth values between."""
    rows = ["Timestamp,Key,Value"]
    for k, t in enumerate(T):
        rows += [f"{t:.6f},/Drive/wheel{w}/velocity_rad_s,{k + 0.5 * w!r}" for w in (1, 2, 3)]
        rows += [f"{t + 0.003:.6f},/Drive/gyro_rad_s,{-k}"] * (k % 4 == 0)
        rows += [f"{t:.6f},/Drive/enabled,{'true' if k else 'false'}", f"{t:.6f},/Mode,auto"] * (k % 10 == 0)
    path = tmp_path / "list.csv"
    path.write_text("\n".join(rows) + "\n")
    log = recorded_log(path)
    known = np.isfinite(log.channels["wheel_speed"]).all(axis=1)
    np.testing.assert_allclose(log.t[known], T, atol=1e-9)
    np.testing.assert_array_equal(log.channels["wheel_speed"][known], np.arange(60)[:, None] + [0.5, 1.0, 1.5])
    table = read_table(path)
    assert table.own_clocks
    gyro = np.isfinite(table.columns["/Drive/gyro_rad_s"])
    np.testing.assert_allclose(table.columns["t_s"][gyro], T[::4] + 0.003, atol=1e-9)
    np.testing.assert_array_equal(
        table.columns["/Drive/enabled"][np.isfinite(table.columns["/Drive/enabled"])][:2], [0, 1]
    )
    assert "words are not read: /Mode" in table.notes
    assert len(table.sha256) == 64


def test_a_list_is_held_within_bounds(tmp_path):
    path = tmp_path / "list.csv"
    path.write_text("Timestamp,Key,Value\n" + "".join(f"{k / 100},a,{k}\n" for k in range(3000)))
    assert len(read_table(path, max_bytes=60_000)) == 3000
    with pytest.raises(InputError, match=r"the file is too large; got more than 40000 bytes"):
        read_table(path, max_bytes=40_000)


def test_a_table_of_advantagescope_is_a_log(tmp_path):
    names = [f"/Drive/wheel{k}/velocity_rad_s" for k in (1, 2, 3)]
    rows = [",".join(["Timestamp", *names, "/Drive/Enabled", "/Mode"])]
    rows += [f"{t:.6f},{k},{2 * k},{3 * k},{'true' if k > 5 else 'false'},auto" for k, t in enumerate(T)]
    path = tmp_path / "table.csv"
    path.write_text("\n".join(rows) + "\n")
    log = recorded_log(path)
    np.testing.assert_array_equal(log.channels["wheel_speed"], np.arange(60)[:, None] * [1.0, 2.0, 3.0])


def test_a_table_of_plotjuggler_is_a_log(tmp_path):
    """Each topic fills its own rows; the first column is __time."""
    names = [f"/joint_states/wheel_{k}_joint/velocity" for k in (1, 2, 3)]
    names += [f"/odom/twist/twist/{each}" for each in ("linear/x", "linear/y", "angular/z")]
    names += [f"/cmd_vel/{each}" for each in ("linear/x", "linear/y", "angular/z")]
    rows = [",".join(["__time", *names])]
    for k, t in enumerate(T):
        odom = ["0.1", "0.2", f"{k / 32}"] if k % 4 == 0 else [""] * 3
        rows.append(",".join([f"{1.7e9 + t:.6f}", "1", "2", f"{k}", *odom, "0.5", "0", "0"]))
    path = tmp_path / "juggler.csv"
    path.write_text("\n".join(rows) + "\n")
    run = recorded_log(path).to_run()
    np.testing.assert_array_equal(run.wheel_speed[:, 2], np.arange(60.0))
    np.testing.assert_array_equal(run.twist_command[:, 0], 0.5)
    known = np.isfinite(run.twist[:, 2])
    np.testing.assert_array_equal(run.twist[known, 2], np.arange(0.0, 60.0, 4.0) / 32)


def test_a_log_of_road_runner_is_named_with_the_way_out(tmp_path):
    path = tmp_path / "2026_11_20__10_00_00_000__Tele.log"
    path.write_bytes(b"RR\x00\x01" + bytes(range(200)))
    with pytest.raises(InputError, match=r"got a log of Road Runner; .*open it in AdvantageScope and export it"):
        read_table(path)
