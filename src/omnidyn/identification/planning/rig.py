"""plan_rig: a program for one motor on a bench, or one axis, and how well each of its numbers will be known after it.

    w' = (u - offset - slope w - dead band sgn w) / (slope lag)       u held from row to row

What is predicted is what `identify` finds of simulated logs of motors that may be meant, the whole of it: no formula of
its own.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from omnidyn.arguments import check_order, is_number
from omnidyn.arrays import FloatArray
from omnidyn.document import Document, Points, Table, percent_cell, plain
from omnidyn.errors import InputError, OmnidynError, UnsupportedError
from omnidyn.identification.methods import MotorFit
from omnidyn.identification.motors.estimate import BAND, LAG, OFFSET, SLOPE, MotorEstimate
from omnidyn.identification.motors.log import motor_logs
from omnidyn.identification.motors.start import START, STOP
from omnidyn.identification.motors.steady_curve import curves_of_logs
from omnidyn.identification.motors.study import study_motors
from omnidyn.identification.planning.recorded import noise_of
from omnidyn.model.drive import DUTY, SPEED
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel
from omnidyn.progress import Progress, Report, silent
from omnidyn.run import Run
from omnidyn.shown import Displayable
from omnidyn.statement import NOTE, WARNING, Statement, as_verdict

DRAWS, SEED = 3, 0
DEAD_BANDS, LAGS, ASYMMETRY = (0.03, 0.15), (0.03, 0.3), 0.2  # of the largest input; [s]; of the dead band, by side
STICTION = 1.2  # times the dead band, up to which a motor rests
REST, LEVELS, REVERSALS = 0.5, (0.2, 0.35, 0.5, 0.65, 0.8, 1.0), (0.5, 0.9)
RAMP, RAMP_SHARE, STAIR_SHARE = 0.3, 0.4, 0.4  # of the largest input; of the time, for ramps and for stairs
SHORTEST, LONGEST = 20.0, 600.0  # [s]
BEND = 3.0  # of a driver that passes on 1 - exp(-BEND u) of the input, which is no line
GAIN, OFFSET_OF_BAND, CURVE = "gain", "offset over dead band", "driver curve"
FORWARD, BACKWARD = "forward", "backward"
WORDS = {START: "first motion", STOP: "stop"}
NAMES = (
    *(f"{word} {direction}" for word in WORDS.values() for direction in (FORWARD, BACKWARD)),
    *(GAIN, "lag", "dead band", OFFSET_OF_BAND, CURVE),
)
NUISANCES = ("offset",)  # that a motor may have beside its line


class RigMotor(NamedTuple):
    """slope [V s/rad, or % s/rad]; dead_band, offset [V or %]; lag [s]."""

    slope: float
    dead_band: float
    offset: float
    lag: float


@dataclass(frozen=True, eq=False)
class RigPlan(Displayable):
    """A program for one motor. dt [s]: of a row. share (rows,): of the largest input, which is `limit` in `unit`, V or
    duty. predicted: number -> half its 95 % interval over the number, in the middle and in the worst of the motors
    drawn; infinite where it was not told. top [rad/s]: the speed at the largest input."""

    robot: Robot
    dt: float
    share: FloatArray
    unit: str
    limit: float
    predicted: Mapping[str, tuple[float, float]]
    noise: Mapping[str, FloatArray]
    top: float

    @property
    def seconds(self) -> float:
        """Of the program [s]."""
        return len(self.share) * self.dt

    def commands(self) -> Run:
        """The program: time and input of the one motor, of each row."""
        t = np.asarray(self.dt * np.arange(len(self.share)), dtype=float)
        values = self.limit * self.share[:, None]
        return (
            Run(t=t, duty=values, source="planned") if self.unit == DUTY else Run(t=t, voltage=values, source="planned")
        )

    @property
    def missing(self) -> tuple[str, ...]:
        """What it does not tell of most motors drawn."""
        return tuple(name for name, (half, _) in self.predicted.items() if not math.isfinite(half))

    @property
    def verdict(self) -> Statement:
        """How well the motor will be known."""
        shares = {name: half for name, (half, _) in self.predicted.items() if math.isfinite(half)}
        widest = max(shares, key=lambda name: shares[name], default="")
        numbers = {"seconds": self.seconds, "told": len(shares), "count": len(self.predicted), "widest": widest}
        numbers |= {"share": shares.get(widest), "missing": self.missing}
        return Statement("planned_rig", WARNING if self.missing else NOTE, self.robot.name, numbers)

    def document(self) -> Document:
        """What it says."""
        rows = [(name, percent_cell(half), percent_cell(worst)) for name, (half, worst) in self.predicted.items()]
        parts = [
            Points([
                Statement("rig_turns", NOTE, numbers={"top": self.top, "limit": self.limit, "unit": self.unit}),
                Statement("plan_records", NOTE, numbers={"noise": self.noise, "rate": 1.0 / self.dt}),
            ]),
            Table(("number", "95 % +- %", "worst %"), rows, "<>>", name="numbers"),
        ]  # fmt: skip
        return Document(parts, as_verdict(self.verdict) | self.to_dict(), verdict=self.verdict)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, but for the rows of the program."""
        return plain({
            "robot": self.robot.name,
            "seconds": self.seconds,
            "row_s": self.dt,
            "unit": self.unit,
            "limit": self.limit,
            "top_rad_s": self.top,
            "noise": {channel: std.tolist() for channel, std in self.noise.items()},
            "rig": {name: {"half": half, "worst": worst} for name, (half, worst) in self.predicted.items()},
        })  # fmt: skip


