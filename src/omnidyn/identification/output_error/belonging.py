"""What was fitted beside the numbers of the robot file: what belongs to the robot goes into it, the rest to its logs.

The dead band of a driver is the robot's, and so is what all channels are late by together: to whatever commands the
robot it is one delay, wherever on the way it arises. A gain, a fade, a tilt, a push, and what one channel is later than
another belong to the logs, and stand in the table [log] with the marks of these.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from omnidyn.arrays import FloatArray
from omnidyn.identification.estimate import identified, printable
from omnidyn.identification.output_error.engines.actuation import late_by
from omnidyn.identification.output_error.problem.nuisances import LATENCY, PUSH, TILT
from omnidyn.identification.output_error.problem.problem import Problem
from omnidyn.identification.output_error.problem.record import Record
from omnidyn.model import keys
from omnidyn.model.actuation import DEAD_BAND, FADE, GAIN
from omnidyn.model.frames import AXES
from omnidyn.model.keys import find_key, with_priors
from omnidyn.model.log_effects import Lateness, LogEffects, log_mark
from omnidyn.model.robot import JOINT, WITH_THE_FIT, Prior, Robot
from omnidyn.run import Run


def with_nuisances(
    robot: Robot, problem: Problem, values: FloatArray, std: Mapping[str, float], open_: Sequence[str],
    records: Sequence[Record], data: str,
) -> Robot:  # fmt: skip
    """The fitted robot with the dead band and the latency that were fitted beside it, and with what its logs did.

    std: of the parameters by name; open_: those that the data do not determine, which only go with the others.
    """
    angles = any(name == "wheel_angle" for name, _ in problem.columns)
    if problem.robot_count == len(problem.parameters) and not angles and robot.log is None:
        return robot
    found = {p.name: float(v) for p, v in zip(problem.parameters, values, strict=True)}
    seconds, where = late_by(problem, values, problem.columns)
    late = {name: each for (name, _), each in zip(problem.columns, seconds, strict=True)}
    own = max(0.0, min(late.values(), default=robot.drive.latency))
    change: dict[str, float] = {}
    told: dict[str, Prior] = {}
    if DEAD_BAND in found:
        change["dead_band"] = found[DEAD_BAND]
        told[keys.DEAD_BAND] = _known(DEAD_BAND, std, open_, data)
    if any(k >= 0 for k in where):
        change["latency"] = own
        first = min(late, key=lambda name: late[name])
        told[keys.LATENCY] = _known(f"{LATENCY}.{first}", std, open_, data)
    drive = robot.drive.replace(**change) if change else robot.drive
    priors = {name: each for name, each in robot.priors.items() if name not in told}
    told = {name: each for name, each in told.items() if keys.Key.parse(name).get(robot.replace(drive=drive)) > 0.0}
    robot = robot.replace(drive=drive, priors=priors, log=_effects(found, late, own, records))
    return with_priors(robot, told)


def key_of(name: str, robot: Robot) -> str:
    """Under which key a fitted number stands in the file of the robot, "" for one of the logs."""
    if find_key(name) is not None:
        return name
    key = {DEAD_BAND: keys.DEAD_BAND}.get(name, "")
    return key if key in robot.priors and robot.priors[key].std is not None else ""


def _known(name: str, std: Mapping[str, float], open_: Sequence[str], data: str) -> Prior:
    if name not in std or name in open_:
        return Prior(source=printable(f"{WITH_THE_FIT}, {data}"), origin=JOINT)
    return identified(std[name], f"output error, {data}")


def _effects(
    found: Mapping[str, float], late: Mapping[str, float], own: float, records: Sequence[Record]
) -> LogEffects | None:
    """What the logs did; None where they did nothing."""
    runs = [record.run for record in records if record.run is not None]
    latency = Lateness(
        **{name: each for name, each in late.items() if each != own},
        averaged=any(_added_up(run, late) for run in runs),
    )
    tilt, push = ([found.get(f"{kind}.{axis}", 0.0) for axis in AXES] for kind in (TILT, PUSH))
    effects = LogEffects(
        gain=found.get(GAIN, 1.0), fade=found.get(FADE, 0.0), latency=latency,
        tilt=(tilt[0], tilt[1]), push=(push[0], push[1], push[2]),
    )  # fmt: skip
    return None if effects == LogEffects() else effects.replace(of=tuple(log_mark(run) for run in runs))


def _added_up(run: Run, late: Mapping[str, float]) -> bool:
    """Whether the wheel speeds of a run were fitted as the angles that they add up to."""
    return "wheel_angle" in late and run.wheel_angle is None and run.wheel_speed is not None and len(run) > 1
