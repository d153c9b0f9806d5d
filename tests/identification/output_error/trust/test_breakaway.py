"""Breakaway between the drives of a log: runs of the reference integrator, which goes from event to event."""

import numpy as np

from omnidyn.identification.whole_logs import fit_output_error
from omnidyn.model.friction import AxesFriction, Friction
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from tests.reference import modes

SLIDES, HOLDS = 2.2, 5.9  # [N] along x and y
VISCOUS = (0.94, 0.96, 0.01)
DT, NOISE = 0.02, 0.005
VOLTS = (1.0, 1.5, 2.5, 1.2, 0.0, -1.5, -2.5, -1.2, 0.0, 1.5, 3.0, 0.8, 0.0)  # 1.5 V give 4.9 N at rest, 2.5 V 8.2 N
X, Y = (0.0, 1.0, -1.0), (2.0 / np.sqrt(3.0), -1.0 / np.sqrt(3.0), -1.0 / np.sqrt(3.0))  # as much force either way


def test_it_is_found_above_the_last_drive_below_three_times_coulomb():
    """It held 4.9 N and gave way under 8.2 N, more than three times Coulomb friction: between the two it may be.

    That plateau was left out once Coulomb friction was known: breakaway ended below 4.9 N, beside wrong levels.
    """
    levels = {"viscous": VISCOUS, "coulomb": (SLIDES, SLIDES, 0.099)}
    robot = load_robot("axebot").replace(friction=Friction(axes=AxesFriction(**levels)))
    holding = robot.friction.axes.replace(breakaway=(HOLDS, HOLDS, 0.13))
    volts = np.concatenate([np.outer(np.repeat(VOLTS, 50), way) for way in (X, Y)])
    truth = modes.reference(robot.replace(friction=Friction(axes=holding)), volts, DT)
    noise = np.random.default_rng(3).normal(size=truth.twist.shape) * [NOISE, NOISE, 4.0 * NOISE]
    t = DT * np.arange(len(truth.twist))
    log = Run(t=t, voltage=np.concatenate([volts, volts[-1:]]), twist=truth.twist + noise)
    keys = [f"friction.axes.{name}[{axis}]" for name in ("viscous", "coulomb", "breakaway") for axis in (0, 1)]
    fit = fit_output_error(log, robot, free=keys, nuisances=())
    for key, true in zip(keys[:4], (*VISCOUS[:2], SLIDES, SLIDES), strict=True):
        assert abs(fit.value[key] - true) < 4.5 * fit.std[key]
        assert fit.std[key] < 0.05
    for key in keys[4:]:
        low, high = fit.ci95[key]
        assert 4.9 < low < HOLDS < high < 8.3
    assert fit.noise["twist[0]"] < 1.1 * NOISE
