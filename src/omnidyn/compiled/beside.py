"""Several runs of kernels at a time: kernels leave the interpreter to other threads; and no threads where they cost."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from contextvars import copy_context
from functools import cache
from threading import Lock
from typing import TypeVar

from threadpoolctl import ThreadpoolController

MOST_THREADS = 8

T = TypeVar("T")
R = TypeVar("R")


def side_by_side(task: Callable[[T], R], items: Iterable[T]) -> list[R]:
    """[task(item) for item in items], as many at a time as there are processors, under the caller's settings of NumPy.

    Raises what the first task raises that fails.
    """
    every = list(items)
    threads = min(os.cpu_count() or 1, MOST_THREADS, len(every))
    if threads < 2:
        return [task(item) for item in every]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(lambda item, context: context.run(task, item), every, [copy_context() for _ in every]))


def one_by_one(task: Callable[[T], R], items: Iterable[T]) -> Iterator[R]:
    """The same where results are large: no more of them are there at a time than processors."""
    every, threads = list(items), min(os.cpu_count() or 1, MOST_THREADS)
    for begin in range(0, len(every), threads):
        yield from side_by_side(task, every[begin : begin + threads])


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
