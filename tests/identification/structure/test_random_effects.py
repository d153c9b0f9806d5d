"""Random effects by draws and dense matrices: rows made white, what is predicted and how far that is open, how much of
their variance there is."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from omnidyn.identification.output_error.linear.random_effects import RandomEffects, scaled
from omnidyn.identification.output_error.linear.rows import Linear

RANDOM = np.random.default_rng(3)
Z = RANDOM.normal(size=(40, 7)) * np.geomspace(1e-3, 4.0, 7)


def test_rows_are_made_white_by_the_inverse_of_their_covariance():
    values = RANDOM.normal(size=(40, 3))
    white = RandomEffects.of(Z).white(values)
    assert white.T @ white == pytest.approx(values.T @ np.linalg.solve(np.eye(40) + Z @ Z.T, values))


def test_effects_are_predicted_as_their_mean_beside_noise():
    values, covariance = RANDOM.normal(size=(40, 3)), np.eye(40) + Z @ Z.T
    effects = RandomEffects.of(Z / 2.0, 2.0)
    assert effects.predicted(values) / 2.0 == pytest.approx(Z.T @ np.linalg.solve(covariance, values))
    assert effects.open @ effects.open.T / 4.0 == pytest.approx(np.eye(7) - Z.T @ np.linalg.solve(covariance, Z))


def test_a_piece_without_rounded_inputs_beside_one_with_them_leaves_nothing_open():
    """A piece in which the robot only stands: of nothing was anything rounded off."""
    shown, effects = [np.zeros((2, 20, 0)), Z.reshape(2, 20, 7)], [RandomEffects.of(Z[:, :0]), RandomEffects.of(Z)]
    linear: Any = SimpleNamespace(rows=SimpleNamespace(rounding=shown), rounding=effects)
    assert [Linear.open(linear, k).shape for k in range(2)] == [(2, 20, 0), (2, 20, 7)]


@pytest.mark.parametrize("true", [0.0, 0.4, 1.0])
def test_errors_tell_how_much_of_the_variance_there_is(true):
    """In two pieces, beside five numbers that were fitted: never too little by more than chance has it."""
    z = [RANDOM.normal(size=(400, 60)), RANDOM.normal(size=(300, 60))]
    basis = np.linalg.qr(RANDOM.normal(size=(700, 5)))[0]
    found = []
    for _ in range(20):
        e = RANDOM.normal(size=700) + true**0.5 * np.concatenate([own @ RANDOM.normal(size=60) for own in z])
        found.append(scaled(z, e - basis @ (basis.T @ e), basis)[0].size[0] ** 2)
    assert np.mean(np.array(found) >= true) >= 0.9
    assert np.mean(found) <= 1.6 * true + 0.05
