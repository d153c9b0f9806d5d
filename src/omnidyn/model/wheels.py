"""Wheels: where they stand and how they push. One matrix, the wrench matrix G; eqs (3), (7)-(9) follow from it.

    wrench    = G f            (7)-(9): traction f_i of the wheels [N] to (F_x, F_y, T) [N, N, N m]
    rim speed = G^T twist      (3): by conservation of power, f . rim speed = wrench . twist

Column i for a wheel at azimuth phi, at distance b from the centre, with rollers at angle gamma:

    [-sin phi - tan gamma cos phi,  cos phi - tan gamma sin phi,  b]

gamma = 0 is an omni wheel. For a mecanum wheel phi is the azimuth of its axle, gamma the roller angle
(+-45 degrees), and b = half track + |tan gamma| wheelbase/2: where it stands follows from b and the wheelbase alone.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BeforeValidator, Field, model_validator

from omnidyn.arrays import FloatArray
from omnidyn.errors import UnsupportedError
from omnidyn.model.value import PerWheel, Value, number, per_wheel_number, to_list

MIN_WHEELS, MAX_WHEELS = 3, 16
WHEEL_RADII, ROBOT_RADII = (2e-3, 0.5), (5e-3, 5.0)  # [m] what robots have: of a wheel, from the centre to a wheel
SIN_45, SIN_60 = 0.5**0.5, 0.75**0.5
MAX_CONDITION = 1e6  # of G scaled by the robot radius: beyond it the wheels cannot move the robot in every direction


class Wheels(Value):
    """The wheels of a robot; a tuple means one value per wheel.

    azimuth_deg: where each wheel stands, seen from the centre, counter-clockwise from forward [degree].
    robot_radius: distance b from the centre to the wheels [m]. wheel_radius: r [m].
    roller_angle_deg: 0 for omni wheels, +-45 for mecanum wheels [degree]. wheel_inertia: of a wheel about its axle
    [kg m^2]. wheelbase: of mecanum wheels, from the axles in front to those behind [m]; None: not known, and only what
    they carry depends on it. traction_mu: of what a wheel carries, the share beyond which it slips; None: never.
    """

    azimuth_deg: Annotated[
        tuple[Annotated[float, number(-360.0, 360.0)], ...],
        BeforeValidator(to_list),
        Field(min_length=MIN_WHEELS, max_length=MAX_WHEELS, description="counter-clockwise from forward"),
    ]
    robot_radius: Annotated[
        PerWheel, per_wheel_number(1e-3, 100.0), Field(alias="robot_radius_m", description="b, centre to wheel")
    ]
    wheel_radius: Annotated[PerWheel, per_wheel_number(1e-3, 10.0), Field(alias="wheel_radius_m", description="r")]
    roller_angle_deg: Annotated[
        PerWheel, per_wheel_number(-80.0, 80.0), Field(description="0 = omni, +-45 = mecanum")
    ] = 0.0
    wheel_inertia: Annotated[
        PerWheel,
        per_wheel_number(0.0, 1e4),
        Field(alias="inertia_kg_m2", description="J_w, of one wheel about its axle"),
    ] = 0.0
    wheelbase: Annotated[
        Annotated[float, number(1e-3, 100.0)] | None,
        Field(alias="wheelbase_m", description="of mecanum wheels, from the axles in front to those behind"),
    ] = None
    traction_mu: Annotated[
        Annotated[PerWheel, per_wheel_number(1e-3, 100.0)] | None,
        Field(description="mu, what the floor takes over the load"),
    ] = None

    @model_validator(mode="after")
    def _moves_in_every_direction(self) -> Wheels:
        for name in ("robot_radius", "wheel_radius", "roller_angle_deg", "wheel_inertia", "traction_mu"):
            check_count(name, getattr(self, name), self.count)
        scaled = self.wrench_matrix / np.array([[1.0], [1.0], [np.mean(self.robot_radius)]])
        if np.linalg.cond(scaled) > MAX_CONDITION:
            raise ValueError(f"wheels at azimuths {list(self.azimuth_deg)} cannot move the robot in every direction")
        if self.wheelbase is not None:
            self._refuse_wheelbase(self.wheelbase)
        return self

    def _refuse_wheelbase(self, wheelbase: float) -> None:
        """Raises ValueError for one of omni wheels, or one that leaves no track."""
        sin, cos = sin_cos_deg(per_wheel(self.roller_angle_deg, self.count))
        if not sin.all():
            raise ValueError(f"wheelbase_m {wheelbase} is of mecanum wheels; roller_angle_deg has a 0: leave it out")
        largest = float((2.0 * per_wheel(self.robot_radius, self.count) * cos / np.abs(sin)).min())
        if wheelbase >= largest:
            raise ValueError(
                f"wheelbase_m {wheelbase} leaves no track: robot_radius_m is half track + half wheelbase; expected "
                f"less than {largest:.4g}"
            )

    @property
    def count(self) -> int:
        """Number of wheels."""
        return len(self.azimuth_deg)

    @property
    def azimuth(self) -> FloatArray:
        """Wheel azimuths [rad]. Shape (wheels,)."""
        return np.radians(self.azimuth_deg)

    @property
    def radii(self) -> FloatArray:
        """Wheel radius of each wheel [m]. Shape (wheels,)."""
        return per_wheel(self.wheel_radius, self.count)

    @property
    def places(self) -> FloatArray | None:
        """Where the wheels touch the floor, x and y from the centre [m]. Shape (2, wheels); None: no key says it.

        Along the axle (cos phi, sin phi): b - |tan gamma| wheelbase/2; across it: sign(gamma) wheelbase/2.
        """
        sin, cos = sin_cos_deg(self.azimuth_deg)
        roller_sin, roller_cos = sin_cos_deg(per_wheel(self.roller_angle_deg, self.count))
        if self.wheelbase is None and roller_sin.any():
            return None
        ahead = 0.5 * (self.wheelbase or 0.0) * np.sign(roller_sin)
        out = per_wheel(self.robot_radius, self.count) - ahead * roller_sin / roller_cos
        return np.stack([out * cos - ahead * sin, out * sin + ahead * cos])

    @property
    def wrench_matrix(self) -> FloatArray:
        """G of eqs (7)-(9): wrench = G @ traction. Shape (3, wheels), read-only. Exact zeros at multiples of 30 deg."""
        return _wrench_matrix(self)  # pyright: ignore[reportArgumentType]


@lru_cache(maxsize=256)
def _wrench_matrix(wheels: Wheels) -> FloatArray:
    sin, cos = sin_cos_deg(wheels.azimuth_deg)
    roller_sin, roller_cos = sin_cos_deg(per_wheel(wheels.roller_angle_deg, wheels.count))
    tan = roller_sin / roller_cos
    matrix = np.stack([-sin - tan * cos, cos - tan * sin, per_wheel(wheels.robot_radius, wheels.count)]) + 0.0
    matrix.flags.writeable = False
    return matrix


def per_wheel(value: PerWheel, count: int) -> FloatArray:
    """`value` as an array with one entry per wheel. Shape (count,)."""
    return np.full(count, value, dtype=float)


def check_count(name: str, value: PerWheel | None, count: int) -> None:
    """Raises ValueError when `value` is a tuple of another length than there are wheels."""
    if isinstance(value, tuple) and len(value) != count:
        raise ValueError(f"{name} has {len(value)} values; expected 1, or one per wheel ({count})")


def sin_cos_deg(angle: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Sine and cosine of an angle in degrees, exact where they are 0, 1/2 or 1. Shape (*batch,) each.

    A wheel that should not turn must not turn: sin(radians(180)) is 1.2e-16, here it is 0.
    """
    angle = np.asarray(angle, dtype=float)
    turned = np.fmod(np.abs(angle), 360.0)
    half = np.where(turned > 180.0, 360.0 - turned, turned)
    sin, cos = _quarter_sin_cos(np.where(half > 90.0, 180.0 - half, half))
    negative = (turned > 180.0) ^ (angle < 0.0)
    return np.where(negative, -sin, sin) + 0.0, np.where(half > 90.0, -cos, cos) + 0.0


