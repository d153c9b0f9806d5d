"""Random forces on a robot whose law is right: a floor is never even. What is found missing, and what intervals hold.

Forces on each axis of the body with a memory of 0.1 s, of a share of its Coulomb friction; the robots are those of
wrong_worlds. The simulator is the plainest there is, Euler with 100 steps in a row and an impulse that dry friction
takes up to its level, and shares no code with omnidyn.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from benchmarks.size import scaled
from benchmarks.table import Table, machine
from benchmarks.wrong_worlds.log import NOISE, SPEEDS, right_case, robot_of, truths, voltages
from benchmarks.wrong_worlds.remedies import FRICTION
from benchmarks.wrong_worlds.world import World
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.run import Run

LOGS = scaled(40, 2)
FIRST_SEED, MEMORY, INNER = 90_000, 0.1, 100  # memory [s]; steps in a row
SHARES = (0.0, 0.03, 0.1)  # std of the force, over Coulomb friction
FALSE, HELD = 0.03, 0.9


@njit
def _march(G, ke, ohm, mass, coulomb, viscous, volts, dt, force, keep, rng):
    """Speeds of the body at each row. Shape (rows, 3)."""
    rows, v, w = len(volts), np.zeros(3), np.zeros(3)
    found = np.zeros((rows, 3))
    for k in range(rows):
        found[k] = v
        for _ in range(INNER):
            drive = G @ (ke * (volts[k] - ke * (G.T @ v)) / ohm)
            for a in range(3):
                w[a] = keep * w[a] + np.sqrt(1.0 - keep * keep) * force[a] * rng.normal()
                momentum = mass[a] * v[a] + dt * (drive[a] + w[a] - viscous[a] * v[a])
                most = dt * coulomb[a]
                v[a] = 0.0 if abs(momentum) <= most else (momentum - np.sign(momentum) * most) / mass[a]
    return found


def pushed(world: World, volts: np.ndarray, rate: float, share: float, seed: int) -> np.ndarray:
    """Speeds of the body under random forces. Shape (rows, 3)."""
    dt, coulomb = 1.0 / rate / INNER, np.array(world.coulomb)
    return _march(
        np.ascontiguousarray(world.G),
        world.ke,
        np.array(world.resistance),
        np.array([world.mass, world.mass, world.inertia]),
        coulomb,
        np.array(world.viscous),
        np.ascontiguousarray(volts),
        dt,
        share * coulomb,
        np.exp(-dt / MEMORY),
        np.random.default_rng([seed, 7]),
    )


def measure() -> Table:
    """A row for each share."""
    names = list(truths(right_case(FIRST_SEED).told, "axes"))
    short = [f"{name.split('.')[-1]}" for name in names]
    table = Table(
        "forces: a right robot under random forces, by its wheel speeds",
        ["force / Coulomb", "logs", "found", "held", "rms z", *short],
    )
    table.notes += [machine(), "rms z: error over its standard error, root mean square: of all numbers, then of each"]
    for share in SHARES:
        found, z = [], []
        for number in range(LOGS):
            seed = FIRST_SEED + number
            case = right_case(seed).setup_but(sensor=SPEEDS).both_but(frame=False)
            world, rng = case.told, np.random.default_rng(seed)
            t, volts = voltages(case, seed)
            twist = pushed(world, volts, case.setup.rate, share, seed)
            speed = twist @ world.G / np.array(world.wheel_radius)
            run = Run(t, voltage=volts, wheel_speed=speed + NOISE * rng.normal(size=speed.shape))
            fit = identify(run, robot_of(world), OutputError(free=FRICTION)).estimate
            lack = getattr(fit, "lack_of_fit", None)
            found.append(bool(getattr(lack, "found", False)))
            z.append([(fit.value[n] - true) / fit.std[n] for n, true in truths(world, world.shape).items()])
        error, says = np.array(z), float(np.mean(found))
        held = float(np.nanmean(np.abs(error) < 1.96))
        rms = np.sqrt(np.nanmean(error**2, axis=0)).tolist()
        table.add(
            f"found <= {FALSE}, held >= {HELD}",
            says <= FALSE and held >= HELD,
            **{"force / Coulomb": share},
            logs=LOGS,
            found=says,
            held=held,
            **{"rms z": float(np.sqrt(np.nanmean(error**2)))},
            **dict(zip(short, rms, strict=True)),
        )
    return table
