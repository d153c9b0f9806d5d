"""The state of a log that is watched while it grows, which all pages share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from omnidyn.studio import calls
from omnidyn.studio.calls import LogFile
from omnidyn.studio.parts import LIVE, WATCH
from omnidyn.studio.session import Session
from omnidyn.studio.worker import CancelledError, JobError

WITHIN = 10.0  # [%] half an interval that is enough, where nobody says


@dataclass
class Watching:
    """The log that is watched. log: its key. within: half an interval that is enough [%]. status: the last answer.

    trouble: why it ended. command, python: that do the same.
    """

    session: Session
    running: bool = False
    log: str = ""
    within: float = WITHIN
    status: dict[str, Any] | None = None
    trouble: str = ""
    command: str = ""
    python: str = ""

    def why_not(self) -> str:
        """What keeps from it, in words; "" for nothing."""
        return "" if self.session.robot_path else "Choose a robot first."

    def want(self, within: Any) -> None:
        """Take how wide half an interval may be [%]."""
        if isinstance(within, int | float) and 0.0 < within < 1e6:
            self.within = float(within)
        self.session.changed(WATCH)

    async def run(self, log: LogFile) -> None:
        """Watch a log until `stop`; then it is checked with all that came."""
        if self.running or self.why_not():
            return
        session = self.session
        self.running, self.log, self.status, self.trouble = True, log.key, None, ""
        self.command, self.python = calls.watch(log, session.robot_path, self.within)
        session.changed(WATCH, LIVE)

        def listen(kind: str, value: Any) -> None:
            if kind == "live":
                self.status = session.without_paths(value)
                session.changed(LIVE)

        request = {**log.request, "robot": session.robot_path, "within": self.within / 100.0}
        try:
            self.status = session.without_paths(await session.workers[WATCH].run("watch", request, listen))
        except JobError as error:
            self.trouble = session.shown(str(error))
        except CancelledError:
            pass
        self.running = False
        session.changed(WATCH, LIVE)
        if log.key in session.logs:
            await session.check(log)

    def stop(self) -> None:
        """End it."""
        self.session.workers[WATCH].command("stop")
