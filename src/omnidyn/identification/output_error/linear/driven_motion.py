"""How a small force on the body shows in what a log holds: the motion of the fitted robot, and its linear answer.

A force that no law of the model describes changes the twist by M d' = f + (dF/dv) d where the robot moves, and not at
all where friction holds it. The answer is a direction to look in, not a prediction: it is exact to first order in the
length of a row.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.identification.output_error.engines.driver import driver_of
from omnidyn.identification.output_error.problem.heading import HEADING, facing_at_start
from omnidyn.identification.output_error.problem.observation.observation import Along
from omnidyn.identification.output_error.problem.observation.observations import OBSERVATIONS
from omnidyn.identification.output_error.problem.problem import Piece, Point, Problem
from omnidyn.model.actuation import Driver, at_motors, without_map
from omnidyn.model.drive import SPEED
from omnidyn.model.dynamics import acceleration
from omnidyn.model.layout import N_AXES, YAW
from omnidyn.model.mass import mass_matrix
from omnidyn.model.motor import per_wheel, settled_current
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import wheel_speed
from omnidyn.simulation.simulate import simulate

SMALL = 1e-4  # [m/s, rad/s] of a change of speed for a slope
SLIPS = 1e-6  # [m/s] between the rim of a wheel and the floor under it


@dataclass(frozen=True, eq=False)
class DrivenMotion:
    """A piece as the fitted robot drives it. t (n,); twist (n, 3), pose (n, 3); voltage (n, W) at the motors from each
    row on, current (n, W); share (n,): of the run that has gone by; decay (n - 1, S, S), gain (n - 1, S, 3): of a
    change of the twist, and per force, over a row; behind a speed loop with an integral S is 6, for the way of the
    change is what its integral gathers, else 3; rolls (n, W): whether a wheel does, or slips."""

    piece: Piece
    robot: Robot
    t: FloatArray
    twist: FloatArray
    pose: FloatArray
    voltage: FloatArray
    current: FloatArray
    share: FloatArray
    decay: FloatArray
    gain: FloatArray
    rolls: BoolArray

    @cached_property
    def pace(self) -> FloatArray:
        """The change of the twist over each row, a second; 0 over the last. Shape (n, 3)."""
        return np.append(np.diff(self.twist, axis=0) / np.diff(self.t)[:, None], np.zeros((1, N_AXES)), axis=0)

    @cached_property
    def turned(self) -> FloatArray:
        """How far each wheel has turned since the first row [rad]. Shape (n, W)."""
        travel = 0.5 * (self.twist[1:] + self.twist[:-1]) * np.diff(self.t)[:, None]
        angles = np.cumsum(travel @ self.robot.wheels.wrench_matrix, axis=0) / self.robot.wheels.radii
        return np.append(np.zeros_like(angles[:1]), angles, axis=0)

    def twist_by(self, force: FloatArray) -> FloatArray:
        """The change of the twist by forces [N, N, N m] from each row on. Shapes (n, K, 3) -> (n, K, 3)."""
        twist_changes = np.einsum("nij,nkj->nki", self.gain, force[:-1])
        responses = np.zeros((len(force), *twist_changes.shape[1:]))
        for k in range(len(self.decay)):
            responses[k + 1] = responses[k] @ self.decay[k].T + twist_changes[k]
        return responses[..., :N_AXES]

    def under(self, voltage: FloatArray, dt: FloatArray, row: int) -> FloatArray:
        """The twist of the fitted robot from a row on, other voltages (m, W) held for dt (m,). Shape (m + 1, 3)."""
        pose = (0.0, 0.0, self.pose[row, YAW])
        run = simulate(_ideal(self.robot), voltage, dt, twist=self.twist[row], pose=pose)
        assert run.twist is not None
        return run.twist

    def shown_by(self, force: FloatArray) -> FloatArray:
        """What the columns of the log show of such forces. Shapes (n, K, 3) -> (C, n, K)."""
        return self.shown(self.twist_by(force))

    def shown(self, change: FloatArray) -> FloatArray:
        """What the columns show of a change of the twist (n, K, 3). Shape (C, n, K)."""
        columns = self.piece.record.columns
        along = Along(self.robot, self.t, self.twist, self.pose, self.rolls)
        names = dict.fromkeys(name for name, _ in columns)
        channels = {name: OBSERVATIONS[name].changed(along, change) for name in names}
        return np.stack([channels[name][..., i] for name, i in columns])


def in_the_room(motion: DrivenMotion) -> FloatArray:
    """Forces on the centre of mass along x and along y of the room, as the body feels them. Shape (n, 2, 3)."""
    c, s = np.cos(motion.pose[:, YAW]), np.sin(motion.pose[:, YAW])
    x, y = motion.robot.body.centre
    return np.stack([np.stack([c, -s, -x * s - y * c], axis=1), np.stack([s, c, x * c - y * s], axis=1)], axis=1)


def motions(problem: Problem, point: Point) -> list[DrivenMotion]:
    """The motion of every piece at a point."""
    robot, (driver, _) = problem.robot_at(point.values), driver_of(problem, point.values)
    return [_motion(piece, robot, state, driver) for piece, state in zip(problem.pieces, point.states, strict=True)]


def _motion(piece: Piece, robot: Robot, state: FloatArray, driver: Driver) -> DrivenMotion:
    record, rows = piece.record, slice(piece.first, piece.last)
    t, faces = record.t[piece.first : piece.last + 1], facing_at_start(piece, robot)
    if HEADING in record.columns:
        faces = float(state[N_AXES + record.columns.index(HEADING)])
    if record.set_point is None:
        requested_voltage, _ = at_motors(record.voltage[rows], record.share[rows], driver)
        run = simulate(_ideal(robot), requested_voltage, np.diff(t), twist=state[:N_AXES], pose=(0.0, 0.0, faces))
    else:
        run = simulate(robot, dt=np.diff(t), wheel_speed_command=record.set_point[rows], pose=(0.0, 0.0, faces))
    assert run.twist is not None
    assert run.pose is not None
    assert run.voltage is not None
    assert run.wheel_speed is not None
    rolls = np.abs(run.wheel_speed - wheel_speed(robot.wheels, run.twist)) * robot.wheels.radii < SLIPS
    decay, gain = _answers(robot, run.twist, run.voltage, np.diff(t), rolls)
    current = settled_current(robot.motor, run.voltage, run.wheel_speed)
    share = record.share[piece.first : piece.last + 1]
    return DrivenMotion(piece, robot, t, run.twist, run.pose, run.voltage, current, share, decay, gain, rolls)


def _ideal(robot: Robot) -> Robot:
    """The robot behind its driver, whose map, dead band and latency were taken off the voltages."""
    drive = robot.drive.model_copy(update={"dead_band": 0.0, "latency": 0.0})
    return without_map(robot.model_copy(update={"drive": drive}))


def _answers(
    robot: Robot, twist: FloatArray, voltage: FloatArray, dt: FloatArray, rolls: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """(decay, gain) of every row, by the trapezoidal rule; an axis that rests at both ends of a row stays at rest."""
    slips = ~rolls[1:] | ~rolls[:-1]
    robot = robot.model_copy(update={"wheels": robot.wheels.model_copy(update={"traction_mu": None})})
    middle, held_voltage = 0.5 * (twist[1:] + twist[:-1]), voltage[:-1]
    resting_axes = (twist[1:] == 0.0) & (twist[:-1] == 0.0)
    rate = np.empty((len(middle), N_AXES, N_AXES))
    for axis in range(N_AXES):
        change = SMALL * np.eye(N_AXES)[axis]
        upper, lower = (
            acceleration(robot, middle + change, held_voltage),
            acceleration(robot, middle - change, held_voltage),
        )
        rate[:, :, axis] = (upper - lower) / (2.0 * SMALL)
    per_force = np.array(np.broadcast_to(np.linalg.inv(mass_matrix(robot)), rate.shape), dtype=float)
    integral_gain = np.zeros((N_AXES, N_AXES))
    if robot.drive.kind == SPEED:
        kp, ki = (per_wheel(loop_gain or 0.0, robot.wheels.count) for loop_gain in (robot.drive.kp, robot.drive.ki))
        rate -= np.einsum("aw,wb->ab", *_by_speed(robot, kp))
        integral_gain = np.einsum("aw,wb->ab", *_by_speed(robot, ki))
    if slips.any():  # whose push does not depend on the speed
        emf_by_wheel, turns = _by_speed(robot, per_wheel(robot.motor.emf_constant, robot.wheels.count))
        ratio = per_wheel(robot.motor.gear_ratio, robot.wheels.count)
        rate += np.einsum("aw,nw,wb->nab", emf_by_wheel * ratio, slips, turns)
    rate[resting_axes[:, :, None] | resting_axes[:, None, :]] = 0.0
    per_force[resting_axes] = 0.0
    # What crosses zero within a row jumps in its friction, not in its slope: no rate may be faster than a row.
    h = dt[:, None, None]
    size = np.abs(rate * h).max(axis=(1, 2))
    rate *= np.minimum(1.0, 1.0 / np.maximum(size, 1e-12))[:, None, None]
    if integral_gain.any():
        rate, per_force, resting_axes = _with_integral(rate, per_force, resting_axes, integral_gain)
    identity = np.eye(rate.shape[1])
    inverse = np.linalg.inv(identity - 0.5 * h * rate)
    decay = inverse @ (identity + 0.5 * h * rate)
    decay[resting_axes] = 0.0
    return decay, inverse @ (h * per_force)


def _with_integral(
    rate: FloatArray, per_force: FloatArray, resting_axes: BoolArray, integral_gain: FloatArray
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """The same with the way p of the change d beside it: d' = rate d - integral_gain p + f/M, p' = d. At rest both are
    0."""
    n = len(rate)
    block_rate = np.zeros((n, 2 * N_AXES, 2 * N_AXES))
    block_rate[:, :N_AXES, :N_AXES], block_rate[:, :N_AXES, N_AXES:] = rate, -integral_gain
    block_rate[:, N_AXES:, :N_AXES] = np.eye(N_AXES)
    resting_states = np.concatenate([resting_axes, resting_axes], axis=1)
    block_rate[resting_states[:, :, None] | resting_states[:, None, :]] = 0.0
    return block_rate, np.concatenate([per_force, np.zeros_like(per_force)], axis=1), resting_states


def _by_speed(robot: Robot, volts: FloatArray) -> tuple[FloatArray, FloatArray]:
    """What motors that lose so many volts per speed of their wheel [V s/rad] add to the damping [1/s]: the product of
    two factors, (3, W) and (W, 3)."""
    g, motor, n = robot.wheels.wrench_matrix, robot.motor, robot.wheels.count
    push = per_wheel(motor.gear_ratio, n) * per_wheel(motor.torque_constant, n)
    push = push / (per_wheel(motor.resistance, n) * robot.wheels.radii)
    return np.linalg.inv(mass_matrix(robot)) @ (g * (push * volts / robot.wheels.radii)), g.T
