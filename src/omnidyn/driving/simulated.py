"""A simulated robot behind a line, which may misbehave: what every sender and every guard is tested with."""

from __future__ import annotations

import heapq
from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.driving.clock import DriveClock, SimulatedClock
from omnidyn.driving.connection import Command, Measured
from omnidyn.driving.dead_man import DeadMan
from omnidyn.identification.planning.recorded import noise_of
from omnidyn.model.actuation import reaching
from omnidyn.model.dynamics import settled_currents
from omnidyn.model.robot import Robot
from omnidyn.simulation.live import LiveRobot

LATE, DEAF, MUTE, RESET, HALTS = "late", "deaf", "mute", "reset", "halts"
CLOCK, REVERSED, STUCK, SUPPLY, PUSHED = "clock", "reversed", "stuck", "supply", "pushed"
FAULTS = (LATE, DEAF, MUTE, RESET, HALTS, CLOCK, REVERSED, STUCK, SUPPLY, PUSHED)
BOOT = 1.0  # [s] without a word after a reset
EDGE = 1e-9  # [s]: so near, two times are one


class Fault(NamedTuple):
    """What goes wrong, and when.

    kind: late (the line takes `size` seconds more), deaf (no command arrives), mute (nothing measured arrives), reset
    (the firmware begins anew), halts (the motors have no power), clock (its clock jumps by `size` seconds), reversed
    (the wires of a motor), stuck (a wheel: its motor does nothing, and its encoder says so), supply (the battery has
    `size` volts), pushed (forward, with `size` newtons).
    """

    kind: str
    at: float
    size: float = 0.0
    wheel: int = 0


