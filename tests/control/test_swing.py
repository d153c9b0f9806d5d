"""A loop that swings says so within a second; one that is pushed, or whose model is wrong, does not."""

import numpy as np
import pytest

from benchmarks.control_real import Instruments, told, wrench_at
from benchmarks.control_real.paths import paths
from benchmarks.control_real.plant import Plant
from benchmarks.control_real.robots import NUMBERS, robot_of
from omnidyn.control.controller import SWINGS
from omnidyn.control.mpc.controller import Mpc
from omnidyn.control.pid import Pid
from omnidyn.control.swing import Swing

AXEBOT = NUMBERS["axebot"]


def swinging(make, numbers, name="clover", seconds=8.0):
    """(times of the steps that said so, time of the first error of 5 mm) of a loop of the axebot with encoders."""
    plant, path, control = Plant(numbers), paths()[name], make(told(robot_of("axebot", AXEBOT), "encoder"))
    plant.reset(path.at(0.0).pose)
    sensors, times, far = Instruments("encoder", plant, 0), [], np.inf
    while plant.t < seconds:
        plant.push = wrench_at(plant.t, plant.friction) if name == "push" else np.zeros(3)
        t = plant.t
        output = control.step(t, *sensors.seen(), path)
        if control.info.status == SWINGS:
            assert control.info.ok
            times.append(t)
        sensors.drive(output, 0.02)
        if np.hypot(*(plant.pose - path.at(plant.t).pose)[:2]) > 5e-3:
            far = min(far, t)
    return times, far


@pytest.mark.parametrize("make", [Pid, Mpc])
def test_outputs_that_act_later_than_told_make_a_loop_swing(make):
    times, far = swinging(make, AXEBOT | {"latency": 0.04})
    assert times[0] < far + 1.0


@pytest.mark.parametrize("make", [Pid, Mpc])
@pytest.mark.parametrize(
    "numbers, name",
    [
        (AXEBOT, "clover"),
        (AXEBOT, "push"),
        (AXEBOT, "square"),
        (AXEBOT | {"mass": 2.25, "inertia": 0.0375}, "clover"),
        (AXEBOT | {"coulomb": (3.3, 2.25, 0.15)}, "clover"),
        (AXEBOT | {"coulomb": (1.1, 0.75, 0.05)}, "push"),
    ],
)
@pytest.mark.some(4)
def test_a_push_or_a_wrong_model_is_no_swing(make, numbers, name):
    assert not swinging(make, numbers, name)[0]


def test_six_changes_within_a_second_are_a_swing():
    swing = Swing(robot_of("axebot", AXEBOT), 0.02)
    for frequency, expected in ((2.0, False), (4.0, True)):
        swing.reset()
        t = np.arange(0.0, 3.0, 0.02)
        found = [swing.found(x, 0.0, 0.0, 6.0 * np.sin(2.0 * np.pi * frequency * x)) for x in t.tolist()]
        assert any(found) is expected
    swing.reset()
    assert not any(swing.found(x, 1e-3 * (-1.0) ** k, 0.0, 0.0) for k, x in enumerate(t.tolist()))
