"""The robots and voltage programs of the accuracy tests and benchmarks: Table 3, and random ones from a seed.

Only `random.Random` and sines rounded to a millivolt: the same numbers on every platform and version.
"""

from __future__ import annotations

import math
from dataclasses import replace
from random import Random

import numpy as np

from omnidyn.model.friction import AxesFriction, Friction
from omnidyn.model.motor import Motor
from omnidyn.model.robot import Body, Robot
from omnidyn.model.wheels import Wheels
from tests.reference.reference import Physical

LIMIT_V = 6.0
TABLE_3 = Physical(
    mass=1.5,
    inertia=0.025,
    robot_radius=0.1,
    wheel_radius=0.035,
    resistance=1.69,
    torque_constant=0.0059,
    emf_constant=0.0059,
    gear_ratio=19.0,
    azimuth_deg=(180.0, -60.0, 60.0),
    viscous=(0.94, 0.96, 0.01),
    coulomb=(2.2, 1.5, 0.099),
    breakaway=(2.2, 1.5, 0.099),
)


def with_breakaway(p: Physical, ratio: float) -> Physical:
    """The same robot with breakaway = ratio * coulomb on every axis."""
    return replace(p, breakaway=tuple(ratio * c for c in p.coulomb))


def robot_of(p: Physical, name: str = "reference") -> Robot:
    """The omnidyn robot with these numbers."""
    return Robot(
        name=name,
        body=Body(mass=p.mass, inertia=p.inertia),
        wheels=Wheels(azimuth_deg=p.azimuth_deg, robot_radius=p.robot_radius, wheel_radius=p.wheel_radius),
        motor=Motor(
            resistance=p.resistance,
            torque_constant=p.torque_constant,
            emf_constant=p.emf_constant,
            gear_ratio=p.gear_ratio,
            voltage_limit=LIMIT_V,
        ),
        friction=Friction(axes=AxesFriction(viscous=p.viscous, coulomb=p.coulomb, breakaway=p.breakaway)),
    )


def random_robot(seed: int, spread: float = 0.5) -> Physical:
    """Table 3 with every number changed by up to +-spread, 3 to 6 evenly spaced wheels, breakaway 1 to 1.5 coulomb."""
    random = Random(seed)

    def around(value: float) -> float:
        return value * random.uniform(1 - spread, 1 + spread)

    wheels = random.choice((3, 3, 4, 5, 6))
    first = random.randrange(-180 * 64, 180 * 64) / 64  # exact in binary, and so are the sums below
    coulomb = tuple(map(around, TABLE_3.coulomb))
    ratio = random.choice((1.0, random.uniform(1.0, 1.5)))
    return Physical(
        mass=around(TABLE_3.mass),
        inertia=around(TABLE_3.inertia),
        robot_radius=around(TABLE_3.robot_radius),
        wheel_radius=around(TABLE_3.wheel_radius),
        resistance=around(TABLE_3.resistance),
        torque_constant=around(TABLE_3.torque_constant),
        emf_constant=around(TABLE_3.emf_constant),
        gear_ratio=around(TABLE_3.gear_ratio),
        azimuth_deg=tuple((first + 360.0 / wheels * i + 180.0) % 360.0 - 180.0 for i in range(wheels)),
        viscous=tuple(map(around, TABLE_3.viscous)),
        coulomb=coulomb,
        breakaway=tuple(ratio * c for c in coulomb),
    )


def prbs_bits(count: int, register: int = 0b101010101010101) -> list[int]:
    """Bits of the 15-bit shift register x^15 + x^14 + 1."""
    bits = []
    for _ in range(count):
        bit = (register ^ (register >> 1)) & 1
        register = (register >> 1) | (bit << 14)
        bits.append(bit)
    return bits


def table_3_voltages() -> np.ndarray:
    """10 s at 1 kHz [V]: 4 s of sines that cross zero, 3 s of 37 ms PRBS, 2 s in the dead zone, 1 s of chirp."""
    phase, frequency = (0.3, 1.1, 2.0), (1.3, 2.1, 3.7)
    bits = prbs_bits(3 * 100)
    rows = []
    for k in range(10_000):
        t = k * 1e-3
        if k < 4000:
            row = [7.0 * math.sin(2 * math.pi * f * t + p) for f, p in zip(frequency, phase, strict=True)]
        elif k < 7000:
            first = 3 * ((k - 4000) // 37)
            row = [(1 - 2 * bit) * level for bit, level in zip(bits[first : first + 3], (4.0, 3.0, 5.0), strict=True)]
        elif k < 9000:
            row = [-0.03, 0.06, -0.02]
        else:
            row = [6.0 * math.sin(2 * math.pi * (2 + 6 * (t - 9)) * t + p) for p in phase]
        rows.append([round(min(max(u, -LIMIT_V), LIMIT_V), 3) for u in row])
    return np.array(rows)


def random_program(seed: int, steps: int, wheels: int) -> np.ndarray:
    """Voltages [V], shape (steps, wheels), in millivolts: stretches of nothing, little, two levels, and sines."""
    random = Random(1000 + seed)
    rows: list[list[float]] = []
    while len(rows) < steps:
        kind, length, scale = random.randrange(5), random.randrange(20, 400), random.uniform(0.3, LIMIT_V)
        phase = [random.uniform(0, 2 * math.pi) for _ in range(wheels)]
        period = [random.uniform(20, 300) for _ in range(wheels)]
        level = [0.0] * wheels
        for k in range(length):
            if kind == 0:
                level = [0.0] * wheels
            elif kind == 1 and k == 0:
                level = [random.uniform(-0.2, 0.2) for _ in range(wheels)]
            elif kind == 2 and k % 37 == 0:
                level = [random.choice((-scale, scale)) for _ in range(wheels)]
            elif kind >= 3:
                level = [scale * math.sin(2 * math.pi * k / n + p) for n, p in zip(period, phase, strict=True)]
            rows.append([round(u, 3) for u in level])
    return np.array(rows[:steps])


def random_steps(seed: int, steps: int) -> np.ndarray:
    """Lengths of steps [s], shape (steps,): 1 ms throughout, or log-uniform from 1e-5 to 0.1 s for every other seed."""
    if seed % 2 == 0:
        return np.full(steps, 1e-3)
    random = Random(2000 + seed)
    return np.array([10.0 ** random.uniform(-5.0, -1.0) for _ in range(steps)])
