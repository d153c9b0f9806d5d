"""One run of one robot, logged by topics with clocks of their own: any offsets, jitter and rates.

The plant shares nothing with `omnidyn.simulation`: three equal wheels decouple the axes, each an Euler step of 0.25 ms
with Coulomb friction that stops it, as in T. Moreau's time stepping.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from tests.support.bags import BagMaker, write_mcap

AZIMUTH, ARM, RADIUS = np.radians([60.0, 180.0, 300.0]), 0.2, 0.05  # [rad], [m], [m]
MASS, VISCOUS, COULOMB = np.array([10.0, 10.0, 0.6]), np.array([5.0, 5.0, 0.5]), np.array([8.0, 8.0, 1.2])
OHM, VOLT_SECONDS, VOLTS = 2.0, 0.6, 12.0  # R, l K at the wheel, limit
STEP, PERIOD, HOLD = 0.25e-3, 0.02, 0.6  # [s]
NOISE = {"w": 0.05, "v": 0.004, "omega": 0.01, "pose": 0.0005, "heading": 0.001, "i": 0.02, "supply": 0.01}

ROBOT = f"""schema = 1
name = "staggered"
[body]
mass_kg = 10.0
inertia_kg_m2 = 0.6
rotating_frame = false
[wheels]
azimuth_deg = [60.0, 180.0, 300.0]
robot_radius_m = {ARM}
wheel_radius_m = {RADIUS}
[motor]
resistance_ohm = {OHM}
torque_constant_Nm_A = 0.03
emf_constant_Vs_rad = 0.03
gear_ratio = 20.0
voltage_limit_V = {VOLTS}
electrical = "quasi-static"
[friction.axes]
viscous = [8.0, 8.0, 0.8]
coulomb = [5.0, 5.0, 0.8]
"""

Values = Callable[[np.ndarray], np.ndarray]  # times [s], shape (n,) -> what a sensor gives then, without noise


@dataclass(frozen=True)
class Topic:
    """What comes in one message. columns: component -> values. offset, jitter [s]: of its stamps, and their spread."""

    columns: Mapping[str, Values]
    offset: float = 0.0
    rate: float = 1.0 / PERIOD
    jitter: float = 0.0

    def late(self, seconds: float) -> Topic:
        """The topic of a sensor that shows what was so long before its stamp."""
        columns = {name: _earlier(true, seconds) for name, true in self.columns.items()}
        return replace(self, columns=columns)


def _earlier(true: Values, seconds: float) -> Values:
    return lambda t: true(np.maximum(t - seconds, 0.0))


@lru_cache(maxsize=2)
def plant(seconds: float = 40.0, seed: int = 1) -> dict[str, Values]:
    """Component -> its true values at any time."""
    rng = np.random.default_rng(seed)
    count = round(seconds / STEP)
    held = rng.uniform(-1.0, 1.0, (round(seconds / HOLD) + 1, 3)) * [6.0, 6.0, 4.0]
    held *= rng.uniform(0.4, 1.0, (len(held), 1))
    held[[0, 1, 2, -3, -2, -1]] = 0.0
    sides = np.column_stack([-np.sin(AZIMUTH), np.cos(AZIMUTH), np.full(3, ARM)])  # rim speed = sides @ twist
    volts = np.clip(held @ np.column_stack([sides[:, 0], sides[:, 1], np.ones(3)]).T, -VOLTS, VOLTS)
    row = np.minimum((np.arange(count) * STEP / HOLD + 1e-9).astype(int), len(held) - 1)
    pull = VOLT_SECONDS / (OHM * RADIUS)
    push, drag = pull * volts @ sides, pull * VOLT_SECONDS / RADIUS * (sides**2).sum(axis=0) + VISCOUS
    twist = np.column_stack([_axis(push[row, k], drag[k], COULOMB[k], MASS[k]) for k in range(3)])
    heading = np.concatenate([[0.0], np.cumsum(twist[:-1, 2] * STEP)])
    steps = (twist[:, 0] + 1j * twist[:, 1]) * np.exp(1j * (heading + 0.5 * twist[:, 2] * STEP)) * STEP
    place = np.concatenate([[0.0], np.cumsum(steps[:-1])])
    wheels = twist @ sides.T / RADIUS
    grid = np.arange(count) * STEP
    line = {
        "vx": twist[:, 0],
        "vy": twist[:, 1],
        "omega": twist[:, 2],
        "x": np.real(place),
        "y": np.imag(place),
        "heading": heading,
    }
    line |= {f"w{k + 1}": wheels[:, k] for k in range(3)}
    line |= {f"a{k + 1}": np.cumsum(wheels[:, k]) * STEP for k in range(3)}
    known: dict[str, Values] = {name: _on_line(grid, values) for name, values in line.items()}
    known |= {f"u{k + 1}": _held(volts[:, k]) for k in range(3)}
    known |= {f"i{k + 1}": _current(known[f"u{k + 1}"], known[f"w{k + 1}"]) for k in range(3)}
    return known | {"supply": lambda t: np.full(len(t), 12.3)}


def _axis(push: np.ndarray, drag: float, coulomb: float, mass: float) -> np.ndarray:
    """Speed of an axis: m v' = push - drag v - coulomb sgn v, by an implicit step of the friction."""
    v, out = 0.0, np.empty(len(push))
    share = STEP / mass
    for k, force in enumerate(push.tolist()):
        out[k] = v
        free = v + share * (force - drag * v)
        v = free - share * coulomb if free > share * coulomb else min(free + share * coulomb, 0.0)
    return out