def plan_rig(
    robot: Robot,
    seconds: float = 60.0,
    *,
    noise: Mapping[str, Any] | None = None,
    rate: float = 100.0,
    progress: Progress = silent,
) -> RigPlan:
    """A program for one motor of a robot on a bench, wheels off the ground, and how well it tells that motor.

    Rest; slow ramps from rest, up and down, both ways: where it sets off and where it stops; stairs: gain and the curve
    of the driver; steps with reversals, and coasting: the lag. Predicted by what `identify` with `MotorFit` finds of
    simulated logs of three motors whose dead band, lag and offset are unknown.

    Args:
        robot: Whose motor it is: its constants say how fast it turns; all motors as the first.
        seconds: Of the program [s].
        noise: As of `plan`: wheel_angle or wheel_speed.
        rate: Of commands and of the log [Hz].
        progress: Hears what is done.

    Raises InputError for a time, a rate or a noise that cannot be, UnsupportedError for a robot whose firmware holds
    the speeds of its wheels.
    """
    check_order("plan_rig(robot, seconds)", (robot, Robot), (seconds, object))
    for name, value, least, most in (("seconds", seconds, SHORTEST, LONGEST), ("rate", rate, 20.0, 1000.0)):
        if not is_number(value) or not least <= value <= most:
            raise InputError("out of range", got=value, expected=f"{least:g} to {most:g}", where=name)
    if robot.drive.kind == SPEED:
        raise UnsupportedError(
            "a firmware holds the speeds of the wheels: what a motor does with volts cannot be planned behind it",
            got=robot.name,
            expected="a robot that takes volts or duties",
            remedy="leave `rig` out: the whole robot is planned in set points; or plan for the same motor without "
            "[drive] kind = speed, if it can be driven directly",
        )
    dt, motor, is_duty = 1.0 / rate, robot.motor, robot.drive.kind == DUTY
    stds = {name: std for name, std in noise_of(robot, dt, noise).items() if name.startswith("wheel_")}
    if not stds:
        raise InputError(
            "nothing is recorded of a wheel", got="no channel", expected="wheel_angle, wheel_speed", where="noise"
        )
    volts = float(robot.drive.supply or 0.0) if is_duty else float(np.min(motor.voltage_limit))
    slope = float((per_wheel(motor.emf_constant, 1) * per_wheel(motor.gear_ratio, 1))[0])
    share, rng = program(seconds, dt), np.random.default_rng(SEED)
    found = []
    for k in range(DRAWS):
        progress(Report("finding what it tells", k, DRAWS))
        drawn = _drawn(slope, volts, rng)
        bent = np.sign(share) * np.expm1(-BEND * np.abs(share)) / np.expm1(-BEND)
        logs = [_log(drawn, share, passed, volts, dt, stds, rng, is_duty) for passed in (share, bent)]
        found.append(_told(*logs))
    halves = {name: [one[name] for one in found] for name in NAMES}
    predicted = {name: (float(np.median(values)), max(values)) for name, values in halves.items()}
    top = volts / slope
    return RigPlan(robot, dt, share, DUTY if is_duty else "V", 1.0 if is_duty else volts, predicted, stds, top)


