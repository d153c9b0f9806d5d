"""Who waits for a compiler can hear of it.

Nothing is heard unless somebody listens. Needs no numba: a command listens before it knows whether it will compile.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator

COMPILING = " (a kernel is being compiled: once, the first time)"  # behind what is being done


class Compiling:
    """Kernels, by name: those that are being compiled just now, in any thread, and those that have been, with [s]."""

    def __init__(self) -> None:
        self.under_way: list[str] = []
        self.done: list[tuple[str, float]] = []


_listeners: list[Compiling] = []  # those who are inside `heard` just now


@contextlib.contextmanager
def heard() -> Iterator[Compiling]:
    """Yields what is kept up to date with all that is compiled meanwhile."""
    compiling = Compiling()
    _listeners.append(compiling)
    try:
        yield compiling
    finally:
        _listeners.remove(compiling)


@contextlib.contextmanager
def told(name: str) -> Iterator[None]:
    """Tells all who listen that a kernel is being compiled, and, unless that fails, that it has been."""
    listeners, start = tuple(_listeners), time.perf_counter()
    for listener in listeners:
        listener.under_way.append(name)
    try:
        yield
        for listener in listeners:
            listener.done.append((name, time.perf_counter() - start))
    finally:
        for listener in listeners:
            listener.under_way.remove(name)
