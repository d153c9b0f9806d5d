"""Which statements a steady-state study makes, from its numbers."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict

import numpy as np

from omnidyn.identification.steady.choice import ShapeChoice, ShapeScore
from omnidyn.identification.steady.lack_of_fit import ROOM, LackOfFit
from omnidyn.identification.steady.operating_points import CURRENT, VOLTAGE, ForcePoints
from omnidyn.identification.steady.shape_fit import ShapeFit
from omnidyn.identification.steady.study_parts import Difference, Viscous
from omnidyn.model.keys import VISCOUS, Key
from omnidyn.statement import NOTE, Statement

LOW_WEIGHT = 0.5
WRONG_WAY = 0.05  # share of points whose force points against the motion from which a sign is doubted
MATTERS = 0.02  # of the force: a viscous part below this does not matter in the speeds driven


def result_statements(
    choice: ShapeChoice, viscous: Mapping[str, Sequence[Viscous]], differences: Sequence[Difference],
    internal: Mapping[str, float], lack: Mapping[str, LackOfFit], within: Collection[str],
) -> list[Statement]:  # fmt: skip
    """What the data say. within: groups in which the force changes within a run."""
    found = [_shape(choice), *_own_shapes(choice), *_ties(choice), *_better_shape(choice)]
    found += [
        _of(group, Statement("no_lack_of_fit", NOTE, numbers={"changes": group in within}) if one.tested
            else Statement("fit_not_tested", NOTE))
        for group, one in lack.items() if not one.found
    ]  # fmt: skip
    found += [_of(group, _viscous(level, choice.of(group))) for group, levels in viscous.items() for level in levels]
    found += [_difference(one) for one in differences]
    found += [
        _of(group, Statement("internal_force", NOTE, numbers={"force": force})) for group, force in internal.items()
    ]
    return found


def _of(group: str, statement: Statement) -> Statement:
    return statement if group == "all" else statement.of(group)


def _shape(choice: ShapeChoice) -> Statement:
    score = choice.score
    box = next((other for other in choice.scores if other.name == "box" and other is not score), None)
    numbers = {"error": (score.loo, score.loo_std), "box": (box.loo, box.loo_std) if box else None}
    return Statement("shape_chosen", NOTE, score.name, numbers)


def _own_shapes(choice: ShapeChoice) -> list[Statement]:
    """Groups whose shape is not that of the others."""
    found = []
    for group, name in choice.own.items():
        scores = {score.name: score for score in choice.scored[group]}
        own, other = scores[name], scores[choice.chosen]
        numbers = {"shape": name, "error": (own.loo, own.loo_std), "other": None}
        if name != choice.chosen:
            numbers |= {"other": other.name, "other_error": (other.loo, other.loo_std)}
        found.append(Statement("group_shape", NOTE, group, numbers))
    return found


def _ties(choice: ShapeChoice) -> list[Statement]:
    """Shapes that the data cannot tell from the best."""
    best, *ties = [score for score in choice.scores if not score.told_apart] or [choice.score]
    behind = [(tie.behind, tie.behind_std) for tie in ties]
    numbers = {"shapes": [tie.name for tie in ties], "behind": behind}
    return [Statement("shapes_tied", NOTE, best.name, numbers)] if ties else []


def _better_shape(choice: ShapeChoice) -> list[Statement]:
    """The best shape, where it is not the chosen one and the data do tell the two apart."""
    best = choice.scores[0]
    if best.name == choice.chosen or not choice.score.told_apart:
        return []
    why = "not_in_model" if not best.in_model else "below_zero" if best.at_bound else "not_asked"
    behind = (choice.score.behind, choice.score.behind_std)
    return [Statement("better_shape_not_used", NOTE, best.name, {"behind": behind, "why": why})]


def lack_statements(
    lack: Mapping[str, LackOfFit], choice: ShapeChoice, within: Collection[str] = ()
) -> list[Statement]:
    """That no offered shape fits, and what would. within: groups in which the force changes within a run."""
    found = []
    for group, one in lack.items():
        best = one.remedies[0] if one.remedies else None
        numbers = {"changes": group in within, "share": one.share, "with": best.words if best else ""}
        if best:
            numbers |= {"shape": choice.of(group), "error": best.error, "error_before": best.error_before,
                        "same": best.same_as}  # fmt: skip
        found += [_of(group, Statement("no_shape_fits", numbers=numbers))] if one.found else []
    return found


def _viscous(level: Viscous, chosen: str) -> Statement:
    numbers = {name: value for name, value in asdict(level).items() if name not in ("key", "seen")}
    if level.guesses:
        return Statement("viscous_with_back_emf", NOTE, level.key, numbers)
    if not level.seen:
        matters = level.effect > MATTERS * level.level
        return Statement("viscous_not_identifiable", NOTE, level.key, numbers | {"matters": matters})
    if level.value < 0.0:
        return Statement("force_falls_with_speed", NOTE, level.key, numbers)
    return Statement("viscous_seen", NOTE, level.key, numbers | {"in_shape": "viscous" in chosen})


def _difference(one: Difference) -> Statement:
    numbers = {name: getattr(one, name) for name in ("values", "difference", "low", "high", "differs")}
    return Statement("group_difference", NOTE, one.key, numbers | {"groups": [one.first, one.second]})


def point_statements(points: ForcePoints, choice: ShapeChoice, turning: bool) -> list[Statement]:
    """What is weak about the points or the comparison of shapes."""
    found = []
    along = points.along[np.isfinite(points.along)]
    wrong = int((along < 0.0).sum())
    if wrong > WRONG_WAY * max(len(along), 1):
        found.append(Statement("against_motion", "warning", points.force_from, {"wrong": wrong, "points": len(along)}))
    if points.force_from == VOLTAGE:
        found.append(Statement("forces_from_voltage", NOTE))
    if not turning:
        found.append(Statement("not_turned"))
    for why in dict.fromkeys(choice.missing.values()):
        shapes = [name for name, reason in choice.missing.items() if reason == why]
        found.append(Statement("shapes_not_compared", NOTE, numbers={"why": why, "shapes": shapes}))
    return found


def fit_statements(fit: ShapeFit, robust: bool, kept: Mapping[str, float], guesses: Sequence[str]) -> list[Statement]:
    """What is weak about the levels of one group. kept: levels of the robot file; guesses: of the back-EMF."""
    found = [
        Statement("level_at_bound", subject=key, numbers={"free": free})
        for key, free in zip(fit.keys, fit.free.tolist(), strict=True) if free < 0.0
    ]  # fmt: skip
    far = int((fit.weight < LOW_WEIGHT).sum())
    if robust and far:
        found.append(Statement("points_far_from_shape", NOTE, numbers={"far": far, "points": len(fit.weight)}))
    found += [Statement("level_kept", NOTE, key, {"level": level}) for key, level in kept.items()]
    levels = [key for key in fit.keys if Key.parse(key).level == VISCOUS]
    if levels and guesses:
        found.append(Statement("rests_on_back_emf", numbers={"levels": levels, "guesses": guesses}))
    return found


def advice(
    choice: ShapeChoice, viscous: Mapping[str, Sequence[Viscous]], lack: Mapping[str, LackOfFit], turning: bool,
    force_from: str,
) -> list[Statement]:  # fmt: skip
    """What to measure next."""
    found = []
    if any(one.found for one in lack.values()):
        keys = {remedy.key for one in lack.values() for remedy in one.remedies}
        found.append(Statement("drive_turned_around" if keys & ROOM else "look_beyond_shapes", NOTE))
    if not turning:
        found.append(Statement("turn_on_the_spot", NOTE))
    if not any(viscous.values()):
        found.append(Statement("drive_at_two_speeds", NOTE))
    elif not all(level.seen for levels in viscous.values() for level in levels):
        found.append(Statement("drive_faster", NOTE))
    tie = next((score for score in choice.scores[1:] if not score.told_apart and score.apart > 0.0), None)
    if tie is not None:
        found.append(_more_directions(choice.scores[0], tie))
    if force_from == CURRENT:
        found.append(Statement("pull_once", NOTE))
    return found


def _more_directions(best: ShapeScore, tie: ShapeScore) -> Statement:
    return Statement("more_directions", NOTE, tie.name, {"best": best.name, "apart": tie.apart})
