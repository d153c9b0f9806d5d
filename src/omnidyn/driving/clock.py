"""Time as a drive sees it: of this machine, or simulated, which passes at once."""

from __future__ import annotations

import time
from typing import Protocol


class DriveClock(Protocol):
    """now: seconds that never go back. sleep_until: wait for that time; no wait where it is past."""

    def now(self) -> float: ...

    def sleep_until(self, due: float) -> None: ...


class RealClock:
    """The monotonic clock of this machine."""

    def now(self) -> float:
        """Seconds since any fixed moment."""
        return time.monotonic()

    def sleep_until(self, due: float) -> None:
        """Wait until then."""
        left = due - self.now()
        if left > 0.0:
            time.sleep(left)


class SimulatedClock:
    """A clock that is set, and never waited for."""

    def __init__(self) -> None:
        self._now = 0.0

    def now(self) -> float:
        """Seconds since it was made."""
        return self._now

    def sleep_until(self, due: float) -> None:
        """Set it to that time."""
        self._now = max(self._now, due)


LATE = 0.1  # [s]: what is more behind is not made up


class PacedClock(SimulatedClock):
    """A simulated clock that goes on so many times as fast as real time, for who looks on.

    A machine that is busy slows it down: nothing that it times is late.
    """

    def __init__(self, pace: float = 1.0) -> None:
        super().__init__()
        self.pace, self._due = pace, time.monotonic()

    def sleep_until(self, due: float) -> None:
        """Set it to that time when it is so late in real time too."""
        now = time.monotonic()
        self._due = max(self._due + max(due - self._now, 0.0) / self.pace, now - LATE)
        if self._due > now:
            time.sleep(self._due - now)
        super().sleep_until(due)
