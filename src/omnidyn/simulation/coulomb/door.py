"""From plants and voltages to a run of this room."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.model.layout import N_AXES, Plant
from omnidyn.simulation.coulomb.law import changes, drive_of, is_coulomb, kind_of, law_of
from omnidyn.simulation.coulomb.run import Law, Rows, Seen, empty_seen, run_rows

MEMORY_BOUNDS = (0.15, 30.0)  # [s] a robot is taken to forget an error in its memory, within these bounds
MOST_STEPS = (1e6, 7e6)  # steps solved at tol 1e-6, and so many more per second simulated; then a run is given up


def knows(numbers: Plant, plants: Sequence[Plant]) -> bool:
    """Whether a robot, and all that a derivative compares it with, moves by the law of this room."""
    others = {id(plant): plant for plant in plants if plant is not numbers}.values()
    kind = kind_of(numbers)
    return is_coulomb(numbers) and all(is_coulomb(plant, couples=True) and kind_of(plant) == kind for plant in others)


def run(
    numbers: Plant,
    t: FloatArray,
    dt: FloatArray,
    voltage: FloatArray,
    twist: FloatArray,
    tol: float,
    late: FloatArray,
    travel: int,
    push: FloatArray | None = None,
    changed: Sequence[Plant] = (),
    step: float = 1.0,
    rates: Sequence[dict[str, Any]] = (),
) -> Seen:
    """A run from a twist under held voltages, seen at t - late, with its derivatives.

    Args:
        numbers: of the robot.
        t: of the samples [s], shape (samples,).
        dt: for how long each voltage holds [s], shape (rows,).
        voltage: at the motors [V], shape (rows, n).
        twist: at the start, shape (3,).
        tol: of the twist [m/s].
        late: latencies [s], shape (L,).
        travel: how many numbers of the way, see sensitivity/sample.py.
        push: wrench from outside over each row [N, N, N m], shape (rows, 3).
        changed, step: plants up (2k) and down (2k + 1) each of the first R of K directions, by this step.
        rates: of each of the K directions the derivatives of voltage, push and twist, where there are any.

    Raises InputError where motion is so fast beside its duration that no patience would do.
    """
    drive, keys = drive_of(numbers), len(rates)
    law_changes, drive_changes = changes(changed, step)
    force, dforce = voltage @ drive.T, np.zeros((len(dt), N_AXES, keys))
    if push is not None:
        force = force + push[: len(dt)]
    dtwist = np.zeros((N_AXES, keys))
    for k, rate in enumerate(rates):
        if k < len(drive_changes) and drive_changes[k].any():
            dforce[:, :, k] = voltage @ drive_changes[k].T
        if rate.get("voltage") is not None:
            dforce[:, :, k] += rate["voltage"] @ drive.T
        if rate.get("push") is not None:
            dforce[:, :, k] += rate["push"][: len(dt)]
        if rate.get("twist") is not None:
            dtwist[:, k] = rate["twist"]
    memory = min(max(float(numbers.body.memory[0]), MEMORY_BOUNDS[0]), MEMORY_BOUNDS[1])
    law = Law(law_of(numbers), law_changes, kind_of(numbers), memory)
    seen = empty_seen(t, late, keys, travel)
    limit = (MOST_STEPS[0] + MOST_STEPS[1] * float(dt.sum())) * max(1.0, (1e-6 / tol) ** 0.25)
    rows = Rows(np.ascontiguousarray(dt), np.ascontiguousarray(force), dforce)
    row = run_rows(law, rows, np.array(twist, dtype=float), dtwist, tol, min(limit, math.inf), seen)
    if row < len(dt):
        raise InputError(
            "this robot moves too fast to be followed",
            got=f"more than {limit:.2g} steps up to row {row}",
            expected=f"motion that tol = {tol:g} m/s can follow in steps of 100 ns",
            remedy="check mass, inertia, gear ratio, torque and EMF constant of the robot file; or take one step per "
            "row (tol=None)",
        )
    return seen
