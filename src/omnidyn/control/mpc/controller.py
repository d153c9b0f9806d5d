"""Mpc: the model predictive controller of one robot, on the contract of control/controller.py.

    min  sum over the horizon of 1/2 |pose - path|^2 + 1/2 |twist - path's|^2 + 1/2 |u - u of the path|^2, weighted
    so that  the model of the robot holds,  |u| <= limit

What happens in a step stands in loop.py.
"""

from __future__ import annotations

import math
import time
from copy import copy
from dataclasses import replace
from typing import Any, Self

import numpy as np

from omnidyn.arguments import is_whole
from omnidyn.arrays import FloatArray
from omnidyn.compiled.kernel import machine_code
from omnidyn.control.controller import (
    BACKWARDS,
    BAD_PATH,
    BAD_POSE,
    BAD_TIME,
    BAD_TWIST,
    BRIDGED,
    DOUBTS,
    FAILED,
    INACCURATE,
    LATEST,
    MOST_BRIDGED,
    OK,
    PATH_ENDED,
    SWINGS,
    TIME_STANDS_STILL,
    VOLTAGE,
    WAITING,
    WHEEL_SPEED,
    Info,
    failure,
    in_steps,
    output_kind,
    output_limit,
    per_volt,
    supply_of,
    vector,
)
from omnidyn.control.feedforward import DT, check_dt, loop_motor
from omnidyn.control.filtered_twist import FilteredTwist, filtered_twist
from omnidyn.control.mpc.batch import MpcBatch
from omnidyn.control.mpc.loop import INACCURATE_STEP, NO_STATE, control_step, expect
from omnidyn.control.mpc.memory import Memory, MpcWorkspace
from omnidyn.control.mpc.model import numbers, volts
from omnidyn.control.mpc.observer import PUSH, SCALE
from omnidyn.control.mpc.preview import Preview
from omnidyn.control.mpc.settings import FILTERED, Settings
from omnidyn.control.pose_estimator import PoseEstimator, pose_estimator
from omnidyn.control.pose_gate import TRUSTED, PoseGate
from omnidyn.control.swing import Swing
from omnidyn.control.without_slip import without_slip
from omnidyn.errors import INTERRUPTS, InputError, told_by
from omnidyn.model.robot import Robot
from omnidyn.model.surroundings import refuse_slope

HORIZON, MOST_HORIZON, MOST_DELAY = 20, 500, 50
MET = 1e-5  # [V] from a limit
LONGEST = 2.5  # steps after the one before, up to which its observer goes on: it may miss one
LEAST_REST = 0.02  # of a step, that a delay may be off a whole number of them


