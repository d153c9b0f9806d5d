"""What a log can be used for: each use yes, or no and why; and the verdict in a sentence."""

import numpy as np
import pytest

import omnidyn
from omnidyn.findings.check import check, check_blocks
from omnidyn.logs.read_log import LogOptions, recorded_log
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run

GOOD = {"whole logs": True, "steady state": True, "motors": True, "geometry": True}


def good(verdict):
    return {use.name: use.good for use in verdict.uses}


def words(verdict, name):
    return next(str(use.reason) for use in verdict.uses if use.name == name)


@pytest.fixture
def pwm(tmp_path):
    """What people log on an Arduino: PWM of no unit, counts of no turn."""
    rows = ["time_ms,PWM1,PWM2,PWM3,enc1,enc2,enc3,note"]
    for k in range(400):
        duty = [round(150 * np.sin(0.05 * k + wheel)) for wheel in range(3)]
        rows.append(f"{20 * k},{','.join(map(str, duty))},{','.join(str(7 * k + wheel) for wheel in range(3))},ok")
    path = tmp_path / "pwm.csv"
    path.write_text("\n".join(rows) + "\n")
    return path


def held(robot, seconds=20.0, step=0.01):
    """A run of the robot whose voltages are held for a second each."""
    rng = np.random.default_rng(1)
    wrench = rng.normal(size=(round(seconds), 3)) / [1.0, 1.0, 0.1]
    volts = wrench @ robot.wheels.wrench_matrix
    volts *= 5.0 / np.abs(volts).max(axis=1, keepdims=True)
    run = omnidyn.simulate(robot, np.repeat(volts, round(1.0 / step), axis=0), step)

    def noisy(values):
        return values + 0.003 * np.abs(values).max() * rng.normal(size=values.shape)

    return run.replace(current=noisy(run.current), wheel_speed=noisy(run.wheel_speed), twist=noisy(run.twist))


@pytest.fixture(scope="module")
def run():
    return held(load_robot("axebot"))


def test_a_full_log_is_usable_for_all(run, robot):
    verdict = check(run, robot)
    assert good(verdict) == GOOD
    assert verdict.verdict == "Usable for whole logs, steady state, motors and geometry; no warning."
    assert str(verdict).splitlines()[0] == verdict.verdict
    assert words(verdict, "whole logs") == "voltage in, twist, wheel_speed, current and pose out"
    assert "stretches of constant speed, the force from current" in words(verdict, "steady state")
    assert "omni wheels at 180, 300 and 60 degrees" in words(verdict, "geometry")
    use = verdict.to_dict()["uses"][0]
    assert (use["name"], use["good"], use["code"], use["text"]) == (
        "whole logs",
        True,
        "serves_whole",
        words(verdict, "whole logs"),
    )


def test_a_run_is_checked_without_a_robot_too(run):
    verdict = omnidyn.check(run)
    assert good(verdict) == GOOD
    assert words(verdict, "whole logs").endswith("; with a robot file")
    assert words(verdict, "steady state").endswith("; with a robot file")
    assert omnidyn.check(run.replace(warnings=("the clock was sorted",))).of("reading")[0].severity == "note"


def test_pwm_without_a_unit_names_what_would_settle_it(pwm):
    verdict = check(recorded_log(pwm))
    assert verdict.useless
    assert verdict.conclusion.numbers["reason"].code == "no_input"
    for settled in ("PWM1 .. PWM3, no unit is given", "(say `assume` d=duty/255)", "a=ticks/COUNTS_PER_TURN)"):
        assert settled in verdict.verdict
    assert words(verdict, "motors").startswith("no motor input: PWM1 .. PWM3, no unit is given")
    doubts = verdict.of("not_taken")
    columns = [finding.numbers["doubt"].columns for finding in doubts]
    assert columns == [("PWM1", "PWM2", "PWM3"), ("enc1", "enc2", "enc3")]
    assert doubts[1].numbers["doubt"].declarations == (("assume", "a=ticks/COUNTS_PER_TURN"),)
    assert doubts[1].remedy_text == "say `assume` a=ticks/COUNTS_PER_TURN"
    assert verdict.of("not_used")[0].numbers == {"columns": ("note",)}
    assert verdict.conclusion.code == "not_usable"


def test_the_units_it_names_settle_it(pwm):
    verdict = check(recorded_log(pwm, None, LogOptions(assume={"d": "duty/255", "a": "ticks/1000"})))
    assert good(verdict) == GOOD | {"geometry": False}
    assert words(verdict, "whole logs").endswith("with a robot file that has supply_V")
    assert words(verdict, "steady state").endswith("the force from duty; with a robot file that has supply_V")
    assert verdict.verdict.startswith("Usable for whole logs, steady state and motors, not for geometry")
    assert not verdict.of("not_taken")


