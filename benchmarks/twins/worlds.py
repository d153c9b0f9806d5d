"""Worlds with known numbers, and their logs: plain NumPy loops, and nothing of omnidyn in them.

Each world makes several logs of one robot as CSV files and knows the numbers that made them. Friction sticks by a
clamp: the force that would stop the mass within the step is taken where it is no larger than what friction can hold.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
FINE = 1e-4  # [s], of what happens between rows


@dataclass(frozen=True)
class Twin:
    """logs: of one robot, the first to fit, the others to predict. robot: text of its file, as a user would have it,
    or "". truth: name -> number."""

    logs: Sequence[Path]
    truth: dict[str, float]
    robot: str = ""
    arguments: Sequence[str] = field(default=())


def write(path: Path, columns: dict[str, Array]) -> Path:
    """A CSV file of columns of equal length."""
    table = np.column_stack(list(columns.values()))
    np.savetxt(path, table, delimiter=",", header=",".join(columns), comments="", fmt="%.9g")
    return path


# --- one axis or motor: (1/gain) v' = u - offset - viscous v - coulomb sgn v


@numba.njit(cache=True)
def _moved(v, u, gain, viscous, front, back, left):
    """(way, speed) after a time under a constant drive, in closed form, stops and reversals within it included."""
    way = 0.0
    for _ in range(3):
        if v == 0.0 and -back <= u <= front:
            return way, 0.0
        ahead = v > 0.0 or (v == 0.0 and u > front)
        end, rate = (u - (front if ahead else -back)) / viscous, gain * viscous
        after = end + (v - end) * math.exp(-rate * left)
        if (after >= 0.0) == ahead or after == 0.0:
            return way + end * left + (v - after) / rate, after
        time = math.log1p(-v / end) / rate
        way, left, v = way + end * time + v / rate, left - time, 0.0
    return way, v


@numba.njit(cache=True)
def axis_run(u, step, gain, viscous, front, back):
    """(position, speed) at the begin of each step from rest; u is what drives, Coulomb `front` for v > 0."""
    x, v = np.zeros(len(u)), np.zeros(len(u))
    for k in range(len(u) - 1):
        way, v[k + 1] = _moved(v[k], u[k], gain, viscous, front, back, step)
        x[k + 1] = x[k] + way
    return x, v


@numba.njit(cache=True)
def _servo(target, rate, row, gain, viscous, coulomb, offset, p, d):
    """(input of each row, position at each row): a cascade of position and speed loops that acts once a row."""
    rows = len(target)
    u, seen = np.zeros(rows), np.zeros(rows)
    x, v, before = 0.0, 0.0, 0.0
    for k in range(rows):
        seen[k] = x
        speed = (x - before) / row if k else 0.0
        before = x
        u[k] = d * (p * (target[k] - x) + rate[k] - speed)
        way, v = _moved(v, u[k] - offset, gain, viscous, coulomb, coulomb, row)
        x += way
    return u, seen


def offset_axis(folder: Path, seed: int) -> Twin:
    """A positioning axis at 1 kHz under a position loop, with dry friction and a constant force [V of its input]."""
    rng = np.random.default_rng(seed)
    row = 1e-3
    mass, viscous, coulomb = rng.uniform(2.0, 4.0), rng.uniform(4.0, 8.0), rng.uniform(0.3, 0.8)
    offset = 0.09 * rng.choice([-1.0, 1.0]) * rng.uniform(0.8, 1.2)
    logs = []
    for k, size in enumerate((0.25, 0.12)):
        t, target, rate = _trapezoids(rng, 25.0, row, size)
        u, x = _servo(target, rate, row, 1.0 / mass, viscous, coulomb, offset, 20.0, 60.0 * mass / 3.0)
        x = np.round((x + 1e-6 * rng.standard_normal(len(x))) / 1e-6) * 1e-6
        logs.append(write(folder / f"axis{k}.csv", {"t_s": t, "u1_V": u, "a1_rad": x}))
    truth = {"inertia": mass, "viscous": viscous, "coulomb": coulomb, "offset": offset}
    return Twin(logs, truth, arguments=("--what", "motors"))


def _trapezoids(rng, seconds: float, row: float, size: float) -> tuple[Array, Array, Array]:
    """(t, position, speed) of moves to and fro with trapezoids of speed."""
    rows = round(seconds / row)
    rate = np.zeros(rows)
    k, way = round(0.3 / row), 1.0
    while k < rows:
        top, ramp, hold = rng.uniform(0.3, 1.0) * size, rng.uniform(0.2, 0.5), rng.uniform(0.3, 1.0)
        shape = np.interp(
            np.arange(0.0, 2 * ramp + hold, row), [0, ramp, ramp + hold, 2 * ramp + hold], [0, top, top, 0]
        )
        for sign in (way, -way):
            part = shape[: max(rows - k, 0)]
            rate[k : k + len(part)] = sign * part
            k += len(part) + round(rng.uniform(0.1, 0.4) / row)
        way = -way
    return np.arange(rows) * row, np.cumsum(rate) * row, rate


def late_motor(folder: Path, seed: int) -> Twin:
    """A motor at 200 Hz under stairs of voltage from rest, whose drive is late by 2.6 ms, half a row."""
    rng = np.random.default_rng(seed)
    row, late = 5e-3, 2.6e-3
    slope, band, lag = 0.020 * rng.uniform(0.7, 1.4), 0.35 * rng.uniform(0.6, 1.4), 0.12 * rng.uniform(0.5, 1.5)
    logs = []
    for k in range(2):
        volts = np.concatenate([np.zeros(60), *(np.full(200, v) for v in rng.uniform(-4.0, 4.0, 20))])
        fine = np.repeat(volts, round(row / FINE))
        fine = np.concatenate([np.zeros(round(late / FINE)), fine])[: len(fine)]
        _, w = axis_run(fine, FINE, 1.0 / (slope * lag), slope, band, band)
        w = w[:: round(row / FINE)] + 0.3 * rng.standard_normal(len(volts))
        logs.append(write(folder / f"late{k}.csv", {"t_s": np.arange(len(volts)) * row, "u1_V": volts, "w1_rad_s": w}))
    return Twin(logs, {"slope": slope, "dead_band": band, "lag": lag, "latency": late}, arguments=("--what", "motors"))


@numba.njit(cache=True)
def _freewheel(duty, row, step, supply, ohm, henry, emf, torque, inertia, viscous, coulomb, period, diode):
    """Speed at each row: the bridge drives for a share of each period, then lets the current die in its diodes."""
    speed = np.zeros(len(duty))
    w, i, phase = 0.0, 0.0, 0.0
    for k in range(len(duty)):
        speed[k] = w
        share, sign = abs(duty[k]), 1.0 if duty[k] >= 0.0 else -1.0
        for _ in range(round(row / step)):
            phase += step / period
            phase -= math.floor(phase)
            if phase < share:
                i = (i * henry / step + sign * supply - emf * w) / (henry / step + ohm)
            elif i != 0.0:
                way = 1.0 if i > 0.0 else -1.0
                new = (i * henry / step - way * (supply + 2.0 * diode) - emf * w) / (henry / step + ohm)
                i = new if new * way > 0.0 else 0.0
            drive = w * inertia / step + torque * i - viscous * w
            hold = min(max(drive, -coulomb), coulomb)
            w = (drive - hold) * step / inertia
    return speed


FREEWHEEL = {
    "supply": 12.0, "ohm": 3.0, "henry": 2e-3, "emf": 0.33, "torque": 0.33, "inertia": 0.001, "viscous": 0.001,
    "coulomb": 0.01, "period": 2e-3, "diode": 0.7,
}  # fmt: skip


def freewheeling_bridge(folder: Path, seed: int) -> Twin:
    """A motor behind an H-bridge that opens all switches between its pulses: speed is a curve of the duty."""
    rng = np.random.default_rng(seed)
    row, step = 0.01, 1e-5
    numbers = {**FREEWHEEL, "supply": 12.0 * rng.uniform(0.9, 1.1), "coulomb": 0.01 * rng.uniform(0.5, 2.0)}
    logs = []
    for k in range(2):
        levels = rng.permutation(np.concatenate([[0.08, 0.16, 0.27, 0.51, 0.98], rng.uniform(0.05, 1.0, 5)]))
        levels = levels * rng.choice([-1.0, 1.0], 10)
        duty = np.concatenate([np.zeros(50), *(np.full(300, level) for level in levels)])
        w = _freewheel(duty, row, step, *numbers.values()) + 0.1 * rng.standard_normal(len(duty))
        logs.append(
            write(folder / f"bridge{k}.csv", {"t_s": np.arange(len(duty)) * row, "d1_duty": duty, "w1_rad_s": w})
        )
    held = np.full(400, 1.0)
    curve = {f"{d:g}": float(_freewheel(held * d, row, step, *numbers.values())[-100:].mean()) for d in CURVE}
    return Twin(logs, curve, arguments=("--what", "motors"))


CURVE = (0.08, 0.16, 0.27, 0.51, 0.98)


# --- a robot of three omni wheels


@numba.njit(cache=True)
def _robot(volts, hold, step, g, mass, gain, emf, viscous, box):
    """Twist at each row: voltages held for `hold` steps each, friction of each axis of the body for itself."""
    v = np.zeros(3)
    seen = np.zeros((len(volts), 3))
    for k in range(len(volts)):
        seen[k] = v
        for _ in range(hold):
            force = np.zeros(3)
            for m in range(g.shape[1]):
                rim = g[0, m] * v[0] + g[1, m] * v[1] + g[2, m] * v[2]
                push = gain * (volts[k, m] - emf * rim)
                for a in range(3):
                    force[a] += g[a, m] * push
            turn = (mass[0] * v[1] * v[2], -mass[1] * v[0] * v[2], 0.0)
            for a in range(3):
                drive = v[a] * mass[a] / step + force[a] + turn[a] - viscous[a] * v[a]
                v[a] = (drive - min(max(drive, -box[a]), box[a])) * step / mass[a]
    return seen


AZIMUTH = np.radians([180.0, -60.0, 60.0])


def wheels(arm: float) -> Array:
    """The force and torque (rows) of a push of 1 N of each wheel (columns)."""
    return np.stack([-np.sin(AZIMUTH), np.cos(AZIMUTH), np.full(3, arm)])


def wrong_radius(folder: Path, seed: int) -> Twin:
    """A robot whose file has another wheel radius and inertia than it has, late by 20 ms; volts and wheel speeds."""
    rng = np.random.default_rng(seed)
    row, late, ohm, constant, gear, arm, radius, mass = 0.02, 0.02, 1.7, 0.006, 19.0, 0.12, 0.0519, 3.0
    inertia = 0.5 * mass * arm**2
    gain, emf = constant * gear / (ohm * radius), constant * gear / radius
    box = np.array([2.5, 2.0, 0.12]) * rng.uniform(0.7, 1.3, 3)
    viscous = np.array([1.2, 1.0, 0.012]) * rng.uniform(0.7, 1.3, 3)
    logs = []
    for k in range(3):
        count = 30
        volts = np.concatenate([np.zeros((25, 3)), np.repeat(rng.uniform(-6.0, 6.0, (count, 3)), 40, axis=0)])
        acting = np.concatenate([np.zeros((round(late / row), 3)), volts])[: len(volts)]
        numbers = (np.array([mass, mass, inertia]), gain, emf, viscous, box)
        twist = _robot(acting, 200, row / 200, wheels(arm), *numbers)
        w = twist @ wheels(arm) / radius + 0.05 * rng.standard_normal((len(volts), 3))
        columns = {"t_s": np.arange(len(volts)) * row}
        columns |= {f"u{m + 1}_V": volts[:, m] for m in range(3)} | {f"w{m + 1}_rad_s": w[:, m] for m in range(3)}
        logs.append(write(folder / f"radius{k}.csv", columns))
    file = f"""schema = 1
