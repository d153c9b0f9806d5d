"""Newton's iteration for the root of a number that rises, within a bracket: it solves what bends, and what slips."""

from __future__ import annotations

from omnidyn.compiled.kernel import part

ROOT_TOLERANCE = 4e-16  # of what is looked for: a change that is rounding


@part
def newton(guess, off, slope, low, high):
    """(the next guess, low, high) from what is left at `guess`, `off`, and its slope.

    The middle, where Newton's step leaves the bracket; an end of it may be the root.
    """
    if off > 0.0:
        high = guess
    else:
        low = guess
    new = guess - off / slope
    return (new if low <= new <= high else 0.5 * (low + high)), low, high
