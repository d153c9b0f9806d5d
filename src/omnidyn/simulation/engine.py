"""Engines by the contract of contract.py, and `choose_engine`, which picks one."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arguments import is_number
from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError, UnsupportedError
from omnidyn.model.actuation import reaching
from omnidyn.model.dynamics import drive_wrench, linear_part
from omnidyn.model.layout import N_AXES
from omnidyn.model.motor import DYNAMIC
from omnidyn.model.robot import Robot
from omnidyn.model.stick_slip.plant import plant
from omnidyn.model.stick_slip.release import start_state
from omnidyn.simulation.commands import Commands, as_floats, current_bounds, loop_gains, on_ticks, phase
from omnidyn.simulation.contract import Conditions, Engine, Motion
from omnidyn.simulation.coulomb.door import moved, run, run_looped
from omnidyn.simulation.exact.exact_march import ExactMarch, why_not_exact
from omnidyn.simulation.exact.inductance import simulate_exact_inductance
from omnidyn.simulation.grip import Grip, not_converged
from omnidyn.simulation.implicit.implicit_march import Outcome, capped, march_workspace, run_implicit
from omnidyn.simulation.slip.plant import slip_plant
from omnidyn.simulation.slip.slip_march import rolling, run_slipping
from omnidyn.simulation.speed_loop import LoopSettings, loop_of, no_loop
from omnidyn.simulation.travel import PATH
from omnidyn.statement import Statement

TOLERANCE = 1e-6
# Beyond these a step has no meaning and the implicit engine no end: [m/s, rad/s], [m, rad], [A].
LARGEST_START = {"twist": 1e3, "pose": 1e9, "current": 1e6}


def choose_engine(robot: Robot, conditions: Conditions, tol: float | None = TOLERANCE) -> Engine:
    """The engine that moves a robot in these conditions.

    tol: global error of an engine that is not exact [m/s], None for a fixed step a row. Raises InputError where it lies
    outside 1e-10..1 m/s, UnsupportedError for a push on wheels that may slip behind a speed loop.
    """
    tolerance = as_tolerance(tol)  # refused for any engine: which one runs is not what the caller chose
    conditions = conditions._replace(fixed=tolerance == 0.0)
    return next(engine for engine in ENGINES if engine.serves(robot, conditions))(robot, conditions, tolerance)


class _PaperLaw:
    """What the two engines of the paper's law share."""

    name = "exact engine"

    def statements(self, state: Any) -> tuple[Statement, ...]:
        """A closed form has nothing to warn of."""
        return ()


def _follows_paper(robot: Robot, conditions: Conditions) -> bool:
    """Whether a robot moves by the paper's law under voltages that are given."""
    under_voltages = not (conditions.speed_loop or conditions.coasting or conditions.tilt)
    return under_voltages and not why_not_exact(robot)


