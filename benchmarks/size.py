"""How large a run is: OMNIDYN_BENCH_SHARE=0.05 does that share of the draws of each benchmark, 0 the fewest.

The seed of a draw is its number, so that a smaller run is the first part of a larger one.
"""

from __future__ import annotations

import os

SHARE = float(os.environ.get("OMNIDYN_BENCH_SHARE", "1"))
SMALLEST = SHARE == 0.0  # also fewer robots and studies, of each kind one
WHOLE = SHARE >= 1.0  # at full size the goals are what they are; below it counting errors are granted


def scaled(full: int, least: int = 1) -> int:
    """The number of draws: this share of all, `least` at the fewest."""
    return max(round(full * SHARE), least)
