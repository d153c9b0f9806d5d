"""Progress on stderr, for work that takes longer than one likes to wait in silence."""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections.abc import Callable, Iterator

from omnidyn.cli.terminal.streams import say
from omnidyn.compiled.hearing import Compiling, heard

SILENT_S, NEW_S, BEAT_S = 2.0, 3.0, 5.0
COMPILING = " (a kernel is being compiled: once, the first time)"


@contextlib.contextmanager
def progress(step: str) -> Iterator[Callable[[str], None]]:
    """Says after 2 s, and then every 5 s, what is being done: every 3 s where that is something new.

    Yields the function that names the next step.
    """
    steps, done = [step], threading.Event()
    with heard() as compiling:
        teller = threading.Thread(target=_tell, args=(steps, done, compiling, time.monotonic()), daemon=True)
        teller.start()
        try:
            yield steps.append
        finally:
            done.set()
            teller.join()


def _tell(steps: list[str], done: threading.Event, compiling: Compiling, started: float) -> None:
    said, wait = "", SILENT_S
    while not done.wait(wait):
        if _now(steps, compiling) == said and done.wait(BEAT_S - NEW_S):
            return
        said, wait = _now(steps, compiling), NEW_S
        with contextlib.suppress(OSError, ValueError):
            say(f"omnidyn: {said} ... {time.monotonic() - started:.0f} s")
            sys.stderr.flush()


def _now(steps: list[str], compiling: Compiling) -> str:
    """What is being done."""
    return steps[-1] + (COMPILING if compiling.under_way else "")
