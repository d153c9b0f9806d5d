"""Sums of a piece as normal equations of parameters and of the states at its start, and their solution."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.problem.problem import PieceSums

NO_INFORMATION = 1e-100  # information on the start of a piece that is none: divided by it, nothing is finite
SPEED_LIMITS = np.array([30.0, 30.0, 300.0])  # [m/s, m/s, rad/s] no robot sets off faster; a step astray would not end


def of_states(information: FloatArray, right: FloatArray) -> FloatArray:
    """information^-1 right for the start of a piece; a state that no row tells of stays where it is.

    Such is the speed of a motor that sticks from the start, or whose outputs are missing until it has stopped.
    """
    try:
        return np.asarray(np.linalg.solve(information, right), dtype=float)
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.pinv(information, hermitian=True) @ right, dtype=float)


def weighted(
    sums: PieceSums,
    weight: FloatArray,
    scale: FloatArray,
    states: FloatArray,
    start_prior: tuple[FloatArray, FloatArray],
) -> tuple[FloatArray, FloatArray]:
    """Gradient and information of a piece over its columns, in inner numbers. start_prior: of its start, see
    `start_prior`.

    States that are not free do not move. Nor does a speed that the rows only know to be below the fastest (a robot may
    forget its start before the first row that is used), or that they would pull beyond it.
    """
    count = len(scale)
    full = np.concatenate([scale, np.ones(sums.grad.shape[1] - count)])
    grad = (weight @ sums.grad) * full
    info = np.tensordot(weight, sums.info, 1) * np.outer(full, full)
    start = np.arange(count, count + len(start_prior[0]))
    grad[start] += start_prior[0]
    info[start, start] += start_prior[1]
    state_information = info.diagonal()[count:]
    if not state_information.max(initial=0.0) > NO_INFORMATION:
        return grad[:count], info[:count, :count]
    unseen_states = state_information <= NO_INFORMATION
    unseen_states[: len(SPEED_LIMITS)] |= state_information[: len(SPEED_LIMITS)] < SPEED_LIMITS**-2
    speeds, pull = states[: len(SPEED_LIMITS)], grad[count : count + len(SPEED_LIMITS)]
    unseen_states[: len(SPEED_LIMITS)] |= (np.abs(speeds) >= SPEED_LIMITS) & (np.sign(speeds) * pull > 0.0)
    state_indices = np.flatnonzero(unseen_states) + count
    grad[state_indices], info[state_indices, :], info[:, state_indices] = 0.0, 0.0, 0.0
    info[state_indices, state_indices] = 1.0
    return grad, info


def damped(info: FloatArray, damping: float) -> FloatArray:
    return info + np.diag(damping * info.diagonal()) if damping else info


def solve_balanced(information: FloatArray, gradient: FloatArray) -> FloatArray:
    """information^-1 gradient in balanced units; directions that the data do not see stay where they are."""
    size = np.sqrt(np.maximum(information.diagonal(), 0.0))
    size[size == 0.0] = 1.0
    values, vectors = np.linalg.eigh(information / np.outer(size, size))
    seen_values = values > 1e-13 * max(float(values.max(initial=0.0)), 1e-300)
    inverse = np.where(seen_values, 1.0 / np.where(seen_values, values, 1.0), 0.0)
    return (vectors @ (inverse * (vectors.T @ (gradient / size)))) / size
