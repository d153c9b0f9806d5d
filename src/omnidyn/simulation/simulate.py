"""simulate: robot and commands in, Run out. The exact engine where the robot allows it, else the implicit one."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from omnidyn.arguments import check_order
from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.model.actuation import reaching
from omnidyn.model.dynamics import settled_currents
from omnidyn.model.fitted.log_effects import LogEffects
from omnidyn.model.layout import N_AXES
from omnidyn.model.motor import DYNAMIC, settled_current
from omnidyn.model.robot import Robot
from omnidyn.model.stick_slip.plant import plant
from omnidyn.model.stick_slip.release import start_state
from omnidyn.model.wheels import wheel_speed
from omnidyn.run import Run
from omnidyn.simulation.commands import Commands, as_floats, commands, current_bounds, on_ticks
from omnidyn.simulation.exact.inductance import simulate_exact_inductance
from omnidyn.simulation.exact.march import simulate_exact, why_not_exact
from omnidyn.simulation.implicit.march import Outcome, capped, run_implicit
from omnidyn.simulation.slip.grip import Grip, not_converged
from omnidyn.simulation.slip.march import rolling, run_slipping
from omnidyn.simulation.slip.plant import slip_plant
from omnidyn.simulation.speed_loop import Loop, loop_of, no_loop
from omnidyn.simulation.view import PLAIN, View, pushing, refuse_push, seen_at_once, seen_through
from omnidyn.statement import Statement

TOLERANCE = 1e-6
# Beyond these a step has no meaning and the implicit engine no end: [m/s, rad/s], [m, rad], [A].
FARTHEST = {"twist": 1e3, "pose": 1e9, "current": 1e6}


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

    voltage: one row per step [V], shape (n, wheels); what exceeds the motor's limit is clipped, with a warning.
    duty: in place of a voltage, -1..1 of the supply, shape (n, wheels). supply: voltage of the battery behind a duty
    [V], a number or shape (n,). wheel_speed_command: in place of a voltage, for a drive with a speed loop [rad/s],
    shape (n, wheels). twist_command: the same for the body [m/s, m/s, rad/s], shape (n, 3).
    dt: length of the rows [s], a number or shape (n,). twist, pose, current: where it starts, shapes (3,), (3,),
    (wheels,); current [A] matters for dynamic electrics only.
    tol: global error of the implicit engine [m/s], 10 tol [rad/s]; None takes one fixed step per row. The exact
    engine, used wherever the robot allows it, needs no tolerance; Run.source says which engine ran.
    log: what a log did beside the robot, such as `robot.log` of a fit: a battery that sagged, sensors that were late.
    Returns a Run of n + 1 samples: t, voltage (the last row repeats), current, wheel_speed, twist, pose.
    What is at rest within its dead zone has a speed of exactly 0.0.
    Raises InputError for wrong shapes, NaN, infinite values, a start beyond 1e3 m/s, dt outside 1e-9..3600 s, a missing
    supply, or a tol outside 1e-10..1 m/s.
    """
    _check_order(robot, voltage, dt)
    given = commands(robot, voltage, dt, duty, wheel_speed_command, twist_command, supply)
    view = seen_at_once(robot, given) if log is None else seen_through(robot, given, log)
    return simulate_seen(robot, given, view, twist=twist, pose=pose, current=current, tol=tol)


def simulate_seen(
    robot: Robot, given: Commands, view: View, *, twist: ArrayLike, pose: ArrayLike, current: ArrayLike | None,
    tol: float | None,
) -> Run:  # fmt: skip
    """`simulate` of commands that were checked, as the log of a view shows them."""
    start = as_start("twist", twist, 3), as_start("pose", pose, 3)
    amperes = as_start("current", np.zeros(robot.wheels.count) if current is None else current, robot.wheels.count)
    tolerance = as_tolerance(tol)  # refused for either engine: which one runs is not what the caller chose
    acting = view.acting(robot, given)
    exact = given.set_point is None and given.open_circuit is None and view.room is None
    exact &= view.push is None or robot.motor.electrical != DYNAMIC
    if exact and not why_not_exact(robot):
        assert acting.voltage is not None
        if robot.motor.electrical == DYNAMIC:
            twists, poses, currents = simulate_exact_inductance(robot, acting.voltage, acting.dt, *start, amperes)
        else:
            (twists, poses), currents = simulate_exact(robot, _pushed(robot, acting, view), acting.dt, *start), None
        done = Done(acting.voltage, twists, poses, None, currents)
        return as_run(robot, given, acting, done, "exact engine", (), view)
    return _implicit(robot, given, acting, *start, amperes, tolerance, view)


