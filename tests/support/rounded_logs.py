"""Logs of the simulator of wrong_worlds whose inputs are logged in steps, and fits to them."""

import numpy as np

from benchmarks.wrong_worlds.log import SPEEDS, logged, right_case, robot_of, truths
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError


def rounded(values, step):
    return np.round(np.asarray(values) / step) * step


def errors(seed, step):
    """(errors of the friction numbers in standard errors, warnings) of a log whose voltages are rounded."""
    case = right_case(3 * seed).setup_but(sensor=SPEEDS, memory=0.0, rate=50.0)
    run = logged(case, 7000 + seed)
    fit = identify(
        run.replace(voltage=rounded(run.voltage, step)), robot_of(case.told), OutputError(nuisances=())
    ).estimate
    truth = truths(case.told, case.told.shape)
    return [(fit.value[key] - true) / fit.std[key] for key, true in truth.items()], fit.warnings


def a_fit(seed, step, make=lambda case: case, sensor=SPEEDS, memory=0.0, duties=False):
    """The fit to a log of a world whose inputs are rounded."""
    case = make(right_case(3 * seed).setup_but(sensor=sensor, memory=memory, rate=50.0))
    run = logged(case, 7000 + seed)
    volts = rounded(run.voltage, step) if step else run.voltage
    inputs = (
        {"voltage": None, "duty": volts / 12.0, "supply": np.full(len(run.t), 12.0)} if duties else {"voltage": volts}
    )
    return identify(run.replace(**inputs), robot_of(case.told), OutputError(free="friction")).estimate
