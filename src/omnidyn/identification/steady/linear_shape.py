"""A fitted shape of friction as a linear problem: its levels, beside whatever else may explain the forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.steady.operating_points import ForcePoints
from omnidyn.identification.steady.shapes import (
    HUBER,
    RAYLEIGH,
    ShapeFit,
    element_speeds,
    fold_numbers,
    seen_components,
)
from omnidyn.model.robot import Robot
from omnidyn.statistics import huber_weight

SLOW_SHARE = 0.02  # of the fastest rim: a part of the shape that moves less may be at rest
STILL_TIMES = 2.0  # as sure as that: what is not known to move is left out, and what hardly is

ROUNDS = 10  # of robust weights


def all_moving(robot: Robot, points: ForcePoints, fit: ShapeFit) -> ForcePoints:
    """The points at which every part of a shape moves: one at rest holds any force."""
    slow = element_speeds(fit.shape, robot, points)
    fastest = np.linalg.norm(points.twist * [1.0, 1.0, float(np.mean(robot.wheels.robot_radius))], axis=1)
    bound = np.maximum(STILL_TIMES * points.still, SLOW_SHARE * fastest)
    return points.chosen(np.asarray((slow > bound[:, None]).all(axis=1)))


@dataclass(frozen=True, eq=False)
class SolvedShape:
    """A linear fit. level, std: of all columns; error: left out, (points, components); added: force of the new ones."""

    level: FloatArray
    std: FloatArray
    error: FloatArray
    residual: FloatArray
    degrees: int
    new: int


class LinearShape:
    """The chosen shape, linear about its fitted levels, with more columns beside it."""

    def __init__(self, robot: Robot, points: ForcePoints, fit: ShapeFit, has_yaw: bool):
        self.arm, self.seen = float(np.mean(robot.wheels.robot_radius)), seen_components(points, has_yaw)
        wrench, slope = fit.shape.table(robot, points, is_turning_fit(fit), fit.free)
        self.base, self.force = self.components(slope), self.components(wrench[:, :, None])
        self.target = self.components((points.wrench - wrench)[:, :, None])[:, :, 0] + self.base @ fit.free
        self.fold, self.count = fold_numbers(points), int(fold_numbers(points).max()) + 1
        self.sizes = np.linalg.norm(self.base, axis=(0, 1)) > 0.0

    def components(self, wrench: FloatArray) -> FloatArray:
        """(F_x, F_y), and T / b, of an array of shape (points, 3, levels), as far as a point tells them."""
        scale = np.array([1.0, 1.0, self.arm])[None, :, None]
        return (wrench / scale)[:, : self.seen.shape[1]] * self.seen[:, :, None]

    def solve(self, extra_columns: FloatArray) -> SolvedShape | None:
        """Robust least squares, each fold left out once; None where the columns are not determined."""
        design = np.concatenate([self.base[:, :, self.sizes], extra_columns], axis=2)
        norm = np.linalg.norm(design, axis=(0, 1))
        if (norm == 0.0).any() or self.count <= design.shape[2] + 1:
            return None
        design, weight = design / norm, np.ones(len(design))
        if np.linalg.cond(design.reshape(-1, len(norm))) > 1e4:
            return None
        level = np.zeros(len(norm))
        for _ in range(ROUNDS):
            normal, right = self._sums(design, weight)
            level = np.linalg.solve(normal.sum(axis=0), right.sum(axis=0))
            length = np.linalg.norm(self.target - design @ level, axis=1)
            scale = float(np.median(length)) / RAYLEIGH
            if scale == 0.0:
                break
            weight = huber_weight(length, HUBER * scale)
        normal, right = self._sums(design, weight)
        normal_without_fold = normal.sum(axis=0) - normal
        if np.linalg.cond(normal_without_fold).max() > 1e8:
            return None
        levels = np.linalg.solve(normal_without_fold, (right.sum(axis=0) - right)[:, :, None])[:, :, 0]
        deviation = levels - levels.mean(axis=0)
        std = np.sqrt((self.count - 1) / self.count * (deviation**2).sum(axis=0))
        error = self.target - np.einsum("ncp,np->nc", design, levels[self.fold])
        return SolvedShape(
            level, std, error, self.target - design @ level, self.count - len(level), extra_columns.shape[2]
        )

    def _sums(self, design: FloatArray, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The normal equations of each fold: (folds, p, p), (folds, p)."""
        p = design.shape[2]
        normal, right = np.zeros((self.count, p, p)), np.zeros((self.count, p))
        np.add.at(normal, self.fold, weight[:, None, None] * np.einsum("nca,ncb->nab", design, design))
        np.add.at(right, self.fold, weight[:, None] * np.einsum("nca,nc->na", design, self.target))
        return normal, right


def is_turning_fit(fit: ShapeFit) -> bool:
    """Whether a shape was fitted to the torque too."""
    return fit.error.shape[1] == 3
