"""Several runs of kernels at a time: kernels leave the interpreter to other threads."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from typing import TypeVar

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
