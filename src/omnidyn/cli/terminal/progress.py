"""Progress on stderr, for work that takes longer than one likes to wait in silence."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Iterator

from omnidyn.cli.terminal.streams import say
from omnidyn.compiled.listeners import COMPILING, Compiling, heard
from omnidyn.progress import Progress, Report

SILENT_S, NEW_S, BEAT_S = 2.0, 3.0, 5.0
WARM = "omnidyn: a first run waits for the compiler, up to a minute; `omnidyn warm` compiles for all commands, once"


@contextlib.contextmanager
def shown_progress(phase: str, hint: str = WARM) -> Iterator[Progress]:
    """Says after 2 s, and then every 5 s, what is being done: every 3 s where that is something new.

    hint: said once, where the compiler is waited for; "": nothing.
    Yields the listener; what is urgent is said at once.
    """
    steps, finished = [Report(phase)], threading.Event()

    def listen(report: Report) -> None:
        if report.urgent:
            say(f"omnidyn: {report}")
        else:
            steps[0] = report

    with heard() as compiling:
        teller = threading.Thread(target=_tell, args=(steps, finished, compiling, hint), daemon=True)
        teller.start()
        try:
            yield listen
        finally:
            finished.set()
            teller.join()


def _tell(steps: list[Report], finished: threading.Event, compiling: Compiling, hint: str) -> None:
    message, wait, start = "", SILENT_S, time.monotonic()
    while not finished.wait(wait):
        if _now(steps, compiling) == message and finished.wait(BEAT_S - NEW_S):
            return
        message, wait = _now(steps, compiling), NEW_S
        if hint and compiling.under_way:
            say(hint)
            hint = ""
        say(f"omnidyn: {message} ... {time.monotonic() - start:.0f} s")


def _now(steps: list[Report], compiling: Compiling) -> str:
    """What is being done."""
    return str(steps[0]) + (COMPILING if compiling.under_way else "")
