"""Which statements a steady-state study makes, from its numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING

from omnidyn.identification.lack_of_fit import LackOfFit
from omnidyn.identification.steady.choice import ShapeChoice
from omnidyn.identification.steady.operating_points import ForcePoints
from omnidyn.identification.steady.unoffered_parts import TILTED_FLOOR
from omnidyn.model.keys import Key
from omnidyn.statement import Statement

if TYPE_CHECKING:
    pass
from collections.abc import Collection, Sequence

import numpy as np

from omnidyn.identification.steady.group_numbers import Difference, Viscous
from omnidyn.identification.steady.operating_points import CURRENT, VOLTAGE
from omnidyn.identification.steady.shapes import ShapeFit
from omnidyn.model.keys import VISCOUS
from omnidyn.statement import NOTE

LOW_WEIGHT = 0.5
WRONG_WAY = 0.05  # share of points whose force points against the motion from which a sign is doubted
FORCE_SHARE = 0.02  # of the force: a viscous part below this does not matter in the speeds driven


def result_statements(
    choice: ShapeChoice,
    viscous: Mapping[str, Sequence[Viscous]],
    differences: Sequence[Difference],
    internal: Mapping[str, float],
    lack: Mapping[str, LackOfFit],
    changed_groups: Collection[str],
) -> list[Statement]:
    """What the data say. changed_groups: groups in which the force changes within a run."""
    statements = _shape_statements(choice)
    statements += [
        of_group(
            group,
            Statement("no_lack_of_fit", NOTE, numbers={"changes": group in changed_groups})
            if group_lack.tried
            else Statement("fit_not_tested", NOTE),
        )
        for group, group_lack in lack.items()
        if not group_lack.found
    ]
    statements += [
        of_group(group, _viscous(level, choice.of(group))) for group, levels in viscous.items() for level in levels
    ]
    statements += [
        Statement(
            "group_difference",
            NOTE,
            pair.key,
            {
                "values": pair.values,
                "difference": pair.difference,
                "low": pair.low,
                "high": pair.high,
                "differs": pair.differs,
                "groups": [pair.first, pair.second],
            },
        )
        for pair in differences
    ]
    statements += [
        of_group(group, Statement("internal_force", NOTE, numbers={"force": force}))
        for group, force in internal.items()
    ]
    return statements


def of_group(group: str, statement: Statement) -> Statement:
    return statement if group == "all" else statement.of(group)


def _shape_statements(choice: ShapeChoice) -> list[Statement]:
    """The shape that was chosen, groups with another one, shapes that the data cannot tell from the best, and the best
    where it is not the chosen one and the data do tell the two apart.
    """
    score, best = choice.score, choice.scores[0]
    box = next(
        (rival_score for rival_score in choice.scores if rival_score.name == "box" and rival_score is not score), None
    )
    numbers = {"error": (score.loo, score.loo_std), "box": (box.loo, box.loo_std) if box else None}
    statements = [Statement("shape_chosen", NOTE, score.name, numbers)]
    for group, name in choice.own.items():
        scores = {score.name: score for score in choice.scored[group]}
        score, other_score = scores[name], scores[choice.chosen]
        numbers = {"shape": name, "error": (score.loo, score.loo_std), "other": None}
        if name != choice.chosen:
            numbers |= {"other": other_score.name, "other_error": (other_score.loo, other_score.loo_std)}
        statements.append(Statement("group_shape", NOTE, group, numbers))
    first, *ties = [score for score in choice.scores if not score.told_apart] or [choice.score]
    if ties:
        numbers = {"shapes": [tie.name for tie in ties], "behind": [(tie.behind, tie.behind_std) for tie in ties]}
        statements.append(Statement("shapes_tied", NOTE, first.name, numbers))
    if best.name != choice.chosen and score.told_apart:
        reason = "not_in_model" if not best.in_model else "below_zero" if best.at_bound else "not_asked"
        numbers = {"behind": (score.behind, score.behind_std), "why": reason}
        statements.append(Statement("better_shape_not_used", NOTE, best.name, numbers))
    return statements


def lack_statements(
    lack: Mapping[str, LackOfFit], choice: ShapeChoice, changed_groups: Collection[str] = ()
) -> list[Statement]:
    """That no offered shape fits, and what would. changed_groups: groups in which the force changes within a run."""
    statements = []
    for group, group_lack in lack.items():
        numbers = {"changes": group in changed_groups, "share": group_lack.channels["force"], "with": ""}
        if group_lack.remedies and (best := group_lack.remedies[0]).force:
            numbers |= {
                "with": best.cause,
                "shape": choice.of(group),
                "error": best.force.after,
                "error_before": best.force.before,
                "same": best.same_as,
            }
        statements += [of_group(group, Statement("no_shape_fits", numbers=numbers))] if group_lack.found else []
    return statements


def _viscous(level: Viscous, shape_name: str) -> Statement:
    numbers = {name: value for name, value in asdict(level).items() if name not in ("key", "seen")}
    if level.guesses:
        return Statement("viscous_with_back_emf", NOTE, level.key, numbers)
    if not level.seen:
        matters = level.effect > FORCE_SHARE * level.level
        return Statement("viscous_not_identifiable", NOTE, level.key, numbers | {"matters": matters})
    if level.value < 0.0:
        return Statement("force_falls_with_speed", NOTE, level.key, numbers)
    return Statement("viscous_seen", NOTE, level.key, numbers | {"in_shape": "viscous" in shape_name})


def point_statements(points: ForcePoints, choice: ShapeChoice, has_yaw: bool) -> list[Statement]:
    """What is weak about the points or the comparison of shapes."""
    statements = []
    travel_forces = points.along[np.isfinite(points.along)]
    wrong = int((travel_forces < 0.0).sum())
    if wrong > WRONG_WAY * max(len(travel_forces), 1):
        statements.append(
            Statement("against_motion", "warning", points.force_from, {"wrong": wrong, "points": len(travel_forces)})
        )
    if points.force_from == VOLTAGE:
        statements.append(Statement("forces_from_voltage", NOTE))
    if not has_yaw:
        statements.append(Statement("not_turned"))
    for missing_reason in dict.fromkeys(choice.missing.values()):
        shapes = [name for name, reason in choice.missing.items() if reason == missing_reason]
        statements.append(Statement("shapes_not_compared", NOTE, numbers={"why": missing_reason, "shapes": shapes}))
    return statements


def fit_statements(
    fit: ShapeFit, robust: bool, kept_levels: Mapping[str, float], guesses: Sequence[str]
) -> list[Statement]:
    """What is weak about the levels of one group. kept_levels: levels of the robot file; guesses: of the back-EMF."""
    statements = [
        Statement("level_at_bound", subject=key, numbers={"free": free})
        for key, free in zip(fit.keys, fit.free.tolist(), strict=True)
        if free < 0.0
    ]
    far_count = int((fit.weight < LOW_WEIGHT).sum())
    if robust and far_count:
        statements.append(
            Statement("points_far_from_shape", NOTE, numbers={"far": far_count, "points": len(fit.weight)})
        )
    statements += [Statement("level_kept", NOTE, key, {"level": level}) for key, level in kept_levels.items()]
    levels = [key for key in fit.keys if Key.parse(key).level == VISCOUS]
    if levels and guesses:
        statements.append(Statement("rests_on_back_emf", numbers={"levels": levels, "guesses": guesses}))
    return statements


def advice(
    choice: ShapeChoice,
    viscous: Mapping[str, Sequence[Viscous]],
    lack: Mapping[str, LackOfFit],
    has_yaw: bool,
    force_from: str,
) -> list[Statement]:
    """What to measure next."""
    statements = []
    if any(group_lack.found for group_lack in lack.values()):
        keys = {remedy.key for group_lack in lack.values() for remedy in group_lack.remedies}
        statements.append(Statement("drive_turned_around" if keys & TILTED_FLOOR else "look_beyond_shapes", NOTE))
    if not has_yaw:
        statements.append(Statement("turn_on_the_spot", NOTE))
    if not any(viscous.values()):
        statements.append(Statement("drive_at_two_speeds", NOTE))
    elif not all(level.seen for levels in viscous.values() for level in levels):
        statements.append(Statement("drive_faster", NOTE))
    tie = next((score for score in choice.scores[1:] if not score.told_apart and score.apart > 0.0), None)
    if tie is not None:
        numbers = {"best": choice.scores[0].name, "apart": tie.apart}
        statements.append(Statement("more_directions", NOTE, tie.name, numbers))
    if force_from == CURRENT:
        statements.append(Statement("pull_once", NOTE))
    return statements
