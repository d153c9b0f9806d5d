"""PidBatch: `Pid` for many robots at once: the law is that of `Pid`; what each remembers stands in arrays."""

from __future__ import annotations

import math

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.control.paths.motion import Path
from omnidyn.control.pid import Pid
from omnidyn.control.pose_gate import PoseGate
from omnidyn.control.speed_loop import MOST_STEPS


class PidBatch:
    """As many controllers as asked for, all like one, of voltages and of speeds that are instantaneous."""

    def __init__(self, pid: Pid, count: int) -> None:
        self._pid, self._sum, self._t = pid, np.zeros((count, 3)), math.nan
        self._estimator = pid._estimator
        if self._estimator is not None:
            self._poses = self._estimator.memories(count)
        self._gate, self._memories = PoseGate(pid.robot, pid.dt), np.zeros((count, 7, 3))

    def step_batch(self, t: float, pose: FloatArray, twist: FloatArray, path: Path) -> FloatArray:
        """Volts from t [s] on. pose, twist: shape (n, 3). Returns shape (n, wheels)."""
        pid, volts = self._pid, self._pid.volts
        dt = 0.0 if math.isnan(self._t) else min(t - self._t, MOST_STEPS * pid.dt)
        self._t = t
        states = np.hstack([pose, twist])
        if self._estimator is not None:
            self._estimator.estimate_each(self._poses, t, states)
        self._gate.judge_each(self._memories, t, states)
        pose, twist = states[:, :3], states[:, 3:]
        motion = path.at(np.array([t, t + pid.late, t + pid.late + pid.dt]))
        off = motion.pose[0] - pose
        off[:, 2] -= 2.0 * math.pi * np.round(off[:, 2] / (2.0 * math.pi))
        aim = pid.aim(off, pose[:, 2], twist, motion.velocity)
        place, turn = pid.farthest
        place, turn = (
            place / np.maximum(place, np.sum(off[:, :2] ** 2, axis=1)),
            turn / np.maximum(turn, off[:, 2] ** 2),
        )
        raised_sum = summed_each(self._sum, off * dt, np.stack([place, place, turn], axis=1))
        raised, kept = pid.effort(aim, raised_sum), pid.effort(aim, self._sum)
        met = np.logical_or(*volts.beyond(raised))[:, None]
        self._sum = np.where(met, self._sum, raised_sum)
        return np.clip(np.where(met, kept.voltage, raised.voltage), -volts.limit, volts.limit)


def summed_each(totals: FloatArray, more: FloatArray, weights: FloatArray) -> FloatArray:
    """`summed` of many."""
    lowered = totals + more
    beyond = (weights < 1.0) & (lowered * totals < 0.0)
    return np.where(more * totals >= 0.0, totals + weights * more, np.where(beyond, 0.0, lowered))
