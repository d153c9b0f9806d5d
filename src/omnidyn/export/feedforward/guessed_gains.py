"""Gains that rest on a guess of the friction: a robot of `omnidyn init`, before a fit."""

from __future__ import annotations

from omnidyn.errors import InputError
from omnidyn.export.feedforward.gains import MOST_TICKS
from omnidyn.model.keys import COULOMB
from omnidyn.model.known.told import guesses
from omnidyn.model.robot import Robot


def guessed_gains(robot: Robot, force_guess: bool) -> tuple[str, ...]:
    """What to say of gains whose kS is a guess; () where the Coulomb friction is known.

    Raises InputError for such gains unless `force_guess`: on a robot they look like measured ones.
    """
    keys = [key for key in guesses(robot) if key.startswith("friction.") and COULOMB in key]
    if not keys:
        return ()
    if not force_guess:
        raise InputError(
            "these gains are guesses: no log has told the friction of this robot",
            got=f"a guess for {', '.join(keys)}",
            expected="friction that was identified, measured or given",
            remedy="fit it by `omnidyn identify` and export the fit, or use `force_guess`",
        )
    return (f"GUESSES, not measured: kS, and what follows from it, rest on a guess for {', '.join(keys)}",)


def check_ticks(ticks_per_turn: float | None) -> None:
    """Raises InputError for what is no number of ticks in a turn of a wheel."""
    if ticks_per_turn is not None and not 0.0 < ticks_per_turn <= MOST_TICKS:
        raise InputError(
            "not a number of ticks in a turn of a wheel",
            got=ticks_per_turn,
            expected=f"more than 0 and at most {MOST_TICKS:g}",
            where="ticks_per_turn",
        )
