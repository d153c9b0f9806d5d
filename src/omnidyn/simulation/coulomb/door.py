"""From plants and voltages to a run of this room."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.model.layout import N_AXES, Plant, many
from omnidyn.simulation.coulomb.law import (
    DAMPING,
    TURNING,
    couples,
    drives_of,
    is_coulomb,
    kind_of,
    laws_of,
    rims_of,
    wheels_of,
)
from omnidyn.simulation.coulomb.run import run_loop, run_rows
from omnidyn.simulation.coulomb.state import ForceRows, Law, Loop, Seen, empty_seen, new_work
from omnidyn.simulation.speed_loop import LoopSettings
from omnidyn.simulation.travel import SAME_TIME

MEMORY_BOUNDS = (0.15, 30.0)  # [s] a robot is taken to forget an error in its memory, within these bounds
SAME_SHARE = 0.1  # of the shortest row: times nearer than this are one, or than SAME_TIME
MOST_STEPS = (1e6, 7e6)  # steps solved at tol 1e-6, and so many more per second simulated; then a run is given up


class Moved(NamedTuple):
    """A robot of this room, and how it changes along directions: see law.py."""

    law: Law
    drive: FloatArray  # (3, n)
    drive_change: FloatArray  # (R, 3, n)
    rim: FloatArray  # (n, 3)
    rim_change: FloatArray  # (R, n, 3)
    limit: FloatArray  # (n,) of currents [A]
    bounded: Law  # the same with its motors one by one

    def law_under(self, bound: FloatArray) -> tuple[Law, FloatArray]:
        """(the law, the bounds of currents (rows, m) [A]) under bounds (rows, n): m is 0 where none is finite."""
        if np.isfinite(bound).any():
            return self.bounded.fresh(), np.ascontiguousarray(bound)
        return self.law, np.zeros((len(bound), 0))


def moved(numbers: Plant, plants: Sequence[Plant], step: float) -> Moved | None:
    """The robot, and its derivatives from plants up (2k) and down (2k + 1) each of R directions, by `step`; None where
    this room does not know one of them."""
    everyone = many([numbers, *plants])
    kinds = kind_of(everyone)
    if couples(numbers) or not is_coulomb(everyone).all() or (kinds != kinds[0]).any():
        return None
    laws, drives, rims, wheels = laws_of(everyone), drives_of(everyone), rims_of(everyone), wheels_of(everyone)
    bare = laws_of(everyone, emf=False)[:, DAMPING:TURNING]
    limits = everyone.element["limit"][:, N_AXES:]
    limit_change = np.where(np.isfinite(limits[1::2]), _change(np.where(np.isfinite(limits), limits, 0.0), step), 0.0)

    def law(wheels: FloatArray, limit_change: FloatArray) -> Law:
        return Law(
            laws[0].copy(),
            np.ascontiguousarray(_change(laws, step).T),
            int(kinds[0]),
            np.clip(numbers.body.memory, *MEMORY_BOUNDS),
            wheels[0].copy(),
            _change(wheels, step),
            limit_change,
            np.zeros(wheels.shape[1]),
            bare[0].copy(),
            np.ascontiguousarray(_change(bare, step).T),
        )

    return Moved(
        law(wheels[:, :0], limit_change[:, :0]),
        drives[0],
        _change(drives, step),
        rims[0],
        _change(rims, step),
        limits[0].copy(),
        law(wheels, limit_change),
    )


def _change(numbers: FloatArray, step: float) -> FloatArray:
    """Derivatives of numbers: of the robot, then up and down each of R directions. Shape (R, ...)."""
    return np.ascontiguousarray((numbers[1::2] - numbers[2::2]) / (2.0 * step))


def run(
    robot: Moved,
    t: FloatArray,
    dt: FloatArray,
    voltage: FloatArray,
    twist: FloatArray,
    step: FloatArray,
    tol: float,
    late: FloatArray,
    travel: FloatArray,
    push: FloatArray | None = None,
    rates: Sequence[Mapping[str, FloatArray | None]] = (),
    order: Sequence[int] = (),
    bound: FloatArray | None = None,
) -> Seen:
    """A run from a twist under held voltages, seen at t - late, with its derivatives.

    Args:
        robot: with its derivatives by the first R of K directions.
        t: of the samples [s], shape (samples,).
        dt: for how long each voltage holds [s], shape (rows,).
        voltage: at the motors [V], shape (rows, n).
        twist: at the start, shape (3,).
        step: to begin with [s], shape (1,); becomes the one to go on with.
        tol: of the twist [m/s].
        late: latencies [s], shape (L,).
        travel: at the start, shape (W,), of as many numbers as are wanted: see ../travel.py.
        push: wrench from outside over each row [N, N, N m], shape (rows, 3).
        rates: of each of the K directions the derivatives of voltage, push and twist, where there are any.
        order: the place of each of them in what is seen.
        bound: of the current of each motor over each row [A], shape (rows, n); None for the limits of the robot.

    Raises InputError where motion is so fast beside its duration that no patience would do.
    """
    drive, keys, rows = robot.drive, len(rates), len(dt)
    law, bound = robot.law_under(np.broadcast_to(robot.limit, voltage.shape) if bound is None else bound)
    limited = bound.shape[1] > 0
    force, dforce = np.zeros((rows, N_AXES)), np.zeros((rows, N_AXES, keys))
    dvolts = np.zeros((rows, bound.shape[1], keys))
    for w in range(0 if limited else drive.shape[1]):  # in this order: what mirrors cancels to the last bit
        force += voltage[:, w, None] * drive[:, w]
    changes = robot.drive_change
    if len(changes) and not limited:
        dforce[:, :, : len(changes)] = (
            (voltage @ changes.reshape(-1, drive.shape[1]).T).reshape(len(dt), len(changes), N_AXES).swapaxes(1, 2)
        )
    if push is not None:
        force = force + push[: len(dt)]
    dtwist = np.zeros((N_AXES, keys))
    for k, rate in enumerate(rates):
        dvoltage, dpush, start = rate.get("voltage"), rate.get("push"), rate.get("twist")
        if dvoltage is not None and limited:
            dvolts[:, :, k] = dvoltage
        elif dvoltage is not None:
            dforce[:, :, k] += dvoltage @ drive.T
        if dpush is not None:
            dforce[:, :, k] += dpush[: len(dt)]
        if start is not None:
            dtwist[:, k] = start
    seen = empty_seen(t, late, min(SAME_TIME, SAME_SHARE * float(dt.min())), np.asarray(order, np.int64), len(travel))
    volts = np.ascontiguousarray(voltage[:, : bound.shape[1]])
    held = ForceRows(np.ascontiguousarray(dt), np.ascontiguousarray(force), dforce, volts, dvolts, bound)
    limit = _most_steps(dt, tol)
    _refuse_run_away(run_rows(law, held, new_work(twist, travel, dtwist), step, tol, limit, seen), dt, tol, limit)
    return seen


class Looped(NamedTuple):
    """A run behind a speed loop. ask [V]: what the loop asks for in each of J intervals (J, n); dask: its derivatives
    (K, J, n); sum [V]: the integral at the end (n,)."""

    seen: Seen
    ask: FloatArray
    dask: FloatArray
    sum: FloatArray


def run_looped(
    robot: Moved,
    gains: FloatArray,
    dgains: FloatArray,
    loop: LoopSettings,
    before: FloatArray,
    t: FloatArray,
    dt: FloatArray,
    twist: FloatArray,
    step: FloatArray,
    tol: float,
    late: FloatArray,
    travel: FloatArray,
    push: FloatArray | None = None,
    dcommand: FloatArray | None = None,
) -> Looped:
    """A run behind the firmware's speed loop, with its derivatives by K numbers of the robot, which rested before.

    Args:
        robot: with these derivatives.
        gains, dgains: kp, ki, limit and radius of each wheel, (4, n), and their derivatives (K, 4, n).
        loop: the commands of each interval (J, n), whether it begins with a tick, and the integral so far.
        before: what the loop has asked for until its first tick [V], shape (n,).
        t, dt, twist, step, tol, late, travel: as of `run`, of J intervals.
        push: wrench from outside [N, N, N m], shape (3,).
        dcommand: derivatives of the commands, shape (K, J, n).

    Raises InputError where motion is so fast beside its duration that no patience would do.
    """
    keys, n = len(dgains), gains.shape[1]
    seen = empty_seen(t, late, SAME_TIME, np.arange(keys), len(travel))
    law, bound = robot.law_under(robot.limit[None])
    whole = Loop(
        gains,
        dgains,
        robot.rim,
        robot.rim_change,
        np.ascontiguousarray(robot.drive),
        np.ascontiguousarray(robot.drive_change),
        np.ascontiguousarray(loop.command),
        np.zeros((0, 0, n)) if dcommand is None else np.ascontiguousarray(dcommand),
        loop.tick,
        np.zeros(N_AXES) if push is None else np.array(push, dtype=float),
        bound[0],
        loop.period,
        loop.dead,
        loop.sum.copy(),
        np.zeros((keys, n)),
        np.zeros((len(dt), n)),
        np.zeros((keys, len(dt), n)),
    )
    work, limit = new_work(twist, travel, np.zeros((N_AXES, keys))), _most_steps(dt, tol)
    dt = np.ascontiguousarray(dt)
    row = run_loop(law, dt, whole, before, np.zeros((keys, n)), work, step, tol, limit, seen)
    _refuse_run_away(row, dt, tol, limit)
    return Looped(seen, whole.ask, whole.dask, whole.sum)


def _most_steps(dt: FloatArray, tol: float) -> float:
    return (MOST_STEPS[0] + MOST_STEPS[1] * float(dt.sum())) * max(1.0, (1e-6 / tol) ** 0.25)


def _refuse_run_away(row: int, dt: FloatArray, tol: float, limit: float) -> None:
    """Raises InputError where a run was given up in a row."""
    if row < len(dt):
        raise InputError(
            "this robot moves too fast to be followed",
            got=f"more than {limit:.2g} steps up to row {row}",
            expected=f"motion that tol = {tol:g} m/s can follow in steps of 100 ns",
            remedy="check mass, inertia, gear ratio, torque and EMF constant of the robot file; or take one step per "
            "row (tol=None)",
        )
