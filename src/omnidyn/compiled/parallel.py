"""Several runs of kernels at a time: kernels leave the interpreter to other threads; and no threads where they cost."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from contextvars import copy_context
from functools import cache
from threading import Lock
from typing import Any, TypeVar

from threadpoolctl import ThreadpoolController

MOST_THREADS = 8

T = TypeVar("T")
R = TypeVar("R")


def side_by_side(task: Callable[[T], R], items: Iterable[T]) -> list[R]:
    """[task(item) for item in items], as many at a time as there are processors, under the caller's settings of NumPy.

    Raises what the first task raises that fails.
    """
    tasks = list(items)
    threads = min(os.cpu_count() or 1, MOST_THREADS, len(tasks))
    if threads < 2:
        return [task(item) for item in tasks]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(lambda item, context: context.run(task, item), tasks, [copy_context() for _ in tasks]))


def one_by_one(task: Callable[[T], R], items: Iterable[T]) -> Iterator[R]:
    """The same where results are large: no more of them are there at a time than processors."""
    tasks, threads = list(items), min(os.cpu_count() or 1, MOST_THREADS)
    for begin in range(0, len(tasks), threads):
        yield from side_by_side(task, tasks[begin : begin + threads])


_within: list[AbstractContextManager[object]] = []  # the one limit, once for each who is within `small_matrices`
_guard = Lock()


@contextmanager
def small_matrices() -> Iterator[None]:
    """Within it the linear algebra of NumPy and SciPy uses one thread, in the whole process.

    Threads of matrices of 100 rows wait for each other, and where other work runs on the machine they wait long: a
    diagnosis took four times as much of the processors. The first who enters sets it, the last who leaves restores it.
    """
    with _guard:
        _within.append(_within[0] if _within else _controller().limit(limits=1, user_api="blas"))
    try:
        yield
    finally:
        with _guard:
            last = _within.pop()
            if not _within:
                last.__exit__(None, None, None)


@cache
def _controller() -> ThreadpoolController:
    """Finds the libraries once, which takes milliseconds."""
    return ThreadpoolController()


# Kernels compiled by another process, while this one compiles what it needs first
#
# numba compiles one kernel after the other, whatever the number of processors. What another process compiles lies on
# disk, where this one finds it when it comes to need it. Should it not be there by then, this one compiles for itself.

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
    return is_there is not None and not is_there() and processors() > 1


def processors() -> int:
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
