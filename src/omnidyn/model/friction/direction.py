"""Friction along the direction of travel: a disc or an ellipse in (v_x, v_y), and a torque about yaw.

    potential  D(v) = sqrt(Cx^2 vx^2 + Cy^2 vy^2)      maximum dissipation; Cx = Cy is a disc, C v/|v|
    sliding    F = -(Cx^2 vx, Cy^2 vy)/D - B v
    at rest    F anywhere in the ellipse (Fx/Sx)^2 + (Fy/Sy)^2 <= 1

On real floors the force is collinear with the velocity and of constant size (252 runs of a Robotino): the shape the
box of eqs (4)-(6) misses.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import BeforeValidator, Field, model_validator

from omnidyn.arrays import FloatArray
from omnidyn.model.layout import HOLD, HOLD_X, HOLD_Y, N_AXES, SLIDE, SLIDE_X, SLIDE_Y, VISCOUS, YAW
from omnidyn.model.value import Value, number, to_list

Level = Annotated[float, number(0.0, 1e6)]
Pair = Annotated[tuple[Level, Level], BeforeValidator(to_list)]


class DirectionFriction(Value):
    """Friction that follows the direction of travel.

    coulomb: (Cx, Cy) [N]; viscous: B [N s/m], the same in every direction; breakaway: (Sx, Sy) >= coulomb [N].
    yaw_coulomb [N m], yaw_viscous [N m s], yaw_breakaway >= yaw_coulomb [N m]: about the vertical axis.
    """

    coulomb: Annotated[Pair, Field(description="(Cx, Cy) [N]; equal = a disc")] = (0.0, 0.0)
    breakaway: Annotated[Pair | None, Field(description="(Sx, Sy) >= coulomb [N]")] = None
    viscous: Annotated[Level, Field(description="B [N s/m]")] = 0.0
    yaw_coulomb: Annotated[Level, Field(description="[N m]")] = 0.0
    yaw_breakaway: Annotated[Level | None, Field(description=">= yaw_coulomb [N m]")] = None
    yaw_viscous: Annotated[Level, Field(description="[N m s]")] = 0.0

    def add_to(self, body: FloatArray, element: FloatArray, length: float) -> None:
        """Add the ellipse, the same damping in every direction, and what resists turning; see FrictionLaw."""
        body[[SLIDE_X, SLIDE_Y]] += self.coulomb
        body[[HOLD_X, HOLD_Y]] += self.coulomb if self.breakaway is None else self.breakaway
        yaw_hold = self.yaw_coulomb if self.yaw_breakaway is None else self.yaw_breakaway
        element[:N_AXES, VISCOUS] += [self.viscous, self.viscous, self.yaw_viscous / length**2]
        element[YAW, SLIDE : SLIDE + 2] += self.yaw_coulomb / length
        element[YAW, HOLD : HOLD + 2] += yaw_hold / length

    @model_validator(mode="after")
    def _levels_in_order(self) -> DirectionFriction:
        x, y = self.coulomb
        if (x == 0.0) != (y == 0.0):
            raise ValueError(f"coulomb {[x, y]} is flat; give both entries, or use [friction.axes] for one axis")
        if self.breakaway is not None and (self.breakaway[0] < x or self.breakaway[1] < y):
            raise ValueError(f"breakaway {list(self.breakaway)} is below coulomb {list(self.coulomb)}")
        if self.yaw_breakaway is not None and self.yaw_breakaway < self.yaw_coulomb:
            raise ValueError(f"yaw_breakaway {self.yaw_breakaway} is below yaw_coulomb {self.yaw_coulomb}")
        return self