def test_a_duty_needs_its_battery(run, robot):
    duty = run.replace(voltage=None, duty=run.voltage / 6.0)
    lacking = check(duty.replace(current=None), robot)
    for name in ("whole logs", "steady state"):
        assert (
            words(lacking, name) == "a duty needs its battery: a column supply, or [drive] supply_V in the robot file"
        )
    battery = robot.replace(drive=robot.drive.replace(supply=6.0))
    assert good(check(duty, battery))["whole logs"]


def test_no_input(run, robot):
    verdict = check(run.replace(voltage=None, current=None), robot)
    assert good(verdict) == {"whole logs": False, "steady state": False, "motors": False, "geometry": True}
    assert words(verdict, "whole logs") == "holds no voltage and no duty"
    assert words(verdict, "steady state") == "no current and no motor input"
    assert verdict.verdict == "Usable for geometry, not for whole logs, steady state and motors; no warning."


def test_encoders_only(run, robot):
    turned = np.cumsum(run.wheel_speed, axis=0) * 0.01
    verdict = check(Run(t=run.t, wheel_angle=turned, source="counts.csv"), robot)
    assert verdict.useless
    assert not verdict.has_errors
    assert verdict.verdict == "Not usable: holds no voltage and no duty."
    with_volts = check(Run(t=run.t, wheel_angle=turned, voltage=run.voltage), robot)
    assert good(with_volts) == GOOD | {"geometry": False}


def test_set_speeds_need_the_loop_of_the_firmware(run, robot):
    log = run.replace(voltage=None, wheel_speed_command=run.wheel_speed)
    assert "[drive] kind" in words(check(log, robot), "whole logs")
    assert not good(check(log, robot))["whole logs"]
    assert "speed loop of the firmware" in words(check(log), "whole logs")
    assert good(check(log))["whole logs"]


def test_too_short(run, robot):
    short = Run(t=run.t[:20], **{name: values[:20] for name, values in run.channels.items()})
    verdict = check(short, robot)
    assert verdict.useless
    assert verdict.verdict.startswith("Not usable: 20 rows, too few to tell motion from noise")


def test_at_rest_all_the_time(run, robot):
    rng = np.random.default_rng(2)
    still = run.replace(
        wheel_speed=1e-3 * rng.normal(size=run.wheel_speed.shape),
        twist=1e-3 * rng.normal(size=run.twist.shape),
        voltage=0.01 * run.voltage,
        pose=None,
        current=None,
    )
    verdict = check(still, robot)
    assert verdict.useless
    assert verdict.verdict.startswith("Not usable: the robot never moves")


def test_commands_that_never_hold_have_no_steady_state(robot):
    t = np.arange(0.0, 10.0, 0.01)
    wheel = 10.0 * np.stack([np.sin(9.0 * t + phase) for phase in (0.0, 2.0, 4.0)], axis=1)
    verdict = check(Run(t=t, voltage=0.5 * wheel, wheel_speed=wheel), robot)
    assert good(verdict) == {"whole logs": True, "steady state": False, "motors": True, "geometry": False}
    assert words(verdict, "steady state").startswith("no stretch of constant speed: hold")


def test_another_robot(run):
    verdict = check(run, load_robot("four-wheel"))
    assert words(verdict, "whole logs") == "the log is of 3 wheels, four-wheel has 4"
    assert good(verdict)["motors"]


def test_a_faulty_log_says_what_it_can_be_used_for_once_corrected(run, robot):
    verdict = check(run.replace(wheel_speed=run.wheel_speed[:, [1, 0, 2]]), robot)
    assert verdict.has_errors
    assert verdict.verdict.startswith("Not usable as it stands: ")
    assert "once corrected, usable for whole logs" in verdict.verdict


def test_blocks_have_one_answer(run, robot):
    log = omnidyn.findings.check.Log.of_run(run)
    blocks = [log.rows(slice(k, k + 500)) for k in range(0, 2001, 500)]
    verdict = check_blocks(blocks, robot)
    assert good(verdict) == good(check(run, robot))


def test_doubts_are_told_once_for_all_blocks(pwm):
    log = recorded_log(pwm)
    verdict = check_blocks([log.rows(slice(0, 200)), log.rows(slice(200, 400))])
    assert len(verdict.of("not_taken")) == 2
    assert "blocks" not in verdict.of("not_taken")[0].numbers
