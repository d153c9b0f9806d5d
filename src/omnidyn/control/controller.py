"""The contract of a controller. One file per controller; whatever runs one (track, tune, exports) knows only this.

A controller must:

1. take `step(t, pose, twist, path, supply=None)`: time [s], pose (x, y, heading) in the world, twist (v_x, v_y,
   omega) in the body frame, shapes (3,), a Path (path.py), and the measured supply behind a duty [V], where it is
   known; return what to send to the drive until the next step, shape (wheels,);
2. say by `output` what that is: "voltage" [V], "duty" [1], or "wheel_speed" [rad/s] for a drive with a speed loop;
3. keep |output| <= `limit`, shape (wheels,), in every step;
4. never raise in `step` but an interrupt: what is missing, NaN, of a wrong shape or earlier than the step before gives
   zeros, and a word in `info.status`. Up to MOST_BRIDGED measurements or commands missing in a row, each a step after
   the one before, are bridged: by what an observer predicts, else by the last output. A time that stands still repeats
   the last output;
5. go on where a path has ended: it holds the last pose of the path, and says so in `info.status`;
6. tell by `info` what the last step did: status, iterations, time, predicted path, limits met;
7. forget by `reset()` all it remembers of steps before;
8. take another robot by `replace(robot=...)`: the same settings and the same memory, while it runs.

`Guarded` keeps 1, 3, 4, 5, 7 and 8 for controllers whose step may cost microseconds more than that: they write
`_output`. `Safe` is that without a path, for a loop that follows a command.
"""

from __future__ import annotations

import math
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass
from typing import Any, Protocol, Self

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.control.filtered_twist import FilteredTwist, filtered_twist
from omnidyn.control.paths.adapter import as_path
from omnidyn.control.pose_estimator import PoseEstimator, pose_estimator
from omnidyn.control.pose_gate import JUMPED, REPEATED, SLIPPED, PoseGate
from omnidyn.control.without_slip import without_slip
from omnidyn.errors import INTERRUPTS, InputError, told_by
from omnidyn.model.drive import DUTY, SPEED
from omnidyn.model.motor import no_load_speed
from omnidyn.model.robot import Robot
from omnidyn.model.surroundings import refuse_slope
from omnidyn.model.wheels import per_wheel

OK, WAITING, PATH_ENDED = "ok", "no step yet", "path ended: holding its last pose"
BAD_TIME, BACKWARDS, TIME_STANDS_STILL = "time is no finite number", "time went backwards", "time stands still"
BAD_POSE, BAD_TWIST, BAD_COMMAND = "pose missing", "twist missing", "command missing"
BAD_PATH, FAILED = "no path", "no output found"
INACCURATE = "inaccurate"  # the output is sent, but rounding may have moved it
BRIDGED = {word: f"{word}: bridged" for word in (BAD_POSE, BAD_TWIST, BAD_COMMAND)}
DOUBTS = {
    JUMPED: "pose jumped: followed slowly",
    SLIPPED: "twist disagrees with poses: corrected",
    REPEATED: "measurement repeated: moved on",
}
SWINGS = "swings: correct latency_s of [drive], or lower the gains"
MOST_BRIDGED = 2  # measurements missing in a row
LATEST = 1.5  # steps after the one before: what comes later is not gone on from
MOST_SUPPLY = 1e4  # [V]
MOST_COMMAND = 3.0  # of a speed loop, in speeds without load
LARGEST_STATE = 1e9  # of any number of a state: what is beyond is no place, and no speed
VOLTAGE, WHEEL_SPEED = "voltage", "wheel_speed"


@dataclass(frozen=True, eq=False)
class Info:
    """What the last step did.

    status: "ok", or why the output is what it is, in words. iterations: of a solver. time: that the step took [s].
    predicted: poses the controller expects to pass, shape (k, 3), None where it predicts nothing. limits: what the
    output met, such as "voltage" or "current".
    """

    status: str = WAITING
    iterations: int = 0
    time: float = 0.0
    predicted: FloatArray | None = None
    limits: tuple[str, ...] = ()

    @property
    def ok(self) -> bool:
        """Whether the output is what the controller wanted to send: for a path that ended or a doubtful state, too."""
        return self.status in (OK, PATH_ENDED, SWINGS, *DOUBTS.values())


class Controller(Protocol):
    """What every controller provides; the numbered list above says how."""

    @property
    def name(self) -> str:
        """What it is called in tables: "pid", "mpc_no_friction"."""
        ...

    @property
    def robot(self) -> Robot:
        """The robot it believes to drive."""
        ...

    @property
    def output(self) -> str:
        """ "voltage" [V], "duty" [1] or "wheel_speed" [rad/s]."""
        ...

    @property
    def limit(self) -> FloatArray:
        """What no output exceeds in size, in the unit of the output. Shape (wheels,)."""
        ...

    @property
    def info(self) -> Info:
        """What the last step did."""
        ...

    def step(self, t: float, pose: Any, twist: Any, path: Any, supply: float | None = None) -> FloatArray:
        """What to send to the drive from t [s] on. Shape (wheels,). Never raises."""
        ...

    def reset(self) -> None:
        """Forget all steps."""
        ...

    def replace(self, *, robot: Robot) -> Self:
        """The same controller, its memory included, for another robot."""
        ...


