"""The block step against a plain Python loop over the one formula, bit for bit."""

import numpy as np
import pytest

from omnidyn.compiled.kernel import kernel, plain
from omnidyn.model.dynamics import state_space
from omnidyn.simulation.batch.exact import advance, exact_law, put_drive, put_shared_drive
from omnidyn.simulation.batch.parameters import WIDTH, batch_parameters, in_blocks, out_of_blocks
from omnidyn.simulation.exact.exact_march import axis_levels
from omnidyn.simulation.exact.step import exact_step
from tests.support.exported import exact_robot

DT = 0.004


@kernel
def _shared(laws, voltage, speeds):
    zero, drive = laws.dtype.type(0), np.empty((3, WIDTH), laws.dtype)
    for b in range(len(laws)):
        for k in range(len(voltage)):
            put_shared_drive(drive, laws[b], voltage[k])
            advance(speeds[b], drive, laws[b], zero)


@kernel
def _rows(laws, voltage, speeds):
    zero, drive = laws.dtype.type(0), np.empty((3, WIDTH), laws.dtype)
    for b in range(len(laws)):
        for k in range(len(voltage)):
            put_drive(drive, laws[b], voltage[k])
            advance(speeds[b], drive, laws[b], zero)


def python_loop(robot, voltage, speed):
    """The speeds of a robot after each row, by the formula in Python."""
    system, step, out = state_space(robot), plain(exact_step), []
    levels = axis_levels(robot, system)
    for row in voltage.tolist():
        for axis in range(3):
            drive = 0.0
            for wheel, volts in enumerate(row):
                drive += volts * system.B[axis, wheel]
            a, c, s = (float(values[axis]) for values in levels)
            speed[axis] = step(speed[axis], drive, c, s, a, -np.expm1(-a * DT) / a, 0.0)
        out.append(list(speed))
    return np.array(out)


@pytest.mark.parametrize("wheels", [3, 4])
@pytest.mark.parametrize("kernel_of", [_shared, _rows])
def test_blocks_are_the_python_loop_bit_for_bit(wheels, kernel_of):
    robots = list(map(exact_robot, range(wheels - 3, 280, 4)))
    rng = np.random.default_rng(wheels)
    voltage = rng.uniform(-3.0, 3.0, (40, wheels)) * (rng.random((40, 1)) < 0.7)
    laws = in_blocks(exact_law(batch_parameters(robots), DT), float)
    speeds = np.zeros((len(laws), 3, WIDTH))
    volts = voltage if kernel_of is _shared else np.repeat(voltage[:, :, None], WIDTH, axis=2)
    kernel_of(laws, volts, speeds)
    moved = out_of_blocks(speeds, len(robots))
    for n in (0, 1, 63, 64, len(robots) - 1):
        np.testing.assert_array_equal(moved[:, n], python_loop(robots[n], voltage, [0.0, 0.0, 0.0])[-1])
