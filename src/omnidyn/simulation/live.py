"""A simulated robot that is driven step by step: `simulate`, its whole state carried from one call to the next.

The engines are those of `simulate`: what a live robot does under a row of commands is what `simulate` gives for all of
them at once; a test holds that. A command may act late: by whole steps, by the latency of the drive, by both.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.errors import InputError
from omnidyn.model.actuation import clip_voltage, reaching
from omnidyn.model.drive import DUTY, SPEED
from omnidyn.model.motor import DYNAMIC
from omnidyn.model.robot import Robot
from omnidyn.model.stick_slip.plant import plant
from omnidyn.model.stick_slip.release import start_state
from omnidyn.model.wheels import per_wheel, wheel_speed
from omnidyn.simulation.exact.inductance import simulate_exact_inductance
from omnidyn.simulation.exact.march import ExactMarch, why_not_exact
from omnidyn.simulation.implicit.march import room, run_implicit
from omnidyn.simulation.simulate import TOLERANCE, as_start, as_tolerance
from omnidyn.simulation.slip.grip import Grip
from omnidyn.simulation.slip.march import rolling, run_slipping
from omnidyn.simulation.slip.plant import slip_plant
from omnidyn.simulation.speed_loop import Loop, loop_of, no_loop
from omnidyn.simulation.view import pushing, refuse_push
from omnidyn.statement import Statement

EDGE = 1e-9  # of a step or a tick: so near, two times are one


class LiveRobot:
    """A robot in the middle of its motion. twist, pose, shape (3,): of now.

    wheel_speed (wheels,) [rad/s]: how fast its wheels turn, which does not follow from the twist where they slip.

    voltage (wheels,): that the last step asked of the drivers, as a log has it; of a speed loop, as the step began.

    dt [s]: how long each command is held. delay: steps until a command acts, beside the latency of the robot's drive;
    until the first one does, nothing acts. supply [V]: behind a duty. push: constant wrench (3,) on the body
    [N, N, N m]. twist, pose: of the start. tol: of the implicit engine [m/s].
    """

    def __init__(
        self, robot: Robot, dt: float, *, pose: ArrayLike = (0.0, 0.0, 0.0), twist: ArrayLike = (0.0, 0.0, 0.0),
        delay: int = 0, supply: float | None = None, push: tuple[float, float, float] = (0.0, 0.0, 0.0),
        tol: float | None = TOLERANCE,
    ) -> None:  # fmt: skip
        self.robot, self.dt, self.supply = robot, dt, supply
        self.pose, self.twist = as_start("pose", pose, 3), as_start("twist", twist, 3)
        self._kind, n = robot.drive.kind, robot.wheels.count
        self._push = push if any(push) else None
        late = delay + robot.drive.latency / dt
        self._whole = int(np.floor(late + EDGE))
        self._part = late - self._whole if late - self._whole > EDGE else 0.0
        self._queue = [np.zeros(n) for _ in range(self._whole + (self._part > 0.0))]
        self.voltage, self._fresh = np.zeros(n), False
        self._turning: FloatArray | None = None
        self._grip = Grip(robot) if robot.wheels.traction_mu is not None else None
        self._advance = self._engine(as_tolerance(tol))

    @property
    def wheel_speed(self) -> FloatArray:
        """How fast the wheels turn now [rad/s]. Shape (wheels,)."""
        return wheel_speed(self.robot.wheels, self.twist) if self._turning is None else self._turning

    @property
    def warnings(self) -> tuple[Statement, ...]:
        """What is to be said of the way so far: which wheels slipped or lifted off, as `simulate` says it."""
        return self._grip.statements if self._grip is not None else ()

    def step(self, command: FloatArray) -> None:
        """Hold a command for dt: volts, a duty, or wheel speeds, shape (wheels,), whichever the drive takes."""
        given = np.array(command, dtype=float)
        if self._kind != SPEED:
            self.voltage = self._volts(given)
        self._queue.append(given)
        self._fresh = True
        parts = [(1.0, self._queue[0])]
        if self._part:
            parts = [(self._part, self._queue[0]), (1.0 - self._part, self._queue[1])]
        self._queue.pop(0)
        for share, each in parts:
            self._advance(share * self.dt, each)

    def _engine(self, tol: float) -> Callable[[float, FloatArray], None]:
        """Which engine moves it."""
        robot = self.robot
        dynamic = robot.motor.electrical == DYNAMIC
        if self._kind == SPEED or robot.drive.coasts or why_not_exact(robot) or (dynamic and self._push):
            return self._implicit(tol)
        if dynamic:
            self._current = np.zeros(robot.wheels.count)
            return self._with_windings
        march, pushed = ExactMarch(robot), pushing(robot, self._push) if self._push else 0.0

        def advance(length: float, command: FloatArray) -> None:
            """Go on by a length of time [s] with a command held, from the state that the last call left."""
            volts = self._at_motors(command) + pushed
            self.twist, self.pose = march.step(volts, length, self.twist, self.pose)

        return advance

    def _volts(self, command: FloatArray) -> FloatArray:
        """What a command asks of the drivers [V]."""
        if self._kind != DUTY:
            return clip_voltage(self.robot.motor, command)
        battery = self.supply if self.supply is not None else self.robot.drive.supply
        assert battery is not None
        return clip_voltage(self.robot.motor, np.clip(command, -1.0, 1.0) * battery)

    def _at_motors(self, command: FloatArray) -> FloatArray:
        return reaching(self.robot, self._volts(command))

    def _with_windings(self, length: float, command: FloatArray) -> None:
        rows = self._at_motors(command)[None], np.array([length]), self.twist, self.pose, self._current
        twists, poses, currents = simulate_exact_inductance(self.robot, *rows)
        self.twist, self.pose, self._current = twists[1], poses[1], currents[1]

    def _implicit(self, tol: float) -> Callable[[float, FloatArray], None]:
        """The implicit engine, the speed loop of the firmware included."""
        robot, n = self.robot, self.robot.wheels.count
        slips = robot.wheels.traction_mu is not None
        numbers, pushed = plant(robot), np.zeros(n)
        units = np.array([1.0, 1.0, numbers.body.length])
        if self._push and slips:
            refuse_push(robot, self._kind == SPEED)
            pushed = pushing(robot, self._push)
        elif self._push:
            numbers.body.push += np.array(self._push) / units
        limit = robot.motor.current_limit
        most = per_wheel(np.inf if limit is None else limit, n)
        state, work = start_state(numbers, self.twist, np.zeros(n)), room(numbers)
        wheels = slip_plant(robot) if slips else None
        slid_to = np.zeros(0) if wheels is None else rolling(wheels, self.twist)
        loop: Loop = no_loop(n)
        if self._kind == SPEED:
            loop = loop_of(robot, np.zeros((1, n)), np.ones(1, np.bool_))
        period, now, asked = loop.period, 0.0, np.zeros(n)

        def advance(length: float, command: FloatArray) -> None:
            """Go on by a length of time [s] with a command held, from the state that the last call left."""
            nonlocal state, slid_to, now, asked
            dts, ticks = _ticks(now, length, period) if period else (np.array([length]), np.ones(1, np.bool_))
            volts = np.empty((len(dts), n))
            if period:
                volts[-1] = asked  # a row before the first tick takes the voltage of the row before it: the last one
                given = loop._replace(command=np.tile(command, (len(dts), 1)), tick=ticks)
            else:
                volts[:], given = self._at_motors(command) + pushed, loop
            bound = np.tile(np.where(command == 0.0, 0.0, most) if robot.drive.coasts else most, (len(dts), 1))
            if wheels is not None:
                slid = run_slipping(wheels, volts, bound, dts, slid_to, self.pose, given, tol)
                assert self._grip is not None
                self._grip.add(slid)
                slid_to, self.pose = slid.state[-1], slid.pose[-1]
                self.twist, self._turning = slid.twist[-1].copy(), slid.rims[-1] / robot.wheels.radii
            else:
                out = run_implicit(numbers, volts, bound, dts, state, self.pose, given, tol, work)
                state, self.pose = out.state.at(-1), out.pose[-1]
                self.twist = state.x / units
            now, asked = now + length, volts[-1]
            if period and self._fresh:
                self.voltage, self._fresh = volts[0].copy(), False

        return advance


def _ticks(now: float, length: float, period: float) -> tuple[FloatArray, BoolArray]:
    """The rows of a stretch, cut at the ticks of a firmware: their lengths [s], and which begin with a tick."""
    first = np.ceil(now / period - EDGE)
    ticks = np.arange(first, np.ceil((now + length) / period - EDGE)) * period - now
    ticks = np.where(np.abs(ticks) <= EDGE * period, 0.0, ticks)
    edges = np.unique(np.concatenate([[0.0], ticks, [length]]))
    return np.diff(edges), np.isin(edges[:-1], ticks)


def check_supply(robot: Robot, supply: float | None) -> None:
    """Raises InputError for a duty without a supply."""
    if robot.drive.kind == DUTY and supply is None and robot.drive.supply is None:
        raise InputError(
            "a duty needs a supply", got="no supply", expected="`supply`, or [drive] supply_V",
            remedy="add supply_V to the [drive] of the robot file",
        )  # fmt: skip