def _on_line(grid: np.ndarray, values: np.ndarray) -> Values:
    return lambda t: np.interp(t, grid, values)


def _held(values: np.ndarray) -> Values:
    return lambda t: values[np.clip(((t + 1e-9) / HOLD).astype(int), 0, len(values) - 1)]


def _current(volts: Values, speed: Values) -> Values:
    return lambda t: (volts(t) - VOLT_SECONDS * speed(t)) / OHM


def topics(number: int, offset: float, jitter: float = 0.0, rates: bool = False, seconds: float = 40.0) -> list[Topic]:
    """2, 4 or 8 topics of the run, each so much later than the one before [s]; half a period: every second one.

    rates: wheels at 100 Hz, the motion over the floor at 30 Hz, all else at 50 Hz.
    """
    true = plant(seconds)
    wheels, body = [f"w{k}" for k in (1, 2, 3)], ["vx", "vy", "omega", "x", "y", "heading"]
    volts, amps = [f"u{k}" for k in (1, 2, 3)], [f"i{k}" for k in (1, 2, 3)]
    parts = {
        2: [[*volts, *wheels], body],
        4: [volts, wheels, body, ["supply"]],
        8: [volts, *([name] for name in wheels), body[:3], body[3:], amps, ["supply"]],
    }[number]
    made = []
    for k, names in enumerate(parts):
        rate = 1.0 / PERIOD if not rates else 100.0 if names[-1] in wheels else 30.0 if names[-1] in body else 50.0
        late = offset * (k % 2) if offset == 0.5 * PERIOD else offset * k
        made.append(Topic({n: true[n] for n in names}, late, rate, 0.0 if names == volts else jitter))
    return made


@dataclass(frozen=True)
class Logged:
    """Stamps of each topic [s] and the noisy values of its components."""

    topics: list[tuple[np.ndarray, dict[str, np.ndarray]]] = field(default_factory=list)

    @classmethod
    def of(cls, made: list[Topic], seconds: float = 40.0, seed: int = 5) -> Logged:
        """The noise of a message is the same whatever its stamp: its generator is that of its component."""
        logged = []
        for topic in made:
            count = int((seconds - 0.1) * topic.rate)
            names = "".join(topic.columns)
            rng = np.random.default_rng([seed, *names.encode()])
            stamps = np.arange(count) / topic.rate + topic.offset + topic.jitter * rng.normal(size=count)
            stamps = np.maximum.accumulate(np.round(np.maximum(stamps, 0.0), 6))
            fresh = np.append(True, np.diff(stamps) > 0.0)
            values = {}
            for name, true in topic.columns.items():
                own = np.random.default_rng([seed, *name.encode()])
                values[name] = true(stamps[fresh]) + _noise(name) * own.normal(size=count)[fresh]
            logged.append((stamps[fresh], values))
        return cls(logged)

    def csv(self, path: Path) -> Path:
        """One table with a row per stamp, blank where a topic has nothing."""
        t = np.unique(np.concatenate([stamps for stamps, _ in self.topics]))
        columns = {}
        for stamps, values in self.topics:
            for name, own in values.items():
                columns[name] = np.full(len(t), np.nan)
                columns[name][np.searchsorted(t, stamps)] = own
        names = [f"{name}_{UNITS[name.rstrip('123')]}" for name in columns]
        table = np.column_stack([t, *columns.values()]).tolist()
        lines = [",".join(["" if cell != cell else repr(cell) for cell in row]) for row in table]
        path.write_text("\n".join([",".join(["t_s", *names]), *lines]) + "\n")
        return path

    def mcap(self, path: Path) -> Path:
        """A bag of ROS 2: joint states, odometry and arrays of numbers, each topic with the stamps of its header."""
        maker = BagMaker()
        for stamps, values in self.topics:
            table = np.column_stack(list(values.values()))
            names = list(values)
            for t, row in zip(stamps.tolist(), table, strict=True):
                _message(maker, t, dict(zip(names, row.tolist(), strict=True)))
        return write_mcap(maker, path)


UNITS = {
    "u": "V",
    "w": "rad_s",
    "a": "rad",
    "i": "A",
    "vx": "m_s",
    "vy": "m_s",
    "omega": "rad_s",
    "x": "m",
    "y": "m",
    "heading": "rad",
    "supply": "V",
}


def _noise(name: str) -> float:
    letter = name.rstrip("123")
    if letter in ("x", "y"):
        return NOISE["pose"]
    return NOISE.get("v" if letter in ("vx", "vy") else letter, 0.0)


def _message(maker: BagMaker, t: float, row: dict[str, float]) -> None:
    wheels = [name for name in row if name[0] == "w"]
    if wheels:
        names = [f"wheel_{name[1]}_joint" for name in wheels]
        maker.joints(t, names, [], [row[name] for name in wheels], f"/{wheels[0]}/joint_states")
    if "vx" in row:
        maker.odometry(t, (row["x"], row["y"], row["heading"]), (row["vx"], row["vy"], row["omega"]))
    if "supply" in row:
        maker.battery(t, row["supply"])
