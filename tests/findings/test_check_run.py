"""check of a Run in memory: the findings of its log, and the log is kept for the picture."""

import omnidyn
from omnidyn.findings.check import check_log
from omnidyn.logs.log import Log
from tests.support.compared_logs import clean_log, noisy

ROBOT = omnidyn.load_robot("axebot")
RUN = noisy(clean_log(ROBOT, 1), 1)


def test_a_run_and_its_log_have_the_same_verdict():
    verdict = omnidyn.check(RUN, ROBOT)
    assert verdict == check_log(Log.of_run(RUN), ROBOT)
    assert verdict.rows == len(RUN)
    assert verdict.channels == tuple(RUN.channels)
    assert verdict.log is not None


def test_two_wheels_swapped_are_found_in_memory_too():
    swapped = RUN.replace(wheel_speed=RUN.wheel_speed[:, [1, 0, 2]])
    assert omnidyn.check(swapped, ROBOT).has_errors
    assert not omnidyn.check(RUN, ROBOT).has_errors


def test_the_verdict_that_the_command_keeps_holds_no_log():
    assert check_log(Log.of_run(RUN)).log is None
