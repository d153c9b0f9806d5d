"""What holds at rest in the reference of slipping.py: forces within levels, one pair of them within an ellipse.

least: the forces r, q of what is at rest that leave the least acceleration, |A r + P q - b|^2, r within bounds and
(q_x/C_x)^2 + (q_y/C_y)^2 <= 1. A ray of the ellipse is a segment, so for one direction of q it is least squares within
bounds; the best direction is where the slope along the edge is 0: along it there is one minimum.
"""

import numpy as np
from scipy.optimize import brentq, linprog, lsq_linear

RAYS = 32
NONE = 1e-26  # of |b|^2: a square that is rounding
CUTS, NEAR = 60, 1e-13


class Ellipse:
    """Friction along the direction of travel: levels (Cx, Cy) in motion and at rest; fall: 1/v_s, 0 for none."""

    def __init__(self, law, fall):
        self.slide = np.array(law.coulomb)
        self.hold = np.array(law.coulomb if law.breakaway is None else law.breakaway)
        self.law, self.fall = law, fall

    def force(self, v, falling):
        """C^2 v/|C v|, C the levels at the speed |v|."""
        size, slide, hold = np.hypot(*v), self.slide, self.hold
        c = slide if self.fall == 0.0 else falling(self.law, size, slide, hold, self.fall)
        return c**2 * v / np.hypot(*(c * v))


def least(matrix, right, bounds, plane=None, levels=None):
    """(r, q). bounds: (low, high) of r; plane: P, None where no ellipse is at rest."""
    many = matrix.shape[1]

    def solved(more, low, high):
        both = np.append(bounds[0], low), np.append(bounds[1], high)
        return lsq_linear(np.hstack([matrix, more]), right, both, method="bvls", tol=1e-15).x

    if plane is None:
        return (solved(np.zeros((len(right), 0)), [], []) if many else np.zeros(0)), np.zeros(2)
    x = solved(plane, [-np.inf] * 2, [np.inf] * 2)
    if np.hypot(*(x[many:] / levels)) <= 1.0:
        return x[:many], x[many:]

    def along(angle):
        ray = plane @ (levels * [np.cos(angle), np.sin(angle)])
        x = solved(ray[:, None], [0.0], [1.0])
        off = matrix @ x[:many] + ray * x[many] - right
        slope = x[many] * off @ (plane @ (levels * [-np.sin(angle), np.cos(angle)]))
        return off @ off, slope, x

    step = 2.0 * np.pi / RAYS
    angle = min(np.arange(RAYS) * step, key=lambda each: along(each)[0])
    low, high = angle - step, angle + step
    if along(angle)[0] > NONE * (right @ right) and along(low)[1] < 0.0 < along(high)[1]:
        angle = brentq(lambda each: along(each)[1], low, high, xtol=1e-15, rtol=1e-15)
    x = along(angle)[2]
    return x[:many], x[many] * levels * [np.cos(angle), np.sin(angle)]


def room(rows, load, both, levels=None):
    """The most by which what is at rest could hold less, where its elements share their load.

    rows (j, k): the directions of j scalar elements, and behind them of the ellipse; load (j + 2,): forces with which
    they hold; both (j, 2): levels. t with rows^T x = rows^T load and -back + t <= x <= hold - t; of the ellipse
    |x/levels| + t/min(levels) <= 1, by tangents.
    """
    count = len(both)
    j = len(rows)
    above = np.hstack([np.vstack([np.eye(count, j), -np.eye(count, j)]), np.ones((2 * count, 1))])
    most = np.concatenate([both[:, 0], both[:, 1]])
    basis = np.linalg.svd(rows.T)[0][:, : np.linalg.matrix_rank(rows)].T @ rows.T
    same = np.hstack([basis, np.zeros((len(basis), 1))])
    tangents = [] if levels is None else list(np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False))
    for _ in range(CUTS):
        cuts = np.zeros((len(tangents), j + 1))
        for row, angle in zip(cuts, tangents, strict=True):
            row[count:] = np.cos(angle) / levels[0], np.sin(angle) / levels[1], 1.0 / min(levels)
        out = linprog(
            -np.eye(j + 1)[-1],
            np.vstack([above, cuts]),
            np.append(most, np.ones(len(cuts))),
            same,
            basis @ load,
            [(None, None)] * (j + 1),
        )
        if levels is None:
            break
        q = out.x[count:-1] / levels
        if np.hypot(*q) + out.x[-1] / min(levels) <= 1.0 + NEAR:
            break
        tangents.append(np.arctan2(q[1], q[0]))
    return float(out.x[-1])
