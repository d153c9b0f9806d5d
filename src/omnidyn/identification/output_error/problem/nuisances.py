"""What a log does to a model that is right: nuisances, fitted beside the robot so that they do not bias it.

latency.CHANNEL   the channel shows what was t ago [s]; exact, by steps that end within a row
gain              voltage at the motor = gain x logged; with a supply that is only nominal, a prior of 10 %
dead_band         of the driver: (|u| - dead_band)+ sgn u reaches the motor [V]; at most what is seen to have driven it
tilt.x, tilt.y    constant force along x and y of the room [N]: a floor that is not level, whichever way the robot faces
push.AXIS         constant force on x, y [N], yaw [N m] of the body: a cable, a brush, wheels that toe in
fade              share of the voltage lost from the start of a run to its end, evenly: a battery that sags
start             twist at the start of each piece of the log; pose and angles of the wheels too
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.identification.methods import AUTO, REST
from omnidyn.identification.output_error.problem.driving_voltages import least_that_drove
from omnidyn.identification.output_error.problem.parameters import LEAST_LATENCY, MOST_LATENCY, Parameter
from omnidyn.identification.output_error.problem.problem import Piece
from omnidyn.identification.output_error.problem.record import Record
from omnidyn.identification.output_error.problem.starts import measured_twists
from omnidyn.model.actuation import DEAD_BAND, FADE, GAIN
from omnidyn.model.first_guess import GRAVITY
from omnidyn.model.frames import AXES
from omnidyn.model.keys import DEAD_BAND as KEY_DEAD
from omnidyn.model.keys import LATENCY as KEY_LATE
from omnidyn.model.layout import YAW
from omnidyn.model.robot import IDENTIFIED, Robot
from omnidyn.sensors import TABLE, TRAVEL
from omnidyn.statement import WARNING, Statement

LATENCY, TILT, PUSH = "latency", "tilt", "push"
NUISANCES = (LATENCY, GAIN, DEAD_BAND, FADE, TILT, PUSH)
FILTER = (
    0.03  # [s] of a speed that was smoothed forwards and backwards: so early it shows what the voltage is yet to do
)
SUPPLY_STD = 0.1  # of a nominal supply: a battery is full or it is not
MOST_FADE = 0.9
SILENT_ROWS = 5  # rows without voltage that show a robot at rest
MOTION_ERRORS = 4.0  # standard errors from 0 that count as motion
LEAD = 5  # rows whose mean is where a free start begins


def earliest(records: Sequence[Record]) -> float:
    """The latency [s] before which no log is plausible: a row, and what a filter looks ahead."""
    rows = [record.step_of(slice(None)) for record in records if len(record.t) > 1]
    return -(max(rows, default=0.0) + FILTER)


def implausible(name: str, latency: float, fitted: bool = True) -> Statement:
    """What to say of a latency before `earliest` [s]. fitted: whether it is fitted all the same."""
    return Statement("implausible_latency", WARNING, name, {"latency": latency, "fitted": fitted})


def nuisance_parameters(
    wanted_names: Sequence[str], records: Sequence[Record], robot: Robot, from_: float = LEAST_LATENCY
) -> list[Parameter]:
    """The nuisances asked for as free parameters; latencies begin at `from_` [s].

    Raises InputError for a name that is none.
    """
    unknown = [name for name in wanted_names if name.partition(".")[0] not in NUISANCES]
    if unknown:
        raise InputError("no such nuisance", got=unknown[0], expected=", ".join(NUISANCES), where="nuisances")
    channels = measured_channels(records)
    parameters: list[Parameter] = []
    for name in wanted_names:
        if name == LATENCY:
            parameters += [_latency(channel, robot, from_) for channel in channels]
        elif name.startswith(f"{LATENCY}."):
            channel = _as_fitted(name.partition(".")[2], channels)
            if channel not in channels:
                raise InputError("no such channel", got=name, expected=", ".join(channels), where="nuisances")
            parameters.append(_latency(channel, robot))
        elif name == GAIN:
            prior = (1.0, SUPPLY_STD) if any(record.is_nominal_supply for record in records) else None
            parameters.append(Parameter(GAIN, 1.0, 0.1, 10.0, True, prior))
        elif name == DEAD_BAND:
            largest_voltage = max(float(np.nanmax(np.abs(record.voltage))) for record in records)
            file_dead_band, driving_voltage = robot.drive.dead_band, least_that_drove(records, robot)
            high = max(driving_voltage if np.isfinite(driving_voltage) else 0.5 * largest_voltage, file_dead_band)
            parameters.append(
                Parameter(DEAD_BAND, file_dead_band, 0.0, high, prior=_of_file(robot, KEY_DEAD, file_dead_band))
            )
        elif name.partition(".")[0] in (TILT, PUSH):
            parameters += _forces(name, robot)
        else:
            parameters.append(Parameter(FADE, 0.0, -MOST_FADE, MOST_FADE))
    return list({p.name: p for p in parameters}.values())


def _latency(channel: str, robot: Robot, from_: float = LEAST_LATENCY) -> Parameter:
    """How late a channel is, that of the robot's own drive included, with which it begins."""
    file_latency = robot.drive.latency
    prior = _of_file(robot, KEY_LATE, file_latency)
    return Parameter(
        f"{LATENCY}.{channel}",
        file_latency,
        min(from_, file_latency),
        max(MOST_LATENCY, 2.0 * file_latency),
        prior=prior,
    )


