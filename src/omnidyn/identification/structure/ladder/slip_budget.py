"""What the ladder spends on fits of wheels that slip, which take a hundred times as long as others.

Their engine simulates the log twice for every number of the fit. So what needs it is tried last of a step, not where
the others leave nothing but noise and it promised less than they, and FITS times in all: counted, so that the
answer is
the same on every machine. What is not tried for that is in the answer, by name.
"""

from __future__ import annotations

from collections.abc import Sequence

from omnidyn.identification.structure.ladder.models import Model, Move, Untried
from omnidyn.identification.structure.missing.laws import TRACTION
from omnidyn.statement import NOTE, Statement

FITS = 4  # of wheels that slip, in all steps together
CHI2_MARGIN = 6.0  # of chi squared, by which one remedy explains more than another
NOT_NEEDED_NOTE = Statement("slow_and_not_needed", NOTE)
SPENT_NOTE = Statement("slow_fits_spent", NOTE, numbers={"fits": FITS})


class Purse:
    """How many slow fits are left, and what was not tried for want of them."""

    def __init__(self) -> None:
        self.left, self._untried = FITS, list[Untried]()

    def pays(self, moves: Sequence[Move], base_model: Model) -> list[Move]:
        """Those of some moves that are made; the others are noted."""
        paid_moves = list[Move]()
        for move in moves:
            slow = is_slow(move, base_model)
            if slow and not self.left:
                self._leave(move, SPENT_NOTE)
                continue
            self.left -= slow
            paid_moves.append(move)
        return paid_moves

    def rivals(self, moves: Sequence[Move], best: Model) -> list[Move]:
        """Those of some slow moves that promised about as much as one that leaves nothing but noise; the others are
        noted. Both by the diagnosis of what stood before."""
        assert best.move is not None
        least_promise = best.move.promise - CHI2_MARGIN
        for move in moves:
            if move.promise < least_promise:
                self._leave(move, NOT_NEEDED_NOTE)
        return [move for move in moves if move.promise >= least_promise]

    def untried(self) -> list[Untried]:
        """What was not tried since this was asked last."""
        untried_models, self._untried = self._untried, []
        return untried_models

    def _leave(self, move: Move, reason: Statement) -> None:
        self._untried.append(Untried(move, move.cause, reason))


def is_slow(move: Move, base_model: Model) -> bool:
    """Whether a move is a fit with wheels that slip."""
    slips = any(robot.wheels.traction_mu is not None for robot, _ in base_model.begins.values())
    return slips or move.key == TRACTION


def quick_first(moves: Sequence[Move], base_model: Model) -> tuple[list[Move], list[Move]]:
    """(those of other engines, those with wheels that slip), each best first."""
    slow = [move for move in moves if is_slow(move, base_model)]
    return [move for move in moves if move not in slow], slow
