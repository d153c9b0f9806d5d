"""What a wrong model may leave in the residuals: forces on the body, and faults of what measures, by what they follow.

Each theme is a set of directions; none claims to be the law of anything. Together they span what robots are known to
do: friction that is no line, or not the same both ways, or not alike in all directions of travel; mass and turning;
motors that differ or give way; what changes in the course of a log; where the robot looks; sensors.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.linear.driven_motion import DrivenMotion, in_the_room
from omnidyn.model.layout import N_AXES, YAW

Directions = Callable[[DrivenMotion, FloatArray], FloatArray]  # of a motion and its fastest twist (3,)
Sensors = Sequence[tuple[str, int]]  # (channel, component) of all that the logs show


@dataclass(frozen=True)
class Theme:
    """name: what the misfit follows, in words people read. directions: forces (n, K, 3); None of what is no force:
    what sensors show by themselves."""

    name: str
    directions: Directions | None


def _on_axes(values: list[tuple[int, FloatArray]]) -> FloatArray:
    """Forces (n, K, 3) each along one axis, from (axis, size (n,))."""
    forces = np.zeros((len(values[0][1]), len(values), N_AXES))
    for k, (axis, size) in enumerate(values):
        forces[:, k, axis] = size
    return forces


def _speed(motion: DrivenMotion, top: FloatArray) -> FloatArray:
    """Friction against the speed of each axis: beside the line, curves that fall or rise at any speed."""
    terms = []
    for axis in range(N_AXES):
        side, share = np.sign(motion.twist[:, axis]), np.abs(motion.twist[:, axis]) / top[axis]
        terms += [(axis, side), (axis, side * share), (axis, side * share**2)]
        terms += [(axis, side * np.exp(-share / width)) for width in (0.03, 0.1, 0.3)]
    return _on_axes(terms)


def _one_way(motion: DrivenMotion, top: FloatArray) -> FloatArray:
    """Forces that do not turn with the direction: a slope, more friction forwards than backwards."""
    shares = np.abs(motion.twist) / top
    sizes = np.ones_like(shares), (shares > 0.0).astype(float), shares
    return _on_axes([(axis, size[:, axis]) for axis in range(N_AXES) for size in sizes])


def _travel(motion: DrivenMotion, top: FloatArray) -> FloatArray:
    """Friction along one axis that depends on the motion along the others."""
    x, y, w = (motion.twist / top).T
    size = np.hypot(motion.twist[:, 0], motion.twist[:, 1])
    moving = np.where(size > 0.0, size, 1.0)
    c, s = motion.twist[:, 0] / moving, motion.twist[:, 1] / moving
    turns, absolute_w = np.sign(w), np.abs(w)
    terms = [
        (0, c),
        (1, s),
        (0, c**3),
        (1, s**3),
        (0, np.sign(x) * absolute_w),
        (1, np.sign(y) * absolute_w),
        (0, np.sign(x) * (absolute_w > 0.0)),
        (1, np.sign(y) * (absolute_w > 0.0)),
        (YAW, turns * (size > 0.0)),
        (YAW, turns * np.hypot(x, y)),
        (YAW, turns * c**2),
        (0, y),
        (1, x),
        (0, np.sign(y)),
        (1, np.sign(x)),
        (YAW, x),
        (YAW, y),
        (YAW, np.sign(x)),
        (YAW, np.sign(y)),
        (0, w),
        (1, w),
        (0, turns),
        (1, turns),
    ]
    return _on_axes(terms)


def _wheels(motion: DrivenMotion, top: FloatArray) -> FloatArray:
    """Friction and drag of single wheels."""
    g = motion.robot.wheels.wrench_matrix
    rim = motion.twist @ g
    at_rim = np.concatenate([np.sign(rim), rim / max(float(np.abs(rim).max()), 1e-12)], axis=1)
    return at_rim[:, :, None] * np.concatenate([g, g], axis=1).T


def _acceleration(motion: DrivenMotion, top: FloatArray) -> FloatArray:
    """Mass and inertia that are other than said, and the terms of a turning frame."""
    x, y, w = motion.twist.T
    terms = [(axis, motion.pace[:, source_axis]) for axis in range(N_AXES) for source_axis in range(N_AXES)]
    return _on_axes([*terms, (0, w * y), (1, w * x), (0, w**2), (1, w**2), (0, w * np.abs(w)), (1, w * np.abs(w))])


def _inputs(motion: DrivenMotion, top: FloatArray) -> FloatArray:
    """Motors and drivers that give more or less than said: each, by its voltage, its current and what all draw."""
    g, u, i = motion.robot.wheels.wrench_matrix, motion.voltage, motion.current
    voltage_limit, peak = (max(float(np.abs(values).max()), 1e-12) for values in (u, i))
    draw = np.abs(i).sum(axis=1, keepdims=True) / peak
    share, load = u / voltage_limit, i / peak
    motor_forces = np.concatenate([share, np.sign(u)], axis=1)[:, :, None] * np.concatenate([g, g], axis=1).T
    total_forces = np.stack(
        [
            (share * np.abs(share)) @ g.T,
            (share * draw) @ g.T,
            (load * np.abs(load)) @ g.T,
            np.sign(i) @ g.T,
            (np.sign(i) * np.maximum(np.abs(load) - 0.5, 0.0)) @ g.T,
            load @ g.T,
            (np.sign(u) * np.exp(-np.abs(share) / 0.15)) @ g.T,
        ],
        axis=1,
    )
    dry = np.sign(motion.twist) * (np.abs(load) @ np.abs(g).T)  # friction that grows with what the gears carry
    return np.concatenate([motor_forces, total_forces, _on_axes([(a, dry[:, a]) for a in range(N_AXES)])], axis=1)


def _time(motion: DrivenMotion, top: FloatArray) -> FloatArray:
    """What is not the same at the end of the log as at its start: friction, mass, supply."""
    tau = 2.0 * motion.share - 1.0
    shapes = tau, tau**2, np.sign(tau)
    sizes = np.sign(motion.twist), motion.twist / top
    friction = [(a, size[:, a] * shape) for shape in shapes for size in sizes for a in range(N_AXES)]
    drive = (motion.voltage @ motion.robot.wheels.wrench_matrix.T) / max(float(np.abs(motion.voltage).max()), 1e-12)
    supply = np.stack([drive * shape[:, None] for shape in shapes], axis=1)
    return np.concatenate([_on_axes(friction), supply], axis=1)


def _angles(motion: DrivenMotion, top: FloatArray) -> FloatArray:
    """What comes back with every turn of a wheel: an eccentric wheel, a bent axle, teeth. On force and on speed."""
    g = motion.robot.wheels.wrench_matrix
    return np.concatenate(
        [wave(n * motion.turned)[:, :, None] * g.T for n in (1.0, 2.0) for wave in (np.cos, np.sin)], axis=1
    )


def _sensors(motion: DrivenMotion, sensors: Sensors) -> FloatArray:
    """Sensors that show more or less, later or one-sided: each by itself, also one of other logs. Shape (C, n, K)."""
    speed, dt = motion.shown(motion.twist[:, None, :])[:, :, 0], np.diff(motion.t)
    columns = np.zeros((len(speed), len(motion.t), 4 * len(sensors)))
    for c, (sensor, values) in enumerate(zip(motion.piece.record.columns, speed, strict=True)):
        first = 4 * sensors.index(sensor)
        pace = np.zeros_like(values)
        pace[1:-1] = (values[2:] - values[:-2]) / (dt[1:] + dt[:-1])
        largest_value = max(float(np.abs(values).max()), 1e-12)
        columns[c, :, first : first + 4] = np.stack(
            [values, pace, np.abs(values), values * np.abs(values) / largest_value], axis=1
        )
    return columns


THEMES = (
    Theme("the speed", _speed),
    Theme("which way an axis moves", _one_way),
    Theme("the direction of travel", _travel),
    Theme("the speed of single wheels", _wheels),
    Theme("the acceleration", _acceleration),
    Theme("voltages and currents", _inputs),
    Theme("the time in the log", _time),
    Theme("the heading in the room", lambda motion, _: in_the_room(motion)),
    Theme("the angle of the wheels", _angles),
    Theme("what each sensor shows", None),
)


def shown_by_themes(
    motion: DrivenMotion, top: FloatArray, sensors: Sensors, themes: Sequence[Theme] = THEMES
) -> tuple[FloatArray, list[int]]:
    """(what all directions of all themes show of a motion (C, n, K), how many of the K each theme has)."""
    forces = [theme.directions(motion, top) for theme in themes if theme.directions is not None]
    ends = np.cumsum([force.shape[1] for force in forces])[:-1]
    force_columns = iter(np.split(motion.shown_by(np.concatenate(forces, axis=1)), ends, axis=2) if forces else ())
    columns = [_sensors(motion, sensors) if theme.directions is None else next(force_columns) for theme in themes]
    return np.concatenate(columns, axis=2), [column.shape[2] for column in columns]