def _pushed(robot: Robot, acting: Commands, view: View) -> FloatArray:
    """The voltages of what acts, and beside them those that push as hard as what pushes from outside."""
    assert acting.voltage is not None
    return acting.voltage if view.push is None else acting.voltage + pushing(robot, view.push)


def _check_order(robot: Robot, voltage: object, dt: object) -> None:
    """Refuses a robot, a voltage and a time in each other's place."""
    call = "simulate(robot, voltage, dt)"
    if not isinstance(robot, Robot):
        check_order(call, (robot, Robot), (voltage, type(robot)), (dt, object))
    if isinstance(voltage, int | float) and isinstance(dt, list | tuple | np.ndarray):
        raise InputError("two arguments stand in each other's place", got="the time before the voltage", expected=call)


def as_tolerance(tol: float | None) -> float:
    """The tolerance [m/s], 0 for None: a fixed step a row. Raises InputError outside 1e-10..1 m/s."""
    if tol is None:
        return 0.0
    if not 1e-10 <= tol <= 1.0:
        raise InputError(
            "tolerance out of range", got=tol, expected="1e-10 to 1 m/s, or None for a fixed step",
            remedy="leave `tol` out", where="tol",
        )  # fmt: skip
    return float(tol)


def as_start(name: str, value: ArrayLike, size: int) -> FloatArray:
    array = as_floats(name, value)
    if array.shape != (size,) or not np.isfinite(array).all():
        raise InputError("cannot start there", got=value, expected=f"{size} finite numbers", where=name)
    if (np.abs(array) > FARTHEST[name]).any():
        expected = f"{size} numbers within -{FARTHEST[name]:g} to {FARTHEST[name]:g}, in SI units"
        raise InputError("no robot starts there", got=value, expected=expected, where=name)
    return array


def _implicit(
    robot: Robot, given: Commands, acting: Commands, twist: FloatArray, pose: FloatArray, current: FloatArray,
    tol: float, view: View,
) -> Run:  # fmt: skip
    """Run the implicit engine, on the grid of the speed loop where there is one, and keep the rows asked for.

    Of wheels that slip: theirs.
    """
    if robot.wheels.traction_mu is not None:
        return _slipping(robot, given, acting, (twist, pose, current), tol, view)
    numbers = plant(robot)
    numbers.body.room += (0.0, 0.0) if view.room is None else view.room
    if view.push is not None:
        numbers.body.push += np.array(view.push) / [1.0, 1.0, numbers.body.length]
    dt, voltage, loop, keep = _on_grid(robot, acting)
    bound = current_bounds(robot, acting, len(dt))
    outcome = run_implicit(numbers, voltage, bound, dt, start_state(numbers, twist, current), pose, loop, tol)
    kept = Outcome(outcome.pose[keep], outcome.state.at(keep), outcome.iterations, outcome.steps)
    asked = voltage[keep[:-1]]
    motors = asked if acting.set_point is None else reaching(robot, asked)
    return implicit_run(robot, given, motors, kept, tol, acting, view, asked)


def _on_grid(robot: Robot, acting: Commands) -> tuple[FloatArray, FloatArray, Loop, NDArray[np.intp]]:
    """(dt, voltages to fill or as given, the speed loop, where the rows asked for begin) of what acts."""
    if acting.set_point is None:
        assert acting.voltage is not None
        return acting.dt, acting.voltage.copy(), no_loop(robot.wheels.count), np.arange(len(acting.dt) + 1)
    dt, set_point, tick, keep = on_ticks(robot, acting)
    return dt, np.zeros_like(set_point), loop_of(robot, set_point, tick), keep


