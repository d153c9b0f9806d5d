"""sample: many robots that may be meant, drawn from what is known of one, as a struct of arrays.

From a fit, or a robot file with std: all numbers that have one, with their correlations, by the scales and the Latin
hypercube of model/known/uncertainty.py. From ranges: each number evenly between its ends, apart from the others.

Numbers that only scale what moves a robot are drawn for a million robots at once, beside friction:

    push of a volt ~ l K_t/(R r),   back-EMF ~ l^2 K_t K_v/(R r^2)

in the order of operations of one robot, so that a sample moves as its robots do, to the last bit. Any other number, or
one that differs from wheel to wheel, takes a robot of its own for each draw: 0.2 ms.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from omnidyn.arguments import Rng, is_whole, seed_of
from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.model.keys import BODY_AXES, BREAKAWAY, COULOMB, DIRECTION, EMF, TORQUE, VISCOUS, Key, expand
from omnidyn.model.known.breakaway_levels import holding
from omnidyn.model.known.uncertainty import MOST_DRAWS, Draws
from omnidyn.model.mass import added_mass
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel, rim_speed, wrench_from_traction
from omnidyn.simulation.batch.parameters import BatchParameters, batch_parameters

MASS, INERTIA, RADIUS = "body.mass_kg", "body.inertia_kg_m2", "wheels.wheel_radius_m"
RESISTANCE, GEAR = "motor.resistance_ohm", "motor.gear_ratio"
MOTOR = (RESISTANCE, TORQUE, EMF, GEAR, RADIUS)  # they scale what motors do, alike at all wheels
SPINS = (GEAR, RADIUS)  # they also change the mass of what spins
LOG_NORMAL, NORMAL, EVEN = "log-normal", "normal", "even"  # how a number is drawn
SCALES = {LOG_NORMAL: "log-normal, the value is the median", NORMAL: "normal", EVEN: "even"}
LEVELS = (VISCOUS, COULOMB, BREAKAWAY)


class Sample(Sequence[Robot]):
    """Robots drawn around one. center: that robot; keys, values (n, keys): what was drawn, in the unit of each key.

    scales: how each number was drawn, "log-normal", "normal" or "even". parameters: of all of them, for blocks; None
    where each takes a robot of its own. A sequence of robots, each made as it is asked for.
    """

    def __init__(
        self,
        center: Robot,
        keys: Sequence[str],
        values: FloatArray,
        robot_of: Callable[[int], Robot],
        scales: Sequence[str] = (),
    ) -> None:
        self.center, self.keys, self.values, self._robot_of = center, tuple(keys), values, robot_of
        self.scales = tuple(scales) or (EVEN,) * len(self.keys)
        self.parameters = scaled_parameters(center, dict(zip(keys, values.T, strict=True)))

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, k: Any) -> Any:
        """Robot k, from the end where it is negative; a list of them for a slice."""
        places = range(len(self))[k]
        return self._robot_of(places) if isinstance(places, int) else [self._robot_of(place) for place in places]

    def robot(self, k: int) -> Robot:
        """Robot k of the sample. Raises InputError where there is none."""
        if not 0 <= operator.index(k) < len(self):
            raise InputError("no such robot", got=k, expected=f"0 to {len(self) - 1}", where="robot")
        return self[k]

    def __repr__(self) -> str:
        pairs = [*zip(self.keys, self.scales, strict=True)]
        words = [
            f"{SCALES[scale]}: {', '.join(key for key, own in pairs if own == scale)}"
            for scale in dict.fromkeys(self.scales)
        ]
        return f"<Sample of {len(self)} robots around {self.center.name}; {'; '.join(words)}>"


def sample(
    fit: Any,
    count: int,
    rng: Rng = 0,
    *,
    ranges: Mapping[str, tuple[float, float]] | None = None,
    factors: Mapping[str, tuple[float, float]] | None = None,
) -> Sample:
    """Robots that may be meant: by all std and correlations of a fit or of a robot, or by ranges of numbers.

    A std is one of the logarithm, std/value, where a number must be above 0 or a friction is twice its std or more: the
    value stays the median, and the mean of a number with a large std lies above it. Any other number is normal.
    What is drawn beyond a limit of the robot file comes back half-way as often as it takes; friction stays above 0, and
    breakaway is at least its Coulomb level. One seed gives the same robots, always.

    Args:
        fit: An estimate, or a robot.
        count: Number of robots.
        rng: A seed or a numpy.random.Generator of the draws.
        ranges: Key of a robot file -> (low, high), in its unit; that of a list stands for each entry.
        factors: The same in shares of the value, such as (0.8, 1.2).

    Raises InputError for a range that the robot cannot have, InsufficientDataError where nothing has a std.

    >>> import omnidyn
    >>> robots = omnidyn.sample(omnidyn.load_robot("axebot"), 3, factors={"body.mass_kg": (0.8, 1.2)})
    >>> omnidyn.simulate_batch(robots, [[0.0, 3.0, -3.0]] * 50, dt=0.02).end.twist.shape
    (3, 3)
    """
    center = fit if isinstance(fit, Robot) else getattr(fit, "robot", None)
    if not isinstance(center, Robot):
        raise InputError("cannot draw robots from this", got=type(fit).__name__, expected="an estimate, or a robot")
    if not is_whole(count) or not 1 <= count <= MOST_DRAWS:
        raise InputError("strange number of draws", got=count, expected=f"1 to {MOST_DRAWS}", where="count")
    seed = seed_of(rng)
    if ranges is None and factors is None:
        draws = Draws(center, count, seed)
        keys, values = [str(key) for key in draws.keys], draws.values
        found = Sample(center, keys, values, draws.robot, [LOG_NORMAL if log else NORMAL for log in draws.log])
        ends = [values.min(axis=0), values.max(axis=0)]
        if found.parameters is not None and not all(_is_allowed(center, keys, end) for end in ends):
            found.parameters = batch_parameters(list(found))
        return found
    ends = _ends(center, ranges or {}, factors or {})
    low, high = np.array(list(ends.values())).T
    values = low + (high - low) * np.random.default_rng(seed).random((count, len(ends)))
    keys = [Key.parse(name) for name in ends]
    return Sample(center, list(ends), values, partial(_row, center, keys, values))


def _ends(
    center: Robot, ranges: Mapping[str, tuple[float, float]], factors: Mapping[str, tuple[float, float]]
) -> dict[str, tuple[float, float]]:
    """Key -> lowest and highest value. Raises InputError for a range that the robot cannot have."""
    ends: dict[str, tuple[float, float]] = {}
    for given, name, pair in [(ranges, name, ranges[name]) for name in ranges] + [
        (factors, name, factors[name]) for name in factors
    ]:
        where = "ranges" if given is ranges else "factors"
        for text in expand(name, center):
            key = Key.parse(text)
            value = float(key.get(center))
            try:
                low, high = (float(end) * (value if given is factors else 1.0) for end in pair)
            except (TypeError, ValueError):
                raise InputError("not a range", got=pair, expected="(low, high)", where=f"{where}, {name}") from None
            if text in ends or not low <= high:
                expected = "low <= high" if text not in ends else "each number once"
                raise InputError("not a range", got=pair, expected=expected, where=f"{where}, {name}")
            for end in (low, high):
                _check(center, text, end)
            ends[text] = low, high
    return ends


def _row(center: Robot, keys: Sequence[Key], values: FloatArray, k: int) -> Robot:
    return _with(center, keys, values[k])


def _with(center: Robot, keys: Sequence[Key], values: FloatArray) -> Robot:
    robot = center
    for key, value in zip(keys, values.tolist(), strict=True):
        robot = key.set(robot, value, checked=False)
    return holding(robot)


def _check(center: Robot, name: str, value: float) -> None:
    """Raises InputError where a robot file may not have this number, breakaway being at least its Coulomb level."""
    key = Key.parse(name)
    if not key.level:
        key.set(center, value)
        return
    law = getattr(holding(key.set(center, value, checked=False)).friction, key.table.rpartition(".")[2])
    law.replace()


def _is_allowed(center: Robot, keys: Sequence[str], values: FloatArray) -> bool:
    try:
        for name, value in zip(keys, values.tolist(), strict=True):
            _check(center, name, value)
    except InputError:
        return False
    return True


def scaled_parameters(center: Robot, drawn: Mapping[str, FloatArray]) -> BatchParameters | None:
    """The numbers of robots like `center` but for what was drawn, key -> values (n,); None where one does not scale."""
    spins = added_mass(center).any()
    if not all(_scales(name) and not (spins and name in SPINS) for name in drawn) or any(center.body.centre):
        return None
    count = len(next(iter(drawn.values())))

    def level(table: str, field: str) -> FloatArray:
        """A level of friction along the three axes, shape (3, n)."""
        names = [f"{table}.{field}[{axis}]" for axis in range(3)]
        if table == DIRECTION:
            names[2] = f"{table}.yaw_{field}"
            if field == VISCOUS:
                names[:2] = [f"{table}.{field}"] * 2
        return np.array([drawn.get(name, np.full(count, float(Key.parse(name).get(center)))) for name in names])

    driving, braking = _motors(center, drawn, count)
    damping = level(BODY_AXES, VISCOUS) + level(DIRECTION, VISCOUS)
    slides, along = level(BODY_AXES, COULOMB), level(DIRECTION, COULOMB)
    holds = slides if center.friction.axes.breakaway is None else np.maximum(slides, level(BODY_AXES, BREAKAWAY))
    mass, inertia = (drawn.get(name, np.full(count, value)) for name, value in _body(center))
    spin = np.diag(added_mass(center))[:, None]
    return BatchParameters(
        driving,
        damping - braking,
        slides + along,
        holds + along,
        np.stack([mass, mass, inertia]) + spin,
        mass,
    )


def _motors(center: Robot, drawn: Mapping[str, FloatArray], count: int) -> tuple[FloatArray, FloatArray]:
    """What motors do per volt, shape (3, wheels, n), and per speed of each axis, shape (3, n): `motor_wrench` of each.

    The same operations in the same order as `settled_current`, `traction` and `wrench_from_traction`.
    """
    wheels = center.wheels
    names = {RESISTANCE: "resistance", TORQUE: "torque_constant", EMF: "emf_constant", GEAR: "gear_ratio"}
    base = {key: per_wheel(getattr(center.motor, name), wheels.count) for key, name in names.items()}
    base[RADIUS] = wheels.radii
    resistance, torque, emf, gear, radius = (drawn[key][:, None, None] if key in drawn else base[key] for key in MOTOR)
    speed = rim_speed(wheels, np.eye(3)) / radius
    volts = np.eye(wheels.count)[None], 0.0 - emf * gear * speed
    per_volt, per_speed = (
        wrench_from_traction(wheels, gear * torque * (driving / resistance) / radius) for driving in volts
    )
    per_volt = np.broadcast_to(per_volt, (count, wheels.count, 3))
    braking = np.broadcast_to(per_speed, (count, 3, 3)).diagonal(axis1=1, axis2=2)
    return np.ascontiguousarray(per_volt.transpose(2, 1, 0) + 0.0), np.ascontiguousarray(braking.T)


def _body(center: Robot) -> list[tuple[str, float]]:
    return [(MASS, center.body.mass), (INERTIA, center.body.inertia)]


def _scales(name: str) -> bool:
    """Whether a number enters by a scale or as a level."""
    if name in MOTOR or name in (MASS, INERTIA):
        return True
    key = Key.parse(name)
    return (
        key.table in (BODY_AXES, DIRECTION)
        and key.field.removeprefix("yaw_") in LEVELS
        and not (key.table == DIRECTION and BREAKAWAY in key.field)
    )
