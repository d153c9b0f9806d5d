"""Friction at the wheels: each resists along its own rolling direction, at the rim. Laws: kinds.py.

sliding    f_i = -(b_i s_i + c_i sgn s_i),  s_i = g_i . twist the rim speed;  c_i may differ forward and backward
at rest    -S_forward <= f_i <= S_backward
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from omnidyn.model.friction.kinds import WHEELS, refuse_mixtures, spread_on, words_of
from omnidyn.model.friction.stribeck import LARGEST_EXPONENT, LEAST_EXPONENT, SHAPES, USUAL_EXPONENT
from omnidyn.model.layout import N_AXES, Plant
from omnidyn.model.value import PerWheel, Value, number, per_wheel_number, word_of

Level = Annotated[PerWheel, per_wheel_number(0.0, 1e6)]
Speed = Annotated[PerWheel, per_wheel_number(1e-7, 1e3)]
Stiffness = Annotated[PerWheel, per_wheel_number(1e-3, 1e12)]


class WheelFriction(Value):
    """Friction of wheels, bearings and gears, seen at the rim; a tuple means one value per wheel.

    coulomb: c [N] while the wheel turns forward, and backward too unless coulomb_backward says otherwise.
    breakaway, breakaway_backward: what holds a wheel at rest [N], at least as large. viscous: b [N s/m]. law and the
    numbers that it takes: kinds.py.
    """

    coulomb: Annotated[Level, Field(description="c [N] at the rim")] = 0.0
    coulomb_backward: Annotated[Level | None, Field(description="c [N] while it turns backward")] = None
    breakaway: Annotated[Level | None, Field(description=">= coulomb [N]")] = None
    breakaway_backward: Annotated[Level | None, Field(description=">= coulomb_backward [N]")] = None
    viscous: Annotated[Level, Field(description="b [N s/m] at the rim")] = 0.0
    law: Annotated[Annotated[str, word_of(*words_of(WHEELS))], Field(description="what kind of law")] = "coulomb"
    stribeck_speed: Annotated[Speed | None, Field(description="v_s [m/s] of the rim")] = None
    stribeck_exponent: Annotated[Annotated[float, number(LEAST_EXPONENT, LARGEST_EXPONENT)], Field(description="d")] = (
        USUAL_EXPONENT
    )
    stribeck_shape: Annotated[Annotated[str, word_of(*SHAPES)], Field(description="f of the fall")] = "exponential"
    karnopp_speed: Annotated[Speed, Field(description="Dv [m/s] of the rim")] = 1e-4
    stiffness: Annotated[Stiffness | None, Field(description="sigma0 [N/m] at the rim")] = None
    damping: Annotated[Level | None, Field(description="sigma1 [N s/m] at the rim")] = None
    damping_speed: Annotated[Speed | None, Field(description="v_d [m/s] of the rim")] = None
    dahl_exponent: Annotated[Annotated[float, number(0.5, 4.0)], Field(description="a")] = 1.0
    elastic_share: Annotated[Annotated[float, number(0.0, 0.99)], Field(description="b")] = 0.7

    @property
    def backward(self) -> float | tuple[float, ...]:
        """Coulomb level of a wheel that turns backward [N]."""
        return self.coulomb if self.coulomb_backward is None else self.coulomb_backward

    @property
    def hold_forward(self) -> float | tuple[float, ...]:
        """Level up to which a wheel at rest resists being turned forward [N]."""
        return self.coulomb if self.breakaway is None else self.breakaway

    @property
    def hold_backward(self) -> float | tuple[float, ...]:
        """Level up to which a wheel at rest resists being turned backward [N]."""
        if self.breakaway_backward is not None:
            return self.breakaway_backward
        return self.backward if self.breakaway is None or self.coulomb_backward is not None else self.breakaway

    def add_to(self, plant: Plant, length: float) -> None:
        """Add the levels of each wheel, forward and backward; see FrictionLaw."""
        wheels = plant.element[N_AXES:]
        wheels["viscous"] += self.viscous
        slide, hold = np.empty((len(wheels), 2)), np.empty((len(wheels), 2))
        slide[:, 0], slide[:, 1], hold[:, 0], hold[:, 1] = (
            self.coulomb,
            self.backward,
            self.hold_forward,
            self.hold_backward,
        )
        mass_at_wheel = plant.body.mass / np.maximum((wheels["g"] ** 2).sum(axis=1), 1e-300)
        spread_on(self, wheels, slide, hold, mass_at_wheel, wheels["viscous"])

    @model_validator(mode="after")
    def _breakaway_at_least_coulomb(self) -> WheelFriction:
        forward = self.hold_forward, self.coulomb, "breakaway"
        backward = self.hold_backward, self.backward, "breakaway_backward"
        for hold, slide, name in (forward, backward):
            if any(s < c for s, c in _pairs(hold, slide)):
                raise ValueError(f"{name} {hold} is below coulomb {slide}")
        refuse_mixtures(self)
        return self


def _pairs(a: float | tuple[float, ...], b: float | tuple[float, ...]) -> list[tuple[float, float]]:
    """Entries of two per-wheel values side by side; one number serves all wheels."""
    count = max(len(value) if isinstance(value, tuple) else 1 for value in (a, b))
    first = a if isinstance(a, tuple) else (a,) * count
    second = b if isinstance(b, tuple) else (b,) * count
    return list(zip(first, second, strict=False))
