"""Which command acts now: the robot's side of the dead-man stop, which needs no clock in common with the sender."""

from __future__ import annotations

from omnidyn.driving.connection import Command


class DeadMan:
    """The command that acts, by the robot's own clock.

    The clocks of both sides differ by an unknown amount. The least difference between arrival and sending seen so far
    is that of the fastest command: beyond it, a command is late. It acts until `hold` after it was sent.
    """

    def __init__(self, wheels: int) -> None:
        self.off = (0.0,) * wheels
        self.session, self.number = -1, -1
        self._inputs, self._begin, self._end, self._difference = self.off, 0.0, 0.0, 0.0

    def take(self, now: float, command: Command) -> bool:
        """Whether a command that arrives now is taken: one of this session, newer than the last, and not too late."""
        if len(command.inputs) != len(self.off):
            return False
        if command.number == 0:
            if command.session != self.session:
                self.session, self._difference = command.session, now - command.sent
            self.number, self._inputs = 0, self.off
            self._difference = min(self._difference, now - command.sent)
            return True
        if command.session != self.session or command.number <= self.number:
            return False
        self._difference = min(self._difference, now - command.sent)
        end = command.sent + self._difference + command.hold
        if now >= end:
            return False
        self.number, self._inputs, self._begin, self._end = command.number, command.inputs, now, end
        return True

    def acting(self, now: float) -> tuple[float, ...]:
        """What the motors get now; a clock that goes back switches them off."""
        if not self._begin <= now < self._end:
            self._inputs = self.off
        return self._inputs

    def stop(self) -> None:
        """Off, whatever was taken."""
        self._inputs = self.off

    @property
    def end(self) -> float:
        """When the command that acts ends, by the robot's clock."""
        return self._end
