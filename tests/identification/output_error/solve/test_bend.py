"""The bend that Gauss-Newton does not see: learnt from gradients, never wild, forgotten when it led astray."""

import numpy as np
import pytest

from omnidyn.identification.output_error.solve.curvature import FLAT, STEEP, Bend

COUNT = 4
ALL = np.zeros(COUNT, bool)


def bowl(seed, shares):
    """(information, Hessian) with these ratios of the Hessian to the information along some ways."""
    random = np.random.default_rng(seed)
    root = random.normal(size=(COUNT, COUNT)) @ np.diag(10.0 ** random.uniform(-3.0, 3.0, COUNT))
    ways = np.linalg.qr(random.normal(size=(COUNT, COUNT)))[0]
    return root.T @ root, root.T @ (ways * shares) @ ways.T @ root


def descend(information, hessian, bend, steps):
    """Squared distance to the best point in standard errors, before each of so many steps from (1, 1, 1, 1)."""
    at, found = np.ones(COUNT), []
    for _ in range(steps):
        gradient = -hessian @ at
        found.append(float(at @ information @ at))
        if bend is not None:
            bend.learn(at, gradient, information)
        more = np.zeros_like(information) if bend is None else bend.beside(information, ALL)
        at = at + np.linalg.solve(information + more, gradient)
    return np.array(found)


def test_a_step_per_bent_way_is_enough():
    """Gauss-Newton covers 0.3 and 0.5 of the way with every step: nine in ten of the distance take six of them."""
    for seed in range(20):
        information, hessian = bowl(seed, [0.3, 0.5, 1.0, 1.0])
        plain, learnt = (descend(information, hessian, bend, 7) for bend in (None, Bend(COUNT)))
        assert learnt[4] < 1e-9 * learnt[0]
        assert plain[4] > 1e-4 * plain[0]


@pytest.mark.parametrize("shares", [[-2.0, 1.0, 1.0, 1.0], [50.0, 1.0, 1.0, 1.0], [-2.0, 50.0, -1.0, 9.0]])
def test_a_bend_stays_within_what_a_step_may_be_told(shares):
    """A hill of -2 times the information, a wall of 50 times it: the whole stays positive and finite."""
    for seed in range(10):
        information, hessian = bowl(seed, shares)
        bend, root = Bend(COUNT), np.linalg.cholesky(information)
        for at in np.random.default_rng(seed).normal(size=(COUNT + 1, COUNT)):
            bend.learn(at, -hessian @ at, information)
        found = np.linalg.eigvalsh(np.linalg.solve(root, np.linalg.solve(root, bend.beside(information, ALL)).T))
        assert found.min() >= FLAT - 1e-6
        assert found.max() <= STEEP + 1e-6
        assert found.max() > STEEP - 0.1 or found.min() < FLAT + 0.1


def test_what_stands_still_has_no_bend_and_what_is_forgotten_none():
    information, hessian = bowl(3, [0.3, 0.5, 1.0, 1.0])
    bend = Bend(COUNT)
    for at in (np.zeros(COUNT), np.array([1.0, 0.0, 0.0, 0.5])):
        bend.learn(at, -hessian @ at, information)
    still = np.array([True, False, False, False])
    assert bend.has_curvature
    assert bend.beside(information, still)[:, 0].tolist() == [0.0] * COUNT
    assert bend.beside(information, still)[3, 3] != 0.0
    bend.forget()
    assert not bend.has_curvature
    assert not bend.beside(information, ALL).any()


def test_a_straight_gradient_teaches_nothing():
    information, _ = bowl(1, [1.0] * COUNT)
    bend = Bend(COUNT)
    for at in (np.zeros(COUNT), np.ones(COUNT)):
        bend.learn(at, -information @ at, information)
    assert np.abs(bend.beside(information, ALL)).max() < 1e-6 * np.abs(information).max()
