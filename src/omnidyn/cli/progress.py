"""Progress on stderr, for work that takes longer than one likes to wait in silence."""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections.abc import Callable, Iterator

from omnidyn.cli.streams import say

SILENT_S, BEAT_S = 2.0, 5.0


@contextlib.contextmanager
def progress(step: str) -> Iterator[Callable[[str], None]]:
    """Says after 2 s, and then every 5 s, what is being done; yields the function that names the next step."""
    steps, done = [step], threading.Event()
    teller = threading.Thread(target=_tell, args=(steps, done, time.monotonic()), daemon=True)
    teller.start()
    try:
        yield steps.append
    finally:
        done.set()
        teller.join()


def _tell(steps: list[str], done: threading.Event, started: float) -> None:
    wait = SILENT_S
    while not done.wait(wait):
        with contextlib.suppress(OSError, ValueError):
            say(f"omnidyn: {steps[-1]} ... {time.monotonic() - started:.0f} s")
            sys.stderr.flush()
        wait = BEAT_S
