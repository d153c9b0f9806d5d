"""The contract of an engine: what moves a robot under commands. engine.py has the engines, and picks one.

An engine is made of a robot, the Conditions it moves in, and a tolerance.

1. `serves(robot, conditions)` says whether it can; the first of ENGINES that can is taken.
2. `start(twist, pose, current)` returns the state of a robot there. Only the engine reads a state.
3. `advance(state, commands)` holds commands row by row and returns the Motion, with the state at its end. The state
   that it is given stays as it is: one state may be advanced many times.
4. `statements(state)` returns what a reader should know of the way so far.
5. `name` stands in the source of a Run.

`simulate` advances all rows at once, a live robot row by row, both by the same engine.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.model.robot import Robot
from omnidyn.simulation.commands import Commands
from omnidyn.statement import Statement


class Conditions(NamedTuple):
    """What acts on a robot, beside voltages: whether a speed loop makes these, and whether motors may coast.

    push: a constant wrench on the body [N, N, N m]; tilt: a constant force that stays in the room [N, N]. fixed: one
    step a row, instead of a tolerance.
    """

    speed_loop: bool = False
    coasting: bool = False
    push: tuple[float, float, float] | None = None
    tilt: tuple[float, float] | None = None
    fixed: bool = False


class Motion(NamedTuple):
    """What a robot does under rows of commands: samples at the start and after each row.

    state: at the end. twist, pose: shape (rows + 1, 3). voltage [V]: at the motors over each row, shape (rows, wheels);
    asked: of the drivers by a speed loop as a row begins, None without one. current [A], wheel_speed [rad/s]: shape
    (rows + 1, wheels), None where they follow from twist and voltage. stuck: wheels at rest to the last bit.
    """

    state: Any
    twist: FloatArray
    pose: FloatArray
    voltage: FloatArray
    asked: FloatArray | None = None
    current: FloatArray | None = None
    wheel_speed: FloatArray | None = None
    stuck: BoolArray | None = None


class Engine(Protocol):
    """What every engine provides; the numbered list above says how."""

    name: str

    def __init__(self, robot: Robot, conditions: Conditions, tol: float) -> None: ...

    @staticmethod
    def serves(robot: Robot, conditions: Conditions) -> bool: ...

    def start(self, twist: FloatArray, pose: FloatArray, current: FloatArray) -> Any: ...

    def advance(self, state: Any, commands: Commands) -> Motion: ...

    def statements(self, state: Any) -> tuple[Statement, ...]: ...
