"""How far the numbers of a fit are off because the inputs of its log are rounded.

While an input is held the true one is off by u, even between -q/2 and q/2 of its step q; another one is, by another u.
To first order this shows z = sum over such stretches of dy/du u in the rows made white, and moves the numbers by

    d = (J'J)^-1 J' z

Draws of all u give the covariance of d. Of what is left of z beside J the residuals e have a share s^2 of that of
steps that lost something, and none where the motors take just these steps:

    E (e'z)^2 = E |z|^2 + s^2 E (z'z~)^2        z, z~: two draws

so that a log in which it would show by itself tells how much of it there is. Where it would not, all of it counts.
"""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.memory.whitening import Weighed
from omnidyn.identification.output_error.problem.input_steps import as_logged, input_steps
from omnidyn.identification.structure.linear import solved
from omnidyn.identification.structure.motion import Motion, motions
from omnidyn.identification.structure.rests_on import as_weighed, members_of
from omnidyn.model.dynamics import drive_wrench, linear_part
from omnidyn.model.layout import N_AXES
from omnidyn.model.motor import per_wheel

DRAWS = 60  # a variance within a fifth; always the same ones
SEED = 20_12


def moved_by_rounding(sure: Weighed) -> FloatArray:
    """What the rounding of its inputs moves the parameters of a fit by, in the numbers that the solver sees: their
    covariance is that times its transpose. Shape (P, DRAWS)."""
    linear, engine, point = as_weighed(sure)
    shown = [np.zeros((*own.shape, DRAWS)) for own in linear.rows.residual]
    random = np.random.default_rng(SEED)
    for problem, own_point, _, places in members_of(engine, linear.rows.problem, point):
        for place, motion in zip(places, motions(problem, own_point), strict=True):
            shown[place] = _shown(motion, _drawn(motion, random))
    e, j = linear.whole()
    z = linear.white(shown)
    by = solved(j, z)
    return by * np.sqrt(_share(e - j @ solved(j, e), z - j @ by) / DRAWS)


def _drawn(motion: Motion, random: np.random.Generator) -> FloatArray:
    """Draws of what was rounded off [V], another one at each change of an input. Shape (rows, DRAWS, W)."""
    record, rows = motion.piece.record, slice(motion.piece.first, motion.piece.last + 1)
    inputs, steps = as_logged(record)[rows], input_steps(record)
    off = np.zeros((len(inputs), DRAWS, len(steps)))
    for w in np.flatnonzero(steps):
        stretch = np.cumsum(np.diff(inputs[:, w], prepend=inputs[:1, w]) != 0.0)
        off[:, :, w] = steps[w] * random.uniform(-0.5, 0.5, (int(stretch[-1]) + 1, DRAWS))[stretch]
    return off * (inputs != 0.0)[:, None, :]  # what is off is off


def _shown(motion: Motion, volts: FloatArray) -> FloatArray:
    """What the columns show of other voltages (rows, K, W). Shape (C, rows, K)."""
    robot = linear_part(motion.robot)
    per_volt = drive_wrench(robot, np.zeros(N_AXES), np.eye(robot.wheels.count))
    found = motion.shown_by(volts @ per_volt)
    ohm = per_wheel(robot.motor.resistance, robot.wheels.count)
    for c, (name, i) in enumerate(motion.piece.record.columns):
        if name == "current":
            found[c] += volts[..., i] / ohm[i]
    return found


def _share(left: FloatArray, z: FloatArray) -> float:
    """How much of the variance of what may have been rounded off there is, two standard errors beyond what is seen."""
    both = (z.T @ z) ** 2
    apart = float(both.sum() - np.trace(both)) / (DRAWS * (DRAWS - 1))
    if apart <= 0.0:
        return 0.0
    seen = float(np.mean((left @ z) ** 2) - np.mean((z**2).sum(axis=0)))
    error = np.sqrt(2.0 * float(both.mean()))
    return float(np.clip((seen + 2.0 * error) / apart, 0.0, 1.0))