def _of_file(robot: Robot, key: str, value: float) -> tuple[float, float] | None:
    """What the robot file knows of a number, unless a fit wrote it: its log would count twice."""
    file_prior = robot.priors.get(key)
    return (
        None
        if file_prior is None or file_prior.std is None or file_prior.origin == IDENTIFIED
        else (value, file_prior.std)
    )


def _as_fitted(channel: str, channels: Sequence[str]) -> str:
    """Under which name a channel is fitted: speeds of wheels that are differences of counts are, as angles."""
    integral = TABLE[channel].integral if channel in TABLE else ""
    return integral if channel not in channels and integral in channels else channel


def measured_channels(records: Sequence[Record]) -> list[str]:
    """Channels with any measurement, each once."""
    return list(
        dict.fromkeys(
            name
            for record in records
            for c, (name, _) in enumerate(record.columns)
            if np.isfinite(record.outputs[:, c]).any()
        )
    )


def _forces(name: str, robot: Robot) -> list[Parameter]:
    """The force on one axis, or on all that it has; at most what the robot weighs, at its wheels for yaw."""
    weight, kind = GRAVITY * robot.body.mass, name.partition(".")[0]
    force_limits = (weight, weight, weight * float(np.max(robot.wheels.robot_radius)))
    force_parameters = [
        Parameter(f"{kind}.{axis}", 0.0, -force_limit, force_limit)
        for axis, force_limit in zip(AXES, force_limits, strict=True)
    ]
    force_parameters = force_parameters[:YAW] if kind == TILT else force_parameters
    parameters = [p for p in force_parameters if name in (kind, p.name)]
    if not parameters:
        raise InputError(
            "no such axis", got=name, expected=", ".join(p.name for p in force_parameters), where="nuisances"
        )
    return parameters


def automatic(records: Sequence[Record], quick: bool = True) -> tuple[str, ...]:
    """The nuisances that a log of a real robot is likely to have, before it is asked whether it determines them.

    quick: whether another one costs next to nothing; else none is tried that has to be shown first. A nominal supply is
    in the intervals of every fit.
    """
    candidate_names = (LATENCY, DEAD_BAND) if quick else (LATENCY,)
    return (*candidate_names, GAIN) if any(record.is_nominal_supply for record in records) else candidate_names


