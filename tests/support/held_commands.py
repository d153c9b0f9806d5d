"""Logs of the paper's robot under commands that are held, with noise that may remember; what a fit to them leaves."""

import numpy as np
from scipy.signal import lfilter

from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import NOISE

AXEBOT, RATE = load_robot("axebot"), 100.0


def commands(seed, seconds=30.0, rests=True):
    """Voltages that are held for 0.3 to 1.5 s, some of them 0. (rows, 3)."""
    rng, rows = np.random.default_rng([seed, 1]), round(seconds * RATE)
    out = [np.zeros((round(0.5 * RATE) * rests, 3))]
    while sum(map(len, out)) < rows:
        volts = rng.uniform(-6.0, 6.0, 3) * (not rests or rng.random() > 0.15)
        out.append(np.tile(volts, (round(rng.uniform(0.3, 1.5) * RATE), 1)))
    return np.concatenate(out)[:rows]


def coloured(rho, rows, rng):
    """Noise of variance NOISE^2 and a correlation from row to row. (rows, 3)."""
    white = rng.normal(size=(rows + 600, 3))
    return lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], white, axis=0)[600:] * NOISE


def log_of(voltage, disturbed=lambda clean, rng: 0.0, rho=0.0, seed=1, twist=lambda values: values):
    """A log of the right robot, its twist disturbed."""
    clean, rng = simulate(AXEBOT, voltage, 1.0 / RATE), np.random.default_rng([seed, 2])
    values = clean.twist + coloured(rho, len(clean.t), rng) + disturbed(clean, rng)
    return Run(t=clean.t, voltage=clean.voltage, twist=twist(values), source="log")


def lack_of(*args, **options):
    """Of a fit to such a log."""
    return identify(log_of(*args, **options), AXEBOT, OutputError(nuisances=())).lack_of_fit
