"""The MPC of Araujo et al. 2011, on whose robot and model the paper builds: for comparison, on the same contract.

    min over du_0 .. du_{m-1}, dv_0 .. dv_{m-1}:   g' + 1e-3 g
    J(du) <= g,  J'(du_0, dv) <= g',  g' <= g,  g >= eps,  g <= g of the step before,   |u| <= limit
    J  = sum over N steps of |Q^1/2 (twist - wanted)|^2 + |R^1/2 du|^2           from now on
    J' = the same a step later, along the moves dv after du_0: its cost must not rise

    twist_{k+j} = twist + S_{j-1} A_d (twist - that of the step before) + sum_i S_{j-1-i} B_d du_i
    S_i = A_d^0 + .. + A_d^i

Their matrix inequalities are second-order cones by Schur's complement, so that a cone solver takes them as they stand.
The wanted twist is the path's, and the way back to it times `home`. As theirs it predicts without dry friction.

What is printed there is not used as it stands: B divides the row of the torque by the mass instead of the inertia, and
continuous matrices stand in a discrete equation. A_d and B_d are those of the model here, exact for held volts. Source:
Araujo et al. 2011, Theorem 1 with its inequalities (35) and (41).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy import sparse

from omnidyn.arrays import FloatArray
from omnidyn.control.controller import WHEEL_SPEED, Guarded
from omnidyn.control.feedforward import DT, check_dt
from omnidyn.control.mpc.model import DECAY, PHI, numbers, volts
from omnidyn.control.paths.motion import Path
from omnidyn.errors import MissingExtraError, UnsupportedError
from omnidyn.model.frames import world_to_body
from omnidyn.model.robot import Robot

AHEAD, MOVES, HOME = 5, 3, 4.0  # steps predicted, moves, [1/s]
ERROR, MOVE, LEAST_CONE_SIZE, SIZE_WEIGHT = 10.0, 0.1, 800.0, 1e-3  # square roots of Q and R, eps, weight of g
MET = 1e-4  # [V] from a limit, as near as the solver comes


class Araujo(Guarded):
    """Araujo's MPC of the twist, on the way back to a path. See Controller.

    dt [s]: between two steps. home: speed of the way back per distance [1/s]. supply [V]: behind a duty.
    """

    name = "araujo"

    def __init__(self, robot: Robot, *, dt: float = DT, home: float = HOME, supply: float | None = None) -> None:
        try:
            import clarabel
        except ImportError:
            remedy = 'pip install "omnidyn[bench]"'
            raise MissingExtraError("this controller is solved by clarabel", remedy=remedy) from None
        solver: Any = clarabel  # an extension, of which type checkers know nothing
        self.dt, self.home, self._solver, self._how = check_dt(dt), float(home), solver, solver.DefaultSettings()
        self._how.verbose = False
        super().__init__(robot, supply)

    def _take(self, robot: Robot) -> None:
        super()._take(robot)
        if self.output == WHEEL_SPEED:
            raise UnsupportedError("araujo gives volts", got="a drive that takes speeds of wheels", remedy="take mpc")
        model = numbers(robot, self.dt, friction=False)
        decay, gain = (model.linear[0, at : at + 9].reshape(3, 3) for at in (DECAY, PHI))
        self._free, self._moved = _predicted(decay, gain @ model.push)
        self._volts, self._wheels = volts(robot), robot.wheels.count
        self._problem = self._cones()

    def reset(self) -> None:
        """Forget all steps."""
        super().reset()
        self._before, self._sent_volts, self._bound = None, np.zeros(self.robot.wheels.count), math.inf

    def _output(
        self, t: float, dt: float, pose: FloatArray, twist: FloatArray, path: Path
    ) -> tuple[FloatArray, tuple[str, ...]]:
        motion = path.at(t + self.dt * np.arange(1, AHEAD + 2))
        off = motion.pose - pose
        off[:, 2] -= 2.0 * math.pi * np.round(off[0, 2] / (2.0 * math.pi))
        reference = (motion.velocity + self.home * off) @ world_to_body(np.asarray(pose[2])).T
        change = np.zeros(3) if self._before is None else twist - self._before
        self._before = twist.copy()
        gap = (self._free @ change).reshape(-1, 3) + twist - np.concatenate([reference[:AHEAD], reference[1:]])
        solution = self._solved(gap.ravel(), max(self._bound, LEAST_CONE_SIZE)) or self._solved(gap.ravel(), math.inf)
        if solution is None:
            raise ArithmeticError("no moves found")
        moves, self._bound = solution
        self._sent_volts = np.clip(self._sent_volts + moves, -self._volts, self._volts)
        met = ("voltage",) if bool((np.abs(self._sent_volts) >= self._volts - MET).any()) else ()
        return self._sent(self._sent_volts), met

    def _cones(self) -> tuple[Any, ...]:
        """(P, q, A, cones) of min q . z so that b - A z lies in the cones; z = (du, dv, g, g')."""
        n = MOVES * self._wheels
        size = 2 * n + 2
        sums = np.kron(np.tril(np.ones((MOVES, MOVES))), np.eye(self._wheels))
        first = np.kron(np.ones((MOVES, 1)), np.eye(self._wheels, n))
        below = np.zeros((3, size))  # g' <= g, g >= eps, g <= that of the step before
        below[:, 2 * n :] = [[-1.0, 1.0], [-1.0, 0.0], [1.0, 0.0]]
        steps = np.zeros((2 * n, size))
        steps[:n, :n], steps[n:, :n], steps[n:, n : 2 * n] = sums, first, sums
        rows = [below, steps, -steps]
        for k, response in enumerate(self._moved):
            cone = np.zeros((2 + len(response) + n, size))  # |(2 y, g - 1)| <= g + 1 is |y|^2 <= g
            cone[[0, -1], 2 * n + k] = -1.0
            cone[1 : 1 + len(response), : 2 * n] = -2.0 * ERROR * response
            cone[1 + len(response) : -1, k * n : (k + 1) * n] = -2.0 * MOVE * np.eye(n)
            rows.append(cone)
        cones = [self._solver.NonnegativeConeT(3 + 4 * n)]
        cones += [self._solver.SecondOrderConeT(len(cone)) for cone in rows[3:]]
        cost = np.zeros(size)
        cost[-2:] = SIZE_WEIGHT, 1.0
        return sparse.csc_matrix((size, size)), cost, sparse.csc_matrix(np.concatenate(rows)), cones

    def _solved(self, gap: FloatArray, bound: float) -> tuple[FloatArray, float] | None:
        """(first move [V], g) for the errors there would be without it; None where the cones have nothing in common."""
        n, half = MOVES * self._wheels, len(gap) // 2
        up = np.tile(self._volts - self._sent_volts, 2 * MOVES)
        down = np.tile(self._volts + self._sent_volts, 2 * MOVES)
        sides = [np.array([0.0, -LEAST_CONE_SIZE, min(bound, 1e9)]), up, down]
        for errors in (gap[:half], gap[half:]):
            sides += [np.ones(1), 2.0 * ERROR * errors, np.zeros(n), -np.ones(1)]
        hessian, cost, matrix, cones = self._problem
        solution = self._solver.DefaultSolver(hessian, cost, matrix, np.concatenate(sides), cones, self._how).solve()
        z = np.asarray(solution.x)
        if "Solved" not in str(solution.status) or not np.isfinite(z).all():
            return None
        return z[: self._wheels], float(z[-2])


def _predicted(decay: FloatArray, push: FloatArray) -> tuple[FloatArray, tuple[FloatArray, FloatArray]]:
    """(what the change of the twist adds to those predicted, what moves do): from now on, and a step later."""
    powers = [np.eye(3)]
    for _ in range(AHEAD):
        powers.append(np.eye(3) + decay @ powers[-1])  # S_0, S_1, ..
    wheels = push.shape[1]
    now, later = np.zeros((3 * AHEAD, 2 * MOVES * wheels)), np.zeros((3 * AHEAD, 2 * MOVES * wheels))
    for j in range(AHEAD):
        rows = slice(3 * j, 3 * j + 3)
        for i in range(min(j + 1, MOVES)):
            now[rows, i * wheels : (i + 1) * wheels] = powers[j - i] @ push
        later[rows, :wheels] = powers[j + 1] @ push
        later[rows, MOVES * wheels :] = now[rows, : MOVES * wheels]
    free = np.concatenate([powers[j] @ decay for j in range(AHEAD)] + [powers[j + 1] @ decay for j in range(AHEAD)])
    return free, (now, later)
