"""What a log cannot tell: blind directions named in rank-deficient set-ups, none in full-rank ones; causes that are the
same to a log in one group of remedies (a few minutes).

setups: what is free, how it is driven, what is logged. log: their logs, by a simulator that shares no code with
omnidyn. told: what a fit says. alike: wrong worlds in which several causes are the same by construction.
"""

from __future__ import annotations

from benchmarks.table import Table, machine

SEED = 4000


def measure() -> Table:
    """A row for each set-up and each wrong world, then the counts."""
    from benchmarks.blind.alike import ALIKE, grouped
    from benchmarks.blind.setups import DEFICIENT, FULL
    from benchmarks.blind.told import named, said

    table = Table("blind: what a log cannot tell, in words", ["set-up", "kind", "as it should be", "answer"])
    table.notes.append(machine())
    right = {"deficient": 0, "full": 0, "alike": 0}
    for kind, setups in (("deficient", DEFICIENT), ("full", FULL)):
        for number, setup in enumerate(setups):
            told = said(setup, SEED + number)
            good = named(setup, told) if setup.count else not told
            right[kind] += good
            table.add(**{"set-up": setup.name, "kind": kind, "as it should be": good, "answer": "; ".join(told)})
    for number, pair in enumerate(ALIKE):
        good, words = grouped(pair, SEED + 100 + number)
        right["alike"] += good
        table.add(**{"set-up": pair.name, "kind": "alike", "as it should be": good, "answer": words})
    for kind, of in (("deficient", len(DEFICIENT)), ("full", len(FULL)), ("alike", len(ALIKE))):
        answer = f"{right[kind]} of {of}"
        table.add(f"{kind}: {of} of {of}", right[kind] == of, **{"set-up": f"all {kind}", "answer": answer})
    return table
