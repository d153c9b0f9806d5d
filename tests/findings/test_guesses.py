"""What rests on a guessed number is never fatal, and is judged again with the fitted robot."""

from dataclasses import replace

import numpy as np

from omnidyn.findings.check import check
from omnidyn.findings.guessed import judged_again, rest_on_guesses
from omnidyn.identification.log_verdicts import judged_by_fit
from omnidyn.logs.columns.mapping import load_map
from omnidyn.logs.read_log import LogOptions, recorded_log
from omnidyn.model.robot import Prior
from omnidyn.model.robot_file import load_robot
from tests.support.cases import case

MOTOR = ("motor.resistance_ohm", "motor.torque_constant_Nm_A", "motor.emf_constant_Vs_rad")


def guessed(robot, size=1.0):
    """The robot with a motor that is only guessed, its resistance `size` times what it is."""
    motor = robot.motor.replace(resistance=size * robot.motor.resistance)
    return robot.replace(motor=motor, priors={key: Prior(origin="guess") for key in MOTOR})


def test_a_guessed_motor_is_no_reason_against_a_wheel():
    robot = load_robot(str(case("logs/guessed_motor/ssl_full.toml")))
    columns = load_map(case("logs/guessed_motor/map.toml"))
    log = recorded_log(case("logs/guessed_motor/ssl_tiny.csv"), robot, LogOptions(columns))
    verdict = check(log, robot)
    assert not verdict.has_errors
    (finding,) = verdict.of("dead")
    assert (finding.severity, finding.subject) == ("warning", "w4")
    assert "motor.resistance_ohm" in str(finding)
    assert [each.code for each in verdict.findings if each.rests_on] == ["dead"]  # its consequences are not told


def test_a_guess_makes_no_finding_fatal(log, robot, with_channels, grave):
    """Currents of mA, by R: fatal for a data sheet, a doubt for a guess."""
    broken = with_channels(current=1e3 * log.channels["current"])
    assert check(broken, robot).has_errors
    verdict = check(broken, guessed(robot))
    assert not verdict.has_errors
    assert grave(verdict) == {"unit"}
    assert "let omnidyn identify fit" in verdict.of("unit")[0].remedy_text


def test_it_stays_or_goes_away_with_the_fitted_robot(log, robot):
    told = []
    # Columns that are exchanged stay wrong whatever the motor is.
    swapped = replace(log, channels={**log.channels, "current": log.channels["current"][:, [1, 0, 2]]})
    before = check(swapped, guessed(robot))
    assert before.of("swapped")[0].severity == "warning"
    (after,) = judged_by_fit([before], [swapped], robot, told.append)
    assert after.of("swapped")[0].severity == "error"
    assert "the fitted robot shows it too" in str(after.of("swapped")[0])
    # A motor that was guessed wrong explains all of it, and the finding goes away.
    wrong = guessed(robot.replace(motor=robot.motor.replace(emf_constant=2.0 * robot.motor.emf_constant)))
    before = check(log, wrong)
    assert rest_on_guesses(before)
    (after,) = judged_by_fit([before], [log], robot, told.append)
    assert not rest_on_guesses(after)
    assert not after.of("energy")
    assert "with the fitted robot this is no longer found" in str(after.of("judged_again")[0])
    assert any(report.urgent and "this is no longer found" in str(report) for report in told)
    assert not any(": :" in str(report) for report in told)


def test_nothing_is_checked_twice_where_nothing_was_guessed(log, robot):
    verdict = check(log, robot)
    assert judged_by_fit([verdict], [], robot, print) == (verdict,)
    assert judged_again(verdict, verdict).findings == verdict.findings


def test_a_guess_of_one_wheel_counts(log, robot):
    motor = robot.motor.replace(resistance=1e-3 * np.ones(3) * robot.motor.resistance)
    one = robot.replace(motor=motor, priors={"motor.resistance_ohm[1]": Prior(origin="guess")})
    assert not check(log, one).has_errors