class Mpc:
    """Model predictive control. See Controller.

    dt [s]: between two steps. horizon: steps that it looks ahead. delay: steps until an output acts; by default what
    the latency of the robot's drive says. friction: whether it knows dry friction. observer: whether it learns what
    the model misses. settings: weights and noise. supply [V]: behind a duty.
    """

    name = "mpc"
    _estimator: PoseEstimator | None = None
    _filtered_twist: FilteredTwist | None = None
    _gate: PoseGate

    def __init__(
        self,
        robot: Robot,
        *,
        dt: float = DT,
        horizon: int = HORIZON,
        delay: int | None = None,
        friction: bool = True,
        observer: bool = True,
        settings: Settings | None = None,
        supply: float | None = None,
    ) -> None:
        self.dt, self.horizon = check_dt(dt), _whole("horizon", horizon, 1, MOST_HORIZON)
        self.delay = None if delay is None else _whole("delay", delay, 0, MOST_DELAY)
        self.friction, self.observer, self.supply = friction, observer and friction, supply
        self.settings = settings or Settings()
        without = ("_no_observer", "", "_no_friction", "_no_friction")[2 * (not friction) + observer]
        self.name = f"{type(self).name}{without}"
        self._take(robot)
        self.reset()

    @property
    def per_volt(self) -> float | FloatArray:
        """What is sent for a volt."""
        return self._per_volt * self._per_command

    @property
    def late_part(self) -> float:
        """By how much the delay of the drive is more than whole steps [s]."""
        return self._preview.rest

    def _take(self, robot: Robot) -> None:
        """Make ready for a robot; settings stay."""
        refuse_slope(robot.floor, "controllers know")
        robot = in_steps(without_slip(robot), self.dt)
        self.robot, self.output, self.limit = robot, output_kind(robot), output_limit(robot)
        self.sensors = robot.sensor_model
        self._per_volt = 1.0 / supply_of(robot, self.supply) if self.output == "duty" else 1.0
        loop = loop_motor(robot, self.dt) if self.output == WHEEL_SPEED else None
        self.driven = driven = robot if loop is None else loop.robot  # by volts
        self._per_command = 1.0 if loop is None else 1.0 / loop.gain
        steps = min(robot.drive.latency / self.dt, float(MOST_DELAY)) if self.delay is None else float(self.delay)
        self.steps_late = round(steps)
        is_whole = abs(steps - self.steps_late) < LEAST_REST
        whole = self.steps_late if is_whole else math.floor(steps)
        rest = 0.0 if is_whole else (steps - whole) * self.dt
        self._zeros = np.zeros(robot.wheels.count)
        self._preview = Preview(self.dt, whole, self.horizon, rest)
        self._room = MpcWorkspace.of(self.horizon, volts(driven))
        if rest > 0.0:
            self._room.rest[:] = numbers(driven, rest, self.friction, loop).linear
        self._numbers = numbers(driven, self.dt, self.friction, loop)
        noise = self.settings.pose_noise
        given = None if noise is None else (noise[0], noise[2])
        self._estimator = pose_estimator(robot, self.dt, self._estimator, given)
        self.robot_settings = self.settings.of(robot, self.dt, None if loop is None else driven)
        self.observer_settings = self.robot_settings
        if self._estimator is not None:
            place, heading = self._estimator.noise
            self.robot_settings = replace(self.robot_settings, pose_noise=(place, place, heading))
            self.observer_settings = replace(self.robot_settings, pose_noise=FILTERED)
        self._tables = self.robot_settings.tables(driven, self.dt, self.observer)
        self._filtered_twist = filtered_twist(robot, self._filtered_twist)
        self._gate = PoseGate(robot, self.dt, vars(self).get("_gate"))
        self.swing = Swing(robot, self.dt)
        self._control = None  # compiled by the first step

    def reset(self) -> None:
        """Forget all steps."""
        self._memory = Memory.of(self.horizon, self.robot.wheels.count, self._preview.inputs, self.observer_settings)
        self._known, self._t, self._last = False, math.nan, self._zeros.copy()
        self._asked: tuple[str, int, float] = (WAITING, 0, 0.0)
        self._state, self._missing, self._since = np.zeros(6), 0, math.nan
        for sensor in (self._estimator, self._filtered_twist, self._gate, self.swing):
            if sensor is not None:
                sensor.reset()

    def replace(self, *, robot: Robot) -> Self:
        """The same controller for another robot. Where the friction is another, its share is learned anew."""
        clone = object.__new__(type(self))
        clone.__dict__.update(self.__dict__)
        clone._take(robot)
        if robot.wheels.count != self.robot.wheels.count or clone._preview.inputs != self._preview.inputs:
            clone.reset()
            return clone
        same_friction = robot.friction == self.robot.friction
        clone._memory, clone._state = (
            self._memory.copied(None if same_friction else clone.observer_settings),
            self._state.copy(),
        )
        if clone._preview.rest == self._preview.rest:
            clone._preview = copy(self._preview)  # what it has sampled stays as it is, to the last bit
        clone._last = np.clip(self._last, -clone.limit, clone.limit)
        return clone

    @property
    def learned(self) -> dict[str, FloatArray]:
        """What the observer found: "push" on each axis [m/s^2, m/s^2, rad/s^2], share of the modelled "friction"."""
        return {"push": self._memory.estimate[PUSH].copy(), "friction": self._memory.estimate[SCALE].copy()}

    def batch(self, count: int) -> MpcBatch:
        """As many controllers of the same robot as asked for, in one: `Batch.step_batch`. They begin anew.

        Raises InputError for a robot whose speeds are filtered.
        """
        if self._filtered_twist is not None:
            raise InputError(
                "many robots in one take speeds as they are",
                got=f"sensors of {self.robot.name}: filtered speeds",
                expected="[sensors] without twist_filter_s, or an Mpc for each robot",
                where="batch",
            )
        return MpcBatch(
            self._numbers,
            self._tables,
            self._room,
            self.observer_settings,
            self._preview,
            (self._estimator, PoseGate(self.robot, self.dt)),
            self._per_command,
            _whole("count", count, 1, 10_000_000),
        )

    @property
    def info(self) -> Info:
        """What the last step did."""
        status, iterations, took = self._asked
        if status not in (OK, PATH_ENDED, INACCURATE, SWINGS, *DOUBTS.values()):
            return Info(status, iterations, took)
        return Info(status, iterations, took, self._memory.x[1:, :3].copy(), self._met())

    def _met(self) -> tuple[str, ...]:
        """The limits that the last output met."""
        memory, limit = self._memory, self._tables.limit
        volts, at_bound = memory.u[0], memory.active[0] != 0
        at_voltage = np.abs(volts) >= limit[0] - MET
        at_current = np.abs(volts - self._tables.emf @ memory.x[0, 3:]) >= limit[1] - MET
        met = {
            "voltage": at_voltage.any(),
            "current": at_current.any(),
            "slew": (at_bound & ~at_voltage & ~at_current).any(),
            "speed": memory.fast[0].any(),
        }
        return tuple(name for name, value in met.items() if value)

    def step(self, t: float, pose: Any, twist: Any, path: Any, supply: float | None = None) -> FloatArray:
        """What to send to the drive from t [s] on. Shape (wheels,). Never raises."""
        start = time.perf_counter()
        if supply is not None:
            self._per_volt = per_volt(self.output, supply, self._per_volt)
        try:
            since = t - self._t
            if since <= 0.0 or since != since:
                word = self._timing(t, since)
                if word:
                    return self._other(word, start)
            self._t, self._since, state = t, since, self._state
            if pose.__class__ is not np.ndarray or pose.shape != (3,):
                pose = vector(pose)
            if twist.__class__ is not np.ndarray or twist.shape != (3,):
                twist = vector(twist)
            if self._filtered_twist is not None:
                twist = self._filtered_twist.mean(t, twist)
            state[:3], state[3:] = pose, twist
            if self._estimator is not None:
                self._estimator.estimate(float(t), state)
            verdict = self._gate.judge(float(t), state)
            sent = self._solved(t, since, path, start)
            self._missing = 0
            if verdict != TRUSTED and self._asked[0] in (OK, PATH_ENDED):
                self._asked = (DOUBTS[verdict], *self._asked[1:])
            return sent
        except Exception as raised:  # the loop of a robot must not end here, but where a user ends it
            error = told_by(raised)
            if isinstance(error, INTERRUPTS):
                raise error from raised
            return self._refused(t, pose, twist, path, raised, start)

    def _bridged(self, t: float, path: Any, word: str, start: float) -> FloatArray:
        """The output of a step with what is expected in place of a sample that lacks a measurement."""
        self._missing += 1
        expect(self._numbers, self.sensors.averaged, self._since, self._memory, self._room, self._state)
        sent = self._solved(t, self._since, path, start)
        if self._asked[0] in (OK, PATH_ENDED):
            self._asked = (BRIDGED[word], self._asked[1], self._asked[2])
        return sent

    def _solved(self, t: float, since: float, path: Any, start: float) -> FloatArray:
        """The output of a step whose arguments look well."""
        preview = self._preview
        row = preview.row_at(t, path)
        elapsed = since if self._known and 0.5 * self.dt < since < LONGEST * self.dt else 0.0
        arguments = self._numbers, self._tables, preview.rows, row, self._state, elapsed, self._memory, self._room
        if self._control is None:
            self._control = machine_code(control_step, *arguments)
        passes = self._control(*arguments)
        inaccurate = passes <= INACCURATE_STEP
        if inaccurate:
            passes = INACCURATE_STEP - passes
        elif passes < 0:
            return self._failed(t, passes, start)
        self._known = True
        sent = self._memory.u[0] * self.per_volt
        if self.output != VOLTAGE:
            sent = np.clip(sent, -self.limit, self.limit)
        self._last = sent
        wanted, (vx, vy, omega) = preview.rows[row - preview.late, 3:].tolist(), self._state[3:].tolist()
        swinging = self.swing.found(float(t), vx - wanted[0], vy - wanted[1], omega - wanted[2])
        status = INACCURATE if inaccurate else SWINGS if swinging else PATH_ENDED if t > preview.end else OK
        self._asked = (status, passes, time.perf_counter() - start)
        return sent.copy()

    def _failed(self, t: float, passes: int, start: float) -> FloatArray:
        """Zeros for a state that is none, and where no input was found: the memory may be why, and goes."""
        if passes == NO_STATE:
            raise ValueError("no state")
        self.reset()
        self._t = t
        return self._other(FAILED, start)

    def _timing(self, t: float, since: float) -> str:
        """A word where the time of a step is wrong; what was remembered goes where a clock went back."""
        if not isinstance(t, int | float | np.number) or not math.isfinite(t):
            return BAD_TIME
        if since < 0.0:
            self.reset()
            self._t = float(t)
            return BACKWARDS
        return TIME_STANDS_STILL if since == 0.0 else ""

    def _other(self, word: str, start: float) -> FloatArray:
        """Zeros, and why; the last output again where time stands still."""
        if word != TIME_STANDS_STILL:
            self._last, self._known = self._zeros.copy(), False
            self._memory.sent[:] = 0.0
        self._asked = (word, 0, time.perf_counter() - start)
        return self._last.copy()

    def _refused(self, t: Any, pose: Any, twist: Any, path: Any, error: Exception, start: float) -> FloatArray:
        """What to do after an exception: find out what it was about."""
        try:
            finite_time = math.isfinite(float(t))
        except (TypeError, ValueError, OverflowError):
            finite_time = False
        if not finite_time:
            word = BAD_TIME
        elif vector(pose) is None:
            word = BAD_POSE
        elif vector(twist) is None:
            word = BAD_TWIST
        elif not callable(getattr(path, "at", None)):
            word = BAD_PATH
        else:
            word = failure(error)
        late = not self._known or self._missing >= MOST_BRIDGED or not 0.5 * self.dt < self._since < LATEST * self.dt
        if word in BRIDGED and not late:
            try:
                return self._bridged(t, path, word, start)
            except Exception as raised:  # as in `step`
                cause = told_by(raised)
                if isinstance(cause, INTERRUPTS):
                    raise cause from raised
        return self._other(word, start)


def _whole(name: str, value: Any, low: int, high: int) -> int:
    """An integer in a range. Raises InputError for anything else."""
    if not is_whole(value) or not low <= value <= high:
        raise InputError("not an integer in the range", got=value, expected=f"{low} to {high}", where=name)
    return int(value)
