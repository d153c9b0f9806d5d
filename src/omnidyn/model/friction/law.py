"""The contract of a friction law. One file per place where friction acts; the parts of a robot's friction add up.

How the level falls with the speed is one of the SHAPES of stribeck.py, what bends one of the LAWS of bristle.py, each
a file; what a table may say of them is a LawKind, with the Numbers that it takes.

A law acts between body and floor. It must:

1. balance energy: with a storage W(z) >= 0 of what it remembers, W(0) = 0, the power that it takes from the body is at
   least dW/dt. Without memory W = 0: it opposes motion. Dahl keeps to it; LuGre does where sigma1 fades with the speed
   (`damping_speed`), and may not where sigma1 is constant and large: the one exception, known (Olsson 1996) and said;
2. say how it rests. Set-valued (coulomb, Stribeck): at rest it exerts whatever balances the drive, up to a breakaway
   level, and rest is exact. With bristles it is a function of its state and never quite rests. With Karnopp's band it
   is at rest below a speed, and remembers the momentum that gathers (stick_slip/band.py). sgn(0) = 0, as printed in
   the paper, would let a robot creep inside its dead zone;
3. hold at least as much as it slides with: breakaway >= coulomb >= 0, element by element, forward and backward apart;
4. never smooth sgn: no tanh, no small speed below which it changes, but where the law itself is that (Karnopp);
5. derive at rest and at constant level from a convex potential of the velocity (maximum dissipation), so that the
   inclusion of stick_slip/inclusion.py has one solution and says by itself what sticks. Where its force falls with the
   speed it is not convex: its shape then bounds the fall (`steepest`), and steps are so short that inertia outweighs it
   (stick_slip/step_bound.py). What it remembers is eliminated from a stage (`rate`): its force is a function of the
   speed there;
6. say so in a plant: `add_to` adds its levels, and the numbers of its kind, to those of the elements on which it
   acts (model/layout.py). Solvers, step control, dead zone, feed-forward and derivatives ask there, and no law by name;
   but Karnopp's band, which has no derivatives, is refused by name.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

from omnidyn.model.layout import Plant

SPEED = ("m/s", "rad/s")


class Number(NamedTuple):
    """A number that a law takes: the field of a plant's records in which it stands (layout.py), about yaw over the
    length^power, or the inverse of it; and its units, along and about yaw."""

    field: str
    power: int = 0
    inverse: bool = False
    units: tuple[str, str] = ("", "")


@dataclass(frozen=True)
class LawKind:
    """A law that a table may choose by a word; kinds.py lists them.

    word: in the robot file; name: what people call it. takes: the keys that it takes beside those of every law. falls:
    whether its level may fall from breakaway with the speed. bends: whether it has bristles; drifts: whether those do,
    under a force that swings below breakaway. usual: of a key that may be left out, the number it is then, a function
    of (stiffness, mass, viscous). places: the tables that know it.
    """

    word: str
    name: str
    takes: Mapping[str, Number] = field(default_factory=dict)
    falls: bool = True
    bends: bool = False
    drifts: bool = True
    usual: Mapping[str, Callable[..., Any]] = field(default_factory=dict)
    places: tuple[str, ...] = ("axes", "direction", "wheels")


class FrictionLaw(Protocol):
    """What every family of friction provides: a frozen value type (its ranges checked) with this function."""

    def add_to(self, plant: Plant, length: float) -> None:
        """Add the levels to a plant, in place; its mass and the directions of its elements stand there already.

        `length` is rho [m] by which yaw is measured: a torque T
        counts as T/rho [N], a damping D [N m s] as D/rho^2 [N s/m], a speed omega as rho omega [m/s].
        """
        ...
