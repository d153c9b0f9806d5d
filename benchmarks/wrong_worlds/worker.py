"""A process beside this one that does one thing at a time, and is given up where it takes too long: a fit that does not
end must not keep a thousand others from being scored."""

from __future__ import annotations

import multiprocessing as mp
from collections.abc import Callable
from multiprocessing.pool import Pool
from typing import Any

LONGEST = 120.0  # [s] of the wall clock


class Worker:
    """A context that holds the process; `ask` calls a function there."""

    def __init__(self) -> None:
        self._pool: Pool | None = None

    def __enter__(self) -> Worker:
        return self

    def __exit__(self, *_: object) -> None:
        if self._pool is not None:
            self._pool.terminate()

    def ask(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """What the function returns; None where it takes longer than LONGEST, what it raises is raised."""
        if self._pool is None:
            self._pool = mp.get_context("spawn").Pool(1)
        try:
            return self._pool.apply_async(function, arguments).get(LONGEST)
        except mp.TimeoutError:
            self._pool.terminate()
            self._pool = None
            return None
