"""PidBatch: `Pid` for many robots at once: the same law, over arrays. A test holds both together, step by step."""

from __future__ import annotations

import math

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.control.paths.motion import Path
from omnidyn.control.pid import Pid
from omnidyn.control.speed_loop import MOST_STEPS
from omnidyn.model.frames import world_to_body


class PidBatch:
    """As many controllers as asked for, all like one, of voltages and of speeds that are instantaneous."""

    def __init__(self, pid: Pid, count: int) -> None:
        self._pid, self._sum, self._t = pid, np.zeros((count, 3)), math.nan

    def step_batch(self, t: float, pose: FloatArray, twist: FloatArray, path: Path) -> FloatArray:
        """Volts from t [s] on. pose, twist: shape (n, 3). Returns shape (n, wheels)."""
        pid, step = self._pid, self._pid.volts.held
        dt = 0.0 if math.isnan(self._t) else min(t - self._t, MOST_STEPS * pid.dt)
        self._t = t
        motion = path.at(np.array([t, t + pid.late, t + pid.late + pid.dt]))
        off = motion.pose[0] - pose
        off[:, 2] -= 2.0 * math.pi * np.round(off[:, 2] / (2.0 * math.pi))
        ahead = np.array([0.0, 1.0]) * pid.dt * motion.velocity[1, 2]
        turned = world_to_body(pose[:, 2, None] + ahead)
        first, second = turned[:, 0], turned[:, 1]
        error, speed = (first @ off[..., None])[..., 0], first @ motion.velocity[0]
        now, then = first @ motion.velocity[1], second @ motion.velocity[2]
        back = pid.gains.speed * (speed - twist) + pid.gains.place * error
        change = (then - now @ step.decay.T) @ step.back.T + now @ step.A.T
        way = 0.5 * (now + then) + pid.home * error
        if not pid.feedforward:
            now, change = 0.0 * now, 0.0 * change
        raised_sum = self._sum + off * dt
        raised, met = self._volts(now, change + back, way, first, raised_sum)
        kept, _ = self._volts(now, change + back, way, first, self._sum)
        self._sum = np.where(met, self._sum, raised_sum)
        return np.where(met, kept, raised)

    def _volts(
        self, now: FloatArray, change: FloatArray, way: FloatArray, turned: FloatArray, total: FloatArray
    ) -> tuple[FloatArray, BoolArray]:
        """Volts within the limits, with a sum of errors; and whether a limit was met, shape (n, 1)."""
        volts, levels = self._pid.volts, self._pid.volts.model.levels
        change = change + self._pid.gains.sum * (turned @ total[..., None])[..., 0]
        viscous = -(levels.viscous * ((way - now) @ levels.directions.T)) @ levels.directions
        friction = volts.model.soft_friction(way, volts.fade) - viscous
        effort = volts.model.effort(now, volts.model.wrench(now, change, friction))
        met = (np.abs(effort.voltage) >= volts.limit) | (np.abs(effort.current) > volts.current_limit)
        return np.clip(effort.voltage, -volts.limit, volts.limit), np.any(met, axis=1)[:, None]
