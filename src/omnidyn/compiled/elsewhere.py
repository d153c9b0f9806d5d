"""Kernels compiled by another process, while this one compiles what it needs first.

numba compiles one kernel after the other, whatever the number of processors. What another process compiles lies on
disk, where this one finds it when it comes to need it. Should it not be there by then, this one compiles for itself.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from typing import Any

NICE = 5  # steps of priority below ours
LEAVES = 5.0  # [s] that it has to go when it is told to


@contextlib.contextmanager
def compiled_elsewhere(kernel: Any, caller: Callable[[], object]) -> Iterator[None]:
    """Meanwhile another process calls `caller`, of a module, which needs this kernel; in the end it is gone.

    None is started where the kernel is on disk, where none can be kept there, on one processor, or in a program that is
    no Python that could be started again. It takes only what others leave of the processors.
    """
    process = _started(caller) if _wanted(kernel) else None
    try:
        yield
    finally:
        if process is not None:
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
    polite = f"import os; hasattr(os, 'nice') and os.nice({NICE})"
    words = f"{polite}; from {caller.__module__} import {caller.__name__}; {caller.__name__}()"
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
