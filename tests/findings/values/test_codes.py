"""Cells that do not mean what they say, and drives without a direction."""

import numpy as np
import pytest

from omnidyn.findings.check import check
from omnidyn.logs.column import Column
from omnidyn.logs.columns.mapping import ColumnMap
from omnidyn.logs.log import Log
from omnidyn.logs.read_log import recorded_log
from omnidyn.simulation.simulate import simulate


@pytest.mark.parametrize("code", [-9999.0, 999.0, 65535.0])
@pytest.mark.parametrize("channel, letter", [("voltage", "u"), ("wheel_speed", "w"), ("pose", "")])
def test_a_number_that_stands_for_no_value(log, robot, with_channels, grave, channel, letter, code):
    values = log.channels[channel].copy()
    values[7::37, 1] = code
    verdict = check(with_channels(**{channel: values}), robot)
    (finding,) = verdict.of("placeholder")
    assert (finding.severity, finding.subject) == ("error", f"{letter}2" if letter else "y")
    assert finding.numbers["cell"] == code
    assert finding.rows[0] == (9, 9)
    assert grave(verdict) == {"placeholder"}


def test_a_speed_that_happens_to_be_such_a_number_is_a_speed(log, robot, with_channels, grave):
    values = log.channels["wheel_speed"] * 999.0 / log.channels["wheel_speed"].max()
    verdict = check(with_channels(wheel_speed=values), robot)
    assert not verdict.of("placeholder")


def test_negative_numbers_of_16_bits_read_as_unsigned(log, robot, with_channels, grave):
    wrong = np.round(log.channels["current"] * 1e3) % 65536 * 1e-3
    columns = ColumnMap({f"i{k}": Column(f"m{k}", "mA") for k in (1, 2, 3)})
    changed = with_channels(current=wrong)
    verdict = check(Log(changed.t, changed.channels, changed.lines, columns), robot)
    assert [finding.subject for finding in verdict.of("wrapped")] == ["i1", "i2", "i3"]
    assert "negative numbers of 16 bits, read as unsigned" in str(verdict.of("wrapped")[0])
    assert grave(verdict) == {"wrapped"}


def test_currents_without_a_sign_tell_nothing_about_the_gear(log, robot, with_channels, grave):
    """Their consequences are not reported as faults of their own."""
    clean = with_channels(current=np.abs(log.channels["current"]), twist=None, pose=None)
    assert grave(check(clean, robot)) == {"unsigned"}


def test_milliamperes_read_as_amperes_leave_the_wheels_alive(log, robot, with_channels, grave):
    only = with_channels(current=1e3 * log.channels["current"], twist=None, pose=None)
    assert grave(check(only, robot)) == {"unit"}


@pytest.mark.parametrize("drive", ["voltage", "duty"])
@pytest.mark.parametrize("how", ["size", "offset"])
def test_a_drive_that_is_never_negative_while_the_wheels_turn_back(log, robot, with_channels, grave, drive, how):
    signed = log.channels["voltage"] / (1.0 if drive == "voltage" else 6.0)
    values = np.abs(signed) if how == "size" else signed / 2.0 + np.abs(signed).max() / 2.0
    verdict = check(with_channels(**{"voltage": None, drive: values}), robot)
    (finding,) = [each for each in verdict.of("unsigned") if each.subject[0] == drive[0].replace("v", "u")]
    assert finding.severity == "error"
    assert "a size without its direction, or counted from an offset" in str(finding)
    assert grave(verdict) <= {"unsigned", "saturation"}


def test_driving_one_way_only_is_no_fault(robot, grave):
    voltage = np.tile([1.0, 5.0, 5.0], (1500, 1))
    voltage[::200] = voltage[1::200] = 0.0
    run = simulate(robot, voltage, 0.01)
    rng = np.random.default_rng(0)
    noisy = run.wheel_speed + 0.05 * rng.normal(size=run.wheel_speed.shape)
    verdict = check(Log(run.t, {"voltage": run.voltage, "wheel_speed": noisy}, np.arange(len(run)) + 2), robot)
    assert not verdict.of("unsigned")


@pytest.mark.parametrize("rate", [100, 1000])
def test_a_long_steady_spin_in_coarse_steps_is_not_stuck(robot, grave, rate):
    voltage = np.full((18 * rate, 3), 4.0)
    voltage[: rate // 2] = 0.0
    run = simulate(robot, voltage, 1.0 / rate)
    step = 0.02 * np.abs(run.wheel_speed).max()
    rng = np.random.default_rng(1)
    channels = {
        "voltage": run.voltage,
        "current": run.current + 0.02 * np.abs(run.current).max() * rng.normal(size=run.current.shape),
        "wheel_speed": step * np.round(run.wheel_speed / step),
    }
    verdict = check(Log(run.t, channels, np.arange(len(run)) + 2), robot)
    assert grave(verdict) == set()
    broken = {**channels, "wheel_speed": channels["wheel_speed"].copy()}
    broken["wheel_speed"][5 * rate :, 1] = broken["wheel_speed"][rate // 2 + 4, 1]
    again = check(Log(run.t, broken, np.arange(len(run)) + 2), robot)
    grave = {finding.subject for finding in again.findings if finding.severity != "note"}
    assert "w2" in grave or again.of("wheel_scale")


@pytest.mark.parametrize("fault", ["rpm", "inverted", "swapped", "gear"])
def test_a_dead_encoder_hides_no_second_fault(log, robot, with_channels, grave, fault):
    speed = log.channels["wheel_speed"].copy()
    if fault == "rpm":
        speed *= 60.0 / (2.0 * np.pi)
    elif fault == "inverted":
        speed[:, 2] *= -1.0
    elif fault == "swapped":
        speed[:, [1, 2]] = speed[:, [2, 1]]
    else:
        speed *= 1.2
    speed[:, 0] = 0.0
    verdict = check(with_channels(wheel_speed=speed), robot)
    assert [finding.subject for finding in verdict.of("dead")] == ["w1"]
    assert grave(verdict) == {"dead", {"rpm": "unit"}.get(fault, fault)}
    if fault == "inverted":
        assert [finding.subject for finding in verdict.of("inverted")] == ["w3"]


def test_what_was_exchanged_with_the_dead_encoder_starts_no_tale(log, robot, with_channels, grave):
    """Nothing is said of slip or gears where the speeds of two wheels are not known."""
    speed = log.channels["wheel_speed"].copy()
    speed[:, 1] = speed[:, 0]
    speed[:, 0] = 0.0
    assert grave(check(with_channels(wheel_speed=speed), robot)) == {"dead"}


@pytest.mark.parametrize(
    "name, code", [("i1_A", -999.0), ("w1_rad_s", 65535.0), ("supply_V", 9999.0), ("x_m", -9999.0)]
)
def test_a_code_in_some_rows_asks_for_no_other_unit(tmp_path, name, code):
    """From the file on: it is the channel that is named, not its unit, however many rows hold the code."""
    t, draw = np.arange(600) / 100.0, np.random.default_rng(0)
    values = 3.0 * np.sin(t) + 0.01 * draw.normal(size=600) + (12.0 if name == "supply_V" else 0.0)
    values[7::37] = code
    table = np.column_stack([t, 5.0 * np.sin(t), values])
    np.savetxt(tmp_path / "log.csv", table, delimiter=",", header=f"t_s,u1_V,{name}", comments="")
    verdict = check(recorded_log(tmp_path / "log.csv"))
    assert not verdict.of("not_taken")
    (finding,) = verdict.of("placeholder")
    assert finding.numbers["cell"] == code
