"""How what a call takes grows with its input: a ratio of processor times, which no slow or busy machine changes."""

import gc
import itertools
import math
import time
from collections.abc import Callable
from typing import Any

ROUNDS = 7  # what else a machine does only adds: the least of so many counts
FACTOR = 4  # between two sizes
NUMBERS = itertools.count()


def linear(factor: int) -> float:
    """Halfway, as a power, between what a linear call takes more and what a quadratic one does: 4, 8 and 16 times.

    A large factor sets the two further apart, for calls whose memory outgrows what a processor keeps near.
    """
    return factor**1.5


LINEAR = linear(FACTOR)


def spent(call: Callable[[], Any]) -> float:
    """Processor time of a call [s], without that of the collector, whose turns come now and then."""
    was_on, begun = gc.isenabled(), time.process_time()
    gc.disable()
    try:
        call()
        return time.process_time() - begun
    finally:
        if was_on:
            gc.enable()


def ratio(small: Callable[[], Any], large: Callable[[], Any], enough: float) -> float:
    """How many times as long the large call takes; measured until it is at most `enough`, ROUNDS times at most."""
    times = [math.inf, math.inf]
    small()  # what is done once is not counted
    for _ in range(ROUNDS):
        times = [min(best, spent(call)) for best, call in zip(times, (small, large), strict=True)]
        if times[1] <= enough * times[0]:
            break
    return times[1] / times[0]


def growth(call: Callable[[int, int], Any], size: int, enough: float = LINEAR, factor: int = FACTOR) -> float:
    """How many times as long a call takes for an input `factor` times as large.

    call: gets the size and a number that no call before had, so that no answer is remembered. size: of the large one.
    """
    return ratio(lambda: call(size // factor, next(NUMBERS)), lambda: call(size, next(NUMBERS)), enough)
