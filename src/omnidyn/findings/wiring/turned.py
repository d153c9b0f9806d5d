"""By which angle one velocity in the plane is turned against another."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.log_under_check import LogUnderCheck
from omnidyn.findings.wiring.orders import means
from omnidyn.statement import WARNING

MOVING_SHARE = 0.2  # of what 90 % of the windows stay below
FEWEST_WINDOWS = 12  # windows
LEAST_ANGLE, SURE_ERRORS = np.radians(3.0), 6.0  # a marker is mounted no better than that; standard errors
FAR_ANGLE = np.radians(18.0)  # a turn that shows in the likeness, too
TURNED_LIKENESS = 0.9  # likeness of what is the same once it is turned


class Turned(NamedTuple):
    """angle, error [rad]: by which `other` is turned against `own`. alike, plain: likeness turned back and as is."""

    angle: float
    error: float
    alike: float
    plain: float

    @property
    def numbers(self) -> dict[str, float]:
        """What a finding tells of it."""
        return {
            "angle_deg": float(np.degrees(self.angle)),
            "error_deg": float(np.degrees(self.error)),
            "likeness": self.alike,
            "likeness_as_logged": self.plain,
        }


def turned(work: LogUnderCheck, reference: FloatArray, second: FloatArray, rate: FloatArray) -> Turned | None:
    """How `second` is turned against `reference`, shapes (rows, 2), in a robot that turns at `rate` [rad/s], (rows,).

    angle of other/own over short windows = angle + lag * rate + c cos(2 d) + s sin(2 d), d the direction of travel: a
    lag of one of the two and an axis with another scale are no turn. None where too little moves.
    """
    z, y, turning = (mean for mean in means(work, reference, second, np.nan_to_num(rate)[:, None]))
    z, y = z @ [1.0, 1.0j], y @ [1.0, 1.0j]
    size = np.abs(z)
    moving = size > MOVING_SHARE * np.quantile(size, 0.9) if size.size else np.zeros(0, dtype=bool)
    if moving.sum() < FEWEST_WINDOWS:
        return None
    z, y, turning, size = z[moving], y[moving], turning[moving, 0], size[moving]
    slope = (np.conj(z) * y).sum() / max(float(np.sqrt((size**2).sum() * (np.abs(y) ** 2).sum())), 1e-300)
    rest = np.angle(np.conj(z) * y * np.exp(-1j * np.angle(slope)))
    x = np.column_stack([np.ones(len(z)), turning, np.cos(2.0 * np.angle(z)), np.sin(2.0 * np.angle(z))])
    weighted = x * size[:, None]
    gram = weighted.T @ weighted
    gram += 1e-9 * np.trace(gram) * np.eye(4)
    inverse = np.linalg.inv(gram)
    solved = inverse @ (weighted.T @ (rest * size))
    residual = (rest - x @ solved) * size
    error = float(np.sqrt((residual @ residual) / (len(z) - 4) * inverse[0, 0]))
    return Turned(float(np.angle(slope) + solved[0]), error, float(abs(slope)), float(slope.real))


def is_turned(turn: Turned) -> bool:
    """Whether a turn is sure, and no matter of noise."""
    shows = turn.plain < turn.alike * np.cos(0.5 * turn.angle)
    large_turn = turn.alike > TURNED_LIKENESS and abs(turn.angle) > FAR_ANGLE and shows
    return bool(large_turn) or (
        turn.alike > TURNED_LIKENESS and abs(turn.angle) > LEAST_ANGLE and abs(turn.angle) > SURE_ERRORS * turn.error
    )


def marker_finding(turn: Turned, source: str, agrees: str = "") -> Finding:
    """The heading of a marker that is mounted at an angle.

    turn: of what `source` says, and `agrees` too, against the pose.
    """
    return Finding("marker_angle", WARNING, "heading", {**turn.numbers, "source": source, "agrees": agrees})


def with_marker(work: LogUnderCheck, pose: FloatArray, angle: float) -> LogUnderCheck:
    """The work with the angle of the marker [rad] taken off the heading."""
    return work.replace(pose=pose - np.array([0.0, 0.0, angle]))
