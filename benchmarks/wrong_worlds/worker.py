"""Processes beside this one, one on each core, that do one thing at a time, and are given up where it takes too long: a
fit that does not end must not keep a thousand others from being scored. One that dies is a defect, and never passes for
a slow one."""

from __future__ import annotations

import multiprocessing as mp
import os
import signal
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from multiprocessing.connection import Connection
from queue import SimpleQueue
from typing import Any

LONGEST = 120.0  # [s] of the processor: what else the machine does has no part in it


class Workers:
    """A context that holds a process for each core; `ask_each` calls a function there."""

    def __init__(self) -> None:
        self._all = [Worker() for _ in range(os.cpu_count() or 1)]

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *_: object) -> None:
        for worker in self._all:
            worker.__exit__()

    def ask_each(self, function: Callable[..., Any], arguments: Iterable[tuple[Any, ...]]) -> list[Any]:
        """What the function makes of each of the arguments, in their order, as `Worker.ask` tells it."""
        free: SimpleQueue[Worker] = SimpleQueue()
        for worker in self._all:
            free.put(worker)

        def one(given: tuple[Any, ...]) -> Any:
            worker = free.get()
            try:
                return worker.ask(function, *given)
            finally:
                free.put(worker)

        with ThreadPoolExecutor(len(self._all)) as threads:
            return list(threads.map(one, arguments))


class Worker:
    """A context that holds one process; `ask` calls a function there."""

    def __init__(self) -> None:
        self._process: Any = None
        self._pipe: Any = None

    def __enter__(self) -> Worker:
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def ask(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """What the function returns; None where it takes longer than LONGEST, what it raises is raised.

        Raises RuntimeError where the process dies; the next call starts another one.
        """
        if self._process is None:
            context = mp.get_context("spawn")
            self._pipe, there = context.Pipe()
            self._process = context.Process(target=_serve, args=(there,), daemon=True)
            self._process.start()
            there.close()
        self._pipe.send((LONGEST, function, arguments))
        try:
            value, error = self._pipe.recv()
        except EOFError:
            self._process.join()
            code = self._process.exitcode
            self._end()
            if code == -signal.SIGPROF:
                return None
            raise RuntimeError(f"the process of {function.__name__}{arguments} died, exit code {code}") from None
        if error is not None:
            raise error
        return value

    def _end(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.join()
            self._pipe.close()
            self._process = None


def _serve(pipe: Connection) -> None:
    """Do what is asked for, until nobody asks any more."""
    while True:
        try:
            longest, function, arguments = pipe.recv()
        except EOFError:
            return
        signal.setitimer(signal.ITIMER_PROF, longest)  # its signal ends the process, whatever it is in the middle of
        try:
            answer = function(*arguments), None
        except Exception as error:
            answer = None, error
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        pipe.send(answer)