def program(seconds: float, dt: float) -> FloatArray:
    """Share of the largest input of each row: rest, ramps, stairs, and steps with reversals, in so many seconds."""

    def rows(duration: float) -> int:
        return max(round(duration / dt), 2)

    rest, parts = np.zeros(rows(REST)), [np.zeros(rows(2.0 * REST))]
    up = np.linspace(0.0, RAMP, rows(RAMP_SHARE * seconds / 4.0 - REST))
    for side in (1.0, -1.0):
        parts += [side * up, side * up[::-1], rest]
    hold = rows((STAIR_SHARE * seconds - 2.0 * REST) / (2 * len(LEVELS)))
    for side in (1.0, -1.0):
        parts += [side * np.repeat(LEVELS, hold), rest]
    left = seconds / dt - sum(map(len, parts)) - 2 * len(REVERSALS) * len(rest)
    step = max(int(left // (4 * len(REVERSALS))), 2)
    for level in REVERSALS:
        for side in (1.0, -1.0):
            parts += [np.full(step, side * level), np.full(step, -side * level), rest]
    return np.concatenate(parts)


def turned(motor: RigMotor, volts: FloatArray, dt: float) -> tuple[FloatArray, FloatArray]:
    """(speed [rad/s], angle [rad]) of a motor from rest under volts held for dt [s] each, exact, with its stops."""
    speed, angle, w, turn = [0.0], [0.0], 0.0, 0.0
    for u in volts.tolist():
        drive, left = u - motor.offset, dt
        if w == 0.0 and abs(drive) <= STICTION * motor.dead_band:
            speed.append(0.0)
            angle.append(turn)
            continue
        while left > 0.0:
            side = math.copysign(1.0, w if w else drive)
            end = (drive - side * motor.dead_band) / motor.slope
            span = left
            if w * end < 0.0:
                span = min(left, motor.lag * math.log1p(-w / end))
            decay = math.exp(-span / motor.lag)
            turn += end * span + (w - end) * motor.lag * (1.0 - decay)
            stops = span < left
            w, left = (0.0 if stops else end + (w - end) * decay), left - span
            if stops and abs(drive) <= STICTION * motor.dead_band:
                break
        speed.append(w)
        angle.append(turn)
    return np.array(speed), np.array(angle)


def _drawn(slope: float, volts: float, rng: np.random.Generator) -> RigMotor:
    """A motor that may be meant."""
    band = volts * float(np.exp(rng.uniform(*np.log(DEAD_BANDS))))
    lag = float(np.exp(rng.uniform(*np.log(LAGS))))
    return RigMotor(slope, band, band * rng.uniform(-ASYMMETRY, ASYMMETRY), lag)


def _log(
    motor: RigMotor,
    share: FloatArray,
    passed: FloatArray,
    volts: float,
    dt: float,
    stds: Mapping[str, FloatArray],
    rng: np.random.Generator,
    is_duty: bool,
) -> Run:
    """What the bench logs of a motor; passed: what the driver passes on, as a share of the largest input."""
    speed, angle = turned(motor, volts * passed, dt)
    t, held = np.asarray(dt * np.arange(len(speed)), dtype=float), np.append(share, share[-1:])[:, None]
    channels: dict[str, Any] = {}
    if "wheel_angle" in stds:
        tick = float(stds["wheel_angle"][0])
        channels["wheel_angle"] = tick * np.floor(angle[:, None] / tick + rng.random())
    if "wheel_speed" in stds:
        channels["wheel_speed"] = speed[:, None] + stds["wheel_speed"][0] * rng.standard_normal((len(speed), 1))
    supply = np.full(len(t), volts)
    return Run(t=t, duty=held, supply=supply, **channels) if is_duty else Run(t=t, voltage=volts * held, **channels)


def _told(straight: Run, bent: Run) -> dict[str, float]:
    """Half the 95 % interval of each number that a study tells of a motor, over the number; infinite where it does not.
    bent: a log of the same motor behind a driver that is no line."""
    shares = dict.fromkeys(NAMES, math.inf)
    for curve in curves_of_logs(motor_logs([bent]))[0]:
        shares[CURVE] = 2.0 * float((curve.std / curve.speed).max())
    try:
        study = study_motors([straight], None, MotorFit(nuisances=NUISANCES))
    except OmnidynError:
        return shares
    shares |= _of_line(study.motors[0])
    for start in study.starts:
        direction = FORWARD if start.side > 0.0 else BACKWARD
        shares |= {f"{word} {direction}": _share(*start.ci95[key], start.value[key]) for key, word in WORDS.items()}
    return shares


def _of_line(motor: MotorEstimate) -> dict[str, float]:
    """The same of gain, lag, dead band, and of an offset, which may be 0, over the dead band."""
    over = {GAIN: (SLOPE, SLOPE), "lag": (LAG, LAG), "dead band": (BAND, BAND), OFFSET_OF_BAND: (OFFSET, BAND)}
    return {
        name: _share(*motor.ci95[key], motor.value[of])
        for name, (key, of) in over.items()
        if key in motor.value and key not in motor.unidentifiable
    }


def _share(low: float, high: float, size: float) -> float:
    """Half an interval over a number; infinite where one of them is not known."""
    share = 0.5 * (high - low) / abs(size) if size else math.inf
    return share if math.isfinite(share) else math.inf
