"""simulate: robot and commands in, Run out, by the engine that `choose_engine` picks."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from omnidyn.arguments import check_order
from omnidyn.errors import InputError
from omnidyn.model.log_effects import LogEffects
from omnidyn.model.motor import settled_current
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import wheel_speed
from omnidyn.run import Run
from omnidyn.simulation.commands import Commands, commands
from omnidyn.simulation.contract import Conditions, Motion
from omnidyn.simulation.engine import TOLERANCE, as_start, choose_engine
from omnidyn.simulation.view import PLAIN, View, seen_at_once, seen_through
from omnidyn.statement import Statement


def simulate(
    robot: Robot,
    voltage: ArrayLike | None = None,
    dt: ArrayLike | None = None,
    *,
    duty: ArrayLike | None = None,
    wheel_speed_command: ArrayLike | None = None,
    twist_command: ArrayLike | None = None,
    supply: ArrayLike | None = None,
    twist: ArrayLike = (0.0, 0.0, 0.0),
    pose: ArrayLike = (0.0, 0.0, 0.0),
    current: ArrayLike | None = None,
    tol: float | None = TOLERANCE,
    log: LogEffects | None = None,
) -> Run:
    """Simulate a robot under commands held from row to row, eqs (1)-(14).

    Returns a Run of n + 1 samples: t, voltage (the last row repeats), current, wheel_speed, twist, pose.
    What is at rest within its dead zone has a speed of exactly 0.0. Run.source says which engine ran.

    Args:
        robot: The robot.
        voltage: One row per step [V], shape (n, wheels); what exceeds the motor's limit is clipped, with a warning.
        dt: Length of the rows [s], a number or shape (n,).
        duty: In place of a voltage, -1..1 of the supply, shape (n, wheels).
        wheel_speed_command: In place of a voltage, for a drive with a speed loop [rad/s], shape (n, wheels).
        twist_command: The same for the body [m/s, m/s, rad/s], shape (n, 3).
        supply: Voltage of the battery behind a duty [V], a number or shape (n,).
        twist: At the start [m/s, m/s, rad/s], shape (3,).
        pose: At the start [m, m, rad], shape (3,).
        current: At the start [A], shape (wheels,); it matters for dynamic electrics only.
        tol: Global error of the implicit engine [m/s], 10 tol [rad/s]; None takes one fixed step per row. The exact
            engine, used wherever the robot allows it, needs no tolerance.
        log: What a log did beside the robot, such as `robot.log` of a fit: a battery that sagged, sensors that were
            late.

    Raises InputError for wrong shapes, NaN, infinite values, a start beyond 1e3 m/s, dt outside 1e-9..3600 s, a missing
    supply, or a tol outside 1e-10..1 m/s.

    >>> import omnidyn
    >>> run = omnidyn.simulate(omnidyn.load_robot("axebot"), [[0.0, 3.0, -3.0]] * 50, dt=0.02)
    >>> run.twist.shape, bool(run.twist[-1, 0] > 0.3)
    ((51, 3), True)
    """
    call = "simulate(robot, voltage, dt)"
    if not isinstance(robot, Robot):
        check_order(call, (robot, Robot), (voltage, type(robot)), (dt, object))
    if isinstance(voltage, int | float) and isinstance(dt, list | tuple | np.ndarray):
        raise InputError("arguments swapped", got="the time before the voltage", expected=call)
    held_commands = commands(robot, voltage, dt, duty, wheel_speed_command, twist_command, supply)
    view = seen_at_once(robot, held_commands) if log is None else seen_through(robot, held_commands, log)
    return simulate_seen(robot, held_commands, view, twist=twist, pose=pose, current=current, tol=tol)


def simulate_seen(
    robot: Robot,
    held_commands: Commands,
    view: View,
    *,
    twist: ArrayLike,
    pose: ArrayLike,
    current: ArrayLike | None,
    tol: float | None,
) -> Run:
    """`simulate` of commands that were checked, as the log of a view shows them."""
    n, acting = robot.wheels.count, view.acting(robot, held_commands)
    start = (
        as_start("twist", twist, 3),
        as_start("pose", pose, 3),
        as_start("current", np.zeros(n) if current is None else current, n),
    )
    around = Conditions(acting.set_point is not None, acting.open_circuit is not None, view.push, view.room)
    engine = choose_engine(robot, around, tol)
    motion = engine.advance(engine.start(*start), acting)
    return as_run(robot, held_commands, acting, motion, engine.name, engine.statements(motion.state), view)


def as_run(
    robot: Robot,
    held_commands: Commands,
    acting: Commands,
    motion: Motion,
    engine: str,
    warnings: tuple[Statement, ...],
    view: View = PLAIN,
) -> Run:
    """The Run of a simulation: what the instruments of the robot would have recorded, as a view shows it.

    Args:
        robot: that moved.
        held_commands: the commands, as a log has them.
        acting: the commands as they reached the motors.
        motion: what it did.
        engine: the name of the engine.
        warnings: of the engine.
        view: how the log shows it.
    """
    dt = held_commands.dt
    t = np.arange(len(dt) + 1) * dt[0] if np.all(dt == dt[0]) else np.concatenate([[0.0], np.cumsum(dt)])
    turning = wheel_speed(robot.wheels, motion.twist) if motion.wheel_speed is None else motion.wheel_speed
    current = motion.current
    if current is None:
        current = settled_current(robot.motor, _with_last(motion.voltage), turning)
    if motion.stuck is not None:  # a wheel that sticks is at rest, to the last bit
        turning[motion.stuck] = 0.0
    if acting.open_circuit is not None:
        current = np.where(_with_last(acting.open_circuit), 0.0, current)
    if held_commands.voltage is None:  # a speed loop makes it, at its own ticks
        voltage = view.of("voltage", _with_last(motion.voltage if motion.asked is None else motion.asked))
    else:
        voltage = _with_last(held_commands.voltage)
    return Run(
        t=t,
        voltage=voltage,
        duty=None if held_commands.duty is None else _with_last(held_commands.duty),
        current=view.of("current", current),
        wheel_speed=view.of("wheel_speed", turning),
        wheel_speed_command=None if held_commands.set_point is None else _with_last(held_commands.set_point),
        twist=view.of("twist", motion.twist),
        twist_command=None if held_commands.twist is None else _with_last(held_commands.twist),
        pose=np.hstack([view.of("position", motion.pose[:, :2]), view.of("heading", motion.pose[:, 2:])]),
        supply=None if held_commands.supply is None else _with_last(held_commands.supply),
        source=f"simulated: {robot.name}, {engine}",
        warnings=held_commands.warnings + warnings,
    )


def _with_last(rows: NDArray) -> NDArray:
    """Input rows as samples: the last one repeats."""
    return np.concatenate([rows, rows[-1:]])
