"""A kernel compiled by another process, while this one compiles what else is wanted.

numba compiles one kernel after the other, whatever the number of processors. What another process compiles lies on
disk, where this one finds it. Should that process fail, or not be started at all, this one compiles for itself.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from typing import Any

from omnidyn.compiled.hearing import told

LONGEST = 300.0  # [s] that the other process is waited for
LEAVES = 5.0  # [s] that it has to go when it is told to


@contextlib.contextmanager
def compiled_elsewhere(kernel: Any, caller: Callable[[], object]) -> Iterator[bool]:
    """Another process calls `caller`, of a module, which needs this kernel; it is waited for at the end.

    Yields whether there is one: not where the kernel is on disk, where none can be kept there, on one processor, or in
    a program that is no Python that could be started again.
    """
    process = _started(caller) if _wanted(kernel) else None
    if process is None:
        yield False
        return
    try:
        yield True
        with told(kernel.__name__), contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(LONGEST)
    finally:
        _end(process)


def _wanted(kernel: Any) -> bool:
    is_there = getattr(getattr(kernel, "_cache", None), "is_there", None)  # numba's own cache has none
    return is_there is not None and not is_there() and _processors() > 1


def _processors() -> int:
    """Those that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _started(caller: Callable[[], object]) -> subprocess.Popen[bytes] | None:
    """A Python that makes the call and says nothing; None where there is none to start."""
    if not sys.executable or getattr(sys, "frozen", False):
        return None
    words = f"from {caller.__module__} import {caller.__name__}; {caller.__name__}()"
    command = [sys.executable, "-P", "-c", words]  # -P: nothing of the folder that we are in
    nothing = subprocess.DEVNULL
    try:
        return subprocess.Popen(command, stdin=nothing, stdout=nothing, stderr=nothing)
    except OSError:
        return None


def _end(process: subprocess.Popen[bytes]) -> None:
    """See that it is gone."""
    if process.poll() is None:
        process.terminate()
        try:
            process.wait(LEAVES)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
