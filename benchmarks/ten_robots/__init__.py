"""Ten robots from `init` to right numbers: coverage, and what is reported of what a log determines (20 minutes).

world: a simulator that shares no code with omnidyn. robots: the ten, their sensors and owners. information: what a log
can tell. score: the two commands, against the truth. OMNIDYN_BENCH_SHARE=0.05 does that share of the logs.
"""

from __future__ import annotations

import numpy as np

from benchmarks.size import SMALLEST, scaled
from benchmarks.table import Table, machine

LOGS = scaled(20)
POOLED, SINGLE, REPORTED = 0.92, 0.75, 0.9
ALL = 20  # logs for which the goals are meant; of fewer, counting errors are granted


def measure() -> Table:
    """Each robot, a row."""
    from benchmarks.ten_robots.robots import cases
    from benchmarks.ten_robots.score import score

    table = Table(
        "ten_robots: `omnidyn init`, then `omnidyn identify LOG`",
        ["robot", "what", "logs", "exit 4", "numbers", "coverage", "least", "of", "reported", "s a log"],
    )
    table.notes.append(machine())
    for case in cases()[1::7] if SMALLEST else cases():
        found = score(case, range(LOGS))
        intervals = sum(map(len, found.held.values()))
        slack = 0.0 if LOGS >= ALL else 3.0 * np.sqrt(0.95 * 0.05 / max(intervals, 1))
        name, least = found.worst
        met = found.pooled >= POOLED - slack and found.reported >= REPORTED and (LOGS < ALL or least >= SINGLE)
        table.add(
            f"coverage >= {POOLED}, least >= {SINGLE}, reported >= {REPORTED}",
            bool(met and not found.words),
            robot=case.name,
            what=case.words,
            logs=len(found.exits),
            numbers=intervals,
            coverage=found.pooled,
            least=least,
            of=name,
            reported=found.reported,
            **{
                "exit 4": sum(code == 4 for code in found.exits),
                "s a log": float(np.median(found.seconds)) if found.seconds else None,
            },
        )
        table.notes += [f"{case.name}: {words}" for words in found.words[:3]]
        missed = sorted(key for key, asked in found.asked.items() if found.told[key] < asked)
        table.notes += [f"{case.name}: determined, but not always reported: {', '.join(missed)}"] if missed else []
        table.notes += (
            [f"{case.name}: no truth to compare: {', '.join(sorted(found.skipped))}"] if found.skipped else []
        )
    return table
