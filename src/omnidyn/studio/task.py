"""Task: a job that a tab asked for, its progress and what came of it; all pages share it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from omnidyn.studio.series import Series
from omnidyn.studio.session import Session
from omnidyn.studio.worker import CancelledError, EndedError, JobError


def progress_of(part: str) -> str:
    """The part of a page that shows how far the task of a part is."""
    return f"{part} progress"


@dataclass
class Task:
    """A job. result: of it; error: in words. folder: of its files. command, python: that do the same, with
    files: their names in these -> paths.

    stopped: whether it was cancelled, or its process ended, before there was a result. cancelling: whether that was
    asked for. running, progress, share, spent, left [s]: while it goes on; left: of what it does now. before: what the
    last one like it took [s]. series: of its signals, by the names of their folders.
    """

    result: dict[str, Any] | None = None
    error: str = ""
    running: bool = False
    stopped: bool = False
    cancelling: bool = False
    progress: str = ""
    share: float | None = None
    spent: float = 0.0
    left: float | None = None
    before: float | None = None
    folder: Path | None = None
    series: dict[str, str] = field(default_factory=dict)
    command: str = ""
    python: str = ""
    files: dict[str, str] = field(default_factory=dict)

    def end(self, session: Session) -> None:
        """Forget its signals."""
        for key in self.series.values():
            session.series.pop(key, None)

    async def run(self, session: Session, part: str, worker: str, job: str, request: dict[str, Any]) -> None:
        """Do a job in a worker. part: of the page that shows it. request: without the "folder" of the results."""
        self.running, self.progress, self.folder = True, "starting", session.new_folder() / job
        session.changed(part)

        def listen(kind: str, value: Any) -> None:
            self.progress, self.share, self.spent, self.left = (value[k] for k in ("text", "share", "spent", "left"))
            session.changed(progress_of(part))

        try:
            result = await session.workers[worker].run(job, {**request, "folder": str(self.folder)}, listen)
            for name in result.get("series", ()):
                self.series[name] = f"{job}{session.count}-{name}"
                session.series[self.series[name]] = Series(self.folder / name)
            self.result = session.without_paths(result)
        except JobError as error:
            self.error, self.stopped = session.shown(str(error)), isinstance(error, EndedError)
        except CancelledError:
            self.stopped = True
        finally:
            self.running = False
            session.changed(part)

    async def cancel(self, session: Session, part: str, worker: str) -> None:
        """Ask the job to end, and show at once that it was asked."""
        self.cancelling = True
        session.changed(progress_of(part))
        await session.workers[worker].cancel()
