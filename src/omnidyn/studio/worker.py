"""Worker: a process that does one job after the other, so that the server is free for its pages.

Both sides send lines of JSON. To the worker: {"job": name, "request": ...}, {"cancel": true}, {"command": ...} for a
job that listens. From it: {"progress": ...}, {"frame": ...}, and at the end {"result": ...} or {"error": ...}.
"""

from __future__ import annotations

import _thread
import asyncio
import contextlib
import json
import os
import queue
import sys
import threading
from collections.abc import Callable
from typing import Any

Listener = Callable[[str, Any], None]
GRACE = 20.0  # [s] that a job has to end after it was cancelled: the best so far may still be written
LINE_BYTES = 64 * 2**20  # of one message


class CancelledError(Exception):
    """The job was cancelled and gave no result."""


class JobError(Exception):
    """The job ended with an error, in words."""


class Worker:
    """The server's side of a worker process, which starts with its first job."""

    def __init__(self) -> None:
        self._process: asyncio.subprocess.Process | None = None
        self._lock = asyncio.Lock()
        self.busy = False

    async def run(self, job: str, request: Any, listen: Listener) -> Any:
        """The result of a job, when those before it are done. listen: gets each kind of message and what it holds.

        Raises JobError with the words of an error, CancelledError for a job that was cancelled without a result.
        """
        async with self._lock:
            self.busy = True
            try:
                return await self._result(await self._started(), job, request, listen)
            finally:
                self.busy = False

    async def _started(self) -> asyncio.subprocess.Process:
        if self._process is None or self._process.returncode is not None:
            self._process = await asyncio.create_subprocess_exec(
                sys.executable,
                "-m",
                "omnidyn.studio.worker",
                stdin=asyncio.subprocess.PIPE,
                stdout=asyncio.subprocess.PIPE,
                limit=LINE_BYTES,
                start_new_session=True,  # Ctrl-C at the terminal is for the server, which ends the worker
            )
        return self._process

    async def _result(self, process: asyncio.subprocess.Process, job: str, request: Any, listen: Listener) -> Any:
        assert process.stdout is not None
        self.send({"job": job, "request": request})
        while line := await process.stdout.readline():
            for kind, value in json.loads(line).items():
                if kind == "result":
                    return value
                if kind == "error":
                    raise (CancelledError if value is None else JobError)(value)
                listen(kind, value)
        raise CancelledError

    def send(self, message: dict[str, Any]) -> None:
        """Send a message to the process, where it runs."""
        if self._process is not None and self._process.stdin is not None and self._process.returncode is None:
            with contextlib.suppress(OSError, RuntimeError):
                self._process.stdin.write(json.dumps(message).encode() + b"\n")

    async def cancel(self) -> None:
        """Ask the job to end; end the process where it does not."""
        if not self.busy:
            return
        process = self._process
        self.send({"cancel": True})
        for _ in range(int(GRACE / 0.1)):
            await asyncio.sleep(0.1)
            if not self.busy:
                return
        if process is not None and process is self._process:
            await self.stop()

    async def stop(self) -> None:
        """End the process."""
        if self._process is not None and self._process.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                self._process.kill()
            await self._process.wait()


# The side of the process


def main() -> None:
    """Do jobs until the server closes the pipe."""
    out = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # what a library prints must not stand between messages
    messages: queue.Queue[dict[str, Any] | None] = queue.Queue()
    commands: queue.Queue[Any] = queue.Queue()
    working = threading.Event()

    def tell(kind: str, value: Any) -> None:
        out.write(json.dumps({kind: value}).encode() + b"\n")

    def read() -> None:
        for line in sys.stdin.buffer:
            message = json.loads(line)
            if "cancel" in message:
                if working.is_set():
                    _thread.interrupt_main()
            elif "command" in message:
                commands.put(message["command"])
            else:
                messages.put(message)
        os._exit(0)  # the server is gone: nobody waits for the job

    threading.Thread(target=read, daemon=True).start()
    while (message := _next(messages)) is not None:
        while not commands.empty():
            commands.get()
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
    from omnidyn.errors import OmnidynError, told_by

    try:
        from omnidyn.studio import jobs

        return "result", jobs.JOBS[message["job"]](message["request"], tell, commands)
    except KeyboardInterrupt:
        return "error", None
    except Exception as raised:
        error = told_by(raised)
        if isinstance(error, OmnidynError):
            return "error", str(error)
        return "error", f"bug: {type(error).__name__}: {' '.join(str(error).split())}"


if __name__ == "__main__":
    main()
