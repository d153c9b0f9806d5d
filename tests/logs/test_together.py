"""Several files of one experiment as one log: joined by their stamps, or refused where they share no time."""

import numpy as np
import pytest

from omnidyn import read_log
from omnidyn.cli import main
from omnidyn.errors import InputError
from tests.support.codes import said

START = 1_700_000_000.0


def table(path, name, t, values, start=START):
    path.write_text(f"t_s,{name}\n" + "".join(f"{start + a:.6f},{b!r}\n" for a, b in zip(t, values, strict=True)))
    return path


def test_two_tables_of_one_clock_are_one_log(tmp_path):
    t, late = np.arange(50) / 50, np.arange(10) / 10 + 0.005
    one = table(tmp_path / "wheels.csv", "w1_rad_s", t, np.arange(50.0).tolist())
    other = table(tmp_path / "mocap.csv", "heading_rad", late, (late / 2).tolist())
    run = read_log(one, beside=[other], columns={"heading": "heading_rad:rad"})
    speed, heading = run.wheel_speed[:, 0], run.pose[:, 2]
    np.testing.assert_allclose(run.t[np.isfinite(speed)], t, atol=1e-6)
    np.testing.assert_array_equal(speed[np.isfinite(speed)], np.arange(50.0))
    np.testing.assert_allclose(run.t[np.isfinite(heading)], late, atol=1e-6)
    np.testing.assert_array_equal(heading[np.isfinite(heading)], late / 2)
    assert any("2 files are one experiment" in words for words in said(run.warnings))


def test_a_bag_and_a_table_are_one_log(tmp_path):
    pytest.importorskip("rosbags")
    from tests.support.bags import BagMaker, write_mcap

    maker = BagMaker()  # begins at START
    for k in range(100):
        maker.joints(k / 100, ["wheel_1", "wheel_2", "wheel_3"], [0, 0, 0], [k, 2, 3])
    bag = write_mcap(maker, tmp_path / "robot.mcap")
    late = np.arange(9) / 10 + 0.1234
    other = table(tmp_path / "battery.csv", "battery_V", late, (12.0 - late).tolist())
    assert main(["convert", str(bag), str(tmp_path / "both.csv"), "--with", str(other)]) == 0
    run = read_log(tmp_path / "both.csv")
    assert np.isfinite(run.wheel_speed[:, 0]).sum() == 100
    assert len(run) == 109


def test_one_column_in_two_files_is_told_by_the_file(tmp_path):
    t = np.arange(20) / 50
    one = table(tmp_path / "a.csv", "w1_rad_s", t, [1.0] * 20)
    other = table(tmp_path / "b.csv", "w1_rad_s", t, [2.0] * 20)
    run = read_log(one, beside=[other], columns={"w1": "b/w1_rad_s:rad/s"})
    np.testing.assert_array_equal(run.wheel_speed[:, 0], 2.0)


def test_files_of_two_runs_or_clocks_are_refused(tmp_path):
    t = np.arange(20) / 50
    one = table(tmp_path / "a.csv", "w1_rad_s", t, [1.0] * 20)
    other = table(tmp_path / "b.csv", "heading_rad", t, [2.0] * 20, start=0.0)
    with pytest.raises(
        InputError,
        match=r"b\.csv: the files were not recorded at the same time; got 0 to 0.38 s, .*"
        r"within 2023-11-14 22:13:20 to .*stamps of one clock",
    ):
        read_log(one, beside=[other])


def test_a_file_that_is_joined_is_not_replaced(tmp_path, capsys):
    t = np.arange(20) / 50
    one = table(tmp_path / "a.csv", "w1_rad_s", t, [1.0] * 20)
    other = table(tmp_path / "b.csv", "heading_rad", t, [2.0] * 20)
    before = other.read_bytes()
    assert main(["convert", str(one), str(other), "--with", str(other), "--force"]) == 3
    assert "the result would replace its own input" in capsys.readouterr().err
    assert other.read_bytes() == before
