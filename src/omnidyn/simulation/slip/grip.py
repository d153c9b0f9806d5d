"""Which wheels lost their grip in a run, and which have none."""

from __future__ import annotations

import numpy as np

from omnidyn.model.robot import Robot
from omnidyn.simulation.slip.loads import wheel_loads
from omnidyn.simulation.slip.march import SlipOutcome
from omnidyn.statement import WARNING, Statement


class Grip:
    """What a run or its stretches, one after the other, showed of the wheels of a robot."""

    def __init__(self, robot: Robot):
        count = robot.wheels.count
        self._robot, self._rows, self._states, self._capped = robot, 0, 0, 0
        self._spun, self._lifted = np.zeros(count, int), np.zeros(count, int)

    def add(self, out: SlipOutcome) -> None:
        """Another stretch."""
        first = 1 if self._states else 0  # where the one before ended
        self._rows += len(out.contact) - 1
        self._states += len(out.contact) - first
        self._spun += (out.contact[first:] != 0.0).sum(axis=0)
        self._lifted += out.lifted.astype(int)
        self._capped += out.capped

    @property
    def statements(self) -> tuple[Statement, ...]:
        """What is to be said of the wheels, and of the solver."""
        shares, rows = self._spun / max(self._states, 1), max(self._rows, 1)
        wheels = np.flatnonzero(shares)
        slip = Statement("wheels_slip", WARNING, numbers={"wheels": wheels + 1, "shares": shares[wheels]})
        lifted = [
            Statement("wheel_lifts", WARNING, numbers={"wheel": w + 1, "share": count / rows})
            for w, count in enumerate(self._lifted.tolist()) if count
        ]  # fmt: skip
        air = [Statement("wheel_in_air", WARNING, numbers={"wheel": w + 1}) for w in wheel_loads(self._robot).lifted]
        capped = [not_converged(self._capped, rows)] if self._capped else []
        return (*air, *([slip] if wheels.size else []), *capped, *lifted)


def not_converged(stopped: int, rows: int) -> Statement:
    """That the friction solver hit its cap in some rows of a run."""
    return Statement("not_converged", WARNING, numbers={"stopped": stopped, "rows": rows})
