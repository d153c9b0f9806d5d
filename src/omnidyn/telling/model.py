"""What a simulation, the dead zone and the friction of a robot say."""

from __future__ import annotations

from omnidyn.document import all_of, short
from omnidyn.statement import Statement
from omnidyn.telling.sentence import Sentence

FULL = {"supply": "the supply", "voltage_limit": "the voltage limit (the file has no supply)"}


def _starts_to_move(statement: Statement) -> str:
    """From which voltage of the most loaded motor a robot moves, which way, and what its motors never reach."""
    ways, volts, stuck = (statement.numbers[name] for name in ("ways", "volts", "stuck"))
    words = all_of([f"{direction} from {level:.2f} V" for direction, level in zip(ways, volts, strict=True)])
    never = f"; {all_of(stuck)} its motors cannot move it" if stuck else ""
    return f"the robot {statement.subject} starts to move {words}{never}"


def _travel_range(statement: Statement) -> str:
    """The easiest and the hardest direction of travel, with intervals where there are any."""
    numbers = statement.numbers
    ends = [
        f"{volts:.3f} V{' [{:.3f}, {:.3f}]'.format(*ends) if ends else ''} at {degrees:.0f} deg"
        for volts, ends, degrees in zip(numbers["volts"], numbers["ci95"], numbers["degrees"], strict=True)
    ]
    return f"over all directions of travel, without turning: from {ends[0]} to {ends[1]}"


def _duty_of(statement: Statement) -> str:
    """The volts that a duty of 1 is."""
    return f"duty: of {FULL[statement.subject]}, {statement.numbers['volts']:g} V"


def _dead_zone_rests_on_guesses(statement: Statement) -> str:
    """Guesses that the dead zone, or its duty, rests on; by how much, where they have a std."""
    numbers = statement.numbers
    pairs = [*zip(numbers["keys"], numbers["effects"], strict=True)]
    with_effect = [f"{key} ({short(100.0 * effect)} % by its std)" for key, effect in pairs if effect is not None]
    bare = [f"{key} (no std: in no interval)" for key, effect in pairs if effect is None]
    return f"{'the duty' if numbers['duty'] else 'it'} rests on guesses: {', '.join([*with_effect, *bare])}"


def _slip(statement: Statement) -> str:
    """Wheels that slipped, and how often."""
    wheels, shares = statement.numbers["wheels"], statement.numbers["shares"]
    parts = [f"wheel {wheel} in {100.0 * share:.2g} %" for wheel, share in zip(wheels, shares, strict=True)]
    return f"wheels slip: {', '.join(parts)} of the samples"


SENTENCES = {
    "starts_to_move": Sentence(_starts_to_move),
    "does_not_move": Sentence("the robot {subject} does not move {ways}, whatever voltage its motors can have"),
    "travel_range": Sentence(_travel_range),
    "duty_of": Sentence(_duty_of),
    "dead_zone_rests_on_guesses": Sentence(_dead_zone_rests_on_guesses),
    "no_interval": Sentence("no interval: no number of the robot file has a std; identify writes them"),
    "empty_intervals": Sentence(
        "the intervals are empty: no number that the dead zone follows from has a std in the file"
    ),
    "holds_exactly": Sentence("a law that does not bend holds exactly; its breakaway is the same at every rate"),
    "creeps": Sentence(
        "a bristle never holds exactly: under a force that swings below breakaway the robot creeps on, which is what "
        "the law says"
    ),
    "bristles_damp": Sentence("in a fast ramp the damping of bristles resists too"),
    "wheels_roll": Sentence("the wheels roll here: their slip (traction_mu) is not simulated"),
    "motors_too_weak": Sentence("the motors cannot break it loose far enough along {axes}: no ramp is shown there"),
    "clipped": Sentence("{subject} above the limit was clipped in {clipped} of {rows} rows, first in row {first}"),
    "not_converged": Sentence(
        "the friction solver stopped at its iteration limit in {stopped} of {rows} rows",
        "compare with a shorter step",
    ),
    "wheels_slip": Sentence(_slip),
    "wheel_lifts": Sentence(
        "wheel {wheel} leaves the floor in {share:.2%} of the rows and has no grip then; tipping is not modelled"
    ),
    "wheel_in_air": Sentence("wheel {wheel} carries no load: it does not touch the floor and has no grip"),
    "quoted": Sentence("{text}"),
}
