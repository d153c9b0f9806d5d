"""What a simulation says of its run."""

from __future__ import annotations

from omnidyn.statement import Statement
from omnidyn.telling.sentence import Sentence


def _slip(statement: Statement) -> str:
    """Wheels that slipped, and how often."""
    wheels, shares = statement.numbers["wheels"], statement.numbers["shares"]
    parts = [f"wheel {wheel} in {100.0 * share:.2g} %" for wheel, share in zip(wheels, shares, strict=True)]
    return f"wheels slip: {', '.join(parts)} of the samples"


SENTENCES = {
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
