"""Derivatives of a simulated run with respect to numbers of the robot file, by the implicit function theorem.

The run is simulated once, by the implicit engine; every stage is differentiated where it was solved. What sticks has
a derivative of exactly 0 along what it holds; a stop, a reversal and a release move with the parameter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from omnidyn.errors import InputError, UnsupportedError
from omnidyn.model.dynamics import settled_currents
from omnidyn.model.keys import Key
from omnidyn.model.layout import ACTIVE, AXES, EFFICIENCY, ELLIPSE, GX, GZ, HOLD, LENGTH, SLIDE, SLIDE_X, SLIDE_Y
from omnidyn.model.motor import DYNAMIC
from omnidyn.model.robot import Robot
from omnidyn.model.stick_slip.plant import Plant, plant
from omnidyn.model.stick_slip.release import new_state, start_state, with_given_currents
from omnidyn.model.stick_slip.workspace import scratch
from omnidyn.run import Run
from omnidyn.simulation.commands import Commands, commands
from omnidyn.simulation.implicit.march import Outcome, begun, room
from omnidyn.simulation.sensitivity.loop import run_tangent_loop
from omnidyn.simulation.sensitivity.march import march_tangent
from omnidyn.simulation.sensitivity.sample import Looks, looks
from omnidyn.simulation.sensitivity.stage import EPS, Ways
from omnidyn.simulation.simulate import TOLERANCE, as_start, as_tolerance, current_bounds, implicit_run

FloatArray = NDArray[np.float64]

RATE = "drive.rate_Hz"


@dataclass(frozen=True, eq=False)
class Derivatives:
    """A run and its derivatives with respect to robot-file keys, in SI units over the unit of the key.

    twist, pose: shape (samples, 3, keys). current [A per unit of the key]: shape (samples, wheels, keys).
    """

    run: Run
    keys: tuple[str, ...]
    twist: FloatArray
    pose: FloatArray
    current: FloatArray


def derivatives(
    robot: Robot, voltage: ArrayLike | None = None, dt: ArrayLike | None = None, keys: Sequence[str] = (), *,
    duty: ArrayLike | None = None, wheel_speed_command: ArrayLike | None = None,
    twist_command: ArrayLike | None = None, supply: ArrayLike | None = None,
    twist: ArrayLike = (0.0, 0.0, 0.0), pose: ArrayLike = (0.0, 0.0, 0.0), tol: float | None = TOLERANCE,
) -> Derivatives:  # fmt: skip
    """Simulate and differentiate with respect to numbers of the robot file, such as "friction.axes.coulomb[1]".

    robot, voltage or duty or set points of a speed loop, dt, supply, twist, pose, tol: as for `simulate`; the implicit
    engine runs whatever the robot. keys: numbers that the robot has, see `Key`. tol None: derivatives of
    the fixed-step map itself.

    They belong to the sequence of starts, stops and reversals that the run shows. Not differentiable, and not seen:
    whether something breaks away at all, a stop that only just happens, an ellipse crossing rest at an angle, a voltage
    exactly at its limit, a tick at which the integral of a speed loop begins or ceases to stand still. At tol 1e-6 a
    derivative of the twist or pose is within 1e-5 of its largest value in the run, within 5e-5 after a release inside a
    row; of a current that has inductance, within 1e-4.
    Raises InputError for what `simulate` refuses, for an unknown key, and for friction or a gear loss that is off;
    UnsupportedError for the rate of a speed loop.
    """

    def applied(robot: Robot) -> Commands:
        return commands(robot, voltage, dt, duty, wheel_speed_command, twist_command, supply)

    ready, given = prepared(robot, keys), applied(robot)
    rows = given.voltage if given.set_point is None else given.set_point
    assert rows is not None
    each = [one.voltage if given.set_point is None else one.set_point for one in map(applied, ready.robots)]
    rates = difference(np.array(each, dtype=float).reshape(-1, *rows.shape))
    return differentiate(
        ready, given, rates, (as_start("twist", twist, 3), as_start("pose", pose, 3)), as_tolerance(tol)
    )


@dataclass(frozen=True, eq=False)
class Prepared:
    """A robot and its keys for any number of runs. robots, plants: up and down each key by EPS scale."""

    robot: Robot
    keys: tuple[str, ...]
    scale: FloatArray
    robots: list[Robot]
    numbers: Plant
    plants: list[Plant]


def prepared(robot: Robot, keys: Sequence[str]) -> Prepared:
    """Raises InputError for an unknown key, and for friction or a gear loss that is off."""
    scale = np.array([_scale(robot, key) for key in keys])
    robots = [_moved(robot, key, s, side) for key, s in zip(keys, scale, strict=True) for side in (1.0, -1.0)]
    numbers, plants = plant(robot), [plant(r) for r in robots]
    for j, key in enumerate(keys):
        refuse_switched_off(key, numbers, plants[2 * j])
    return Prepared(robot, tuple(keys), scale, robots, numbers, plants)


def differentiate(
    ready: Prepared, given: Commands, rates: FloatArray, start: tuple[FloatArray, FloatArray], tol: float,
    settled: float = 0.0, travels: bool = True,
) -> Derivatives:  # fmt: skip
    """`derivatives` of one run.

    rates: derivatives of the voltages or set points, shape (K, rows, n), by key / scale, as are all derivatives up to
    the last line. start: twist and pose. tol: 0 for a fixed step. settled, travels: of a speed loop, see
    `run_tangent_loop`.
    """
    robot, keys, scale, robots = ready.robot, ready.keys, ready.scale, ready.robots
    if given.set_point is not None and RATE in keys:
        raise UnsupportedError(
            "no derivative by the rate of the speed loop", got=RATE, expected="other keys",
            remedy="its ticks would move; try a few rates instead", where="keys",
        )  # fmt: skip
    numbers, plants = ready.numbers, ready.plants
    ways = ways_of(numbers, plants, rates)
    length = numbers.body[LENGTH]
    stretch = difference(np.array([p.body[LENGTH] for p in plants]))
    first = np.zeros((len(keys), AXES + numbers.wheels))
    first[:, 2] = start[0][2] * stretch
    bound = current_bounds(robot, given, len(given.dt))
    if given.set_point is None:
        outcome, ds, dposes = run_tangent(numbers, ways, given, bound, start, first, tol)
        voltage, slopes_of_voltage = given.voltage, rates
    else:
        state = start_state(numbers, start[0], np.zeros(numbers.wheels)), start[1]
        outcome, ds, dposes, voltage, slopes_of_voltage, _ = run_tangent_loop(
            robots, robot, numbers, ways, given, rates, bound[0], state, first, tol, settled, travels
        )
    assert voltage is not None
    run = implicit_run(robot, given, voltage, outcome, tol)
    assert run.twist is not None
    slopes = ds[..., :AXES].copy()
    slopes[..., 2] = (slopes[..., 2] - run.twist[:, 2, None] * stretch) / length
    if robot.motor.electrical == DYNAMIC:
        currents = ds[..., AXES:]
    else:
        currents = _settled(robots, run, slopes, slopes_of_voltage)
    currents = currents * (np.append(bound, bound[-1:], axis=0)[:, None] > 0.0)  # none while a motor coasts
    parts = (np.moveaxis(part, 1, 2) / scale for part in (slopes, dposes, currents))
    return Derivatives(run, keys, *parts)


def run_tangent(
    numbers: Plant, ways: Ways, given: Commands, bound: FloatArray, start: tuple[FloatArray, FloatArray],
    first: FloatArray, tol: float, seen: Looks | None = None,
) -> tuple[Outcome, FloatArray, FloatArray]:  # fmt: skip
    """The run of `run_implicit`, with derivatives of state (rows + 1, K, 3 + n) and pose (rows + 1, K, 3).

    With `seen`, the run is looked at there instead: the derivatives by row are left out, both arrays are empty.
    """
    assert given.voltage is not None
    rows, bare = len(given.dt), with_given_currents(numbers)
    state = start_state(numbers, start[0], np.zeros(numbers.wheels))
    out, kept = begun(rows, state, start[1]), rows + 1 if seen is None else 0
    ds, dposes = np.zeros((kept, *first.shape)), np.zeros((kept, len(first), 3))
    ds[:1] = first
    march_tangent(
        *numbers.copy(), *bare, scratch(), room(state), ways, given.voltage, bound, given.dt, tol, out.pose, out.state,
        out.iterations, out.steps, first, ds, dposes, seen or looks(np.zeros(1), np.zeros(0), AXES, len(first)),
    )  # fmt: skip
    return out, ds, dposes


def ways_of(numbers: Plant, plants: list[Plant], rates: FloatArray) -> Ways:
    """Tables of the plants up and down each key, the robot's own as the last one, and room to work in.

    rates: derivatives of the applied voltages, shape (K, rows, n).
    """
    body = np.array([*(p.body for p in plants), numbers.body])
    element = np.array([*(p.element for p in plants), numbers.element])
    count, n = len(plants) // 2, numbers.wheels
    arm = np.ascontiguousarray(np.swapaxes(difference(element[:-1, :, GX : GZ + 1]), 0, 1))
    work = np.zeros((4, count, AXES + n))
    return Ways(
        body=body, element=element, arm=arm, voltage=rates, scratch=np.array([scratch(), scratch()]),
        lift=np.zeros((3, 6)), held=np.zeros((2, 3), np.int64), point=np.zeros((5, 3)), aim=work[0], middle=work[1],
        half=work[2], state=np.zeros((2, len(new_state(numbers)))), gained=np.zeros(3), carry=np.zeros((3, n)),
        kept=work[3],
    )  # fmt: skip


def difference(values: FloatArray) -> FloatArray:
    """Derivatives from values up (even) and down (odd) each key. Shape (2 K, ...) -> (K, ...)."""
    return np.ascontiguousarray((values[0::2] - values[1::2]) / (2.0 * EPS))


def _settled(robots: list[Robot], run: Run, slopes: FloatArray, dvolts: FloatArray) -> FloatArray:
    """Derivatives of settled currents. Shape (samples, K, wheels)."""
    assert run.twist is not None
    assert run.voltage is not None
    values = []
    for j, robot in enumerate(robots):
        eps, more = EPS * (1 - 2 * (j % 2)), dvolts[j // 2]
        volts = run.voltage + eps * np.concatenate([more, more[-1:]])
        values.append(settled_currents(robot, run.twist + eps * slopes[:, j // 2], volts))
    return np.moveaxis(difference(np.array(values)), 0, 1)


def refuse_switched_off(key: str, numbers: Plant, up: Plant) -> None:
    """Dry friction, or a gear loss, of 0 is not a number to differentiate by: where it is off nothing can stick."""
    levels = np.r_[SLIDE : HOLD + 2, EFFICIENCY]
    off = (numbers.element[:, levels] != up.element[:, levels]).any(axis=1) & (numbers.element[:, ACTIVE] == 0.0)
    ellipse = numbers.body[ELLIPSE] == 2.0 and up.body[SLIDE_X] + up.body[SLIDE_Y] > 0.0
    if off.any() or ellipse:
        raise InputError(
            "cannot differentiate with respect to what is off", got=key, expected="a level that is not 0, a loss",
            remedy="give it a value first", where="keys",
        )  # fmt: skip


def _scale(robot: Robot, key: str) -> float:
    """The size of a parameter, 1 where it is 0: changes are relative to it."""
    return abs(Key.parse(key).get(robot)) or 1.0


def _moved(robot: Robot, key: str, scale: float, side: float) -> Robot:
    """The robot with one number changed a little; not checked, for it may be at the end of its range."""
    place = Key.parse(key)
    return place.set(robot, place.get(robot) + side * EPS * scale, checked=False)
