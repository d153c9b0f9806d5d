"""Worker: a process that does one job after the other, so that the server is free for its pages.

Both sides send lines of JSON. To the worker: {"job": name, "request": ...}, {"cancel": true}, {"command": ...} for a
job that listens. From it: {"progress": ...}, {"frame": ...}, and at the end {"result": ...} or {"error": ...}.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import shutil
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from omnidyn.errors import OmnidynError

Listener = Callable[[str, Any], None]
GRACE = 20.0  # [s] that a job has to end after it was cancelled: the best so far may still be written
LINE_BYTES = 64 * 2**20  # of one message


class CancelledError(Exception):
    """The job was cancelled and gave no result."""


class JobError(Exception):
    """The job ended with an error, in words."""


class EndedError(JobError):
    """The process of the job ended before its result."""

    def __init__(self, code: int) -> None:
        got = f"signal {signal.Signals(-code).name}" if -code in {*signal.Signals} else f"exit code {code}"
        remedy = "run it again; where it ends again, close other programs or use a shorter log: memory may be full"
        super().__init__(str(OmnidynError("the process of this job ended before its result", got=got, remedy=remedy)))


class Worker:
    """The server's side of a worker process, which starts with its first job."""

    def __init__(self) -> None:
        self._process: asyncio.subprocess.Process | None = None
        self._lock = asyncio.Lock()
        self.busy = self._is_cancelled = False
        self._waiting, self._hears = 0, False  # jobs that were asked for; whether one of them takes commands now
        self._early = list[Any]()  # commands to the job that is about to begin

    async def run(self, job: str, request: Any, listen: Listener) -> Any:
        """The result of a job, when those before it are done. listen: gets each kind of message and what it holds.

        Raises JobError with the words of an error, EndedError where the process ended, CancelledError for a job that
        was cancelled without a result.
        """
        self._waiting += 1
        try:
            return await self._run(job, request, listen)
        finally:
            self._waiting -= 1
            self._early *= bool(self._waiting)

    async def _run(self, job: str, request: Any, listen: Listener) -> Any:
        async with self._lock:
            self.busy, self._is_cancelled = True, False
            try:
                before, heard = self._process, [False]

                def hear(kind: str, value: Any) -> None:
                    heard[0] = True
                    listen(kind, value)

                folder = Path(request["folder"]) if "folder" in request else None
                was_there = folder is not None and folder.exists()
                try:
                    return await self._result(await self._started(), job, request, hear)
                except EndedError:
                    if self._process is not before or heard[0]:
                        raise
                if folder is not None:  # what it may have begun to write
                    shutil.rmtree(folder, ignore_errors=True)
                    folder.mkdir() if was_there else None
                return await self._result(await self._started(), job, request, listen)  # it had ended while it waited
            finally:
                self.busy = False

    async def ask(self, job: str, request: Any) -> Any:
        """The result of a short job; it is done once more where its process ends. Raises as `run` does."""
        try:
            return await self.run(job, request, lambda kind, value: None)
        except EndedError:
            return await self.run(job, request, lambda kind, value: None)

    async def start(self) -> None:
        """Start the process: what it needs is loaded while nobody waits for it."""
        async with self._lock:
            await self._started()

    async def _started(self) -> asyncio.subprocess.Process:
        process = self._process
        if process is None or process.returncode is not None or (process.stdout and process.stdout.at_eof()):
            self._process = await asyncio.create_subprocess_exec(
                sys.executable,
                "-m",
                "omnidyn.studio.jobs",
                stdin=asyncio.subprocess.PIPE,
                stdout=asyncio.subprocess.PIPE,
                limit=LINE_BYTES,
                start_new_session=True,  # Ctrl-C at the terminal is for the server, which ends the worker
            )
            return self._process
        return process

    async def _result(self, process: asyncio.subprocess.Process, job: str, request: Any, listen: Listener) -> Any:
        self.send({"job": job, "request": request})
        self._hears, early, self._early = True, self._early, []
        try:
            for command in early:
                self.command(command)
            return await self._answer(process, listen)
        finally:
            self._hears = False

    async def _answer(self, process: asyncio.subprocess.Process, listen: Listener) -> Any:
        assert process.stdout is not None
        while line := await process.stdout.readline():
            try:
                message = json.loads(line)
            except ValueError:  # cut short: the process ended while it wrote
                break
            for kind, value in message.items():
                if kind == "result":
                    return value
                if kind == "error":  # whatever an interrupt did to a job, it is the end that was asked for
                    raise (CancelledError if value is None or self._is_cancelled else JobError)(value)
                listen(kind, value)
        code = await process.wait()
        if self._is_cancelled:
            raise CancelledError
        raise EndedError(code)

    def command(self, value: Any) -> None:
        """Give a command to the job that is at work, or else to the one that is about to begin."""
        if self._hears:
            self.send({"command": value})
        elif self._waiting:
            self._early.append(value)

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
        self._is_cancelled = True
        self.send({"cancel": True})
        for _ in range(int(GRACE / 0.1)):
            await asyncio.sleep(0.1)
            if not self.busy:
                return
        if process is not None and process is self._process:
            self._is_cancelled = True  # of whatever runs by now: what the job waited for was interrupted first
            await self.stop()

    async def stop(self) -> None:
        """End the process."""
        if self._process is not None and self._process.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                self._process.kill()
            await self._process.wait()
