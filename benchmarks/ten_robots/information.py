"""What a log can tell of each number of a World: an information matrix that shares no code with omnidyn.

    I = sum over sensors of J' J / noise^2 + priors,   J by central differences of world.drive

Numbers that must be positive are taken by their logarithm, friction and rotors as they are. Latencies of each kind of
sensor, the first angle of each wheel and the first pose are unknown too. Rounding to counts is noise of tick/sqrt(12).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.ten_robots.robots import Case
from benchmarks.ten_robots.world import ELLIPSE, World, currents, drive

# Of a number, for central differences: a stop is found within 1e-6 s, which leaves 1e-5 m/s of it to chance; what
# viscous friction does is small beside that, and linear.
STEPS = {"viscous": 0.3, "coulomb": 0.03, "rotor_inertia": 0.03}
STEP = 0.01
LEVELS = ("coulomb", "viscous")
GEAR, TORQUE, ROTOR = "gear_ratio", "torque_constant", "rotor_inertia"
LINEAR = (*LEVELS, "rotor_inertia")  # may be 0
TOLD = 0.5  # std over that of the prior below which a log determines a number
# Also open: a std above a tenth of its prior's, more than half of whose variance is what the priors leave open.
TOLD_BY_OTHERS, MOST = 0.1, 0.5


@dataclass(frozen=True)
class Number:
    """A number of a World: its field, entries that are changed together, and the key of a robot file."""

    key: str
    field: str
    entries: tuple[int, ...] = ()

    @property
    def log(self) -> bool:
        return self.field not in LINEAR

    def of(self, world: World) -> float:
        value = getattr(world, self.field)
        return float(value[self.entries[0]] if self.entries else value)

    def changed(self, world: World, inner: float) -> World:
        """The world with this number moved by `inner`, a share where it is logarithmic."""
        value = self.of(world) * np.exp(inner) if self.log else self.of(world) + inner
        if not self.entries:
            return replace(world, **{self.field: float(value)})
        many = list(getattr(world, self.field))
        for entry in self.entries:
            many[entry] = float(value)
        return replace(world, **{self.field: tuple(many)})


def numbers(world: World) -> list[Number]:
    """What `init` guesses of a world, by the keys of its file."""
    found = [
        Number("motor.resistance_ohm", "resistance"),
        Number("motor.torque_constant_Nm_A", "torque_constant"),
        Number("motor.gear_ratio", "gear_ratio"),
        Number("body.inertia_kg_m2", "inertia"),
    ]
    if world.rotor_inertia > 0.0:
        found.append(Number("motor.rotor_inertia_kg_m2", "rotor_inertia"))
    if world.loop[2] > 0.0:
        found += [Number("drive.kp_V_s_rad", "loop", (0,)), Number("drive.ki_V_rad", "loop", (1,))]
    if world.shape == ELLIPSE:
        table = "friction.direction"
        return [
            *found,
            Number(f"{table}.coulomb[0]", "coulomb", (0,)),
            Number(f"{table}.coulomb[1]", "coulomb", (1,)),
            Number(f"{table}.viscous", "viscous", (0, 1)),
            Number(f"{table}.yaw_coulomb", "coulomb", (2,)),
            Number(f"{table}.yaw_viscous", "viscous", (2,)),
        ]
    return [
        *found,
        *(Number(f"friction.axes.{level}[{axis}]", level, (axis,)) for level in LEVELS for axis in range(3)),
    ]


def determined(case: Case, commands: np.ndarray, stds: Mapping[str, tuple[float, float]]) -> set[str]:
    """Keys of what a log of these commands (rows, n) [V, or rad/s of a loop] tells.

    stds: key -> (value, std) of the robot file that the owner begins with; others have no prior.
    """
    free = numbers(case.world)
    slopes, extra = _slopes(case, commands, free), _nuisances(case, commands)
    whole = np.hstack([slopes, extra])
    prior = np.zeros(whole.shape[1])
    for j, number in enumerate(free):
        if number.key in stds:
            value, std = stds[number.key]
            prior[j] = (value / std if number.log else 1.0 / std) ** 2
    size = np.sqrt((whole**2).sum(axis=0) + prior)
    size[size == 0.0] = 1.0
    # Not by J' J: what priors alone hold is 1e-12 of what a million counts say.
    root = np.linalg.pinv(np.vstack([whole / size, np.diag(np.sqrt(prior) / size)]), rcond=1e-12)
    covariance = root @ root.T / np.outer(size, size)
    variance = np.diag(covariance)
    kept = np.sqrt(variance * prior)
    by_priors = np.einsum("ij,j,ij->i", covariance, prior, covariance) > MOST * variance
    is_open = (kept > TOLD) | ((kept > TOLD_BY_OTHERS) & by_priors)
    return {number.key for j, number in enumerate(free) if not is_open[j] and prior[j] > 0.0}


def _slopes(case: Case, commands: np.ndarray, free: list[Number]) -> np.ndarray:
    """Derivatives of all that is measured, each over its noise. Shape (measurements, numbers).

    A gear shows as K_t l and J l^2 only, so that its derivative is one of theirs. By differences of its own the three
    would be told apart by what is left of their curvature, which millions of counts make much of.
    """
    found: dict[str, np.ndarray] = {}
    for number in [each for each in free if each.field != GEAR]:
        step = STEP if number.log else STEPS[number.field] * max(abs(number.of(case.world)), 1e-6)
        up, down = (_seen(case, number.changed(case.world, side * step), commands) for side in (1.0, -1.0))
        parts = [((a - b) / (2.0 * step)).ravel() for a, b in zip(up, down, strict=True)]
        found[number.key] = np.concatenate(parts)
    of = {number.field: found.get(number.key, 0.0) for number in free}
    geared = np.asarray(of[TORQUE] + 2.0 * case.world.rotor_inertia * of.get(ROTOR, 0.0))
    return np.stack([found.get(number.key, geared) for number in free], axis=1)


def _seen(case: Case, world: World, commands: np.ndarray) -> list[np.ndarray]:
    """What each kind of sensor shows, (rows, columns), over its noise."""
    sensors, radii = case.sensors, np.array(world.wheel_radius)
    motion = drive(world, commands, 1.0 / case.rate, sensors.loop)
    twist, path, pose = motion.twist[:-1], motion.path[:-1], motion.pose[:-1]
    found = []
    if sensors.speeds is not None:
        found.append(twist @ world.G / radii / sensors.speeds)
    if sensors.counts:
        found.append(path @ world.G / radii / (2.0 * np.pi / sensors.counts / np.sqrt(12.0)))
    if sensors.gyro is not None:
        found.append(twist[:, 2:] / sensors.gyro)
    if sensors.capture is not None:
        place, angle = sensors.capture
        found += [pose[:, :2] / place, pose[:, 2:] / angle]
    if sensors.amps is not None:
        found.append(currents(world, twist, motion.voltage) / sensors.amps)
    return found


def _nuisances(case: Case, commands: np.ndarray) -> np.ndarray:
    """A latency of each kind of sensor, and the start of what counts from one. Shape (measurements, nuisances)."""
    seen = _seen(case, case.world, commands)
    total, first, columns = sum(each.size for each in seen), 0, []
    kinds = [name for name in ("speeds", "counts", "gyro", "capture", "capture", "amps") if getattr(case.sensors, name)]
    for each, kind in zip(seen, kinds[: len(seen)], strict=True):
        late = np.zeros(total)
        late[first : first + each.size] = np.gradient(each, 1.0 / case.rate, axis=0).ravel()
        columns.append(late)
        for k in range(each.shape[1] if kind in ("counts", "capture") else 0):
            begin, own = np.zeros(total), np.zeros(each.shape)
            own[:, k] = 1.0 / max(float(np.abs(each).max()), 1.0)
            begin[first : first + each.size] = own.ravel()
            columns.append(begin)
        first += each.size
    return np.stack(columns, axis=1)