def pieces(
    records: Sequence[Record], robot: Robot, start: str, has_latency: bool, start_std: FloatArray | None = None
) -> list[Piece]:
    """The pieces of all records. start: "rest", "free" or "auto"; has_latency: whether a latency is free.

    start_std: of a start that was measured, None where it may be anywhere.

    "auto": at rest where the log begins with a voltage that is held and without visible motion; else free. From rest
    no row is left out for a latency: what was before is known.
    """
    result = []
    for record in records:
        twists = [*measured_twists(record, robot)]
        for number, (first, last) in enumerate(record.pieces):
            is_at_rest = start == REST and number == 0
            result.append(_piece(record, twists, first, last, is_at_rest, start == AUTO, has_latency))
            if twists and start_std is not None:
                result[-1] = replace(result[-1], start_std=start_std)
    return result


def _piece(
    record: Record,
    twists: Sequence[FloatArray],
    first: int,
    last: int,
    is_at_rest: bool,
    decide: bool,
    has_latency: bool,
) -> Piece:
    """Rows first..last. twists: as each channel tells it, (rows, 3) each; of rest tells the first that sees all axes: a
    gyroscope alone has a bias, and wheels that stand still tell more."""
    twist = twists[0] if twists else None
    whole_twist = next((each for each in twists if np.isfinite(each).any(axis=0).all()), twist)
    columns = record.columns
    travels = np.array([name in TRAVEL for name, _ in columns])
    rows = slice(first, min(first + LEAD, last + 1))
    guess = np.zeros(3) if twist is None else np.array([_mean(twist[rows, axis]) for axis in range(3)])
    if decide:
        is_at_rest = _begins_at_rest(record, whole_twist, first, last)
    offset = np.array([_mean(record.outputs[rows, c]) if travels[c] else 0.0 for c in range(len(columns))])
    duration = float(record.t[last] - record.t[first])
    margin = min(MOST_LATENCY, 0.1 * duration) if has_latency and not is_at_rest else 0.0
    return Piece(
        record,
        first,
        last,
        np.zeros(3) if is_at_rest else guess,
        offset,
        np.concatenate([np.full(3, not is_at_rest), travels]),
        np.full(len(columns), margin),
    )


def _begins_at_rest(record: Record, twist: FloatArray | None, first: int, last: int) -> bool:
    """Whether a piece begins with rows of one voltage in which nothing visibly moves.

    Of a voltage that breakaway holds, too: a start that is next to rest would slide away under it. Such a voltage may
    also turn a moving robot round: that takes more rows, and no trend either.
    """
    stop = min(first + 10 * SILENT_ROWS, last + 1)
    change_rows = np.flatnonzero((record.voltage[first:stop] != record.voltage[first]).any(axis=1))
    rows, is_driven = int(change_rows[0]) if change_rows.size else stop - first, bool(record.voltage[first].any())
    if rows < (4 * SILENT_ROWS if is_driven else SILENT_ROWS) or twist is None:
        return False
    first_speeds = twist[first : first + rows]
    known_speeds = [
        first_speeds[finite_rows, axis]
        for axis in range(first_speeds.shape[1])
        if (finite_rows := np.isfinite(first_speeds[:, axis])).any()
    ]
    return bool(known_speeds) and all(errors_from_rest(speeds, is_driven) <= MOTION_ERRORS for speeds in known_speeds)


def errors_from_rest(speed: FloatArray, trend: bool) -> float:
    """How many standard errors a speed is from 0, in the mean; in its trend, too, where that counts."""
    n, mean = len(speed), float(speed.mean())
    time = np.arange(n) - 0.5 * (n - 1)
    slope = float(time @ speed) / max(float(time @ time), 1.0) if trend else 0.0
    spread = float(np.std(speed - slope * time))
    distance = np.hypot(mean * np.sqrt(n), slope * np.sqrt(time @ time))
    return 0.0 if distance == 0.0 else float(distance / spread) if spread > 0.0 else np.inf


def _mean(values: FloatArray) -> float:
    known_values = values[np.isfinite(values)]
    return float(known_values.mean()) if known_values.size else 0.0