name = "twin"
[body]
mass_kg = {mass}
inertia_kg_m2 = {0.6 * inertia:.6g}
rotating_frame = true
[wheels]
azimuth_deg = [180.0, -60.0, 60.0]
robot_radius_m = {arm}
wheel_radius_m = 0.0505
[motor]
resistance_ohm = {ohm}
torque_constant_Nm_A = {constant}
emf_constant_Vs_rad = {constant}
gear_ratio = {gear}
voltage_limit_V = 6.0
[friction.axes]
viscous = [1.0, 1.0, 0.01]
coulomb = [2.0, 2.0, 0.1]
"""
    truth = {"latency": late, "radius": radius, "inertia": inertia}
    truth |= {f"viscous{a}": viscous[a] for a in range(3)} | {f"coulomb{a}": box[a] for a in range(3)}
    return Twin(logs, truth, file, ("--robot", "robot.toml"))


# --- steady drives with currents: the wheels of a robot on a floor


def _currents(direction: Array, speed: Array, levels, wheel: Array, arm: float, per_ampere: float) -> Array:
    """Currents [A] of the wheels at steady twists: forces (Cx vx, Cy vy)/|v| of the floor and Coulomb at each wheel."""
    g, way = wheels(arm), np.stack([np.cos(direction), np.sin(direction)], axis=-1)
    force = np.zeros((*direction.shape, 3))
    force[..., :2] = levels * way
    push = force @ np.linalg.pinv(g).T
    rim = np.concatenate([speed[..., None] * way, np.zeros((*direction.shape, 1))], axis=-1) @ g
    return (push + wheel * np.sign(np.where(np.abs(rim) < 1e-6, 0.0, rim))) / per_ampere


PER_AMPERE = 0.0514 * 16.0 / 0.040  # [N/A] at the rim


def _steady_log(path: Path, rng, twist: Array, current: Array, row: float, arm: float, radius: float, gear: float):
    """A log of set twists, wheel speeds (rounded) and unsigned, rippling currents (rounded), from rest."""
    rows = len(twist)
    t = np.arange(rows) * row
    rise = 1.0 - np.exp(-t / 0.1)
    w = (twist @ wheels(arm)) / radius * rise[:, None]
    w = np.round((w * gear + 1.0 * rng.standard_normal(w.shape)) / 2.827) * 2.827 / gear
    i = np.abs(current + 0.16 * rng.standard_normal(current.shape))
    columns = {"t_s": t, "vx_cmd_m_s": twist[:, 0], "vy_cmd_m_s": twist[:, 1], "omega_cmd_rad_s": twist[:, 2]}
    columns |= {f"w{m + 1}_rad_s": w[:, m] for m in range(3)} | {f"i{m + 1}_A": i[:, m] for m in range(3)}
    return write(path, columns)


STEADY_ROBOT = """schema = 1
name = "twin"
[body]
mass_kg = 8.0
inertia_kg_m2 = 0.1
[wheels]
azimuth_deg = [180.0, -60.0, 60.0]
robot_radius_m = 0.125
wheel_radius_m = 0.040
[motor]
resistance_ohm = 5.95
torque_constant_Nm_A = 0.0514
emf_constant_Vs_rad = 0.0514
gear_ratio = 16.0
voltage_limit_V = 24.0
[drive]
kind = "speed"
rate_Hz = 1000.0
kp_V_s_rad = 15.0
[friction.axes]
viscous = [0.0, 0.0, 0.0]
coulomb = [10.0, 10.0, 0.5]
"""


def two_floors(folder: Path, seed: int, *, changes: bool = True) -> Twin:
    """One command held for 17 s, over an edge between two floors of 35 and 14 N (or over one floor of 35 N)."""
    rng = np.random.default_rng(seed)
    row, rows = 0.031, 550
    when = rng.uniform(4.0, 13.0) if changes else math.inf
    t = np.arange(rows) * row
    direction, speed = np.full(rows, rng.uniform(0.0, 2.0 * math.pi)), np.full(rows, rng.choice([0.1, 0.2, 0.3]))
    level = np.where(t < when, 35.0, 14.0) * (
        1.0 + 0.03 * np.convolve(rng.standard_normal(rows + 30), np.ones(31) / 31**0.5, "valid")
    )
    unit = _currents(direction, speed, 1.0, np.zeros(3), 0.125, PER_AMPERE)
    twist = np.stack([speed * np.cos(direction), speed * np.sin(direction), np.zeros(rows)], axis=-1)
    path = _steady_log(folder / "floors.csv", rng, twist, unit * level[:, None], row, 0.125, 0.040, 16.0)
    return Twin([path], {"time": when, "first": 35.0, "second": 14.0}, STEADY_ROBOT, ("--robot", "robot.toml"))


def unequal_wheels(folder: Path, seed: int) -> Twin:
    """Drives in 36 directions at two speeds: an ellipse of force, and a level of its own at each wheel."""
    rng = np.random.default_rng(seed)
    levels, wheel = (
        np.array([42.0, 36.0]) * rng.uniform(0.8, 1.2, 2),
        np.array([2.0, 3.5, 1.0]) * rng.uniform(0.7, 1.3, 3),
    )
    row, rows, logs = 0.031, 160, []
    for k in range(36):
        angle, speed = np.full(rows, math.radians(10.0 * k)), np.full(rows, 0.1 if k % 2 else 0.2)
        current = _currents(angle, speed, levels, wheel, 0.125, PER_AMPERE)
        twist = np.stack([speed * np.cos(angle), speed * np.sin(angle), np.zeros(rows)], axis=-1)
        logs.append(_steady_log(folder / f"way{k:02}.csv", rng, twist, current, row, 0.125, 0.040, 16.0))
    truth = {"x": levels[0], "y": levels[1], **{f"wheel{m}": wheel[m] for m in range(3)}}
    return Twin(logs, truth, STEADY_ROBOT, ("--robot", "robot.toml"))


WORLDS: dict[str, Callable[[Path, int], Twin]] = {
    "offset_axis": offset_axis, "wrong_radius": wrong_radius, "late_motor": late_motor, "two_floors": two_floors,
    "freewheeling_bridge": freewheeling_bridge, "unequal_wheels": unequal_wheels,
}  # fmt: skip
