"""LeKiwi on the clover of `control_real`, by encoders, under 20 integral gains of the speed loop in its firmware.

The robot file knows the gain. A hand-made PI of the pose drives beside ours; `mpc` is held against its own best.
"""

from __future__ import annotations

import numpy as np

from benchmarks.control_real import OURS, errors, makers
from benchmarks.control_real.paths import paths
from benchmarks.control_real.plant import Plant
from benchmarks.control_real.robots import NUMBERS, SLOWER
from benchmarks.table import Table, machine

ROBOT, KIND, RIVAL = "lekiwi", "encoder", "PI + FF"
GAINS = np.linspace(0.0, 250.0, 20)  # [V/rad] k_i
MOST = 1.3  # times the least rms of all gains


def measure() -> Table:
    """A row per gain."""
    proportional, _, rate = NUMBERS[ROBOT]["loop"]
    path = paths(SLOWER[ROBOT])["clover"]
    columns = ["ki [V/rad]", RIVAL, *OURS]
    table = Table("control_gains: rms of position mm / heading mrad, gains of a speed loop", columns, notes=[machine()])
    rms: dict[str, list[float]] = {name: [] for name in OURS}
    for ki in GAINS.tolist():
        numbers = NUMBERS[ROBOT] | {"loop": (proportional, ki, rate)}
        plant = Plant(numbers)
        cells = {name: errors(plant, make(plant), path, KIND) for name, make in makers(ROBOT, numbers, KIND).items()}
        words = {name: f"{cell[0]:.3f}/{cell[1]:.3f}" for name, cell in cells.items()}
        table.add(**{"ki [V/rad]": f"{ki:.0f}"}, **words)
        for name in OURS:
            rms[name].append(cells[name][0])
    ratios = {name: max(values) / min(values) for name, values in rms.items()}
    shown = {name: f"{ratio:.2f} times" for name, ratio in ratios.items()}
    table.add(f"mpc at most {MOST:g} times", ratios["mpc"] <= MOST, **{"ki [V/rad]": "most over least"}, **shown)
    return table
