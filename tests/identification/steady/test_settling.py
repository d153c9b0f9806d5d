"""How fast a robot follows its speed loop: beside a simulated step, and what that decides."""

import numpy as np
import pytest

from omnidyn.identification.default_method import why_not_output_error
from omnidyn.identification.steady.loop_speed import settling_time
from omnidyn.model.dynamics import state_space
from omnidyn.model.friction import Friction
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate


@pytest.mark.parametrize("ki", [0.0, 1.0])
def test_it_is_the_time_constant_of_a_simulated_step(axebot, ki):
    """Without friction the last part of a small step decays by e in that time; the loop ticks at 10 kHz."""
    drive = axebot.drive.replace(kind="speed", kp=0.25, ki=ki, rate=1e4)
    robot = axebot.replace(friction=Friction(), drive=drive)
    slowest = settling_time(robot)
    run = simulate(robot, dt=1e-4, twist_command=np.tile([0.05, 0.0, 0.5], (round(8.0 * slowest * 1e4), 1)), tol=1e-8)
    left = np.abs(run.twist - run.twist[-1])
    near, far = round(2.0 * slowest * 1e4), round(3.0 * slowest * 1e4)
    axis = int(np.argmax(left[far] / np.abs(run.twist[-1] + 1e-12) * [1.0, 0.0, 1.0]))
    assert left[near, axis] / left[far, axis] == pytest.approx(np.e, rel=0.05)


def test_a_loop_that_settles_within_a_row_is_steady_state_by_default():
    robot = load_robot("robotino")
    speeds = np.ones((50, 3))
    run = Run(t=0.03 * np.arange(50), wheel_speed_command=speeds, wheel_speed=speeds, current=speeds)
    why = why_not_output_error([run], robot)
    assert "the speed loop of robotino settles in 8 ms, a row comes every 30 ms" in why
    assert why_not_output_error([run.replace(t=0.002 * np.arange(50))], robot) == ""
    assert why_not_output_error([run.replace(current=None)], robot) == ""


def test_an_integral_alone_swings_and_fades_twice_as_slowly_as_the_robot(axebot):
    """v'' + a v' + w2 v = 0 with a small beside w: exp(-a t/2)."""
    robot = axebot.replace(friction=Friction(), drive=axebot.drive.replace(kind="speed", kp=0.0, ki=1e4, rate=1e3))
    assert settling_time(robot) == pytest.approx(2.0 * state_space(robot).time_constants.max())
