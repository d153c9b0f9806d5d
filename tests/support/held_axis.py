"""Logs of one axis under held levels of its input, made in small steps by a loop of its own."""

import numpy as np

from omnidyn.run import Run

DT, FINE = 0.005, 50  # [s] of a row; steps in it


def axis(put_in, slope=(0.5, 0.5), inertia=0.025, band=0.4, offset=0.0, late=0):
    """(position, speed) of each row from rest: inertia w' = u - offset - slope w - band sgn w, slope by direction.

    late: steps of DT/FINE by which the input is. A step that would stop the mass within what friction holds stops it.
    """
    fine = np.concatenate([np.full(late, put_in[0]), np.repeat(put_in, FINE)])[: FINE * len(put_in)]
    step, x, w, found = DT / FINE, 0.0, 0.0, []
    for k, u in enumerate(fine.tolist()):
        if k % FINE == 0:
            found.append((x, w))
        drive = w * inertia / step + u - offset - slope[w < 0.0] * w
        new = (drive - min(max(drive, -band), band)) * step / inertia
        x, w = x + 0.5 * step * (w + new), new
    return np.array(found).T


def stairs(seed, levels=40, rows=40, rest=20):
    """Random levels of the input, from rest."""
    return np.concatenate([np.zeros(rest), np.repeat(np.random.default_rng(seed).uniform(-2.0, 2.0, levels), rows)])


def run_of(put_in, speed, seed=0, noise=0.02):
    noisy = speed + noise * np.random.default_rng(seed).standard_normal(len(speed))
    return Run(t=DT * np.arange(len(speed)), voltage=put_in[:, None], wheel_speed=noisy[:, None])
