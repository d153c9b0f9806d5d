"""The contract of a friction law. One file per family; the parts of a robot's friction add up.

A law acts between body and floor. It must:

1. oppose motion: `sliding_wrench` is what it exerts on a moving body; its power is never positive;
2. be set-valued at rest: `holds(applied)` tells whether the set of wrenches it can exert at zero twist contains the
   balance of `applied`. sgn(0) = 0, as printed, would let a robot creep inside its dead zone;
3. say how much it can hold: `breakaway` >= `coulomb` >= 0, element by element;
4. never smooth sgn: no tanh, no small speed below which it changes.
"""

from __future__ import annotations

from typing import Protocol

from numpy.typing import ArrayLike, NDArray


class FrictionLaw(Protocol):
    """What every family of friction provides. Twists and wrenches have shape (*batch, 3)."""

    def sliding_wrench(self, twist: ArrayLike) -> NDArray:
        """Wrench on the moving body [N, N, N m]; an element at rest contributes nothing."""
        ...

    def wrench(self, twist: ArrayLike, applied: ArrayLike) -> NDArray:
        """Wrench on the body under the `applied` wrench [N, N, N m], the balance of rest included."""
        ...

    def holds(self, applied: ArrayLike) -> NDArray:
        """Whether a body at rest stays at rest under the `applied` wrench. Shape (*batch, 3), per element."""
        ...