def _slipping(
    robot: Robot, given: Commands, acting: Commands, start: tuple[FloatArray, FloatArray, FloatArray], tol: float,
    view: View,
) -> Run:  # fmt: skip
    """Run the engine of wheels that slip from (twist, pose, current), and say which did."""
    numbers = slip_plant(robot)
    numbers.room[:] += (0.0, 0.0) if view.room is None else view.room
    if view.push is not None:
        refuse_push(robot, acting.set_point is not None)
        acting = replace(acting, voltage=_pushed(robot, acting, view))
    dt, voltage, loop, keep = _on_grid(robot, acting)
    begin = rolling(numbers, start[0], start[2])
    out = run_slipping(numbers, voltage, current_bounds(robot, acting, len(dt)), dt, begin, start[1], loop, tol)
    grip = Grip(robot)
    grip.add(out)
    asked = voltage[keep[:-1]]
    motors = asked if acting.set_point is None else reaching(robot, asked)
    turning = out.rims[keep] / robot.wheels.radii
    push = 0.0 if view.push is None else pushing(robot, view.push)  # not of the motors
    current = out.current[keep]
    if robot.motor.electrical != DYNAMIC:
        current = settled_current(robot.motor, _with_last(motors - push), turning)
    done = Done(motors, out.twist[keep], out.pose[keep], None, current, asked, turning)
    how = f"engine of wheels that slip, tol {tol:g} m/s" if tol else "engine of wheels that slip, fixed step"
    return as_run(robot, given, acting, done, how, grip.statements, view)


def implicit_run(
    robot: Robot, given: Commands, voltage: FloatArray, outcome: Outcome, tol: float, acting: Commands | None = None,
    view: View = PLAIN, asked: FloatArray | None = None,
) -> Run:  # fmt: skip
    """The Run of what the implicit engine found at the samples of a view, its warnings included.

    acting: the commands as they reached the motors; None: as given. voltage [V]: at the motors then. asked: by a speed
    loop; None: the same.
    """
    how = f"implicit engine, tol {tol:g} m/s" if tol else "implicit engine, fixed step"
    stopped, rows = capped(outcome), len(outcome.iterations)
    warnings = (not_converged(stopped, rows),) if stopped else ()
    twists = outcome.state.x / [1.0, 1.0, plant(robot).body.length]
    done = Done(voltage, twists, outcome.pose, outcome, asked=asked)
    return as_run(robot, given, acting or given, done, how, warnings, view)


class Done(NamedTuple):
    """What a simulation found: voltage [V] at the motors over each step; twist, pose and current at each sample.

    outcome: of the implicit engine. current: of the exact engine with winding inductance. asked: by a speed loop.
    wheel_speed: where it does not follow from the twist.
    """

    voltage: FloatArray
    twist: FloatArray
    pose: FloatArray
    outcome: Outcome | None = None
    current: FloatArray | None = None
    asked: FloatArray | None = None
    wheel_speed: FloatArray | None = None


def as_run(
    robot: Robot, given: Commands, acting: Commands, done: Done, engine: str, warnings: tuple[Statement, ...],
    view: View = PLAIN,
) -> Run:  # fmt: skip
    """The Run of a simulation: what the instruments of the robot would have recorded, as a view shows it."""
    dt, n = given.dt, robot.wheels.count
    t = np.arange(len(dt) + 1) * dt[0] if np.all(dt == dt[0]) else np.concatenate([[0.0], np.cumsum(dt)])
    turning, outcome = wheel_speed(robot.wheels, done.twist), done.outcome
    turning = turning if done.wheel_speed is None else done.wheel_speed
    if outcome is not None:  # a wheel that sticks is at rest, to the last bit
        turning[outcome.state.each["sign"][:, N_AXES : N_AXES + n] == 0.0] = 0.0
    if done.current is not None:
        current = done.current
    elif outcome is not None and robot.motor.electrical == DYNAMIC:
        current = outcome.state.each["current"][:, N_AXES : N_AXES + n]
    else:
        current = settled_currents(robot, done.twist, _with_last(done.voltage))
    if acting.open_circuit is not None:
        current = np.where(_with_last(acting.open_circuit), 0.0, current)
    if given.voltage is None:  # a speed loop makes it, at its own ticks
        voltage = view.of("voltage", _with_last(done.voltage if done.asked is None else done.asked))
    else:
        voltage = _with_last(given.voltage)
    return Run(
        t=t,
        voltage=voltage,
        duty=None if given.duty is None else _with_last(given.duty),
        current=view.of("current", current),
        wheel_speed=view.of("wheel_speed", turning),
        wheel_speed_command=None if given.set_point is None else _with_last(given.set_point),
        twist=view.of("twist", done.twist),
        twist_command=None if given.twist is None else _with_last(given.twist),
        pose=np.hstack([view.of("position", done.pose[:, :2]), view.of("heading", done.pose[:, 2:])]),
        supply=None if given.supply is None else _with_last(given.supply),
        source=f"simulated: {robot.name}, {engine}",
        warnings=given.warnings + warnings,
    )


def _with_last(rows: NDArray) -> NDArray:
    """Input rows as samples: the last one repeats."""
    return np.concatenate([rows, rows[-1:]])
