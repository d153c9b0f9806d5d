"""Voltage programs, by their numbers."""

import numpy as np
import pytest

from omnidyn.errors import InputError
from omnidyn.run import Run
from omnidyn.simulation import programs as inputs
from omnidyn.simulation.simulate import simulate


def test_steps_hold_each_row():
    rows = [[0.0, 2.0, -2.0], [0.0, 3.0, -3.0]]
    program = inputs.steps(rows, 0.03, 0.01)
    assert program.tolist() == [rows[0]] * 3 + [rows[1]] * 3


def test_ramp_rises_evenly():
    assert inputs.ramp([0.0, 1.0, -1.0], 2.0, 0.5, 0.1).tolist() == [[0, s, -s] for s in (0.0, 0.5, 1.0, 1.5, 2.0)]


def test_prbs_has_two_levels_and_a_clock():
    program = inputs.prbs([4.0, 3.0, 5.0], 0.037, 10.0, 1e-3, seed=3)
    assert program.shape == (10_000, 3)
    assert (np.abs(program) == [4.0, 3.0, 5.0]).all()
    changes = np.flatnonzero((np.diff(program, axis=0) != 0).any(axis=1)) + 1
    assert (changes % 37 == 0).all()
    assert 0.3 < (np.diff(program[::37], axis=0) != 0).mean() < 0.7
    np.testing.assert_array_equal(program, inputs.prbs([4.0, 3.0, 5.0], 0.037, 10.0, 1e-3, seed=3))
    assert (program != inputs.prbs([4.0, 3.0, 5.0], 0.037, 10.0, 1e-3, seed=4)).any()


def test_chirp_sweeps_from_one_frequency_to_the_other():
    """Zero crossings counted in the first and last tenth: 2 f per second."""
    program = inputs.chirp([6.0, 6.0, 6.0], 1.0, 9.0, 100.0, 1e-3)
    assert np.abs(program).max() <= 6.0
    for wheel in program.T:
        crossings = np.flatnonzero(np.diff(np.sign(wheel)) != 0) * 1e-3
        assert (crossings < 10).sum() == pytest.approx(2 * 10 * 1.4, abs=2)
        assert (crossings > 90).sum() == pytest.approx(2 * 10 * 8.6, abs=2)


def test_the_inputs_of_a_run_simulate_it_again(axebot):
    voltage = inputs.chirp([3.0, 3.0, 3.0], 0.5, 3.0, 1.0, 5e-3)
    dt = np.geomspace(1e-3, 1e-2, len(voltage))
    run = simulate(axebot, voltage, dt)
    again = simulate(axebot, *inputs.from_run(run))
    np.testing.assert_array_equal(again.voltage, run.voltage)
    np.testing.assert_allclose(again.twist, run.twist, atol=1e-12)


def test_bad_programs_are_refused():
    for duration, dt in ((0.0, 1.0), (1.0, 0.0), (-1.0, 1.0), (np.nan, 1.0), (1.0, np.inf)):
        with pytest.raises(InputError, match="not a length of time; got duration"):
            inputs.steps([[1.0]], duration, dt)
    with pytest.raises(InputError, match="the run has no voltage; got no channels; expected voltage"):
        inputs.from_run(Run(t=[0.0, 1.0]))