class Exact(_PaperLaw):
    """The paper's law, currents settled. State: twist, pose."""

    def __init__(self, robot: Robot, conditions: Conditions, tol: float) -> None:
        self._march = ExactMarch(robot)
        self._push = push_voltage(robot, conditions) if conditions.push else None

    @staticmethod
    def serves(robot: Robot, conditions: Conditions) -> bool:
        """Without winding inductance."""
        return robot.motor.electrical != DYNAMIC and _follows_paper(robot, conditions)

    def start(self, twist: FloatArray, pose: FloatArray, current: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Currents follow from the twist."""
        return twist, pose

    def advance(self, state: tuple[FloatArray, FloatArray], commands: Commands) -> Motion:
        """By closed forms, row by row."""
        assert commands.voltage is not None
        volts = commands.voltage if self._push is None else commands.voltage + self._push
        twists, poses = self._march.run(volts, commands.dt, *state)
        return Motion((twists[-1], poses[-1]), twists, poses, commands.voltage)


class ExactInductance(_PaperLaw):
    """The paper's law with winding inductance. State: twist, pose, current."""

    def __init__(self, robot: Robot, conditions: Conditions, tol: float) -> None:
        self._robot = robot

    @staticmethod
    def serves(robot: Robot, conditions: Conditions) -> bool:
        """With winding inductance and without a push, which volts cannot stand for there."""
        return robot.motor.electrical == DYNAMIC and not conditions.push and _follows_paper(robot, conditions)

    def start(self, twist: FloatArray, pose: FloatArray, current: FloatArray) -> tuple[FloatArray, ...]:
        """All three are remembered."""
        return twist, pose, current

    def advance(self, state: tuple[FloatArray, FloatArray, FloatArray], commands: Commands) -> Motion:
        """By closed forms, row by row."""
        assert commands.voltage is not None
        twists, poses, currents = simulate_exact_inductance(self._robot, commands.voltage, commands.dt, *state)
        return Motion((twists[-1], poses[-1], currents[-1]), twists, poses, commands.voltage, current=currents)


class Stepped(NamedTuple):
    """A state of an engine that solves steps, `motion` being its own. now [s]: since the last tick of the speed loop;
    asked [V], total [V]: its voltages and its integrals, shape (wheels,); count: what the solver met."""

    motion: Any
    pose: FloatArray
    now: float
    asked: FloatArray
    total: FloatArray
    count: Any


class _SolverRows(NamedTuple):
    """Commands on the grid of the solver. first: where the rows asked for begin; keep: that, and the end."""

    dt: FloatArray
    voltage: FloatArray
    bound: FloatArray
    loop: LoopSettings
    first: Any = slice(None)
    keep: Any = slice(None)


class _Stepping:
    """What the engines share that solve steps: the grid of the speed loop, and the voltages that it makes."""

    kind: str

    def __init__(self, robot: Robot, conditions: Conditions, tol: float) -> None:
        n = robot.wheels.count
        self._robot, self._tol = robot, tol
        self._loop = loop_of(robot, np.zeros((0, n)), np.zeros(0, np.bool_)) if conditions.speed_loop else no_loop(n)
        self.name = named(self.kind, tol)

    def _begin(self, motion: Any, pose: FloatArray, count: Any) -> Stepped:
        return Stepped(motion, pose, 0.0, np.zeros_like(self._loop.sum), self._loop.sum, count)

    def _rows(self, state: Stepped, commands: Commands) -> _SolverRows:
        """The rows to solve, their voltages yet to be filled by a speed loop: a tick cuts a row."""
        if commands.set_point is None:
            assert commands.voltage is not None
            bound = current_bounds(self._robot, commands, len(commands.dt))
            return _SolverRows(commands.dt, commands.voltage.copy(), bound, self._loop)
        dt, set_point, tick, keep = on_ticks(self._robot, commands, state.now)
        voltage = np.zeros_like(set_point)
        voltage[-1] = state.asked  # a row before the first tick takes the voltage of the row before it: the last one
        loop = self._loop._replace(command=set_point, tick=tick, sum=state.total.copy())
        bound, first = current_bounds(self._robot, commands, len(dt)), keep[:-1]
        if len(first) == 1:
            first = keep = slice(None, None, len(dt))  # a view, where indices make copies
        return _SolverRows(dt, voltage, bound, loop, first, keep)

    def _after(self, state: Stepped, motion: Any, pose: FloatArray, rows: _SolverRows, count: Any) -> Stepped:
        if not rows.loop.period:
            return Stepped(motion, pose, state.now, state.asked, state.total, count)
        now = phase(self._robot, state.now + float(rows.dt.sum()))
        return Stepped(motion, pose, now, rows.voltage[-1], rows.loop.sum, count)

    def _volts(self, rows: _SolverRows, looped: bool) -> tuple[FloatArray, FloatArray | None]:
        """(the voltages at the motors, those that a speed loop asked for) of each row."""
        if not looped:
            return rows.voltage, None
        loop_volts = rows.voltage[rows.first]
        return reaching(self._robot, loop_volts), loop_volts


class Coulomb(_Stepping):
    """Friction of constant levels on the body axes or along the direction of travel. motion: twist, step [s]."""

    kind = "Coulomb engine"

    def __init__(self, robot: Robot, conditions: Conditions, tol: float) -> None:
        super().__init__(robot, conditions, tol)
        known_robot = moved(plant(robot), [], 1.0)
        assert known_robot is not None
        self._moved, self._push = known_robot, conditions.push

    @staticmethod
    def serves(robot: Robot, conditions: Conditions) -> bool:
        """At a tolerance."""
        if conditions.tilt or conditions.fixed:
            return False
        return robot.wheels.traction_mu is None and moved(plant(robot), [], 1.0) is not None

    def start(self, twist: FloatArray, pose: FloatArray, current: FloatArray) -> Stepped:
        """Currents follow from the twist."""
        return self._begin((twist, np.zeros(1)), pose, None)

    def advance(self, state: Stepped, commands: Commands) -> Motion:
        """By steps that solve an inclusion; see coulomb/run.py."""
        (twist, step), pose, looped = state.motion, state.pose, commands.set_point is not None
        rows, edges = self._rows(state, commands), np.zeros(len(commands.dt) + 1)
        np.cumsum(commands.dt, out=edges[1:])
        step = step.copy() if step[0] else rows.dt[:1].copy()
        start_travel, late = np.array([pose[2], 0.0, 0.0, pose[0], pose[1]]), np.zeros(1)
        if looped:
            gains, none = np.array(loop_gains(self._robot)), np.zeros((0, 4, self._robot.wheels.count))
            run_of_loop = run_looped(
                self._moved,
                gains,
                none,
                rows.loop,
                state.asked,
                edges,
                rows.dt,
                twist,
                step,
                self._tol,
                late,
                start_travel,
                None if self._push is None else np.array(self._push),
            )
            seen = run_of_loop.seen
            rows = rows._replace(voltage=run_of_loop.ask, loop=rows.loop._replace(sum=run_of_loop.sum))
        else:
            push = None if self._push is None else np.tile(self._push, (len(rows.dt), 1))
            seen = run(
                self._moved,
                edges,
                rows.dt,
                rows.voltage,
                twist,
                step,
                self._tol,
                late,
                start_travel,
                push,
                bound=rows.bound,
            )
        twists, poses = seen.twist[0], seen.travel[0][:, [PATH, PATH + 1, 0]]
        twists[0], poses[0] = twist, pose
        volts, loop_volts = self._volts(rows, looped)
        return Motion(self._after(state, (twists[-1], step), poses[-1], rows, None), twists, poses, volts, loop_volts)

    def statements(self, state: Any) -> tuple[Statement, ...]:
        """Its stages are solved to rounding: it has nothing to warn of."""
        return ()


class Implicit(_Stepping):
    """Every robot whose wheels grip. count: rows in which the solver hit its cap, and all rows."""

    kind = "implicit engine"

    def __init__(self, robot: Robot, conditions: Conditions, tol: float) -> None:
        super().__init__(robot, conditions, tol)
        self._plant = plant(robot)
        if conditions.tilt:
            self._plant.body.room += conditions.tilt
        if conditions.push:
            self._plant.body.push += np.array(conditions.push) / [1.0, 1.0, self._plant.body.length]
        self._work, self._units = march_workspace(self._plant), np.array([1.0, 1.0, self._plant.body.length])

    @staticmethod
    def serves(robot: Robot, conditions: Conditions) -> bool:
        """In all conditions."""
        return robot.wheels.traction_mu is None

    def start(self, twist: FloatArray, pose: FloatArray, current: FloatArray) -> Stepped:
        """What moves slides; what rests is decided by the first row."""
        return self._begin(start_state(self._plant, twist, current), pose, (0, 0))

    def advance(self, state: Stepped, commands: Commands) -> Motion:
        """By steps that solve an inclusion."""
        rows = self._rows(state, commands)
        out = run_implicit(
            self._plant, rows.voltage, rows.bound, rows.dt, state.motion, state.pose, rows.loop, self._tol, self._work
        )
        count = state.count[0] + capped(out), state.count[1] + len(out.iterations)
        after = self._after(state, out.state.at(-1), out.pose[-1], rows, count)
        volts, loop_volts = self._volts(rows, commands.set_point is not None)
        row_outcome = (
            out if loop_volts is None else out._replace(pose=out.pose[rows.keep], state=out.state.at(rows.keep))
        )
        return implicit_motion(self._robot, self._units, row_outcome, volts, loop_volts, after)

    def statements(self, state: Stepped) -> tuple[Statement, ...]:
        """Whether the solver gave up its last digits."""
        return cap_warnings(*state.count)


def named(kind: str, tol: float) -> str:
    """An engine of this kind and tolerance, as the source of a Run has it."""
    return f"{kind}, tol {tol:g} m/s" if tol else f"{kind}, fixed step"


def cap_warnings(capped_rows: int, rows: int) -> tuple[Statement, ...]:
    """That the solver hit its cap in some of so many rows; nothing where it hit it in none."""
    return (not_converged(capped_rows, rows),) if capped_rows else ()


def implicit_motion(
    robot: Robot,
    units: FloatArray,
    outcome: Outcome,
    voltage: FloatArray,
    loop_volts: FloatArray | None = None,
    state: Any = None,
) -> Motion:
    """The Motion of an outcome of the implicit engine.

    Args:
        robot: that moved.
        units: of a state in those of a twist; its yaw rate is a speed at the length of the plant. Shape (3,).
        outcome: of the kernel.
        voltage, asked, state: as Motion has them.
    """
    states, wheels = outcome.state, slice(N_AXES, N_AXES + robot.wheels.count)
    current = states.each["current"][:, wheels] if robot.motor.electrical == DYNAMIC else None
    stuck = states.each["sign"][:, wheels] == 0.0
    return Motion(state, states.x / units, outcome.pose, voltage, loop_volts, current, stuck=stuck)


class Slipping(_Stepping):
    """Robots whose wheels may slip. count: a Grip."""

    kind = "engine of wheels that slip"

    def __init__(self, robot: Robot, conditions: Conditions, tol: float) -> None:
        super().__init__(robot, conditions, tol)
        if conditions.push and conditions.speed_loop:
            raise UnsupportedError(
                "a push on a robot whose wheels may slip is simulated as volts, and a speed loop makes its own",
                got=f'drive = "{robot.drive.kind}"',
                expected="voltages or duties",
                where=robot.name,
                remedy="leave the push out, or [wheels] traction_mu",
            )
        self._plant, self._push = slip_plant(robot), push_voltage(robot, conditions)
        if conditions.tilt:
            self._plant.room[:] += conditions.tilt

    @staticmethod
    def serves(robot: Robot, conditions: Conditions) -> bool:
        """In all conditions."""
        return robot.wheels.traction_mu is not None

    def start(self, twist: FloatArray, pose: FloatArray, current: FloatArray) -> Stepped:
        """Every wheel grips."""
        return self._begin(rolling(self._plant, twist, current), pose, Grip.none(self._robot.wheels.count))

    def advance(self, state: Stepped, commands: Commands) -> Motion:
        """By steps that solve an inclusion, a wheel at a time."""
        rows, robot = self._rows(state, commands), self._robot
        rows.voltage[:] += self._push
        out = run_slipping(
            self._plant, rows.voltage, rows.bound, rows.dt, state.motion, state.pose, rows.loop, self._tol
        )
        volts, loop_volts = self._volts(rows, commands.set_point is not None)
        after = self._after(state, out.state[-1], out.pose[-1], rows, state.count.with_run(out))
        current = out.current[rows.keep] if robot.motor.electrical == DYNAMIC else None
        turning = out.rims[rows.keep] / robot.wheels.radii
        return Motion(
            after, out.twist[rows.keep], out.pose[rows.keep], volts - self._push, loop_volts, current, turning
        )

    def statements(self, state: Stepped) -> tuple[Statement, ...]:
        """Which wheels slipped, or left the ground."""
        return state.count.statements(self._robot)


ENGINES: tuple[type[Engine], ...] = (Exact, ExactInductance, Coulomb, Implicit, Slipping)


def push_voltage(robot: Robot, conditions: Conditions) -> FloatArray:
    """The least volts that push the body at rest as hard as what pushes from outside. Shape (wheels,)."""
    if conditions.push is None:
        return np.zeros(robot.wheels.count)
    per_volt = drive_wrench(linear_part(robot), np.zeros(3), np.eye(robot.wheels.count)).T
    return np.asarray(np.linalg.lstsq(per_volt, np.array(conditions.push), rcond=None)[0], dtype=float)


def as_tolerance(tol: float | None) -> float:
    """The tolerance [m/s], 0 for None: a fixed step a row. Raises InputError outside 1e-10..1 m/s."""
    if tol is None:
        return 0.0
    if not is_number(tol) or not 1e-10 <= tol <= 1.0:
        raise InputError(
            "tolerance out of range",
            got=tol,
            expected="1e-10 to 1 m/s, or None for a fixed step",
            remedy="leave `tol` out",
            where="tol",
        )
    return float(tol)


def as_start(name: str, value: ArrayLike, size: int) -> FloatArray:
    """A twist, pose or current to start with, shape (size,). Raises InputError for what no robot starts with."""
    array = as_floats(name, value)
    if array.shape != (size,) or not np.isfinite(array).all():
        raise InputError("cannot start there", got=value, expected=f"{size} finite numbers", where=name)
    if (np.abs(array) > LARGEST_START[name]).any():
        expected = f"{size} numbers within -{LARGEST_START[name]:g} to {LARGEST_START[name]:g}, in SI units"
        raise InputError("no robot starts there", got=value, expected=expected, where=name)
    return array
