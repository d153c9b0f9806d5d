"""A key that must be held down: what a terminal sends while it is, again and again."""

from __future__ import annotations

import contextlib
import os
import select
import sys
import time
from collections.abc import Callable, Iterator

from omnidyn.errors import InputError

FIRST, AGAIN = 0.8, 0.25  # [s] until a terminal repeats a key for the first time, and from then on


@contextlib.contextmanager
def held_key() -> Iterator[Callable[[], bool]]:
    """Whether a key is held down in this terminal. Raises InputError where there is no terminal to read."""
    refusal = InputError("no key can be held", got="no terminal", expected="a terminal of Linux or macOS", where="hold")
    try:
        import termios
        import tty
    except ImportError:
        raise refusal from None
    if sys.stdin is None or not sys.stdin.isatty():
        raise refusal
    number = sys.stdin.fileno()
    before = termios.tcgetattr(number)
    tty.setcbreak(number)
    try:
        yield HeldKey(lambda: bool(_read(number)), time.monotonic)
    finally:
        termios.tcsetattr(number, termios.TCSADRAIN, before)


def _read(number: int) -> bytes:
    return os.read(number, 1024) if select.select([number], [], [], 0.0)[0] else b""


class HeldKey:
    """Whether a key is held: true from the first letter on, until none comes any more.

    came: whether letters came since the last call. now: the time [s].
    """

    def __init__(self, came: Callable[[], bool], now: Callable[[], float]) -> None:
        self._came, self._now = came, now
        self._last, self._patience = float("-inf"), FIRST

    def __call__(self) -> bool:
        now = self._now()
        if self._came():
            self._patience = AGAIN if now - self._last < FIRST else FIRST
            self._last = now
        return now - self._last <= self._patience