class SimulatedRobot:
    """A robot in a room, its firmware with the dead-man stop, and the line to it. A `RobotConnection`.

    Args:
        robot: What it is in truth.
        noise: Channel -> std of what it measures, as for `plan`.
        clock: Of the drive; the robot goes on as it does. Default: a simulated one, which nobody waits for.
        rate: Of what it measures [Hz].
        delay: Of the line, each way [s].
        faults: What goes wrong.
        seed: Of the noise.
    """

    def __init__(
        self,
        robot: Robot,
        noise: Mapping[str, Any] | None = None,
        *,
        clock: DriveClock | None = None,
        rate: float = 100.0,
        delay: float = 0.0,
        faults: Sequence[Fault] = (),
        seed: int = 0,
    ) -> None:
        self.robot, self.clock, self.period = robot, clock or SimulatedClock(), 1.0 / rate
        self.noise = noise_of(robot, self.period, noise)
        self.delay, self.faults = delay, deque(sorted(faults, key=lambda fault: fault.at))
        self._rng = np.random.default_rng(seed)
        self._supply = robot.drive.supply or 0.0  # measured where there is one
        self._sign, self._alive = np.ones(robot.wheels.count), np.ones(robot.wheels.count, bool)
        self._deaf = self._mute = self._halted = False
        self._silent_until, self._jump = -np.inf, 0.0
        self.last_driven = -np.inf  # when a motor got something the last time, on the clock of the drive [s]
        self._sensors = robot.sensor_model
        self._begun = False

    def open(self) -> None:
        """Switch it on; what was underway is lost."""
        self.live = LiveRobot(self.robot, self.period, supply=self._supply or None)
        self._time = self._start = self._boot = self.clock.now()
        self._tick, self._angle = 0, np.zeros(self.robot.wheels.count)
        self._poses, self._frame = deque([(self._time, self.live.pose.copy())]), -np.inf
        self._dead_man = DeadMan(self.robot.wheels.count)
        self._arriving: list[tuple[float, int, Command | None]] = []
        self._leaving: list[tuple[float, int, Measured]] = []
        self._count, self._begun = 0, True

    def send(self, command: Command) -> None:
        """A command on its way to the firmware."""
        self._advance()
        self._under_way(command)

    def stop(self) -> None:
        """The stop on its way to the firmware."""
        if self._begun:
            self._advance()
            self._under_way(None)

    def receive(self) -> list[Measured]:
        """What has arrived."""
        self._advance()
        arrived = []
        while self._leaving and self._leaving[0][0] <= self._time + EDGE:
            arrived.append(heapq.heappop(self._leaving)[2])
        return arrived

    def close(self) -> None:
        """Switch it off."""
        self.stop()

    def _under_way(self, command: Command | None) -> None:
        if not self._deaf:
            self._count += 1
            heapq.heappush(self._arriving, (self._time + self.delay, self._count, command))

    def _own_time(self) -> float:
        """What its firmware takes for the time."""
        return self._time - self._boot + self._jump

    def _advance(self) -> None:
        """Go on to the time of the clock."""
        until = self.clock.now()
        while True:
            due = min(self._next(), until)
            self._move(due)
            while self.faults and self.faults[0].at + self._start <= self._time + EDGE:
                self._begin(self.faults.popleft())
            while self._arriving and self._arriving[0][0] <= self._time + EDGE:
                self._take(heapq.heappop(self._arriving)[2])
            if self._start + self._tick * self.period <= self._time + EDGE:
                self._measure()
                self._tick += 1
            if due >= until - EDGE and self._next() > until + EDGE:
                return

    def _next(self) -> float:
        """When something happens."""
        times = [self._start + self._tick * self.period]
        if self._arriving:
            times.append(self._arriving[0][0])
        if self.faults:
            times.append(self._start + self.faults[0].at)
        end = self._dead_man.end - self._jump + self._boot
        if end > self._time + EDGE:
            times.append(end)
        return min(times)

    def _move(self, until: float) -> None:
        """What acts now acts until then."""
        seconds = until - self._time
        if seconds <= EDGE:
            return
        inputs = np.array(self._dead_man.acting(self._own_time()))
        if self._halted:
            inputs = np.zeros_like(inputs)
        if inputs.any():
            self.last_driven = until
        before = self.live.wheel_speed
        self.live.step(np.where(self._alive, self._sign * inputs, 0.0), seconds)
        self._angle += 0.5 * seconds * self._alive * (before + self.live.wheel_speed)
        self._time = until
        self._poses.append((until, self.live.pose.copy()))

    def _take(self, command: Command | None) -> None:
        if self._time < self._silent_until:
            return
        if command is None:
            self._dead_man.stop()
        else:
            self._dead_man.take(self._own_time(), command)

    def _measure(self) -> None:
        """What its sensors say now, on its way."""
        if self._mute or self._time < self._silent_until:
            return
        live, channels = self.live, dict[str, FloatArray]()
        turns = self._alive
        for channel, std in self.noise.items():
            if channel == "wheel_angle":
                channels[channel] = std * np.floor(self._angle / std)
                continue
            if channel == "current":
                exact = settled_currents(self.robot, live.twist, reaching(self.robot, live.voltage))
            else:
                exact = live.wheel_speed * turns if channel == "wheel_speed" else getattr(live, channel)
            if channel == "pose" and (exact := self._new_pose()) is None:
                continue
            channels[channel] = exact + std * self._rng.standard_normal(len(std))
        if self._supply:
            channels["supply"] = np.array([self._supply])
        measured = Measured(self._own_time(), self._dead_man.session, self._dead_man.number, channels)
        self._count += 1
        heapq.heappush(self._leaving, (self._time + self.delay, self._count, measured))

    def _new_pose(self) -> FloatArray | None:
        """The newest pose that has arrived, as late and as often as [sensors] says; None where that came before."""
        at = self._time - self._sensors.pose_delay - self._start
        if rate := self._sensors.pose_rate:
            at = np.floor(at * rate + EDGE) / rate
        if at <= self._frame:
            return None
        self._frame = at
        while len(self._poses) > 1 and self._poses[1][0] <= at + self._start:
            self._poses.popleft()
        (before, pose), (after, next_pose) = self._poses[0], self._poses[min(1, len(self._poses) - 1)]
        share = np.clip((at + self._start - before) / (after - before), 0.0, 1.0) if after > before else 0.0
        return pose + share * (next_pose - pose)

    def _begin(self, fault: Fault) -> None:
        """A fault begins."""
        if fault.kind == LATE:
            self.delay += fault.size
        elif fault.kind == DEAF:
            self._deaf = True
        elif fault.kind == MUTE:
            self._mute = True
        elif fault.kind == RESET:
            self._dead_man = DeadMan(self.robot.wheels.count)
            self._silent_until = self._time + BOOT
            self._boot, self._jump, self._angle = self._silent_until, 0.0, np.zeros_like(self._angle)
        elif fault.kind == HALTS:
            self._halted = True
        elif fault.kind == CLOCK:
            self._jump += fault.size
        elif fault.kind == REVERSED:
            self._sign[fault.wheel] = -1.0
        elif fault.kind == STUCK:
            self._alive[fault.wheel] = False
        elif fault.kind == SUPPLY:
            self._supply = self.live.supply = fault.size
        elif fault.kind == PUSHED:
            self.live.push((fault.size, 0.0, 0.0))
