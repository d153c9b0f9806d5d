"""LeRobotConnection: a robot of LeRobot with a base of omni wheels, such as LeKiwi, driven through a program."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from omnidyn.driving.connection import Command, Measured
from omnidyn.driving.dead_man import DeadMan
from omnidyn.errors import InputError
from omnidyn.model.drive import SPEED
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import twist_from_wheel_speed

KEYS = ("x.vel", "y.vel", "theta.vel")  # [m/s, m/s, deg/s] of actions and observations
POSITION = ".pos"  # behind the name of a joint of the arm, which is held where it is


class LeRobotConnection:
    """An object of LeRobot's class `Robot` as a `RobotConnection`: by its methods alone, LeRobot is not imported.

    robot: such as `LeKiwiClient(config)`. model: its robot file, whose drive is a speed loop. now: clock of the drive.

    Inputs are speeds of the wheels; LeRobot takes the twist that they make. Joints of an arm are held where they are
    found. A stop sends zeros; should this computer stop as well, the host of LeKiwi switches off 0.5 s after the last
    action: that is its own dead-man time. Raises InputError for a model whose drive is no speed loop.
    """

    def __init__(self, robot: Any, model: Robot, now: Callable[[], float] = time.monotonic) -> None:
        if model.drive.kind != SPEED:
            raise InputError(
                "LeRobot takes speeds", got=f"drive.kind = {model.drive.kind}", expected='kind = "speed"', where="model"
            )
        self.robot, self.model, self._now = robot, model, now
        self._dead_man = DeadMan(model.wheels.count)
        self._arm: dict[str, Any] = {}
        self._is_open = False

    def open(self) -> None:
        """Connect, and see where the arm is."""
        self.robot.connect()
        self._is_open = True
        found = self.robot.get_observation()
        missing = [key for key in KEYS if key not in found]
        if missing:
            self.robot.disconnect()
            raise InputError(
                "no base in what this robot observes", got=", ".join(map(str, found))[:80], expected=", ".join(KEYS)
            )
        self._arm = {key: value for key, value in found.items() if str(key).endswith(POSITION)}

    def send(self, command: Command) -> None:
        """The twist that the wheels make."""
        if self._dead_man.take(self._now(), command):
            self._act(np.array(command.inputs))

    def receive(self) -> list[Measured]:
        """What it observes now."""
        found, now = self.robot.get_observation(), self._now()
        forward, left, turn = (float(found[key]) for key in KEYS)
        twist = np.array([forward, left, np.radians(turn)])
        return [Measured(now, self._dead_man.session, self._dead_man.number, {"twist": twist})]

    def stop(self) -> None:
        """Zeros."""
        self._dead_man.stop()
        if self._is_open:
            self._act(np.zeros(self.model.wheels.count))

    def close(self) -> None:
        """Stop, and disconnect."""
        if self._is_open:
            self.stop()
            self._is_open = False
            self.robot.disconnect()

    def _act(self, speeds: np.ndarray) -> None:
        forward, left, turn = twist_from_wheel_speed(self.model.wheels, speeds).tolist()
        self.robot.send_action({**self._arm, **dict(zip(KEYS, (forward, left, np.degrees(turn)), strict=True))})
