"""What was fitted beside the numbers of the robot file: what belongs to the robot goes into it, the rest to its logs.

The dead band of a driver is the robot's, and so is what all channels are late by together: to whatever commands the
robot it is one delay, wherever on the way it arises. A gain, a fade, a tilt, a push, and what one channel is later
than another belong to the logs, and stand in the table [log] with the marks of these.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.estimate import identified, printable
from omnidyn.identification.methods import GAUSS, NU
from omnidyn.identification.output_error.engines.driver import late_by
from omnidyn.identification.output_error.problem.nuisances import LATENCY, PUSH, TILT
from omnidyn.identification.output_error.problem.problem import Problem
from omnidyn.identification.output_error.problem.record import Record
from omnidyn.identification.output_error.sensors_of_logs import has_gyroscope, sensors_shown
from omnidyn.identification.output_error.trust.uncertainty import Trust
from omnidyn.model import keys
from omnidyn.model.actuation import DEAD_BAND, FADE, GAIN
from omnidyn.model.frames import AXES
from omnidyn.model.keys import find_key, with_priors
from omnidyn.model.log_effects import Lateness, LogEffects, log_mark
from omnidyn.model.robot import JOINT, WITH_THE_FIT, Prior, Robot
from omnidyn.run import Run
from omnidyn.sensors import COUNTED, OF_WHEELS

LATENCY_ERRORS = 2.0  # standard errors within which a latency is like none


def latencies_like_zero(problem: Problem, values: FloatArray, uncertainty: Trust) -> tuple[str, ...]:
    """Names of latencies that 0 may stand for: within LATENCY_ERRORS standard errors of it were all else exact.

    So the other numbers, which were found beside it, predict the same without it. A current jumps with the voltage: one
    that was read just before a command is of the voltage before, and late by next to nothing; by 0 it is of the next.
    """
    names = [p.name for p in problem.parameters]
    spreads = np.diag(uncertainty.covariance)
    identified = np.flatnonzero(np.isfinite(spreads) & (spreads > 0.0))
    size = np.sqrt(spreads[identified])
    precision = np.linalg.pinv(
        uncertainty.covariance[np.ix_(identified, identified)] / np.outer(size, size), hermitian=True
    )
    alone = size / np.sqrt(np.maximum(np.diag(precision), 1.0))  # of each, all others exact
    return tuple(
        names[j]
        for j, std in zip(identified.tolist(), alone.tolist(), strict=True)
        if problem.parameters[j].part == LATENCY
        and 0.0 < abs(values[j]) <= LATENCY_ERRORS * std
        and not (names[j] == f"{LATENCY}.current" and values[j] > 0.0)
    )


def with_nuisances(
    robot: Robot,
    problem: Problem,
    values: FloatArray,
    std: Mapping[str, float],
    open_names: Sequence[str],
    records: Sequence[Record],
    data: str,
    noise: Mapping[str, float],
) -> Robot:
    """The fitted robot with the dead band and the latency that were fitted beside it, and with what its logs did.

    std: of the parameters by name; open_names: those that the data do not determine, which only go with the others;
    noise: std of what the fit leaves of each column.
    """
    shown = any(name in COUNTED for name, _ in problem.columns) or any(has_gyroscope(record.run) for record in records)
    if problem.robot_count == len(problem.parameters) and not shown and robot.log is None:
        return robot
    value_by_name = {p.name: float(v) for p, v in zip(problem.parameters, values, strict=True)}
    seconds, slopes_of_latency = late_by(problem, values, problem.columns)
    latency_by_channel = {name: second for (name, _), second in zip(problem.columns, seconds, strict=True)}
    drive_latency = max(0.0, min(latency_by_channel.values(), default=robot.drive.latency))
    change: dict[str, float] = {}
    prior_by_key: dict[str, Prior] = {}
    if DEAD_BAND in value_by_name:
        change["dead_band"] = value_by_name[DEAD_BAND]
        prior_by_key[keys.DEAD_BAND] = _known(DEAD_BAND, std, open_names, data)
    if any(k >= 0 for k in slopes_of_latency):
        change["latency"] = drive_latency
        first = min(latency_by_channel, key=lambda name: latency_by_channel[name])
        prior_by_key[keys.LATENCY] = _known(f"{LATENCY}.{first}", std, open_names, data)
    drive = robot.drive.replace(**change) if change else robot.drive
    priors = {name: prior for name, prior in robot.priors.items() if name not in prior_by_key}
    prior_by_key = {
        name: prior
        for name, prior in prior_by_key.items()
        if keys.Key.parse(name).get(robot.replace(drive=drive)) > 0.0
    }
    effects = _effects(value_by_name, latency_by_channel, drive_latency, records)
    effects = effects.replace(**sensors_shown(records, robot.wheels, noise))
    marks = tuple(log_mark(record.run) for record in records if record.run is not None)
    log = None if effects == LogEffects() else effects.replace(of=marks)
    robot = robot.replace(drive=drive, priors=priors, log=log)
    return with_priors(robot, prior_by_key)


def key_of(name: str, robot: Robot) -> str:
    """Under which key a fitted number stands in the file of the robot, "" for one of the logs."""
    if find_key(name) is not None:
        return name
    key = {DEAD_BAND: keys.DEAD_BAND}.get(name, "")
    return key if key in robot.priors and robot.priors[key].std is not None else ""


def _known(name: str, std: Mapping[str, float], open_names: Sequence[str], data: str) -> Prior:
    if name not in std or name in open_names:
        return Prior(source=printable(f"{WITH_THE_FIT}, {data}"), origin=JOINT)
    return identified(std[name], f"output error, {data}")


def _effects(
    value_by_name: Mapping[str, float],
    latency_by_channel: Mapping[str, float],
    drive_latency: float,
    records: Sequence[Record],
) -> LogEffects:
    """What the logs did."""
    latency = Lateness(
        **{name: other_latency for name, other_latency in latency_by_channel.items() if other_latency != drive_latency},
        averaged=any(_added_up(record.run, latency_by_channel) for record in records if record.run is not None),
    )
    tilt, push = ([value_by_name.get(f"{kind}.{axis}", 0.0) for axis in AXES] for kind in (TILT, PUSH))
    return LogEffects(
        gain=value_by_name.get(GAIN, 1.0),
        fade=value_by_name.get(FADE, 0.0),
        latency=latency,
        tilt=(tilt[0], tilt[1]),
        push=(push[0], push[1], push[2]),
    )


def _added_up(run: Run, latency_by_channel: Mapping[str, float]) -> bool:
    """Whether wheel speeds of a run are those of counts: its angles, or what its speeds add up to, are fitted."""
    one_of_both = sum(getattr(run, name) is not None for name in OF_WHEELS) == 1
    return any(name in latency_by_channel for name in COUNTED) and one_of_both and len(run) > 1


def loss_words(loss: str) -> str:
    """A loss as an answer names it."""
    return "Gaussian noise" if loss == GAUSS else f"Student's t with {NU:g} degrees of freedom"
