"""The contract of a friction law. One file per place where friction acts; the parts of a robot's friction add up.

A law acts between body and floor. It must:

1. oppose motion: its power is never positive;
2. be set-valued at rest: it exerts whatever balances the drive, up to a breakaway level. sgn(0) = 0, as printed in the
   paper, would let a robot creep inside its dead zone;
3. hold at least as much as it slides with: breakaway >= coulomb >= 0, element by element;
4. never smooth sgn: no tanh, no small speed below which it changes;
5. derive from a convex potential of the velocity (maximum dissipation), so that the inclusion of
   stick_slip/inclusion.py has one solution and says by itself what sticks;
6. say so in two tables: `add_to` adds its levels to those of the elements on which it acts. That is all the solvers,
   the dead zone and the derivatives need.
"""

from __future__ import annotations

from typing import Protocol

from omnidyn.arrays import FloatArray


class FrictionLaw(Protocol):
    """What every family of friction provides: a frozen value type (its ranges checked) with this function."""

    def add_to(self, body: FloatArray, element: FloatArray, length: float) -> None:
        """Add the levels to the tables of a plant, in place.

        body: shape (BODY_SIZE,), element: shape (3 + wheels, ELEMENT_SIZE), entries named in layout.py. `length` is
        rho [m] by which yaw is measured: a torque T counts as T/rho [N], a damping D [N m s] as D/rho^2 [N s/m].
        """
        ...
