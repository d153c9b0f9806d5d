"""Threads of a batch, kept from call to call: kernels let other threads run."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from omnidyn.arguments import is_whole
from omnidyn.compiled.parallel import MOST_THREADS
from omnidyn.errors import InputError


class Threads:
    """So many threads; None: one for each processor. The pool starts with the first work that is worth two."""

    def __init__(self, count: int | None) -> None:
        if count is not None and (not is_whole(count) or count < 1):
            raise InputError(
                "cannot work with so many threads", got=count, expected="1 or more, or None", where="threads"
            )
        self.count = count or min(os.cpu_count() or 1, MOST_THREADS)
        self._pool: ThreadPoolExecutor | None = None

    def spans(self, count: int, most: int) -> list[tuple[int, int]]:
        """(first, last) of shares of `count` items, a share for each thread, of at most so many items."""
        share = max(1, min(most, -(-count // self.count)))
        return [(first, min(first + share, count)) for first in range(0, count, share)]

    def map(self, task: Callable[[Any], Any], items: Iterable[Any]) -> list[Any]:
        """[task(item) for item in items]."""
        items = list(items)
        if self.count == 1 or len(items) < 2:
            return [task(item) for item in items]
        if self._pool is None:
            self._pool = ThreadPoolExecutor(self.count)
        return list(self._pool.map(task, items))
