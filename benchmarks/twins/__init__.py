"""Six twins of real robots, whose numbers are known, and what `identify` says of their logs (20 minutes).

worlds: their simulators, which share no code with omnidyn. lines: what each must show. motor: the plain fit of a motor.
held_out: the written robot beside plain ones on logs that neither fit nor choice saw, of the twins and of real robots.
`python -m benchmarks.twins --only offset_axis --seeds 2` does a part; OMNIDYN_BENCH_SHARE that share of the seeds.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence

from benchmarks.size import scaled
from benchmarks.table import Table, machine

SEEDS = 10
HELD_OUT = "held_out"


def measure(only: Sequence[str] = (), seeds: int | None = None) -> Table:
    """Each line a row. only: names of twins, and `held_out`; none: all. seeds: logs of each."""
    from benchmarks.twins.held_out import held_out
    from benchmarks.twins.lines import TWINS, Lines

    numbers = range(scaled(SEEDS) if seeds is None else seeds)
    table = Table(
        "twins: logs of robots whose numbers are known, and logs that no fit saw", ["twin", "what", "value", "logs"]
    )
    table.notes += [machine(), "a share meets its goal within one counting error of the goal"]
    for name, show in TWINS.items():
        if not only or name in only:
            begin = time.process_time()
            show(Lines(table, name), numbers)
            print(f"{name}: {time.process_time() - begin:.0f} s of processor time", file=sys.stderr, flush=True)
    if not only or HELD_OUT in only:
        held_out(table, numbers)
    return table
