"""What came of a drive: its log, how far it went, and why it ended."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from omnidyn.document import Document, Points, Table
from omnidyn.driving.program import DriveProgram
from omnidyn.run import Run
from omnidyn.shown import Displayable
from omnidyn.statement import NOTE, Statement, as_verdict


@dataclass(frozen=True, eq=False)
class DriveRecord(Displayable):
    """A drive that is over.

    program: that was driven. run: its log, as `identify` reads it; None where nothing was driven. rows: of the program
    that were sent. stopped: why it ended before the last row; None where it did not. stopped_at: when the last command
    that moves anything was sent, on the clock of the drive [s]. error: that ended it, to be raised where it should be;
    None for none.
    """

    program: DriveProgram
    run: Run | None
    rows: int
    stopped: Statement | None
    stopped_at: float
    error: BaseException | None = None

    @property
    def is_complete(self) -> bool:
        """Whether all of the program was driven."""
        return self.stopped is None

    @property
    def legs(self) -> int:
        """How many legs were driven to their end."""
        return sum(leg.end <= self.rows for leg in self.program.legs)

    @property
    def verdict(self) -> Statement:
        """How far it went, and why it ended."""
        seconds, name = self.rows * self.program.dt, self.program.robot.name
        numbers = {"seconds": seconds, "legs": self.legs, "all_legs": len(self.program.legs)}
        if self.stopped is None:
            return Statement("drive_complete", NOTE, name, numbers)
        return Statement("drive_stopped", self.stopped.severity, name, {**numbers, "why": self.stopped})

    def document(self) -> Document:
        """What it says: a line for each leg."""
        rows = [
            (f"{k}", f"{leg.first * self.program.dt:.1f}", leg.words, "yes" if leg.end <= self.rows else "no")
            for k, leg in enumerate(self.program.legs, 1)
        ]
        table = Table(("leg", "starts s", "leads, as predicted", "driven"), rows, "><<<", name="legs")
        points = Points([self.stopped.remedy_text] if self.stopped is not None else [])
        return Document([points, table], as_verdict(self.verdict) | self.to_dict(), verdict=self.verdict)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, but for the log."""
        return {
            "robot": self.program.robot.name,
            "complete": self.is_complete,
            "stopped": None if self.stopped is None else self.stopped.code,
            "seconds": self.rows * self.program.dt,
            "legs": self.legs,
            "all_legs": len(self.program.legs),
        }
