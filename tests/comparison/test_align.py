"""align: logs cut out of one fine run at known times, with rows and noise of their own."""

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import InsufficientDataError
from tests.support.axebot_logs import excitation
from tests.support.codes import codes
from tests.support.outputs import strict

FINE = 0.001  # [s]
NOISE = {"twist": (0.01, 0.01, 0.05), "wheel_speed": 0.1, "pose": 0.002}


@pytest.fixture(scope="module")
def fine():
    """A run of 30 s, a row each millisecond."""
    return omnidyn.simulate(omnidyn.load_robot("axebot"), np.repeat(excitation(30.0), 10, axis=0), FINE)


def cut(fine, first, last, every, *channels, seed=0):
    """Some rows of a run, from time 0, with noise."""
    draws, rows = np.random.default_rng(seed), slice(first, last, every)
    measured = {name: getattr(fine, name)[rows] for name in channels}
    noisy = {
        name: values + np.array(NOISE[name]) * draws.standard_normal(values.shape) for name, values in measured.items()
    }
    return omnidyn.Run(t=FINE * np.arange(len(fine.t[rows])) * every, voltage=fine.voltage[rows], **noisy)


@pytest.mark.parametrize(
    ("every", "other", "channels"),
    [(10, 10, ["twist"]), (10, 20, ["twist"]), (20, 7, ["wheel_speed"]), (50, 10, ["twist", "wheel_speed"])],
)
def test_the_offset_is_found_to_a_tenth_of_a_row(fine, every, other, channels):
    for part in range(0, 10, 3):
        begin = 4000 + part * max(every, other) // 10
        first = cut(fine, 0, 25_000, every, *channels, seed=1)
        second = cut(fine, begin, None, other, *channels, seed=2)
        found = omnidyn.align(first, second)
        assert abs(found.offset - begin * FINE) < 0.1 * max(every, other) * FINE
        assert abs(omnidyn.align(second, first).offset + begin * FINE) < 0.1 * max(every, other) * FINE
        assert found.correlation > 0.98
        assert found.overlap == pytest.approx((25_000 - begin) * FINE, abs=1.0)


def test_a_camera_and_a_gyro_are_aligned_by_the_rate_of_the_heading(fine):
    camera = cut(fine, 3333, None, 33, "pose", seed=1)
    gyro = cut(fine, 0, None, 10, "twist", seed=2)
    camera = camera.replace(voltage=None)
    found = omnidyn.align(gyro, camera)
    assert found.components == ("omega",)
    assert abs(found.offset - 3.333) < 0.1 * 0.033


def test_two_drives_are_unlike_and_two_logs_without_a_common_channel_are_refused(fine):
    other = omnidyn.simulate(omnidyn.load_robot("axebot"), excitation(30.0, seed=9), 0.01)
    found = omnidyn.align(cut(fine, 0, None, 10, "twist"), other)
    assert codes([found.verdict]) == ["logs_unlike"]
    one, two = omnidyn.Run(t=other.t, twist=other.twist), omnidyn.Run(t=other.t, voltage=other.voltage)
    with pytest.raises(InsufficientDataError, match=r"nothing in common|anything in common"):
        omnidyn.align(one, two)


def test_a_motion_that_repeats_itself_fits_at_several_offsets():
    t, draws = np.arange(0.0, 30.0, 0.01), np.random.default_rng(3)
    waves = np.sin(np.pi * t)  # a period of 2 s
    twist = np.stack([waves, 0.5 * waves, np.zeros_like(t)], axis=1) + 0.01 * draws.standard_normal((len(t), 3))
    found = omnidyn.align(omnidyn.Run(t=t, twist=twist), omnidyn.Run(t=t[530:] - t[530], twist=twist[530:]))
    assert found.correlation > 0.9
    assert codes([found.verdict]) == ["logs_aligned_in_several_ways"]
    assert abs(found.offset - found.rival_offset) == pytest.approx(2.0, abs=0.03)


def test_the_command_prints_the_offset(fine, tmp_path, monkeypatch, capsys):
    from omnidyn.cli import main

    monkeypatch.chdir(tmp_path)  # short names: a long one is broken at its end of line
    paths = ["a.csv", "b.csv"]
    for path, begin in zip(paths, (0, 1234), strict=True):
        omnidyn.write_run(cut(fine, begin, None, 10, "twist"), path)
    assert main(["align", *paths, "--json"]) == 0
    said = strict(capsys.readouterr().out)
    assert said["offset"] == omnidyn.align(*map(omnidyn.read_log, paths)).offset
    assert said["offset"] == pytest.approx(1.234, abs=0.001)
    assert main(["align", *paths]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert f"{said['offset']:+.4f} s added to its times" in text
    assert said["verdict"] in text
    other = omnidyn.simulate(omnidyn.load_robot("axebot"), excitation(30.0, seed=9), 0.01)
    omnidyn.write_run(other, "c.csv")
    assert main(["align", "a.csv", "c.csv"]) == 4
