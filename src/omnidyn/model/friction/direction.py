"""Friction along the direction of travel: a disc or an ellipse in (v_x, v_y), and a torque about yaw. Laws: kinds.py.

    potential  D(v) = sqrt(Cx^2 vx^2 + Cy^2 vy^2)      maximum dissipation; Cx = Cy is a disc, C v/|v|
    sliding    F = -(Cx^2 vx, Cy^2 vy)/D - B v;   with ellipse = "plain"   F = -(Cx vx, Cy vy)/|v| - B v
    at rest    F anywhere in the ellipse (Fx/Sx)^2 + (Fy/Sy)^2 <= 1
    Stribeck   Cx and Cy fall with |v| from Sx and Sy
    bristle    F = -(sigma0 z + sigma1 z') - B v, z a vector that turns with the body, its rate in the file of each law

The force of the plain ellipse turns half as far from the direction of travel. It has no potential: item 5 of law.py
holds but for terms of second order in (Cx - Cy)/(Cx + Cy). It rests as the other does.

On real floors the force is collinear with the velocity and of constant size (252 runs of a Robotino): the shape the
box of eqs (4)-(6) misses.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from omnidyn.arrays import FloatArray
from omnidyn.model.friction.kinds import COULOMB, DIRECTION, refuse_mixtures, spread_on, words_of
from omnidyn.model.friction.stribeck import LARGEST_EXPONENT, LEAST_EXPONENT, SHAPES, USUAL_EXPONENT
from omnidyn.model.layout import N_AXES, YAW, Plant
from omnidyn.model.value import Value, number, to_list, word_of

Level = Annotated[float, number(0.0, 1e6)]
Pair = Annotated[tuple[Level, Level], BeforeValidator(to_list)]
Speed = Annotated[float, number(1e-7, 1e3)]
Stiffness = Annotated[float, number(1e-3, 1e12)]
DISSIPATION, PLAIN = "dissipation", "plain"


class DirectionFriction(Value):
    """Friction that follows the direction of travel.

    coulomb: (Cx, Cy) [N]; viscous: B [N s/m], the same in every direction; breakaway: (Sx, Sy) >= coulomb [N].
    yaw_coulomb [N m], yaw_viscous [N m s], yaw_breakaway >= yaw_coulomb [N m]: about the vertical axis. ellipse: where
    the force of unequal levels points, "dissipation" or "plain". law and the numbers that it takes: kinds.py; yaw_...:
    those about the vertical axis.
    """

    coulomb: Annotated[Pair, Field(description="(Cx, Cy) [N]; equal = a disc")] = (0.0, 0.0)
    breakaway: Annotated[Pair | None, Field(description="(Sx, Sy) >= coulomb [N]")] = None
    viscous: Annotated[Level, Field(description="B [N s/m]")] = 0.0
    yaw_coulomb: Annotated[Level, Field(description="[N m]")] = 0.0
    yaw_breakaway: Annotated[Level | None, Field(description=">= yaw_coulomb [N m]")] = None
    yaw_viscous: Annotated[Level, Field(description="[N m s]")] = 0.0
    ellipse: Annotated[
        Annotated[str, word_of(DISSIPATION, PLAIN)], Field(description="(Cx^2 vx, Cy^2 vy)/D, or (Cx vx, Cy vy)/|v|")
    ] = DISSIPATION
    law: Annotated[Annotated[str, word_of(*words_of(DIRECTION))], Field(description="what kind of law")] = "coulomb"
    stribeck_speed: Annotated[Speed | None, Field(description="v_s [m/s]")] = None
    yaw_stribeck_speed: Annotated[Speed | None, Field(description="v_s [rad/s]")] = None
    stribeck_exponent: Annotated[Annotated[float, number(LEAST_EXPONENT, LARGEST_EXPONENT)], Field(description="d")] = (
        USUAL_EXPONENT
    )
    stribeck_shape: Annotated[Annotated[str, word_of(*SHAPES)], Field(description="f of the fall")] = "exponential"
    karnopp_speed: Annotated[Speed, Field(description="Dv [m/s]")] = 1e-4
    yaw_karnopp_speed: Annotated[Speed, Field(description="Dv [rad/s]")] = 1e-4
    stiffness: Annotated[Stiffness | None, Field(description="sigma0 [N/m]")] = None
    yaw_stiffness: Annotated[Stiffness | None, Field(description="sigma0 [N m/rad]")] = None
    damping: Annotated[Level | None, Field(description="sigma1 [N s/m]")] = None
    yaw_damping: Annotated[Level | None, Field(description="sigma1 [N m s]")] = None
    damping_speed: Annotated[Speed | None, Field(description="v_d [m/s]")] = None
    yaw_damping_speed: Annotated[Speed | None, Field(description="v_d [rad/s]")] = None
    dahl_exponent: Annotated[Annotated[float, number(0.5, 4.0)], Field(description="a")] = 1.0
    elastic_share: Annotated[Annotated[float, number(0.0, 0.99)], Field(description="b")] = 0.7

    @property
    def holds_all(self) -> bool:
        """Whether there is no way, along or about, in which nothing holds."""
        return min(*self.coulomb, self.yaw_coulomb) > 0.0

    def held_share(self, applied: FloatArray) -> FloatArray:
        """How much of what holds at rest a wrench takes: above 1 it gives way. Shape (*batch, 3) -> (*batch,)."""
        hold = self.coulomb if self.breakaway is None else self.breakaway
        yaw_hold = self.yaw_coulomb if self.yaw_breakaway is None else self.yaw_breakaway
        along = np.hypot(applied[..., 0] / hold[0], applied[..., 1] / hold[1])
        return np.maximum(along, np.abs(applied[..., 2]) / yaw_hold)

    def add_to(self, plant: Plant, length: float) -> None:
        """Add the ellipse, the same damping in every direction, and what resists turning; see FrictionLaw."""
        plant.element["viscous"][:N_AXES] += [self.viscous, self.viscous, self.yaw_viscous / length**2]
        body, turning = plant.body, plant.element[YAW : YAW + 1]
        body.plain = float(self.ellipse == PLAIN)
        hold = np.array(self.coulomb if self.breakaway is None else self.breakaway)
        spread_on(self, body, np.array(self.coulomb), hold, float(body.mass), self.viscous)
        yaw_hold = self.yaw_coulomb if self.yaw_breakaway is None else self.yaw_breakaway
        slide, hold = np.full((1, 2), self.yaw_coulomb / length), np.full((1, 2), yaw_hold / length)
        spread_on(self, turning, slide, hold, float(body.mass), turning["viscous"], length, "yaw_")

    @model_validator(mode="after")
    def _levels_in_order(self) -> DirectionFriction:
        x, y = self.coulomb
        if (x == 0.0) != (y == 0.0):
            raise ValueError(f"coulomb {[x, y]} is flat; give both entries, or use [friction.axes] for one axis")
        if self.breakaway is not None and (self.breakaway[0] < x or self.breakaway[1] < y):
            raise ValueError(f"breakaway {list(self.breakaway)} is below coulomb {list(self.coulomb)}")
        if self.yaw_breakaway is not None and self.yaw_breakaway < self.yaw_coulomb:
            raise ValueError(f"yaw_breakaway {self.yaw_breakaway} is below yaw_coulomb {self.yaw_coulomb}")
        if self.ellipse == PLAIN and (self.law != COULOMB or self.stribeck_speed is not None):
            raise ValueError(
                f'ellipse = "{PLAIN}" is of law = "{COULOMB}" without stribeck_speed; take ellipse = "{DISSIPATION}" '
                "beside other laws"
            )
        refuse_mixtures(self)
        refuse_mixtures(self, "yaw_")
        return self
