"""Robots that mix every option of the plant, and voltage programs for them, from a seed.

Only `random.Random` and values rounded to a few digits: the same numbers on every platform and version. Each
is Table 3 with everything changed. About half the robots have breakaway above coulomb (`eager` tells which).
"""

from __future__ import annotations

from random import Random

import numpy as np

from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.motor import DYNAMIC, QUASI_STATIC, Motor
from omnidyn.model.robot import Body, Robot
from omnidyn.model.wheels import Wheels

LIMIT_V = 6.0
PLACES = (
    ("axes",),
    ("direction",),
    ("wheels",),
    ("axes", "wheels"),
    ("direction", "wheels"),
    ("axes", "direction"),
    ("axes", "direction", "wheels"),
)
USUAL = ("lugre", "lugre", "dahl")
REDRAWN: dict[int, int] = {}
"""Seed -> number of draws thrown away because the reference met a tie; filled by hand from modes_make.py."""


def eager(seed: int) -> bool:
    """Whether the robot of this seed has breakaway above coulomb."""
    return seed % 2 == 1


def random_robot(seed: int) -> Robot:
    """A robot that mixes all options."""
    random = Random(f"robot {seed} {REDRAWN.get(seed, 0)}")

    def around(value: float, spread: float = 0.4) -> float:
        return float(f"{value * random.uniform(1 - spread, 1 + spread):.6g}")

    def some(value: float, spread: float, count: int):
        return tuple(around(value, spread) for _ in range(count)) if random.random() < 0.5 else around(value, spread)

    wheels = _wheels(random, around, some)
    n = wheels.count
    dynamic = (seed // 2) % 2 == 1
    resistance = around(1.69)
    motor = Motor(
        resistance=tuple(around(resistance, 0.1) for _ in range(n)) if random.random() < 0.6 else resistance,
        inductance=float(f"{resistance * 5e-5 * 100 ** random.random():.6g}") if dynamic else None,
        torque_constant=some(0.0059, 0.15, n),
        emf_constant=some(0.0059, 0.15, n),
        gear_ratio=around(19.0),
        voltage_limit=LIMIT_V,
        current_limit=some(1.5, 0.4, n) if random.random() < 0.5 else None,
        voltage_drop=some(0.3, 0.5, n) if random.random() < 0.5 else 0.0,
        gear_efficiency=_efficiency(random, n) if random.random() < 0.5 else 1.0,
        electrical=DYNAMIC if dynamic else QUASI_STATIC,
    )
    return Robot(
        name=f"random-{seed}",
        body=Body(mass=around(1.5), inertia=around(0.02), rotating_frame=random.random() < 0.6),
        wheels=wheels,
        motor=motor,
        friction=_friction(random, PLACES[seed % 7], around, n, eager(seed)),
    )


def with_spin(robot: Robot, seed: int, heavy: float = 1.0) -> Robot:
    """The robot with rotors and wheels, each its own, of about 5 and 3 % of its mass a wheel, `heavy` times as much."""
    random, n = Random(f"spin {seed}"), robot.wheels.count

    def each(share: float, gear: float) -> tuple[float, ...]:
        one = heavy * share * robot.body.mass * (0.035 / gear) ** 2
        return tuple(float(f"{one * random.uniform(0.2, 2.0):.6g}") for _ in range(n))

    gear = float(np.mean(robot.motor.gear_ratio))
    return robot.replace(
        motor=robot.motor.replace(rotor_inertia=each(0.05, gear)),
        wheels=robot.wheels.replace(wheel_inertia=each(0.03, 1.0)),
    )


def with_centre(robot: Robot, seed: int) -> Robot:
    """The robot with a centre of mass beside that of the wheels, by up to half of the way to the wheels."""
    random = Random(f"centre {seed}")
    far, way = random.uniform(0.1, 0.5) * float(np.min(robot.wheels.robot_radius)), random.uniform(0.0, 6.28)
    centre = float(f"{far * np.cos(way):.6g}"), float(f"{far * np.sin(way):.6g}")
    return robot.replace(body=robot.body.replace(centre=centre))


def with_stribeck(robot: Robot, seed: int) -> Robot:
    """The robot with levels that fall with the speed, each its own, wherever its breakaway is above coulomb."""
    random, changed = Random(f"stribeck {seed}"), {}

    def speed(scale: float = 1.0) -> float:
        return float(f"{scale * 10 ** random.uniform(-2.2, -0.8):.4g}")

    for name in [n for n in ("axes", "direction", "wheels") if n in robot.friction.model_fields_set]:
        law = getattr(robot.friction, name)
        if law.breakaway is None:
            continue
        falls = {"stribeck_exponent": random.choice((2.0, 2.0, 1.0, 1.4, 3.0))}
        if name == "axes":
            falls["stribeck_speed"] = (speed(), speed(), speed(10.0))
        elif name == "direction":
            falls |= {"stribeck_speed": speed()}
            if "axes" not in robot.friction.model_fields_set:
                falls |= {"yaw_stribeck_speed": speed(10.0)}
        else:
            falls["stribeck_speed"] = tuple(speed() for _ in range(robot.wheels.count))
        changed[name] = law.replace(**falls)
    if "axes" in changed and "direction" in changed:  # about yaw there is one law
        way = changed["direction"].replace(yaw_coulomb=0.0, yaw_breakaway=None, yaw_stribeck_speed=None)
        changed["direction"] = way
    return robot.replace(friction=Friction(**changed))


def with_bristles(robot: Robot, seed: int, kinds: tuple[str, ...] = USUAL) -> Robot:
    """The robot with bristles of its own wherever it has friction, and plain motors: what bristles.py integrates."""
    random, changed, about_yaw = Random(f"bristles {seed}"), {}, False

    def stiff(low: float = 3.0, high: float = 4.5) -> float:
        return float(f"{10 ** random.uniform(low, high):.4g}")

    for name in [n for n in ("axes", "direction", "wheels") if n in robot.friction.model_fields_set]:
        law, kind = getattr(robot.friction, name), random.choice(kinds)
        new = {"law": kind, "stiffness": stiff()}
        falls = kind != "dahl" and law.breakaway is not None
        if kind == "dahl":
            new |= {k: None for k in ("breakaway", "breakaway_backward", "yaw_breakaway") if hasattr(law, k)}
        elif random.random() < 0.4:
            new["damping_speed"] = (0.1, 0.1, 1.0) if name == "axes" else 0.1
        if name == "axes":
            about_yaw, new["stiffness"] = True, (stiff(), stiff(), 0.02 * stiff())
            new |= {"stribeck_speed": (0.02, 0.05, 0.3)} if falls else {}
            new |= {"dahl_exponent": random.choice((1.0, 1.5, 2.0))} if kind == "dahl" else {}
            new |= {"elastic_share": random.choice((0.3, 0.7, 0.9))} if kind == "elastoplastic" else {}
        elif name == "direction":
            turning = {"yaw_stiffness": 0.02 * stiff()} | ({"yaw_stribeck_speed": 0.3} if falls else {})
            none = {"yaw_coulomb": 0.0, "yaw_breakaway": None}
            new |= ({"stribeck_speed": 0.03} if falls else {}) | (none if about_yaw else turning)
            if kinds != USUAL and kind == "dahl":
                new["dahl_exponent"] = random.choice((0.6, 1.5, 2.0))
            new |= {"elastic_share": random.choice((0.3, 0.7, 0.9))} if kind == "elastoplastic" else {}
        else:
            new["stiffness"] = tuple(stiff() for _ in range(robot.wheels.count))
            new |= {"stribeck_speed": 0.04} if falls else {}
        changed[name] = law.replace(**new)
    plain = robot.motor.replace(voltage_drop=0.0, current_limit=None, gear_efficiency=1.0)
    return robot.replace(friction=Friction(**changed), motor=plain)


def with_band(robot: Robot, seed: int) -> Robot:
    """The robot with Karnopp's law wherever it has friction, bands of 0.5 to 5 mm/s, and plain motors."""
    random, changed = Random(f"band {seed}"), {}

    def speed(scale: float = 1.0) -> float:
        return float(f"{scale * 10 ** random.uniform(-3.3, -2.3):.4g}")

    for name in [n for n in ("axes", "direction", "wheels") if n in robot.friction.model_fields_set]:
        new = {"law": "karnopp"}
        if name == "axes":
            new["karnopp_speed"] = (speed(), speed(), speed(10.0))
        elif name == "direction":
            new |= {"karnopp_speed": speed(), "yaw_karnopp_speed": speed(10.0)}
            new |= {"yaw_coulomb": 0.0, "yaw_breakaway": None} if "axes" in changed else {}
        else:
            new["karnopp_speed"] = tuple(speed() for _ in range(robot.wheels.count))
        changed[name] = getattr(robot.friction, name).replace(**new)
    plain = robot.motor.replace(voltage_drop=0.0, current_limit=None, gear_efficiency=1.0)
    return robot.replace(friction=Friction(**changed), motor=plain)


def _wheels(random, around, some) -> Wheels:
    """3 to 6 wheels at random azimuths, or four mecanum wheels."""
    radius = some(0.035, 0.2, 4)
    if random.random() < 0.2:
        axle = float(round(random.uniform(70, 110), 1))
        return Wheels(
            azimuth_deg=(axle, -axle, axle, -axle),
            robot_radius=around(0.15),
            wheel_radius=radius,
            roller_angle_deg=(45.0, -45.0, -45.0, 45.0),
        )
    count = random.choice((3, 3, 4, 4, 5, 6))
    first = random.uniform(-180.0, 180.0)
    gap = 360.0 / count
    places = [(first + gap * (k + random.uniform(-0.25, 0.25)) + 180.0) % 360.0 - 180.0 for k in range(count)]
    return Wheels(
        azimuth_deg=tuple(round(place, 1) for place in places),
        robot_radius=tuple(around(0.1, 0.2) for _ in places) if random.random() < 0.5 else around(0.1),
        wheel_radius=tuple(around(0.035, 0.2) for _ in places) if isinstance(radius, tuple) else radius,
    )


def _efficiency(random, n):
    values = [round(random.uniform(0.7, 1.0), 4) for _ in range(n)]
    return tuple(values) if random.random() < 0.5 else values[0]


def _friction(random, places, around, n, breaks) -> Friction:
    """Levels that add up to about the same whatever the places; breakaway 1 or up to 1.5 times coulomb."""
    share = 1.0 / len(places)

    def held(value):
        if not breaks:
            return None
        factor = random.uniform(1.02, 1.5)
        if isinstance(value, tuple):
            return tuple(float(f"{v * factor:.6g}") for v in value)
        return float(f"{value * factor:.6g}")

    parts = {}
    if "axes" in places:
        coulomb = tuple(around(share * c) for c in (2.2, 1.5, 0.099))
        viscous = tuple(around(share * b) for b in (0.94, 0.96, 0.01))
        parts["axes"] = AxesFriction(viscous=viscous, coulomb=coulomb, breakaway=held(coulomb))
    if "direction" in places:
        one = around(share * 2.2)
        coulomb = (one, one) if random.random() < 0.4 else (one, around(one))
        yaw = around(share * 0.099)
        parts["direction"] = DirectionFriction(
            coulomb=coulomb,
            breakaway=held(coulomb),
            viscous=around(share * 0.9),
            yaw_coulomb=yaw,
            yaw_breakaway=held(yaw),
            yaw_viscous=around(share * 0.01),
        )
    if "wheels" in places:
        coulomb = tuple(around(share * 2.4 / n) for _ in range(n)) if random.random() < 0.5 else around(share * 2.4 / n)
        backward = None if random.random() < 0.5 else around(share * 2.4 / n)
        parts["wheels"] = WheelFriction(
            coulomb=coulomb,
            coulomb_backward=backward,
            breakaway=held(coulomb),
            breakaway_backward=None if backward is None else held(backward),
            viscous=around(share * 0.9 / n),
        )
    return Friction(**parts)


def random_voltages(robot: Robot, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """(voltage [V] (rows, wheels), dt [s] (rows,)) of about 1 s in rows of 5 to 50 ms.

    Stretches of: levels drawn anew, the last row reversed, everything off, a small push, a decaying push.
    """
    random = Random(f"voltages {seed} {REDRAWN.get(seed, 0)}")
    rows, lengths, n = [], [], robot.wheels.count
    last = [0.0] * n
    while sum(lengths) < 1.0:
        kind, scale = random.randrange(6), random.uniform(1.0, LIMIT_V)
        fresh = [random.uniform(-scale, scale) for _ in range(n)]
        for k in range(random.randrange(1, 5)):
            if kind <= 1:
                last = fresh
            elif kind == 2:
                last = [-u for u in last] if k == 0 else last
            elif kind == 3:
                last = [0.0] * n
            elif kind == 4:
                last = [0.12 * u for u in fresh]
            else:
                last = [0.6 * u for u in (fresh if k == 0 else last)]
            rows.append([round(u, 3) for u in last])
            lengths.append(round(random.uniform(5e-3, 50e-3), 4))
    return np.array(rows), np.array(lengths)
