"""check on channels that share no stamps: nothing false, the same motion, and faults found at a channel's own clock."""

import numpy as np
import pytest

from benchmarks.logs.stagger import OFF_AZIMUTH, OFF_RMS, robot_of, seen
from omnidyn.findings.check import check
from omnidyn.logs.geometry import wheel_geometry
from omnidyn.logs.read_log import recorded_log
from tests.support.cases import case
from tests.support.staggered import Logged, topics

SECONDS = 20.0


def logged(number, offset, jitter=0.0, rates=False):
    return Logged.of(topics(number, offset, jitter, rates, SECONDS), SECONDS)


long = pytest.mark.long
CASES = [
    (2, 1e-6, 0.0, False),
    (8, 3e-3, 0.0, False),
    pytest.param(4, 0.01, 0.0, False, marks=long),
    pytest.param(8, 20e-6, 1e-3, False, marks=long),
    pytest.param(4, 3e-3, 0.0, True, marks=long),
]


@pytest.mark.parametrize(("number", "offset", "jitter", "rates"), CASES)
def test_a_log_says_the_same_whatever_its_stamps(tmp_path, number, offset, jitter, rates):
    robot = robot_of(tmp_path)
    equal = seen(logged(number, 0.0, 0.0, rates).csv(tmp_path / "equal.csv"), robot, 0.0)
    found = seen(logged(number, offset, jitter, rates).csv(tmp_path / "log.csv"), robot, jitter)
    assert found.findings == ()
    assert found.azimuth < OFF_AZIMUTH
    np.testing.assert_allclose(found.rms, equal.rms, rtol=OFF_RMS)


def test_a_bag_whose_topics_share_no_stamps(tmp_path):
    pytest.importorskip("rosbags")
    pytest.importorskip("mcap")
    robot = robot_of(tmp_path)
    equal = seen(logged(4, 0.0).csv(tmp_path / "equal.csv"), robot, 0.0)
    path = logged(4, 3e-3).mcap(tmp_path / "log.mcap")
    found = seen(path, robot, 0.0)
    assert found.findings == ()
    assert found.azimuth < OFF_AZIMUTH
    np.testing.assert_allclose(found.rms, equal.rms, rtol=OFF_RMS)
    log = recorded_log(path)
    run = log.to_run()
    assert log.own_clocks
    assert check(run, robot).excitation == check(log, robot).excitation


def with_fault(fault):
    """A log of topics 3 ms apart whose values of one component were changed."""
    whole = logged(4, 3e-3)
    for _, values in whole.topics:
        if "vx" in values:
            fault(values)
    return whole


def test_a_spike_is_found_among_the_samples_of_its_own_channel(tmp_path):
    def spike(values):
        values["vx"][400] += 3.0

    verdict = check(recorded_log(with_fault(spike).csv(tmp_path / "log.csv")), robot_of(tmp_path))
    assert [(found.code, found.subject, found.count) for found in verdict.findings] == [("spike", "vx", 1)]
    assert verdict.excitation["x_max"] < 0.5


def test_a_sensor_that_sticks_is_found_at_its_own_clock(tmp_path):
    def stick(values):
        values["omega"][300:420] = values["omega"][300]

    verdict = check(recorded_log(with_fault(stick).csv(tmp_path / "log.csv")), robot_of(tmp_path))
    assert [(found.code, found.subject, found.count) for found in verdict.findings] == [("stuck", "omega", 120)]
    assert verdict.findings[0].numbers["longest_s"] == pytest.approx(119 * 0.02)


def test_a_topic_that_is_late_is_found_to_the_millisecond(tmp_path):
    """The odometry shows what was 30 ms before its stamp, and has stamps of its own."""
    parts = topics(4, 3e-3, seconds=SECONDS)
    parts[2] = parts[2].late(0.03)
    verdict = check(recorded_log(Logged.of(parts, SECONDS).csv(tmp_path / "log.csv")), robot_of(tmp_path))
    late = [found for found in verdict.findings if found.code == "lag"]
    assert [found.subject for found in late] == ["wheel_speed twist"]
    assert late[0].numbers["seconds"] == pytest.approx(-0.03, abs=1e-3)


def test_the_cases_that_once_went_wrong():
    bag = recorded_log(case("logs/staggered_topics/right_ms3"))
    verdict = check(bag)
    assert not verdict.findings
    assert verdict.excitation["x"] == pytest.approx(0.32, abs=0.002)
    assert verdict.excitation["yaw"] == pytest.approx(0.475, abs=0.002)
    np.testing.assert_allclose(wheel_geometry([bag.to_run()]).azimuth_deg, (60.0, 180.0, 300.0), atol=0.1)
    motor = check(recorded_log(case("logs/wpilog_stagger/gap3us.wpilog")))
    assert not motor.findings
    assert motor.rate == pytest.approx(50.0)
