"""What holds and what slides: loads against sums of friction sets, and accelerations from rest. For
modes.py."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tests.reference.modes_plant import Plant


class Tie(Exception):
    """No mode could be decided: the state is on an edge, to rounding."""


def span(directions: np.ndarray) -> np.ndarray:
    """Orthonormal basis of the span of the rows, in columns. Shape (3, rank); unit vectors where they will
    do."""
    if len(directions) == 0:
        return np.zeros((3, 0))
    scaled = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    _, size, rows = np.linalg.svd(scaled)
    rank = int((size > 1e-9).sum())
    if rank == 3:
        return np.eye(3)
    basis = rows[:rank].T
    units = np.flatnonzero(np.linalg.norm(basis, axis=1) > 1 - 1e-12)  # axes wholly inside the span
    if len(units) == rank:
        return np.eye(3)[:, units]
    return np.where(np.abs(basis) < 1e-15, 0.0, basis)


def null(basis: np.ndarray) -> np.ndarray:
    """Orthonormal basis of what is perpendicular to the columns."""
    rank = basis.shape[1]
    if rank == 0:
        return np.eye(3)
    if rank == 3:
        return np.zeros((3, 0))
    rest = np.linalg.svd(basis)[0][:, rank:]
    return np.where(np.abs(rest) < 1e-15, 0.0, rest)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a x b of two vectors."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


class Gauge:
    """How near a load R is to the edge of sum_e d_e [-backward_e, forward_e] (+ ellipse): t with R on t times
    its edge.

    gauge(R) = max over n of n . R / h(n), h(n) = sum forward (n . d)+ + backward (n . d)- + |S n_xy|, the
    support. For segments alone the normals of the facets are enough. With an ellipse h is minimised on the
    plane n . R = 1; its minimum lies where two segments kink, or at the one point of a segment's kink line
    where the slope of sqrt meets the slope of the segments, or at n_xy = 0. All these points are tried: each
    is an upper bound, the least is the minimum.
    """

    def __init__(self, directions: np.ndarray, ellipse: np.ndarray | None):
        every = np.vstack([directions, np.eye(3)[:2]]) if ellipse is not None else directions
        self.basis = span(every)
        self.rank = self.basis.shape[1]
        self.d = directions @ self.basis
        self.ellipse = ellipse
        if ellipse is not None:  # the basis is (x, y) or (x, y, yaw) then
            assert np.array_equal(self.basis, np.eye(3)[:, : self.rank])
            return
        normals = []
        if self.rank == 1:
            normals = [np.ones(1)]
        elif self.rank == 2:
            normals = [np.array([-d[1], d[0]]) for d in self.d]
        elif self.rank == 3:
            normals = [cross(a, b) for k, a in enumerate(self.d) for b in self.d[:k]]
            small = [1e-9 * np.linalg.norm(a) * np.linalg.norm(b) for k, a in enumerate(self.d) for b in self.d[:k]]
            normals = [n for n, edge in zip(normals, small, strict=True) if np.linalg.norm(n) > edge]
        n = np.array([*normals, *(-n for n in normals)]).reshape(len(normals) * 2, self.rank)
        slope = n @ self.d.T
        slope[np.abs(slope) < 1e-12 * np.abs(slope).max(initial=0.0)] = 0.0
        self.normals, self.up, self.down = n, np.maximum(slope, 0.0), np.maximum(-slope, 0.0)

    def __call__(self, load: np.ndarray, forward: np.ndarray, backward: np.ndarray) -> np.ndarray:
        """`load` (3, k); levels (elements, k). Returns (k,)."""
        load = self.basis.T @ load
        if self.rank == 0:
            return np.zeros(load.shape[1])
        if self.ellipse is not None:
            columns = zip(load.T, forward.T, backward.T, strict=True)
            return np.array([self._with_ellipse(*column) for column in columns])
        support = self.up @ forward + self.down @ backward
        push = self.normals @ load
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(push > 1e-13 * np.abs(self.normals).max(), push / support, 0.0)
        return ratio.max(axis=0)

    def _with_ellipse(self, load: np.ndarray, forward: np.ndarray, backward: np.ndarray) -> float:
        size = np.linalg.norm(load)
        if size < 1e-14:
            return 0.0
        load = load / size
        points = self._points2(load, forward, backward) if self.rank == 2 else self._points3(load, forward, backward)
        slope = points @ self.d.T
        # A point on a kink line is there by construction; rounding must not cost it anything.
        slope[np.abs(slope) < 1e-13 * np.linalg.norm(points, axis=1, keepdims=True)] = 0.0
        support = np.maximum(slope, 0.0) @ forward + np.maximum(-slope, 0.0) @ backward
        support += np.hypot(self.ellipse[0] * points[:, 0], self.ellipse[1] * points[:, 1])
        push = points @ load
        with np.errstate(divide="ignore", invalid="ignore"):
            return float(size * np.max(np.where(push > 0, push / support, 0.0)))

    def _points2(self, load, forward, backward):
        """Rank 2: one line n0 + tau t; kinks where n . d = 0, one sqrt between them."""
        n0, t = load, np.array([-load[1], load[0]])
        return self._line_points(n0, t, self.d, forward, backward)

    def _points3(self, load, forward, backward):
        points = [np.array([[0.0, 0.0, 1.0 if load[2] >= 0 else -1.0]])]
        for d in self.d:
            t = cross(d, load)
            if t @ t < 1e-24:
                continue  # the load pulls along this segment: the plane n . R = 1 does not meet its kink
            t /= math.sqrt(t @ t)
            n0 = cross(t, d)  # perpendicular to d, in the plane of d and the load
            n0 /= n0 @ load
            points.append(self._line_points(n0, t, self.d, forward, backward))
        return np.vstack(points)

    def _line_points(self, n0, t, d, forward, backward):
        """Kinks of the line, and between them the stationary points of beta tau + sqrt(A tau^2 + 2 B tau +
        C)."""
        along, start = d @ t, d @ n0
        kinks = np.sort(-start[np.abs(along) > 1e-12] / along[np.abs(along) > 1e-12])
        if len(kinks) == 0:
            middles = np.zeros(1)
        else:
            middles = np.concatenate([[kinks[0] - 1], (kinks[1:] + kinks[:-1]) / 2, [kinks[-1] + 1]])
        slope = start[:, None] + along[:, None] * middles
        beta = (np.where(slope > 0, forward[:, None], -backward[:, None]) * along[:, None]).sum(axis=0)
        e0, e1 = self.ellipse * n0[:2], self.ellipse * t[:2]
        A, B, C = e1 @ e1, e0 @ e1, e0 @ e0
        if A < 1e-300:
            taus = kinks
        else:
            with np.errstate(invalid="ignore", divide="ignore"):
                rest = np.sqrt(max(C - B * B / A, 0.0) / (A * (A - beta**2)))
            stationary = np.where(np.isfinite(rest), -beta * rest, 0.0) - B / A
            taus = np.concatenate([kinks, stationary])
        if len(taus) == 0:
            taus = np.zeros(1)
        return n0 + taus[:, None] * t


@dataclass
class Decision:
    """What holds, with which sign the rest slides, and the accelerations; margin: distance from the nearest
    edge."""

    stuck: frozenset
    ellipse_stuck: bool
    sigma: np.ndarray
    acceleration: np.ndarray
    margin: float


def closure(plant: Plant, stuck, ellipse_stuck: bool) -> tuple[frozenset, bool]:
    """Every element whose motion is in the span of what holds holds too."""
    basis = span(directions(plant, stuck, ellipse_stuck))
    rest = null(basis)
    inside = frozenset(e for e, d in enumerate(plant.direction) if np.abs(d @ rest).max(initial=0.0) < 1e-9)
    flat = np.abs(rest[:2]).max(initial=0.0) < 1e-9
    return inside, plant.hold_ellipse is not None and bool(flat)


def directions(plant: Plant, stuck, ellipse_stuck: bool) -> np.ndarray:
    rows = plant.direction[sorted(stuck)]
    return np.vstack([rows, np.eye(3)[:2]]) if ellipse_stuck else rows


def project_ellipse(p: np.ndarray, size: np.ndarray) -> np.ndarray:
    """The point of (p_x/size_x)^2 + (p_y/size_y)^2 <= 1 nearest to p: size^2 p / (size^2 + k), k by Newton
    from 0."""
    x, y, a, b = float(p[0]), float(p[1]), float(size[0]), float(size[1])
    if (x / a) ** 2 + (y / b) ** 2 <= 1:
        return p
    k = 0.0
    for _ in range(100):  # the excess is convex and falls with k: Newton rises monotonically
        fx, fy = (a * x / (a * a + k)) ** 2, (b * y / (b * b + k)) ** 2
        step = (fx + fy - 1) / (2 * (fx / (a * a + k) + fy / (b * b + k)))
        k += step
        if step <= 1e-15 * k:
            break
    return np.array([a * a * x / (a * a + k), b * b * y / (b * b + k)])


class Problem:
    """min 1/2 a M a - F . a + sum of levels |d . a| over the elements at rest, solved to rounding.

    Gauss-Seidel on the multipliers finds who moves; then the motion of that pattern is solved alone, and the
    pattern is verified: what moves does so in its direction, what holds is inside the sum of its sets.
    """

    def __init__(self, plant, force, at_rest, ellipse_at_rest, forward, backward, ellipse):
        self.plant, self.force, self.levels = plant, force, (forward, backward)
        self.at_rest, self.ellipse_at_rest, self.ellipse = sorted(at_rest), ellipse_at_rest, ellipse
        self.M, self.inverse = plant.M, np.linalg.inv(plant.M)
        self.flat = 1.0 / np.linalg.eigvalsh(self.inverse[:2, :2])[-1]  # [kg] a step of the ellipse that converges
        self.scale = np.abs(self.inverse @ force).max() + 1e-9

    def solve(self) -> tuple[np.ndarray, dict, bool, float]:
        """(accelerations, sign of each element that moves, whether the ellipse moves, margin)."""
        state = None
        for sweeps in (10, 20, 40, 80, 160, 320, 1000, 4000, 20000):
            a, state = self._sweep(sweeps, state)
            bound = self._at_bound(*state)
            for among, small in [(bound, 0.0), *((w, c) for w in (bound, None) for c in self._cuts(a))]:
                found = self._verify(a, small, among)
                if found is not None:
                    return found
        raise Tie("no pattern of sliding and holding satisfies its own conditions")

    def _at_bound(self, rho, push):
        """Elements whose multiplier is at the edge of its set: only they can move. -1 stands for the
        ellipse."""
        forward, backward = self.levels
        near = 1e-9 * (forward + backward)
        found = {e for e in self.at_rest if rho[e] >= forward[e] - near[e] or rho[e] <= near[e] - backward[e]}
        if self.ellipse_at_rest and (self.ellipse.min() == 0 or np.hypot(*(push / self.ellipse)) > 1 - 1e-9):
            found.add(-1)
        return found

    def _cuts(self, a):
        """Speeds below which an element may be taken to hold: between any two that differ, widest gap
        first."""
        rows = self.plant.direction[self.at_rest] @ a
        speeds = np.sort(np.abs([*rows, *([np.hypot(*a[:2])] if self.ellipse_at_rest else [])]) + 1e-14 * self.scale)
        speeds = np.concatenate([[1e-15 * self.scale], speeds, [1e3 * speeds.max(initial=self.scale)]])
        gaps = speeds[1:] / speeds[:-1]
        return [math.sqrt(speeds[k] * speeds[k + 1]) for k in np.argsort(-gaps) if gaps[k] > 1.5]

    def _sweep(self, sweeps, state):
        p, (forward, backward) = self.plant, self.levels
        size = [d @ self.inverse @ d for d in p.direction]
        rho, push = state if state is not None else (np.zeros(len(p.direction)), np.zeros(2))
        a = self.inverse @ (self.force - p.direction.T @ rho - np.array([*push, 0.0]))
        for _ in range(sweeps):
            before = a.copy()
            for e in self.at_rest:
                d = p.direction[e]
                new = min(max(rho[e] + (d @ a) / size[e], -backward[e]), forward[e])
                a = a - self.inverse @ d * (new - rho[e])
                rho[e] = new
            if self.ellipse_at_rest:
                new = self._project(push + self.flat * a[:2])
                a = a - self.inverse[:, :2] @ (new - push)
                push = new
            if np.abs(a - before).max() < 1e-15 * self.scale:
                break
        return a, (rho, push)

    def _project(self, push):
        return project_ellipse(push, self.ellipse) if self.ellipse.min() > 0 else np.zeros(2)

    def _verify(self, guess, small, among):
        p, (forward, backward) = self.plant, self.levels
        free = self.at_rest if among is None else [e for e in self.at_rest if e in among]
        sign = {e: np.sign(p.direction[e] @ guess) for e in free if abs(p.direction[e] @ guess) > small}
        moves = self.ellipse_at_rest and np.hypot(*guess[:2]) > small and (among is None or -1 in among)
        stuck, ellipse_stuck = [e for e in self.at_rest if e not in sign], self.ellipse_at_rest and not moves
        inside, flat = closure(p, stuck, ellipse_stuck)
        if any(e in inside for e in sign) or (moves and flat):
            return None
        force = self.force.copy()
        for e, s in sign.items():
            force -= p.direction[e] * (forward[e] if s > 0 else -backward[e])
        gauge = Gauge(p.direction[stuck], self.ellipse if ellipse_stuck else None)
        N = null(gauge.basis)
        a = self._motion(N, force, guess if moves else None)
        if a is None:
            return None
        margin = math.inf
        for e, s in sign.items():
            margin = min(margin, s * (p.direction[e] @ a) / self.scale)
        if moves:
            margin = min(margin, np.hypot(*a[:2]) / self.scale)
            force[:2] -= self.ellipse**2 * a[:2] / max(np.hypot(*(self.ellipse * a[:2])), 1e-300)
        if margin <= 0:
            return None
        if gauge.rank:
            load = (force - self.M @ a)[:, None]
            held = float(gauge(load, forward[stuck, None], backward[stuck, None])[0])
            if held > 1.0:
                return None
            margin = min(margin, 1.0 - held)
        return a, sign, moves, margin

    def _motion(self, N, force, guess):
        """Accelerations in the columns of N; `guess` starts Newton's iteration where the ellipse moves."""
        A, b = N.T @ self.M @ N, N.T @ force
        if N.shape[1] == 0:
            return np.zeros(3)
        if guess is None or self.ellipse.max() == 0:
            return N @ np.linalg.solve(A, b)
        Nx, square = N[:2], np.diag(self.ellipse**2)

        def residual(y):
            x = Nx @ y
            return A @ y - b + Nx.T @ (square @ x) / np.hypot(*(self.ellipse * x))

        y = N.T @ guess
        for _ in range(60):
            x = Nx @ y
            size = np.hypot(*(self.ellipse * x))
            if size == 0.0:
                return None
            J = A + Nx.T @ (square / size - np.outer(square @ x, square @ x) / size**3) @ Nx
            change, length = np.linalg.solve(J, residual(y)), 1.0
            old = np.linalg.norm(residual(y))
            while length > 1e-6 and not np.linalg.norm(residual(y - length * change)) <= old:
                length /= 2
            if np.abs(change).max() <= 1e-15 * np.abs(y).max():
                break
            y = y - length * change
        return N @ y


def decide(plant, force, at_rest, ellipse_at_rest, sigma, extra) -> Decision:
    """Who holds and who slides, of the elements at rest; `extra` adds to levels (gear). See the module's
    docstring."""
    released, ellipse_released, margin = set(), False, math.inf
    while True:
        level = plant.hold + extra[:, None]
        level[sorted(released)] = (plant.slide_at_rest + extra[:, None])[sorted(released)]
        ellipse = plant.ellipse_at_rest if ellipse_released else plant.hold_ellipse
        problem = Problem(plant, force, at_rest, ellipse_at_rest, level[:, 0], level[:, 1], ellipse)
        a, sign, moves, edge = problem.solve()
        margin = min(margin, edge)
        if set(sign) <= released and (not moves or ellipse_released):
            break
        released |= set(sign)
        ellipse_released |= moves
    stuck, flat = closure(plant, [e for e in at_rest if e not in sign], ellipse_at_rest and not moves)
    sigma = sigma.copy()
    sigma[sorted(stuck)] = 0.0
    for e, s in sign.items():
        sigma[e] = s
    return Decision(stuck, flat, sigma, a, margin)
