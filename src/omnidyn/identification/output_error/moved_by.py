"""What moves the numbers of a fit beside its noise: what is known of the robot only so far, what its log rounds."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.memory.whitening import Weighed
from omnidyn.identification.output_error.problem.input_steps import input_steps
from omnidyn.identification.output_error.problem.record import Record
from omnidyn.identification.output_error.trust.uncertainty import Trust
from omnidyn.statement import WARNING, Statement

WIDER = 1.1  # times an interval, from which on what widens it is said


class MovedBy(NamedTuple):
    """What moves the parameters, (P, K), the covariance of that being itself times its transpose. file: by numbers that
    the robot file knows only so far, name -> std; rounding: by what the inputs were rounded by."""

    file: Callable[[Weighed, Mapping[str, float]], FloatArray]
    rounding: Callable[[Weighed], FloatArray]


def beside_rounding(
    sure: Weighed, records: Sequence[Record], moved_by: MovedBy | None
) -> tuple[Trust, list[Statement]]:  # fmt: skip
    """(the trust in a fit, with what inputs in steps may have been rounded by; what is to be said of that)."""
    steps = max(float(input_steps(record).max()) for record in records)
    if not steps or moved_by is None:
        return sure.known, []
    known = sure.known.beside(moved_by.rounding(sure))
    with np.errstate(divide="ignore", invalid="ignore"):
        wider = float(np.nanmax(known.std / sure.known.std, initial=1.0))
    rounded = Statement("rounded_inputs", WARNING, numbers={"step": steps, "wider": wider})
    return known, [rounded] if wider > WIDER else []
