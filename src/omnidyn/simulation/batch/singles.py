"""Robots of a batch that go one by one, each by the engine that `simulate` takes for it; several at a time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.errors import InputError
from omnidyn.model.drive import BRAKE
from omnidyn.model.drive import DUTY as DUTY_DRIVE
from omnidyn.model.drive import VOLTAGE as VOLTAGE_DRIVE
from omnidyn.model.robot import Robot
from omnidyn.simulation.batch.blocks import BatchCommands, GroupRun
from omnidyn.simulation.batch.engine_kind import DUTY, VOLTAGE
from omnidyn.simulation.batch.threads import Threads
from omnidyn.simulation.live import LiveRobot
from omnidyn.statement import Statement


class SingleGroup:
    """Robots one by one. command: what is given; supply [V]: behind a duty; tol: as of `simulate`."""

    def __init__(
        self,
        robots: Sequence[Robot],
        command: str,
        supply: float | None,
        dt: float,
        pose: str | None,
        tol: float | None,
    ) -> None:
        self.count, self.rows = len(robots), 3 if pose is None else 6
        self._robots = [_driven(robot, command) for robot in robots]
        self.dt, self._supply, self._tol = dt, supply, tol
        self._live: list[LiveRobot | None] = [None] * len(robots)
        names = [self._start(k, np.zeros(3), np.zeros(3)).engine for k in range(self.count)]
        self.engines = dict(Counter(names))

    def _start(self, robot: int, twist: FloatArray, pose: FloatArray) -> LiveRobot:
        return LiveRobot(self._robots[robot], self.dt, twist=twist, pose=pose, supply=self._supply, tol=self._tol)

    def reset(self, robots: IntArray, twist: FloatArray, pose: FloatArray) -> None:
        """Put some robots to a twist and a pose, shape (robots, 3) each."""
        for k, robot in enumerate(robots.tolist()):
            try:
                self._live[robot] = self._start(robot, twist[k], pose[k])
            except InputError:
                self._live[robot] = None

    def state(self) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Twist and pose, shape (n, 3) each, and whether a robot has failed, shape (n,)."""
        lost = np.full((2, 3), np.nan)
        both = np.array([lost if live is None else (live.twist, live.pose) for live in self._live])
        return both[:, 0], both[:, 1, : self.rows - 3], np.array([live is None for live in self._live])

    def run(self, commands: BatchCommands, every: int, statistics: bool, threads: Threads) -> GroupRun:
        """Hold rows of commands, one after the other."""
        samples = 1 + commands.steps // every if every else 0
        history = np.full((self.count, samples, self.rows), np.nan)
        totals = np.full((self.count if statistics else 0, 4 * self.rows), np.nan)

        def move(k: int) -> tuple[Statement, ...]:
            """What is to be said of robot k, which has moved: its rows are written."""
            live, rows = self._live[k], commands.rows[k if len(commands.rows) > 1 else 0]
            if live is None:
                return ()
            bad = ~np.isfinite(rows).all(axis=1)
            good = int(bad.argmax()) if bad.any() else len(rows)
            try:
                twists, poses = live.run(rows[:good]) if good else (live.twist[None], live.pose[None])
            except InputError:
                self._live[k] = None
                return ()
            shown = np.hstack([twists, poses])[:, : self.rows]
            if every:
                kept = shown[::every]
                history[k, : len(kept)] = kept
            if good < len(rows):
                self._live[k] = None
            elif statistics:
                ends = shown[1:]
                totals[k] = np.concatenate([ends.sum(0), (ends**2).sum(0), ends.min(0), ends.max(0)])
            return live.warnings

        warnings = threads.map(move, range(self.count))
        first = {one.code: one for statements in reversed(warnings) for one in statements}
        return GroupRun(history if every else None, totals if statistics else None, (0, 0), tuple(first.values()))


def _driven(robot: Robot, command: str) -> Robot:
    """The robot whose drive takes such a command; a short circuit at a duty of 0 where it knows of no duties."""
    kinds = {VOLTAGE: VOLTAGE_DRIVE, DUTY: DUTY_DRIVE}
    if command not in kinds or robot.drive.kind == kinds[command]:
        return robot
    return robot.model_copy(update={"drive": robot.drive.model_copy(update={"kind": kinds[command], "off": BRAKE})})
