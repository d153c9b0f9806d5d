"""A simulated robot that is driven step by step: `simulate`, its whole state carried from one call to the next.

The engine is that of `simulate`: what a live robot does under a row of commands is what `simulate` gives for all of
them at once; a test holds that. A command may act late: by whole steps, by the latency of the drive, by both.
"""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import ArrayLike, NDArray

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.model.actuation import clip_voltage, reaching
from omnidyn.model.drive import DUTY, SPEED
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import wheel_speed
from omnidyn.simulation.commands import Commands
from omnidyn.simulation.contract import Conditions, Engine
from omnidyn.simulation.engine import TOLERANCE, as_start, choose_engine
from omnidyn.statement import Statement

EDGE = 1e-9  # of a step or a tick: so near, two times are one


class LiveRobot:
    """A robot in the middle of its motion. twist, pose, shape (3,): of now.

    wheel_speed (wheels,) [rad/s]: how fast its wheels turn, which does not follow from the twist where they slip.

    voltage (wheels,): that the last step asked of the drivers, as a log has it; of a speed loop, as the step began.

    dt [s]: how long each command is held, where its step does not say. delay: steps of dt until a command acts, beside
    the latency of the robot's drive; until the first one does, nothing acts. supply [V]: behind a duty. push: wrench
    (3,) on the body [N, N, N m]. twist, pose: of the start. tol: of the implicit engine [m/s].
    """

    def __init__(
        self,
        robot: Robot,
        dt: float,
        *,
        pose: ArrayLike = (0.0, 0.0, 0.0),
        twist: ArrayLike = (0.0, 0.0, 0.0),
        delay: int = 0,
        supply: float | None = None,
        push: tuple[float, float, float] = (0.0, 0.0, 0.0),
        tol: float | None = TOLERANCE,
    ) -> None:
        self.robot, self.dt, self.supply = robot, dt, supply
        self.pose, self.twist = as_start("pose", pose, 3), as_start("twist", twist, 3)
        self._kind, n = robot.drive.kind, robot.wheels.count
        self._late = delay * dt + robot.drive.latency
        self._acting, self._under_way = np.zeros(n), deque[tuple[float, FloatArray]]()  # (seconds until it acts, it)
        self.voltage, self._fresh = np.zeros(n), False
        self._turning: FloatArray | None = None
        self._tol, self._engines = tol, dict[tuple[float, float, float], Engine]()
        self._engine = self._engine_under(push)
        self._state = self._engine.start(self.twist, self.pose, np.zeros(n))

    def _engine_under(self, push: tuple[float, float, float]) -> Engine:
        """The engine that moves it under a push."""
        if push not in self._engines:
            around = Conditions(self._kind == SPEED, self.robot.drive.coasts, push if any(push) else None)
            self._engines[push] = choose_engine(self.robot, around, self._tol)
        return self._engines[push]

    def push(self, wrench: tuple[float, float, float]) -> None:
        """From now on, this wrench pushes the body [N, N, N m]."""
        engine = self._engine_under(wrench)
        if type(engine) is not type(self._engine):  # windings: their currents settle in less than a millisecond
            self._state = engine.start(self.twist, self.pose, np.zeros(self.robot.wheels.count))
        self._engine = engine

    @property
    def wheel_speed(self) -> FloatArray:
        """How fast the wheels turn now [rad/s]. Shape (wheels,)."""
        return wheel_speed(self.robot.wheels, self.twist) if self._turning is None else self._turning

    @property
    def engine(self) -> str:
        """The name of the engine that moves it."""
        return self._engine.name

    @property
    def warnings(self) -> tuple[Statement, ...]:
        """What is to be said of the way so far, as `simulate` says it."""
        return self._engine.statements(self._state)

    def step(self, command: FloatArray, seconds: float | None = None) -> None:
        """Hold a command: volts, a duty, or wheel speeds, shape (wheels,), whichever the drive takes.

        seconds: for how long, dt by default.
        """
        output = np.array(command, dtype=float)
        if self._kind != SPEED:
            output = self.voltage = self._volts(output)
        self._under_way.append((self._late, output))
        self._fresh = True
        left, edge = self.dt if seconds is None else seconds, EDGE * self.dt
        while left > edge:
            while self._under_way and self._under_way[0][0] <= edge:
                self._acting = self._under_way.popleft()[1]
            length = min(left, self._under_way[0][0]) if self._under_way else left
            if left - length <= edge:
                length = left
            self._hold(length, self._acting)
            self._under_way = deque((wait - length, output) for wait, output in self._under_way)
            left -= length

    def run(self, commands: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Steps of all rows of commands, shape (rows, wheels). Returns twists and poses, the start in row 0."""
        rows = np.array(commands, dtype=float)
        if self._kind != SPEED:
            rows = self._volts(rows)
        steps, acting, ends = self._pieces(rows)
        motion = self._engine.advance(self._state, self._commands(steps, acting))
        asked = rows[-1] if motion.asked is None else motion.asked[ends[-2]]
        self._state, self.twist, self.pose, self.voltage = motion.state, motion.twist[-1], motion.pose[-1], asked
        self._fresh = False
        if motion.wheel_speed is not None:
            self._turning = motion.wheel_speed[-1]
        return motion.twist[ends], motion.pose[ends]

    def _pieces(self, rows: FloatArray) -> tuple[FloatArray, FloatArray, NDArray[np.intp]]:
        """Rows held for dt each, cut where a command begins to act: lengths [s], what acts over each, shape (pieces,
        wheels), and where each row begins, and the end. What is still under way is kept."""
        count, edge = len(rows), EDGE * self.dt
        if self._late == 0.0 and not self._under_way:
            return np.full(count, self.dt), rows, np.arange(count + 1)
        edges = np.arange(count + 1) * self.dt
        acts = np.concatenate([[wait for wait, _ in self._under_way], edges[:-1] + self._late])
        acting = np.concatenate([self._acting[None], *(output[None] for _, output in self._under_way), rows])
        near = np.rint(acts / self.dt) * self.dt
        acts = np.where(np.abs(acts - near) <= edge, near, acts)  # so near, two times are one
        times = np.unique(np.concatenate([edges, acts[(acts > 0.0) & (acts < edges[-1])]]).astype(np.float64))
        begun = acts.searchsorted(times, side="right")
        left = int(begun[-1])
        outputs = [*(output for _, output in self._under_way), *rows][left:]
        self._acting = acting[left]
        self._under_way = deque(zip((acts[left:] - edges[-1]).tolist(), outputs, strict=True))
        return times[1:] - times[:-1], acting[begun[:-1]], times.searchsorted(edges)

    def _hold(self, length: float, command: FloatArray) -> None:
        """Go on by a length of time [s] with a command held."""
        motion = self._engine.advance(self._state, self._commands(np.array([length]), command[None]))
        self._state, self.twist, self.pose = motion.state, motion.twist[-1], motion.pose[-1]
        if motion.wheel_speed is not None:
            self._turning = motion.wheel_speed[-1]
        if motion.asked is not None and self._fresh:
            self.voltage, self._fresh = motion.asked[0], False

    def _commands(self, dt: FloatArray, command: FloatArray) -> Commands:
        """Rows of commands as they reach the motors, or the speed loop."""
        if self._kind == SPEED:
            return Commands(dt, None, set_point=command)
        coasts = (command == 0.0) if self.robot.drive.coasts else None
        return Commands(dt, reaching(self.robot, command), open_circuit=coasts)

    def _volts(self, command: FloatArray) -> FloatArray:
        """What a command asks of the drivers [V]."""
        if self._kind != DUTY:
            return clip_voltage(self.robot.motor, command)
        battery = self.supply if self.supply is not None else self.robot.drive.supply
        assert battery is not None
        return clip_voltage(self.robot.motor, np.clip(command, -1.0, 1.0) * battery)


def check_supply(robot: Robot, supply: float | None) -> None:
    """Raises InputError for a duty without a supply."""
    if robot.drive.kind == DUTY and supply is None and robot.drive.supply is None:
        raise InputError(
            "a duty needs a supply",
            got="no supply",
            expected="`supply`, or [drive] supply_V",
            remedy="add supply_V to the [drive] of the robot file",
        )
