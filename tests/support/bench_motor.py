"""A motor on a bench by small steps of its own: stiction above sliding friction, one level each way, drag, an encoder.

It shares no code with `omnidyn.simulation`.

    inertia w' = u - slope w - drag w |w| - slide sgn w,   at rest while -hold_back <= u <= hold_ahead
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

FINE = 10  # steps from row to row


@dataclass(frozen=True)
class BenchMotor:
    """hold: input at which it sets off from rest (forward, backward); slide: level of sliding friction, either way.

    In units of the input; slope per rad/s, drag per (rad/s)^2, inertia per rad/s^2.
    """

    hold: tuple[float, float] = (0.6, 0.9)
    slide: tuple[float, float] = (0.4, 0.55)
    slope: float = 0.3
    inertia: float = 0.02
    drag: float = 0.0

    def turn(self, t: np.ndarray, put_in: np.ndarray) -> tuple[np.ndarray, np.ndarray, list, list]:
        """(speed, angle) at the rows, and the inputs of (starts, stops), each (side, input): the input is held."""
        w = a = 0.0
        speed, angle, starts, stops = [], [], [], []
        for u, dt in zip(put_in, np.append(np.diff(t), t[-1] - t[-2]), strict=True):
            speed.append(w)
            angle.append(a)
            for _ in range(FINE):
                before = w
                if w == 0.0:
                    side = 1.0 if u > self.hold[0] else -1.0 if u < -self.hold[1] else 0.0
                    if side:
                        starts.append((side, u))
                else:
                    side = float(np.sign(w))
                if side:
                    slide = self.slide[0] if side > 0.0 else self.slide[1]
                    w += (u - self.slope * w - self.drag * w * abs(w) - side * slide) / self.inertia * dt / FINE
                    if w * side <= 0.0:
                        w = 0.0
                        stops.append((side, u))
                a += 0.5 * (before + w) * dt / FINE
        return np.array(speed), np.array(angle), starts, stops


def encoder(t: np.ndarray, angle: np.ndarray, ticks: int) -> np.ndarray:
    """Speed [rad/s] as a counter of so many ticks a turn gives it: differences of counts over a row."""
    count = np.floor(angle * ticks / (2.0 * np.pi))
    steps = np.diff(count) * 2.0 * np.pi / ticks / np.diff(t)
    return np.concatenate([[0.0], steps])


def ramps(peaks: Sequence[float], rate: float, dt: float, rest: float = 0.3) -> tuple[np.ndarray, np.ndarray]:
    """(t, input): up to each peak and back to 0 at a rate per second, at rest in between."""
    parts = []
    for peak in peaks:
        up = np.arange(0.0, abs(peak), rate * dt)
        parts += [np.zeros(round(rest / dt)), np.sign(peak) * up, np.sign(peak) * up[::-1]]
    put_in = np.concatenate([*parts, np.zeros(round(rest / dt))])
    return dt * np.arange(len(put_in)), put_in
