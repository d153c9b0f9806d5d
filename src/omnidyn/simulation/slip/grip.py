"""Which wheels lost their grip in a run, and which have none, in words."""

from __future__ import annotations

import numpy as np

from omnidyn.model.robot import Robot
from omnidyn.simulation.slip.loads import wheel_loads
from omnidyn.simulation.slip.march import SlipOutcome


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
    def words(self) -> tuple[str, ...]:
        """A sentence each."""
        shares, rows = 100.0 * self._spun / max(self._states, 1), max(self._rows, 1)
        spins = [f"wheel {w + 1} in {share:.2g} %" for w, share in enumerate(shares.tolist()) if share > 0.0]
        words = [f"wheels slip: {', '.join(spins)} of the samples"] if spins else []
        if self._capped:
            words.append(f"the friction solver hit its cap in {self._capped} of {rows} rows: look there")
        words += [
            f"wheel {w + 1} lifts off in {100.0 * count / rows:.2g} % of the rows: it has no grip then, and that the "
            "robot tips is not in the model"
            for w, count in enumerate(self._lifted.tolist()) if count
        ]  # fmt: skip
        return (*wheel_loads(self._robot).words, *words)
