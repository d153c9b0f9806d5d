"""Autocorrelated errors while a robot moves: the dense likelihood, what comes back, and when they are seen."""

from itertools import pairwise

import numpy as np
import pytest

from benchmarks.identification.forces import FIRST_SEED, pushed
from benchmarks.wrong_worlds.log import right_case, robot_of, voltages
from benchmarks.wrong_worlds.remedies import FRICTION
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.fit import Fit
from omnidyn.identification.output_error.memory.autoregression import autoregression
from omnidyn.identification.output_error.memory.moving import Moving, _likelihood, new_while_moving, while_moving
from omnidyn.identification.output_error.memory.whitened import moving_rows
from omnidyn.identification.output_error.memory.whitening import whitened
from omnidyn.identification.output_error.trust.uncertainty import WHITE, trust
from omnidyn.run import Run

PHI, SHARE = 0.9, 0.3
SETTLED = Moving(PHI, SHARE, 1.0, np.eye(2), 0.0).settled


def to_and_fro(rows, seed):
    """Which rows move: stretches of 10 to 80 rows, moving and at rest in turn."""
    rng, found = np.random.default_rng([seed, 1]), []
    while len(found) < rows:
        found += [len(found) == 0 or not found[-1]] * int(rng.integers(10, 80))
    return np.array(found[:rows])


def errors(moves, phi, share, seed):
    """By the definition, step by step."""
    rng = np.random.default_rng(seed)
    x, out = 0.0, np.zeros(len(moves))
    for t, m in enumerate(moves):
        x = m * (phi * x + np.sqrt(share) * rng.normal())
        out[t] = x + rng.normal()
    return out[:, None]


def dense(moves, phi, share):
    """Covariance of a stretch, for a robot that has moved for long where it begins moving. Shape (rows, rows)."""
    rows = len(moves)
    found = np.eye(rows)
    for s in range(rows):
        since = s
        while since > 0 and moves[since - 1]:
            since -= 1
        if not moves[s]:
            continue
        age = s - since
        if since == 0:
            own = share / (1.0 - phi * phi)
        else:
            own = share * (1.0 - phi ** (2 * (age + 1))) / (1.0 - phi * phi)
        for t in range(s, rows):
            if not moves[t]:
                break
            found[s, t] = found[t, s] = found[s, t] + own * phi ** (t - s)
    return found


@pytest.mark.parametrize("phi, share", [(0.9, 0.3), (0.99, 0.01), (0.3, 2.0)])
def test_the_likelihood_is_the_dense_one(phi, share):
    moves = to_and_fro(150, 3)
    values = np.random.default_rng(1).normal(size=(150, 2))
    ends = [0, 90, 150]
    square, logs, g, by_logs, _, _ = _likelihood(values, moves, np.array(ends), phi, share)
    parts = [(values[a:b], dense(moves[a:b], phi, share)) for a, b in pairwise(ends)]
    assert square == pytest.approx(sum(np.sum(v * np.linalg.solve(c, v)) for v, c in parts), rel=1e-10)
    assert logs == pytest.approx(sum(np.linalg.slogdet(c)[1] for _, c in parts), rel=1e-10)
    for k, step in enumerate(1e-5 * np.eye(2)):
        above, below = (
            _likelihood(values, moves, np.array(ends), phi + s * step[0], share + s * step[1])[:2] for s in (1.0, -1.0)
        )
        assert g[k] == pytest.approx((above[0] - below[0]) / 2e-5, rel=1e-5)
        assert by_logs[k] == pytest.approx((above[1] - below[1]) / 2e-5, rel=1e-5)


def test_what_is_new_has_the_covariance_of_white_errors():
    """Filtered by the dense covariance of rows of which some are missing: whitened by Cholesky's factor, the same."""
    moves = to_and_fro(120, 5)
    values = np.random.default_rng(2).normal(size=(120, 3))
    steps = np.minimum(np.arange(120), 1)
    new = new_while_moving(values, steps, moves, PHI, SHARE)
    own = np.linalg.solve(np.linalg.cholesky(dense(moves, PHI, SHARE)), values)
    np.testing.assert_allclose(new, own * np.sqrt(SETTLED), rtol=1e-9)


