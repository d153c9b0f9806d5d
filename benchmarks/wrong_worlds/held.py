"""Commands that hold from some times on, for the simulators here."""

from __future__ import annotations

import numba


@numba.njit
def held_until(since, command, row, now, end, u):
    """(the next command's row, the time until which the one of now holds, put into u; at most `end`)."""
    while row < len(since) and since[row] <= now + 1e-12:
        u[:] = command[row]
        row += 1
    return row, end if row >= len(since) else min(end, since[row])
