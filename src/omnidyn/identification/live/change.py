"""What is no longer as in a fit before: the last stretches alone, beside it.

A floor changes Coulomb friction along all axes, one way. A payload changes mass or inertia. What is left of one number
alone is wear: of a bearing, a wheel, a motor.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from omnidyn.identification.live.model import LiveModel
from omnidyn.identification.output_error.conclusion import prior_of
from omnidyn.model.keys import BREAKAWAY, COULOMB, Key
from omnidyn.model.robot import Robot
from omnidyn.statement import WARNING, Statement

ERRORS, SHARE = 5.0, 0.1  # standard errors, and share of a number, that it must have changed by
MASSES = ("body.mass_kg", "body.inertia_kg_m2")
FLOOR, PAYLOAD, WEAR = "floor", "payload", "wear"


def changes(model: LiveModel, reference: Robot) -> tuple[Statement, ...]:
    """What the last stretches say of a robot that was fitted before: which numbers changed, by how much, and what that
    looks like. Nothing until there are enough of them."""
    sums = model.latest
    if sums is None:
        return ()
    inner, covariance = model.of_sums(sums)
    changed: dict[str, float] = {}
    for j, parameter in enumerate(model.problem.robot_parameters):
        before, prior = float(Key.parse(parameter.name).get(reference)), prior_of(reference, parameter.name)
        if before <= 0.0 or not np.isfinite(covariance[j, j]):
            continue
        before_std = 0.0 if prior is None or prior.std is None else prior.std / parameter.slope(before)
        difference, std = (
            float(inner[j]) - parameter.inner(before),
            float(np.hypot(np.sqrt(covariance[j, j]), before_std)),
        )
        share = parameter.outer(float(inner[j])) / before - 1.0
        if abs(difference) > ERRORS * std and abs(share) > SHARE:
            changed[parameter.name] = share
    levels = [p.name for p in model.problem.robot_parameters if Key.parse(p.name).level in (COULOMB, BREAKAWAY)]
    return tuple(
        Statement("live_changed", WARNING, kind, {"keys": tuple(shares), "shares": tuple(shares.values())})
        for kind, shares in _kinds(changed, levels).items()
        if shares
    )


def _kinds(changed: Mapping[str, float], levels: list[str]) -> dict[str, dict[str, float]]:
    """Changes by what they look like. levels: the numbers of dry friction."""
    rubbing = {name: share for name, share in changed.items() if name in levels}
    heavier = {name: share for name, share in changed.items() if name in MASSES}
    is_floor = len(rubbing) == len(levels) and len({share > 0.0 for share in rubbing.values()}) == 1
    if heavier:
        return {PAYLOAD: heavier | rubbing, WEAR: {k: v for k, v in changed.items() if k not in heavier | rubbing}}
    if is_floor:
        return {FLOOR: rubbing, WEAR: {k: v for k, v in changed.items() if k not in rubbing}}
    return {WEAR: dict(changed)}
