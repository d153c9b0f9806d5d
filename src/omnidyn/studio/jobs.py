"""Jobs: what the library is asked for, and the process of a worker, which does one job after the other.

A job takes plain values and gives plain values. It has the arguments request, tell (sends a message to the page) and
commands (a queue of what a page sends while the job goes on).
"""

from __future__ import annotations

import _thread
import contextlib
import json
import os
import queue
import sys
import threading
from collections.abc import Callable, Mapping
from typing import Any

from omnidyn.studio.compare.job import compare, drift
from omnidyn.studio.drive.job import drive
from omnidyn.studio.fit.job import fit, free_keys, warm
from omnidyn.studio.job import Tell
from omnidyn.studio.live.job import watch
from omnidyn.studio.log.job import align, check, example, save_columns
from omnidyn.studio.planned.job import drive_plan, follow, plan
from omnidyn.studio.robot.job import check_robot
from omnidyn.studio.track.job import track
from omnidyn.studio.worker import Listener

JOBS: dict[str, Callable[[Mapping[str, Any], Tell, Any], dict[str, Any]]] = {
    "check": check,
    "align": align,
    "save_columns": save_columns,
    "fit": fit,
    "warm": warm,
    "free_keys": free_keys,
    "example": example,
    "check_robot": check_robot,
    "drive": drive,
    "track": track,
    "compare": compare,
    "drift": drift,
    "watch": watch,
    "plan": plan,
    "drive_plan": drive_plan,
    "follow": follow,
}


def main() -> None:
    """Do jobs until the server closes the pipe."""
    out = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # what a library prints must not stand between messages
    messages: queue.Queue[dict[str, Any] | None] = queue.Queue()
    commands: queue.Queue[Any] = queue.Queue()
    working = threading.Event()

    def tell(kind: str, value: Any) -> None:
        try:
            out.write(json.dumps({kind: value}).encode() + b"\n")
        except BrokenPipeError:  # the server is gone: nobody waits for the job
            os._exit(0)

    def read() -> None:
        for line in sys.stdin.buffer:
            message = json.loads(line)
            if "cancel" in message:
                if working.is_set():
                    _thread.interrupt_main()
                elif not messages.empty():  # cancelled before it began
                    with contextlib.suppress(queue.Empty):
                        messages.get_nowait()
                        tell("error", None)
            elif "command" in message:
                commands.put(message["command"])
            else:
                while not commands.empty():  # to the job before
                    commands.get()
                messages.put(message)
        os._exit(0)  # the server is gone: nobody waits for the job

    threading.Thread(target=read, daemon=True).start()
    while (message := _next(messages)) is not None:
        working.set()
        try:
            kind, value = _answer(message, tell, commands)
            working.clear()
        except KeyboardInterrupt:  # cancelled while the answer was under way
            working.clear()
            kind, value = "error", None
        tell(kind, value)


def _next(messages: queue.Queue[dict[str, Any] | None]) -> dict[str, Any] | None:
    """The next job; an interrupt that comes too late is dropped."""
    while True:
        with contextlib.suppress(KeyboardInterrupt):
            return messages.get()


def _answer(message: dict[str, Any], tell: Listener, commands: queue.Queue[Any]) -> tuple[str, Any]:
    """What a job ends with."""
    from omnidyn.errors import INTERRUPTS, OmnidynError, told_by

    try:
        return "result", JOBS[message["job"]](message["request"], tell, commands)
    except (KeyboardInterrupt, Exception) as raised:
        error = told_by(raised)
        if isinstance(error, INTERRUPTS):
            return "error", None
        if isinstance(error, OmnidynError):
            return "error", str(error)
        return "error", f"bug: {type(error).__name__}: {' '.join(str(error).split())}"


if __name__ == "__main__":
    main()
