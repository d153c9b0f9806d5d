"""Voltage programs, by their numbers."""

import numpy as np
import pytest

from omnidyn.errors import InputError
from omnidyn.paper import voltage_programs as inputs
from tests.support.prbs import prbs


def test_steps_hold_each_row():
    rows = [[0.0, 2.0, -2.0], [0.0, 3.0, -3.0]]
    program = inputs.steps(rows, 0.03, 0.01)
    assert program.tolist() == [rows[0]] * 3 + [rows[1]] * 3


def test_ramp_rises_evenly():
    assert inputs.ramp([0.0, 1.0, -1.0], 2.0, 0.5, 0.1).tolist() == [[0, s, -s] for s in (0.0, 0.5, 1.0, 1.5, 2.0)]


def test_prbs_has_two_levels_and_a_clock():
    program = prbs([4.0, 3.0, 5.0], 0.037, 10.0, 1e-3, seed=3)
    assert program.shape == (10_000, 3)
    assert (np.abs(program) == [4.0, 3.0, 5.0]).all()
    changes = np.flatnonzero((np.diff(program, axis=0) != 0).any(axis=1)) + 1
    assert (changes % 37 == 0).all()
    assert 0.3 < (np.diff(program[::37], axis=0) != 0).mean() < 0.7
    np.testing.assert_array_equal(program, prbs([4.0, 3.0, 5.0], 0.037, 10.0, 1e-3, seed=3))
    assert (program != prbs([4.0, 3.0, 5.0], 0.037, 10.0, 1e-3, seed=4)).any()


def test_bad_programs_are_refused():
    for duration, dt in ((0.0, 1.0), (1.0, 0.0), (-1.0, 1.0), (np.nan, 1.0), (1.0, np.inf)):
        with pytest.raises(InputError, match="not a length of time; got duration"):
            inputs.steps([[1.0]], duration, dt)