def _quarter_sin_cos(angle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Sine and cosine of angles in [0, 90] degrees; folded, so that mirrored wheels get equal numbers."""
    sin, cos = np.sin(np.radians(angle)), np.cos(np.radians(angle))
    exact_values = {0.0: (0.0, 1.0), 30.0: (0.5, SIN_60), 45.0: (SIN_45, SIN_45), 60.0: (SIN_60, 0.5), 90.0: (1.0, 0.0)}
    for degrees, (exact_sin, exact_cos) in exact_values.items():
        sin, cos = np.where(angle == degrees, exact_sin, sin), np.where(angle == degrees, exact_cos, cos)
    return sin, cos


def rim_speed(wheels: Wheels, twist: ArrayLike) -> FloatArray:
    """Speed of the wheel rims over the floor, G^T twist [m/s]; the rows of eq (3) times r.

    `twist` [m/s, m/s, rad/s], shape (*batch, 3). Returns shape (*batch, wheels).
    """
    return _product(np.asanyarray(twist, dtype=float), wheels.wrench_matrix.T)


def wheel_speed(wheels: Wheels, twist: ArrayLike) -> FloatArray:
    """Angular speed of the wheels, G^T twist / r [rad/s], eq (3) solved for the wheels.

    `twist` [m/s, m/s, rad/s], shape (*batch, 3). Returns shape (*batch, wheels).
    """
    return rim_speed(wheels, twist) / wheels.radii


def twist_from_wheel_speed(wheels: Wheels, speed: ArrayLike) -> FloatArray:
    """Twist of the robot from its wheel speeds, eq (3); least squares where there are more than three wheels.

    The printed row of v_n has the wrong sign for wheel 1; this is the pseudo-inverse of G^T instead.
    `speed` [rad/s], shape (*batch, wheels). Returns shape (*batch, 3) [m/s, m/s, rad/s].
    """
    inverse = np.asarray(np.linalg.pinv(wheels.wrench_matrix.T), dtype=float)
    return _product(np.asarray(speed, dtype=float) * wheels.radii, inverse)


def wrench_from_traction(wheels: Wheels, traction: ArrayLike) -> FloatArray:
    """Wrench on the body, G f, eqs (7)-(9).

    `traction` [N], shape (*batch, wheels). Returns (F_x, F_y, T) [N, N, N m], shape (*batch, 3).
    """
    return _product(np.asarray(traction, dtype=float), wheels.wrench_matrix)


def _product(vectors: FloatArray, matrix: FloatArray) -> FloatArray:
    """matrix @ vector for each vector of a batch, summed in a fixed order: equal inputs give equal zeros anywhere."""
    total = np.zeros_like(vectors, shape=(*vectors.shape[:-1], matrix.shape[0]))
    for column in range(matrix.shape[1]):
        total += vectors[..., column, None] * matrix[:, column]
    return total


def refuse_slip(wheels: Wheels, user: str) -> None:
    """Raises UnsupportedError where wheels may slip, for `user` knows only wheels that roll."""
    if wheels.traction_mu is not None:
        raise UnsupportedError(
            f"{user} no wheels that slip",
            got=f"traction_mu = {wheels.traction_mu}",
            expected="wheels that roll",
            remedy="take the robot without it",
            where="[wheels] traction_mu",
        )
