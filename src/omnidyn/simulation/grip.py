"""Which wheels lost their grip in a run, and which have none."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from omnidyn.model.robot import Robot
from omnidyn.simulation.slip.plant import wheel_loads
from omnidyn.simulation.slip.slip_march import SlipOutcome
from omnidyn.statement import WARNING, Statement


class Grip(NamedTuple):
    """What a run, or stretches of it one after the other, showed of the wheels of a robot.

    rows, states: how many; capped: rows in which the solver hit its cap. spun: states in which a wheel slipped, lifted:
    rows in which it would have to be held down, shape (wheels,).
    """

    rows: int
    states: int
    capped: int
    spun: NDArray[np.intp]
    lifted: NDArray[np.intp]

    @classmethod
    def none(cls, wheels: int) -> Grip:
        """Before anything moved."""
        return cls(0, 0, 0, np.zeros(wheels, int), np.zeros(wheels, int))

    def with_run(self, out: SlipOutcome) -> Grip:
        """After another stretch."""
        first = 1 if self.states else 0  # where the one before ended
        return Grip(
            self.rows + len(out.contact) - 1,
            self.states + len(out.contact) - first,
            self.capped + out.capped,
            self.spun + (out.contact[first:] != 0.0).sum(axis=0),
            self.lifted + out.lifted.astype(int),
        )

    def statements(self, robot: Robot) -> tuple[Statement, ...]:
        """What is to be said of the wheels, and of the solver."""
        shares, rows = self.spun / max(self.states, 1), max(self.rows, 1)
        wheels = np.flatnonzero(shares)
        slip = Statement("wheels_slip", WARNING, numbers={"wheels": wheels + 1, "shares": shares[wheels]})
        lifted = [
            Statement("wheel_lifts", WARNING, numbers={"wheel": w + 1, "share": count / rows})
            for w, count in enumerate(self.lifted.tolist())
            if count
        ]
        air = [Statement("wheel_in_air", WARNING, numbers={"wheel": w + 1}) for w in wheel_loads(robot).lifted]
        capped = [not_converged(self.capped, rows)] if self.capped else []
        return (*air, *([slip] if wheels.size else []), *capped, *lifted)


def not_converged(capped_rows: int, rows: int) -> Statement:
    """That the friction solver hit its cap in some rows of a run."""
    return Statement("not_converged", WARNING, numbers={"stopped": capped_rows, "rows": rows})