class Safe:
    """Something that drives a robot, its steps checked before and after it sees them.

    robot: that it believes to drive. supply [V]: behind a duty; the robot's own by default, else its voltage limit.
    """

    name = "controller"
    dt: float  # [s] between two steps
    _filtered_twist: FilteredTwist | None = None
    _swinging = False

    def __init__(self, robot: Robot, supply: float | None = None) -> None:
        self.supply = supply
        self._take(robot)
        self.reset()

    def _take(self, robot: Robot) -> None:
        """Make ready for a robot; settings and memory stay."""
        refuse_slope(robot.floor, "controllers know")
        robot = in_steps(without_slip(robot), self.dt)
        self.robot, self.sensors = robot, robot.sensor_model
        self._filtered_twist = filtered_twist(robot, self._filtered_twist)
        self.output = output_kind(robot)
        self.limit = output_limit(robot)
        self._per_volt = 1.0 / supply_of(robot, self.supply) if self.output == DUTY else 1.0
        self._zeros = np.zeros(robot.wheels.count)

    def reset(self) -> None:
        """Forget all steps."""
        self.info = Info()
        self._t: float | None = None
        self._last = self._zeros.copy()
        self._missing = 0
        if self._filtered_twist is not None:
            self._filtered_twist.reset()

    def replace(self, *, robot: Robot) -> Self:
        """The same controller, its memory included, for another robot."""
        clone = copy(self)
        for key, value in vars(self).items():
            if isinstance(value, np.ndarray):  # changed in place, some of them
                setattr(clone, key, value.copy())
        clone._take(robot)
        if len(clone._last) != robot.wheels.count:
            clone.reset()
        return clone

    def _guarded(
        self, t: Any, word: str, status: str, output: Callable[[float], tuple[FloatArray, tuple[str, ...]]] | None
    ) -> FloatArray:
        """The output of a step within its limits, or a safe one.

        word: what is wrong already; status: where all goes well; output: from the time since the last step.
        """
        start, now, before = time.perf_counter(), _number(t), self._t
        if not math.isfinite(now):
            return self._safe(BAD_TIME, start)
        dt = 0.0 if before is None else now - before
        self._t = now
        if before is not None and dt <= 0.0:
            if dt < 0.0:
                self._forget()
                return self._safe(BACKWARDS, start)
            self.info = Info(TIME_STANDS_STILL, time=time.perf_counter() - start)
            return self._last.copy()
        if word in BRIDGED and 0.0 < dt < LATEST * self.dt and self._missing < MOST_BRIDGED:
            self._missing += 1
            self.info = Info(BRIDGED[word], time=time.perf_counter() - start)
            return self._last.copy()
        if word or output is None:
            return self._safe(word, start)
        self._missing = 0
        try:
            demand, limits = output(dt)
            sent, largest = demand, self.limit
            if sent.shape != largest.shape or not (abs(sent) <= largest).all():
                sent = np.clip(demand, -largest, largest)
                fine = sent.shape == largest.shape and bool(np.isfinite(sent).all())
            else:
                fine = True
        except Exception as raised:  # the loop of a robot must not end here, but where a user ends it
            error = told_by(raised)
            if isinstance(error, INTERRUPTS):
                raise error from raised
            return self._safe(failure(raised), start)
        if not fine:
            return self._safe(FAILED, start)
        self._last = sent
        if self._swinging and status in (OK, PATH_ENDED):
            status = SWINGS
        self.info = Info(status, time=time.perf_counter() - start, limits=limits)
        return sent.copy()

    def _unfiltered(self, t: Any, twist: FloatArray) -> FloatArray:
        """The twist measured, what a filter did to it taken back."""
        if self._filtered_twist is None or not math.isfinite(now := _number(t)):
            return twist
        return self._filtered_twist.mean(now, twist)

    def _safe(self, word: str, start: float) -> FloatArray:
        """Zeros, and why."""
        self._last = self._zeros.copy()
        self.info = Info(word, time=time.perf_counter() - start)
        return self._last.copy()

    def _forget(self) -> None:
        """Forget what was summed up over steps; a clock that went back makes it worthless."""
        last_t = self._t
        self.reset()
        self._t = last_t

    def _sent(self, volts: FloatArray) -> FloatArray:
        """Volts as the drive takes them: volts, or a duty."""
        return volts * self._per_volt


