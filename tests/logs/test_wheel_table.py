"""A table of wheels from what they were asked for and how fast they turned, beside gains that are known."""

import numpy as np
import pytest

import omnidyn
from omnidyn.model.wheels import twist_from_wheel_speed

LEKIWI = omnidyn.load_robot("lekiwi")
DT, LAG = 0.05, 0.1  # [s]
GAIN = np.array([[1.02, 0.95, 1.0], [0.78, 0.9, 1.1]])  # forward, backward, of each wheel
BAND = np.array([[0.1, 0.0, 0.2], [0.15, 0.05, 0.0]])  # [rad/s]


def turned(asked):
    """Speeds of wheels that are no better than these [rad/s]."""
    gain, band = (np.where(asked < 0.0, both[1], both[0]) for both in (GAIN, BAND))
    return np.sign(asked) * gain * np.maximum(np.abs(asked) - band, 0.0)


def driven(levels, noise=0.02, seed=0):
    """A log of steps of 1.5 s of each level, wheels that lag, and noise."""
    rng = np.random.default_rng(seed)
    asked = np.repeat([[s * level] * 3 for level in levels for s in (1.0, 0.0, -1.0, 0.0)], 30, axis=0)
    speed, rows = np.zeros(3), []
    for row in asked:
        rows.append(speed)
        speed = speed + DT / LAG * (turned(row) - speed)
    measured = np.array(rows) + noise * rng.standard_normal(asked.shape)
    return omnidyn.Run(t=DT * np.arange(len(asked)), wheel_speed_command=asked, wheel_speed=measured)


def test_gains_and_dead_bands_are_those_of_the_wheels():
    table = omnidyn.wheel_table(driven([0.6, 1.5, 2.5, 3.5]), LEKIWI)
    for line in table.lines:
        way = 0 if line.direction > 0 else 1
        assert line.gain == pytest.approx(GAIN[way, line.wheel - 1], rel=0.01)
        assert line.dead_band == pytest.approx(BAND[way, line.wheel - 1], abs=0.02)
    assert table.verdict.code == "wheel_table"
    assert "0.78 to 1.10 times as fast as asked" in str(table)


def test_what_it_asks_for_turns_the_wheels_as_wanted():
    table = omnidyn.wheel_table([driven([0.6, 1.5]), driven([2.5, 3.5], seed=1)], LEKIWI)
    wanted = np.random.default_rng(2).uniform(-2.5, 2.5, (100, 3))
    assert np.abs(turned(wanted) - wanted).max() > 0.5
    assert np.abs(turned(table.command(wanted)) - wanted).max() < 0.05
    np.testing.assert_allclose(table.speed(table.command(wanted)), wanted, atol=1e-12)
    assert table.command([0.0, 0.0, 0.0]).tolist() == [0.0, 0.0, 0.0]


def test_a_twist_stands_for_the_wheels():
    run = driven([0.6, 1.5, 2.5, 3.5], noise=0.0)
    of_body = run.replace(wheel_speed=None, twist=twist_from_wheel_speed(LEKIWI.wheels, run.wheel_speed))
    for line, same in zip(
        omnidyn.wheel_table(of_body, LEKIWI).lines, omnidyn.wheel_table(run, LEKIWI).lines, strict=True
    ):
        assert (line.gain, line.dead_band) == pytest.approx((same.gain, same.dead_band), abs=0.01)


def test_it_is_written_and_read(tmp_path):
    table = omnidyn.wheel_table(driven([0.6, 1.5, 2.5]), LEKIWI)
    table.write(tmp_path / "wheels.csv")
    wanted = np.array([1.0, -2.0, 0.5])
    read = omnidyn.read_wheel_table(tmp_path / "wheels.csv")
    np.testing.assert_allclose(read.command(wanted), table.command(wanted), rtol=1e-4)
    with pytest.raises(omnidyn.OmnidynError, match="exists"):
        table.write(tmp_path / "wheels.csv")


def test_a_wheel_at_the_limit_of_its_supply_is_no_line():
    run = driven([0.6, 1.5, 2.5, 3.5, 4.5], noise=0.0)
    table = omnidyn.wheel_table(run.replace(wheel_speed=np.clip(run.wheel_speed, -2.0, 2.0)), LEKIWI)
    assert table.verdict.code == "wheel_table_bent"


@pytest.mark.parametrize(
    ("run", "words"),
    [
        (lambda: driven([2.0]), "wheel 1 has too few speeds forward; got 1 at which"),
        (lambda: driven([1.0, 2.0]).replace(wheel_speed_command=None), "no speeds were asked for"),
        (lambda: driven([1.0, 2.0]).replace(wheel_speed=None), "wheel 1 has too few speeds forward; got 0"),
    ],
)
def test_logs_that_do_not_tell_are_refused(run, words):
    with pytest.raises(omnidyn.OmnidynError, match=words):
        omnidyn.wheel_table(run(), LEKIWI)


@pytest.mark.parametrize(
    ("signs", "wheels"),
    [
        ([1.0, -1.0, 1.0], r"wheel 2 \(gain -0\.9\d\)"),
        ([-1.0, -1.0, -1.0], r"wheel 1 \(gain -0\.8\d\), wheel 2 .*, wheel 3 "),
    ],
)
def test_wheels_that_turn_the_other_way_are_named(signs, wheels):
    run = driven([0.6, 1.5, 2.5, 3.5])
    run = run.replace(wheel_speed=run.wheel_speed * signs)
    words = f"a wheel turns the other way than it is asked to; got {wheels}.*; expected gains above 0; .*`column`"
    with pytest.raises(omnidyn.OmnidynError, match=words):
        omnidyn.wheel_table(run, LEKIWI)


@pytest.mark.parametrize("channel", ["wheel_speed", "wheel_speed_command", "wheel_angle"])
@pytest.mark.parametrize("levels", [[1.0, 2.0], [0.6, 1.5, 2.5]])
def test_the_log_of_another_robot_is_refused(channel, levels):
    """4 wheels in 12 stretches are as many numbers as 3 in 16."""
    run = driven(levels).replace(wheel_angle=np.zeros_like(driven(levels).wheel_speed))
    four = run.replace(**{channel: np.tile(np.asarray(getattr(run, channel))[:, :1], 4)})
    with pytest.raises(omnidyn.OmnidynError, match="another number of wheels; got 4 wheels; expected 3, as lekiwi has"):
        omnidyn.wheel_table(four, LEKIWI)


def test_wheels_of_no_dead_band_have_none():
    asked = np.repeat([[0.0], [1.0], [2.0], [-1.0], [-2.0]], 40, axis=0) * [1.0, 1.0, 1.0]
    angle = np.cumsum(0.8 * 0.05 * asked, axis=0)
    table = omnidyn.wheel_table(
        omnidyn.Run(t=0.05 * np.arange(200), wheel_speed_command=asked, wheel_angle=angle), LEKIWI
    )
    assert "-0" not in str(table)
    assert {round(line.gain, 3) for line in table.lines} == {0.8}


def test_files_that_are_no_table_are_refused(tmp_path):
    path = tmp_path / "wheels.csv"
    path.write_text("wheel,direction,gain,dead_band_rad_s,most_rad_s,missed_rad_s\n1,1,1,0,3,0\n1,1,1,0,3,0\n")
    with pytest.raises(omnidyn.OmnidynError, match="not a table of wheels"):
        omnidyn.read_wheel_table(path)
    with pytest.raises(omnidyn.OmnidynError, match="wrong number of wheels"):
        omnidyn.wheel_table(driven([1.0, 2.0]), LEKIWI).command([1.0, 2.0])
