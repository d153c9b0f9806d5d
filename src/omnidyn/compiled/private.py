"""Whether private parts of numba are used: they save time, change no number, and may change with any version.

`OMNIDYN_PLAIN_NUMBA=1` switches all of them off, before omnidyn is imported: linking in kernel.py, entries.py and the
option `_nrt`. Kernels are then compiled by numba in its own way and kept in memory only, which costs every
process its compile time. Without linking a first `simulate` of the implicit engine takes 45 s of processor time
instead of 14, a first `identify` 99 s instead of 36; without loading each later command takes 0.3 to 0.5 s more.
"""

from __future__ import annotations

import os

import numba

SWITCH = "OMNIDYN_PLAIN_NUMBA"
# Versions that were tried: tests/compiled passes, and runs of both engines are the same to the last bit. With others
# numba compiles in its own way: the same numbers, but a first run takes three times as long.
TRIED = frozenset((0, minor) for minor in range(61, 69))


def switched_off() -> bool:
    """Whether the user wants numba as it comes: nothing private, and nothing on disk."""
    return os.environ.get(SWITCH, "0") not in ("", "0")


def used() -> bool:
    """Whether private parts are used: this numba was tried, and they are not switched off."""
    return numba.version_info.short in TRIED and not switched_off()