class Guarded(Safe, ABC):
    """A controller whose steps are checked before and after it sees them; subclasses write `_output`."""

    _estimator: PoseEstimator | None = None
    _gate: PoseGate

    def _take(self, robot: Robot) -> None:
        super()._take(robot)
        self._estimator = pose_estimator(robot, self.dt, self._estimator)
        self._gate = PoseGate(robot, self.dt, vars(self).get("_gate"))

    def reset(self) -> None:
        """Forget all steps."""
        super().reset()
        if self._estimator is not None:
            self._estimator.reset()
        self._gate.reset()

    def step(self, t: float, pose: Any, twist: Any, path: Any, supply: float | None = None) -> FloatArray:
        """What to send to the drive from t [s] on. Shape (wheels,). Never raises."""
        self._per_volt = per_volt(self.output, supply, self._per_volt)
        place, speed = vector(pose), vector(twist)
        if place is None or speed is None:
            return self._guarded(t, BAD_POSE if place is None else BAD_TWIST, "", None)
        speed = self._unfiltered(t, speed)
        try:
            follow = as_path(path)
        except Exception as raised:  # whatever stands in place of a path, it is none
            word = f"{FAILED}: {type(raised).__name__}" if callable(getattr(path, "at", None)) else BAD_PATH
            return self._guarded(t, word, "", None)
        status = PATH_ENDED if _ended(follow, t) else OK
        if math.isfinite(now := _number(t)):
            state = np.concatenate([place, speed])
            if self._estimator is not None:
                self._estimator.estimate(now, state)
            status = DOUBTS.get(self._gate.judge(now, state), status)
            place, speed = state[:3], state[3:]
        return self._guarded(t, "", status, lambda dt: self._output(float(t), dt, place, speed, follow))

    @abstractmethod
    def _output(
        self, t: float, dt: float, pose: FloatArray, twist: FloatArray, path: Any
    ) -> tuple[FloatArray, tuple[str, ...]]:
        """(the output wanted, shape (wheels,), and the limits it met). dt [s] since the last step, 0 in the first."""


def in_steps(robot: Robot, dt: float) -> Robot:
    """The robot as a loop with steps of dt [s] sees it: without a filter of its speeds that is short beside them."""
    sensors = robot.sensor_model.in_steps(dt)
    return robot if sensors == robot.sensor_model else robot.replace(sensors=sensors)


def output_kind(robot: Robot) -> str:
    """What the drive of a robot takes: "voltage", "duty" or "wheel_speed"."""
    return WHEEL_SPEED if robot.drive.kind == SPEED else robot.drive.kind


def output_limit(robot: Robot) -> FloatArray:
    """The largest output its drive takes, shape (wheels,): the voltage limit [V], a duty of 1, of a speed loop [rad/s].

    That is where a wheel at its no-load speed w is still driven by the whole voltage, w + u/k_p: a loop without a sum
    needs more than the speed; MOST_COMMAND times w at the most.
    """
    count = robot.wheels.count
    volts = per_wheel(robot.motor.voltage_limit, count)
    if robot.drive.kind == DUTY:
        return np.ones(count)
    if robot.drive.kind != SPEED:
        return volts
    fastest = no_load_speed(robot.motor, volts)
    return fastest + volts / np.maximum(per_wheel(robot.drive.kp, count), volts / ((MOST_COMMAND - 1.0) * fastest))


def supply_of(robot: Robot, supply: float | None = None) -> float:
    """The volts that a duty of 1 is: as given, as in the file, else the least voltage limit of its motors [V]."""
    volts = supply if supply is not None else robot.drive.supply
    return float(volts if volts is not None else np.min(robot.motor.voltage_limit))


def failure(error: Exception) -> str:
    """Why a step found no output, in words: what a path does not say, else the kind of the error."""
    return f"{FAILED}: {error.what if isinstance(error, InputError) else type(error).__name__}"


def per_volt(output: str, supply: Any, before: float) -> float:
    """The duty that one volt is behind a supply measured now [V]; as `before` for another output, or without one."""
    if output != DUTY or supply is None:
        return before
    volts = _number(supply)
    return 1.0 / volts if 0.0 < volts <= MOST_SUPPLY else before


def _number(value: Any) -> float:
    """A number, or NaN."""
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        return math.nan


def _ended(path: Any, t: Any) -> bool:
    """Whether a path stands still at that time."""
    try:
        return bool(path.end < _number(t))
    except Exception:  # a path that does not say when it ends goes on
        return False


def vector(value: Any) -> FloatArray | None:
    """Three finite numbers, or None for what is none of a state. Shape (3,)."""
    try:
        array = np.asarray(value, dtype=float)
        if array.shape != (3,):
            return None
        first, second, third = array.tolist()
    except Exception:  # whatever stands in place of a state, it is none
        return None
    sane = (
        -LARGEST_STATE <= first <= LARGEST_STATE
        and -LARGEST_STATE <= second <= LARGEST_STATE
        and -LARGEST_STATE <= third <= LARGEST_STATE
    )
    return array if sane else None
