"""Order and sign of the columns of motors: by u = R i + K l w, or by the likeness of drive and speed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.findings.finding import Finding
from omnidyn.findings.signal.log_under_check import LogUnderCheck
from omnidyn.findings.signal.reference import CURRENT_AND_VOLTAGE, emf, ohmic, volts
from omnidyn.findings.wiring.orders import Wiring, WiringChoice, choose, means, wiring_finding, wirings
from omnidyn.logs.channels import components

HOLDS = 0.25  # of the voltage: where more is left of it under every wiring, a scale is wrong, and no wiring is told
EXACT_SHARE = 0.004  # of the voltage: what less is left of it is the noise of an exact relation


def motor_known(work: LogUnderCheck) -> bool:
    """Whether voltage or current is there to say which motor a speed belongs to."""
    return work.full("wheel_speed") is not None and (
        work.full("voltage") is not None or work.full("duty") is not None or work.full("current") is not None
    )


class Circuit(NamedTuple):
    """holds: whether u = R i + K l w holds under some wiring. wrong: (channel that is wired wrongly, how), or None."""

    holds: bool
    wrong: tuple[str, WiringChoice] | None = None


def by_drive(work: LogUnderCheck) -> tuple[str, WiringChoice] | None:
    """(channel that is wired wrongly, how), from the likeness of voltage or duty and speed."""
    for channel in ("voltage", "duty"):
        if work.full(channel) is not None:
            answer = by_likeness(work, channel)
            return None if answer is None else (channel, answer)
    return None


def by_circuit(work: LogUnderCheck) -> Circuit:
    """What u - R i - K l w says, which is 0 for the right wiring."""
    voltage, current, speed = volts(work), work.full("current"), work.full("wheel_speed")
    robot = work.geometry
    if voltage is None or current is None or speed is None or robot is None or work.log.current_unsigned:
        return Circuit(False)
    ohmic_drop, counter = ohmic(work, current), emf(work, speed)
    assert ohmic_drop is not None
    assert counter is not None
    u, r, e = means(work, voltage, ohmic_drop, counter)
    if len(u) < 8:
        return Circuit(False)
    candidates = list(wirings(u.shape[1]))
    total = float((u**2).sum())
    names = ("duty" if work.get("voltage") is None else "voltage", "current", "wheel_speed")
    best: tuple[str, WiringChoice] | None = None
    holds = False
    for name, permuted, rest in zip(names, (u, r, e), ((r, e, 1), (u, e, -1), (u, r, -1)), strict=True):
        remainder = rest[0] + rest[1] if rest[2] > 0 else rest[0] - rest[1]
        m = permuted.T @ remainder
        size = float((permuted**2).sum() + (remainder**2).sum())
        costs = np.array([size - 2.0 * float((wiring.matrix * m.T).sum()) for wiring in candidates])
        holds |= bool(costs.min() < HOLDS * total)
        answer = choose(candidates, costs, total, poor=EXACT_SHARE)
        if answer is not None and (best is None or answer.left < best[1].left):
            best = (name, answer)
    return Circuit(True, best) if holds or best is not None else _by_scaled_speed(candidates, u - r, e, total)


def _by_scaled_speed(candidates: list[Wiring], emf_target: FloatArray, e: FloatArray, total: float) -> Circuit:
    """The same where no wiring makes the relation hold: speeds in another unit, K l w times any number."""
    along = np.array([float((wiring.matrix * (e.T @ emf_target).T).sum()) for wiring in candidates])
    costs = float((emf_target**2).sum()) - np.maximum(along, 0.0) ** 2 / max(float((e**2).sum()), 1e-300)
    if not costs.min() < HOLDS * total:
        return Circuit(False)
    answer = choose(candidates, costs, total, poor=EXACT_SHARE)
    return Circuit(True, None if answer is None else ("wheel_speed", answer))


def by_likeness(work: LogUnderCheck, channel: str) -> WiringChoice | None:
    """Order and signs under which a drive channel and the speed of the same wheel look alike."""
    driven, speed = work.full(channel), work.full("wheel_speed")
    if driven is None or speed is None or driven.shape != speed.shape:
        return None
    u, w = means(work, driven, speed)
    if len(u) < 8:
        return None
    su, sw = np.sqrt((u**2).sum(axis=0)), np.sqrt((w**2).sum(axis=0))
    if (su < 0.05 * su.max()).any() or (sw < 0.05 * sw.max()).any() or su.max() == 0.0 or sw.max() == 0.0:
        return None  # a wheel that is not driven tells nothing of its place
    alike = (u.T @ w) / np.outer(su, sw)
    n = len(alike)
    candidates = list(wirings(n))
    costs = np.array(
        [
            sum(
                1.0 - (s * alike[j, k]) * abs(alike[j, k])
                for k, (j, s) in enumerate(zip(wiring.order, wiring.sign, strict=True))
            )
            for wiring in candidates
        ]
    )
    answer = choose(candidates, costs, float(n))
    return answer if answer is not None and (answer.logged - answer.left) * n > 1.0 else None


def motor_finding(work: LogUnderCheck, channel: str, answer: WiringChoice, rests_on: tuple[str, ...] = ()) -> Finding:
    """Errors: columns of one channel of the motors are exchanged, or have the opposite sign."""
    names = components(channel, work.wheels)
    against = "wheel_speed" if channel != "wheel_speed" else CURRENT_AND_VOLTAGE
    return wiring_finding(answer, names, {"channel": channel, "against": against}, "motors", rests_on)