def test_rows_that_are_missing_cost_what_they_would_have_told():
    moves = np.ones(60, bool)
    moves[20:30] = False
    kept = np.r_[0:9, 12:40, 41:60]
    values = np.random.default_rng(4).normal(size=(60, 1))
    new = new_while_moving(values[kept], np.diff(kept, prepend=kept[0]), moves[kept], PHI, SHARE)
    own = np.linalg.solve(np.linalg.cholesky(dense(moves, PHI, SHARE)[np.ix_(kept, kept)]), values[kept])
    np.testing.assert_allclose(new, own * np.sqrt(SETTLED), rtol=1e-9)


def test_the_two_numbers_come_back_and_how_well():
    """60 logs of 30 s at 100 Hz that rest half of the time: power of what is slow while they move, and its degrees."""
    found = []
    for seed in range(60):
        moves = to_and_fro(3000, seed)
        found.append(autoregression([errors(moves, 0.95, 0.02, seed)], moves=[moves]))
    assert np.mean([model.moving is not None for model in found]) > 0.9
    power = np.array([model.variance / (1.0 - model.coefficients.sum()) ** 2 for model in found if model.moving])
    assert np.median(power) == pytest.approx(1.0 + 0.02 / 0.05**2, rel=0.25)
    told = np.median([model.degrees for model in found if model.moving])
    assert 0.4 < told / (2.0 / np.var(np.log(power))) < 2.5


def test_how_it_is_told_once_the_robot_has_moved_for_long():
    """Riccati's equation iterated, and differences of what follows from it."""
    spread = 0.0
    for _ in range(1000):
        spread = PHI**2 * spread / (1.0 + spread) + SHARE
    assert pytest.approx(1.0 + spread, rel=1e-12) == SETTLED
    model = Moving(PHI, SHARE, 1.0, np.eye(2), 0.0)
    for k, (phi, log) in enumerate(1e-6 * np.eye(2)):
        ends = [Moving(PHI + s * phi, SHARE * np.exp(s * log), 1.0, np.eye(2), 0.0).mixed for s in (1.0, -1.0)]
        np.testing.assert_allclose(model.slopes[:, k], (ends[0] - ends[1]) / 2e-6, rtol=1e-6, atol=1e-9)


def test_errors_that_are_the_same_at_rest_are_not_taken_for_such():
    """White ones, and those of a sensor that remembers whatever the robot does."""
    for phi, share in ((0.0, 0.0), (0.9, 0.3)):
        seen = 0
        for seed in range(20):
            series = errors(np.ones(3000, bool), phi, share, seed)
            seen += autoregression([series], moves=[to_and_fro(3000, seed)]).moving is not None
        assert seen <= 1


def test_a_robot_that_never_rests_is_asked_for_nothing():
    values = errors(np.ones(500, bool), 0.9, 0.3, 1)
    assert while_moving([values], [np.ones(500, bool)]) is None
    assert while_moving([values], [np.zeros(500, bool)]) is None


def test_a_fit_of_a_pushed_robot_knows_when_its_errors_remember():
    """Under random forces, by another simulator: what is new in rows that move has no slow power left."""
    slow, words = [], 0
    for number in (0, 3, 5):
        seed = FIRST_SEED + number
        case = right_case(seed).both_but(frame=False)
        t, volts = voltages(case, seed)
        twist = pushed(case.told, volts, case.setup.rate, 0.1, seed)
        noise = [0.012, 0.012, 0.1] * np.random.default_rng(seed).normal(size=twist.shape)
        fit = Fit.of([Run(t, voltage=volts, twist=twist + noise)], robot_of(case.told), OutputError(free=FRICTION))
        found = whitened(solution := fit.solve(), trust(solution.solver, solution, WHITE))
        assert found is not None
        words += "moving" in [each.numbers.get("beside_white") for each in found.warnings]
        solver = found.solution.solver
        (piece,), (plain,) = solver.problem.pieces, solver.engine.unfiltered.residuals(found.solution.state.point)
        (new,) = solver.engine.residuals(found.solution.state.point)
        for own, moves, variance in zip(
            new[0], moving_rows(piece, plain[0]), found.solution.state.variance, strict=True
        ):
            cut = len(own) // 25 * 25
            blocks, all_move = (
                np.nan_to_num(own)[:cut].reshape(-1, 25).sum(axis=1),
                moves[:cut].reshape(-1, 25).all(axis=1),
            )
            slow += [np.mean(blocks[all_move] ** 2) / 25 / variance] if all_move.sum() > 5 else []
    assert words == 3
    assert np.median(slow) == pytest.approx(1.0, abs=0.25)
