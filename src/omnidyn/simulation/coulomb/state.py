"""What a run works in: its rows, the robot, the loop in front of it, what sensors show, and room for a step."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.simulation.coulomb.stage import SLIDES


class Seen(NamedTuple):
    """What sensors show at times t - late. L latencies, K derivatives, W numbers of the travel; see ../travel.py.

    NaN where t - late lies outside the run.
    """

    t: FloatArray  # (rows,) [s], from the start of the run
    late: FloatArray  # (L,) [s]
    same: float  # [s] times that differ by less are one
    next: IntArray  # (L,) the row whose sample is next
    order: IntArray  # (K,) the place of each derivative
    twist: FloatArray  # (L, rows, 3)
    pace: FloatArray  # (L, rows, 3) its time derivative
    travel: FloatArray  # (L, rows, W)
    dtwist: FloatArray  # (L, rows, K, 3)
    dtravel: FloatArray  # (L, rows, K, W)


class Law(NamedTuple):
    """The numbers of a robot, how they change with the first R of K parameters, and where friction acts: see law.py.

    Where a motor has a limit or coasts, m is the number of wheels, else 0; then value and change are as the motors are
    at the moment, see limits.py.
    """

    value: FloatArray  # (SIZE,)
    change: FloatArray  # (SIZE, R)
    kind: int
    memory: FloatArray  # (2,) [s] in which the slowest motion fades; and where a motor is at its bound
    wheel: FloatArray  # (m, WHEEL)
    dwheel: FloatArray  # (R, m, WHEEL)
    dlimit: FloatArray  # (R, m) change of the limit [A]
    side: FloatArray  # (m,) 0: free, else the sign of the current at its bound
    bare: FloatArray  # (9,) D without any motor
    dbare: FloatArray  # (9, R)

    def fresh(self) -> Law:
        """The same with room of its own for what changes with the motors."""
        return self._replace(value=self.value.copy(), change=self.change.copy(), side=self.side.copy())


class ForceRows(NamedTuple):
    """Forces held over rows [N, N, N m], and their derivatives; with limits those that are not of the motors."""

    dt: FloatArray  # (rows,)
    force: FloatArray  # (rows, 3)
    dforce: FloatArray  # (rows, 3, K)
    volts: FloatArray  # (rows, m)
    dvolts: FloatArray  # (rows, m, K)
    bound: FloatArray  # (rows, m) of currents [A]


class Work(NamedTuple):
    """Room to work in: ends of the three stages, their x*, what slides in them; and the same of derivatives."""

    x: FloatArray  # (3,)
    ends: FloatArray  # (3, 3)
    goals: FloatArray  # (3, 3)
    slides: FloatArray  # (4, SLIDES)
    rate: FloatArray  # (2, 3) at the start of the step and at its end
    travel: FloatArray  # (2, W) there
    spare: FloatArray  # (3,)
    inverse: FloatArray  # (9,)
    d: FloatArray  # (3, K)
    dends: FloatArray  # (3, 3, K)
    dgoals: FloatArray  # (3, 3, K)
    drate: FloatArray  # (2, 3, K)
    dtravel: FloatArray  # (2, W, K)
    dspare: FloatArray  # (3, K)
    force: FloatArray  # (3,) at work, where motors have limits
    dforce: FloatArray  # (3, K)


def empty_seen(t: FloatArray, late: FloatArray, same: float, order: IntArray, width: int) -> Seen:
    """Nothing has been seen yet. width: W."""
    shape = (len(late), len(t))
    return Seen(
        np.ascontiguousarray(t - t[0]),
        np.array(late, dtype=float),
        same,
        np.zeros(len(late), np.int64),
        order,
        np.full((*shape, 3), np.nan),
        np.full((*shape, 3), np.nan),
        np.full((*shape, width), np.nan),
        np.full((*shape, len(order), 3), np.nan),
        np.full((*shape, len(order), width), np.nan),
    )


def new_work(start: FloatArray, travel: FloatArray, dstart: FloatArray) -> Work:
    """Room for a run from a twist (3,) and a travel (W,), with derivatives of the twist (3, K)."""
    keys, width = dstart.shape[1], len(travel)
    return Work(
        np.array(start, dtype=float),
        np.zeros((3, 3)),
        np.zeros((3, 3)),
        np.zeros((4, SLIDES)),
        np.zeros((2, 3)),
        np.stack([travel, np.zeros(width)]),
        np.zeros(3),
        np.zeros(9),
        np.array(dstart, dtype=float),
        np.zeros((3, 3, keys)),
        np.zeros((3, 3, keys)),
        np.zeros((2, 3, keys)),
        np.zeros((2, width, keys)),
        np.zeros((3, keys)),
        np.zeros(3),
        np.zeros((3, keys)),
    )


class Loop(NamedTuple):
    """The firmware's speed loop, and what it needs of a robot; see ../speed_loop.py. J rows.

    d...: derivatives by K parameters, of numbers of the robot by the first R of them. ask and dask receive what the
    loop asks for.
    """

    gains: FloatArray  # (4, n) kp [V s/rad], ki [V/rad], limit [V], radius [m]
    dgains: FloatArray  # (R, 4, n)
    wheel: FloatArray  # (n, 3) rim speeds of a twist
    dwheel: FloatArray  # (R, n, 3)
    drive: FloatArray  # (3, n) forces per volt
    ddrive: FloatArray  # (R, 3, n)
    command: FloatArray  # (J, n) [rad/s]
    dcommand: FloatArray  # (K, J, n), or none
    tick: BoolArray  # (J,) whether the loop runs at the start of the row; else its voltage stays
    push: FloatArray  # (3,) wrench from outside
    bound: FloatArray  # (n,) of currents [A]
    period: float  # [s]
    dead: float  # [V] of what the loop asks for the driver passes on all but this
    sum: FloatArray  # (n,) integral so far [V], in place
    dsum: FloatArray  # (K, n)
    ask: FloatArray  # (J, n) [V]
    dask: FloatArray  # (K, J, n)
