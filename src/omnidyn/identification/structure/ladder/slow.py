"""What the ladder spends on fits of wheels that slip, which take a hundred times as long as others.

Their engine simulates the log twice for every number of the fit. So what needs it is tried last of a step, not where
the others leave nothing but noise and it promised less than they, and FITS times in all: counted, so that the answer is
the same on every machine. What is not tried for that is in the answer, by name.
"""

from __future__ import annotations

from collections.abc import Sequence

from omnidyn.identification.structure.ladder.models import Model, Move, Untried
from omnidyn.identification.structure.missing.laws import TRACTION
from omnidyn.statement import NOTE, Statement

FITS = 4  # of wheels that slip, in all steps together
CLEARLY = 6.0  # of chi squared, by which one remedy explains more than another
NOT_NEEDED = Statement("slow_and_not_needed", NOTE)
BEYOND = Statement("slow_fits_spent", NOTE, numbers={"fits": FITS})


class Purse:
    """How many slow fits are left, and what was not tried for want of them."""

    def __init__(self) -> None:
        self.left, self._untried = FITS, list[Untried]()

    def pays(self, moves: Sequence[Move], stands: Model) -> list[Move]:
        """Those of some moves that are made; the others are noted."""
        made = list[Move]()
        for move in moves:
            slow = is_slow(move, stands)
            if slow and not self.left:
                self._leave(move, BEYOND)
                continue
            self.left -= slow
            made.append(move)
        return made

    def rivals(self, moves: Sequence[Move], best: Model) -> list[Move]:
        """Those of some slow moves that promised about as much as one that leaves nothing but noise; the others are
        noted. Both by the diagnosis of what stood before."""
        assert best.move is not None
        least = best.move.promise - CLEARLY
        for move in moves:
            if move.promise < least:
                self._leave(move, NOT_NEEDED)
        return [move for move in moves if move.promise >= least]

    def told(self) -> list[Untried]:
        """What was not tried since it was told last."""
        found, self._untried = self._untried, []
        return found

    def _leave(self, move: Move, why: Statement) -> None:
        self._untried.append(Untried(move, move.cause, why))


def is_slow(move: Move, stands: Model) -> bool:
    """Whether a move is a fit with wheels that slip."""
    slips = any(robot.wheels.traction_mu is not None for robot, _ in stands.begins.values())
    return slips or move.key == TRACTION


def quick_first(moves: Sequence[Move], stands: Model) -> tuple[list[Move], list[Move]]:
    """(those of other engines, those with wheels that slip), each best first."""
    slow = [move for move in moves if is_slow(move, stands)]
    return [move for move in moves if move not in slow], slow
