"""A process beside this one that does one thing at a time, and is given up where it takes too long: a fit that does not
end must not keep a thousand others from being scored. One that dies is a defect, and never passes for a slow one."""

from __future__ import annotations

import multiprocessing as mp
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

LONGEST = 120.0  # [s] of the wall clock


class Worker:
    """A context that holds the process; `ask` calls a function there."""

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
        self._pipe.send((function, arguments))
        if not self._pipe.poll(LONGEST):
            self._end()
            return None
        try:
            value, error = self._pipe.recv()
        except EOFError:
            self._process.join()
            code = self._process.exitcode
            self._end()
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
            function, arguments = pipe.recv()
        except EOFError:
            return
        try:
            answer = function(*arguments), None
        except Exception as error:
            answer = None, error
        pipe.send(answer)
