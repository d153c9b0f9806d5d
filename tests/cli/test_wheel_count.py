"""A log of a robot with another number of wheels is refused by every command that takes a robot."""

import re

import numpy as np
import pytest

from omnidyn import Run, check, load_robot
from omnidyn.errors import InputError
from omnidyn.identification.output_error.problem.record import record


def write(path, wheels, channels=("u{}_V", "w{}_rad_s"), rows=60):
    names = [each.format(k + 1) for each in channels for k in range(wheels)]
    values = np.sin(np.arange(rows)[:, None] * 0.1 + np.arange(len(names)))
    lines = [",".join(["t_s", *names]), *(",".join(f"{x:.4f}" for x in (0.01 * k, *values[k])) for k in range(rows))]
    path.write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize("command", ["check", "identify", "compare"])
@pytest.mark.parametrize(
    "wheels, robot, words",
    [
        (3, "four-wheel", "fewer wheels .*; got 3 wheels; expected 4, as four-wheel has; name the robot of this log"),
        (4, "axebot", "more wheels .*; got 4 wheels; expected 3, as axebot has; name the robot of this log"),
    ],
)
def test_another_number_of_wheels_is_refused(call, here, command, wheels, robot, words):
    write(here / "log.csv", wheels)
    code, _, err = call(command, "log.csv", "--robot", robot)
    assert code == 3
    assert re.search(words, err)


def test_the_robot_of_the_log_or_the_column_that_was_missed_is_the_remedy(call, here):
    write(here / "log.csv", 3)
    assert call("check", "log.csv", "--robot", "axebot")[0] == 0
    text = (here / "log.csv").read_text().splitlines()
    more = [f"{line},{'last_one' if k == 0 else 0.01 * k}" for k, line in enumerate(text)]
    (here / "log.csv").write_text("\n".join(more) + "\n")
    _, _, err = call("check", "log.csv", "--robot", "four-wheel")
    assert "say which they are: --column w4=NAME:UNIT" in err
    assert call("check", "log.csv", "--robot", "four-wheel", "--column", "w4=last_one:rad/s")[0] == 0


@pytest.mark.parametrize("channels, wheels", [(("i{}_A",), 3), (("u{}_V", "w{}_rad_s"), 1)])
def test_some_currents_and_a_motor_on_a_bench_are_no_robot(call, here, channels, wheels):
    write(here / "log.csv", wheels, channels)
    assert "wheels than the robot" not in call("check", "log.csv", "--robot", "four-wheel")[2]


def test_a_run_in_memory_is_told_too():
    run = Run(np.arange(9) * 0.1, wheel_speed=np.ones((9, 3)), wheel_speed_command=np.ones((9, 3)))
    robot = load_robot("four-wheel")
    (finding,) = check(run, robot).of("wheel_count")
    assert finding.severity == "error"
    looped = robot.replace(drive=robot.drive.replace(kind="speed", kp=1.0, rate=100.0))
    with pytest.raises(InputError, match=r"another number of wheels; got 3; expected 4, as four-wheel has; give the"):
        record(run, looped)
