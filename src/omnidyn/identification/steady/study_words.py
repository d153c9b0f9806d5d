"""What a steady-state study says in words: plain, with numbers, and with what to do next."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence

import numpy as np

from omnidyn.identification.steady.choice import APART, ShapeChoice, ShapeScore
from omnidyn.identification.steady.lack_of_fit import LackOfFit
from omnidyn.identification.steady.operating_points import CURRENT, SPEEDS, ForcePoints
from omnidyn.identification.steady.shape_fit import ShapeFit
from omnidyn.identification.steady.study_parts import Difference
from omnidyn.identification.steady.study_parts import Viscous as ViscousLevel
from omnidyn.model.keys import VISCOUS, Key, unit
from omnidyn.model.layout import YAW

FORCES = {"current": "motor currents, eqs (7)-(10)", "voltage": "voltage and speed, eq (11)"}
LOW_WEIGHT = 0.5
WRONG_WAY = 0.05  # share of points whose force points against the motion from which a sign is doubted


BESIDE = " on both sides of the change within the run"
LOST = {
    "current": "the sign of the currents is lost (`current_unsigned`)",
    "voltage": "the sign of the voltages or speeds is wrong, or K_t, K_v, the gear or a radius of the robot file is",
}


def method(points: ForcePoints, fit: ShapeFit, robust: bool) -> str:
    """How the numbers were made."""
    weights = "robust least squares" if robust else "least squares"
    folds = int(fit.fold.max()) + 1
    return (
        f"steady state from logs, shape {fit.shape.name}, {weights} on the force vector; forces from "
        f"{FORCES[points.force_from]}; {SPEEDS[points.speed_from]}; std by jackknife over {folds} directions or runs"
    )


def data(points: ForcePoints, group: str) -> str:
    """What the numbers were made from."""
    runs = len(set(points.run.tolist()))
    name = "" if group == "all" else f"{group}: "
    return f"{name}{runs} runs, {len(points)} steady points, {int(points.rows.sum())} rows"


def statements(
    choice: ShapeChoice, viscous: Mapping[str, Sequence[ViscousLevel]], differences: Sequence[Difference],
    internal: Mapping[str, float], lack: Mapping[str, LackOfFit], within: Container[str], matters: float,
) -> tuple[str, ...]:  # fmt: skip
    """What the data say, one sentence each."""
    found = [_about_choice(choice), *_about_own(choice), *_about_ties(choice), *_about_comparison(choice)]
    found += [words for group, each in lack.items() for words in _about_fit_or_not(group, each, group in within)]
    for group, levels in viscous.items():
        found += [_about_viscous(group, level, choice.of(group), matters) for level in levels]
    found += [_about_difference(each) for each in differences]
    found += [
        f"{_of(group)}the wheels work against each other with {force:.3g} N (rms): that pushes nowhere"
        for group, force in internal.items()
    ]
    return tuple(found)


def _of(group: str) -> str:
    return "" if group == "all" else f"{group}: "


def _about_choice(choice: ShapeChoice) -> str:
    score = choice.score
    box = next((each for each in choice.scores if each.name == "box"), None)
    beside = f", {box.loo:.2f} +- {box.loo_std:.2f} N for a box on the axes" if box and box is not score else ""
    return (
        f"friction has the shape {score.name}, {score.words}: it predicts the force in a direction left out within "
        f"{score.loo:.2f} +- {score.loo_std:.2f} N{beside}"
    )


def _about_own(choice: ShapeChoice) -> list[str]:
    """Groups whose shape is not that of the others."""
    found = []
    for group, name in choice.own.items():
        scores = {score.name: score for score in choice.scored[group]}
        own, other = scores[name], scores[choice.chosen]
        beside = "" if name == choice.chosen else f", {other.loo:.2f} +- {other.loo_std:.2f} N for {other.name}"
        found.append(
            f"{group} has a shape of its own, {name}, {own.words}: within {own.loo:.2f} +- {own.loo_std:.2f} N{beside}"
        )
    return found


def _about_ties(choice: ShapeChoice) -> list[str]:
    """Shapes that the data cannot tell from the best."""
    ties = [score for score in choice.scores if not score.told_apart]
    if len(ties) < 2:
        return []
    rest = ", ".join(f"{tie.name} ({tie.behind:+.2f} +- {tie.behind_std:.2f} N)" for tie in ties[1:])
    return [f"the data cannot tell apart from {ties[0].name}, the best: {rest}"]


def _about_comparison(choice: ShapeChoice) -> list[str]:
    """The best shape, where it is not the chosen one and the data do tell the two apart."""
    best = choice.scores[0]
    if best.name == choice.chosen or not choice.score.told_apart:
        return []
    why = (
        "no robot file can hold it" if not best.in_model
        else "a level of it came out below 0" if best.at_bound else "another was asked for"
    )  # fmt: skip
    return [
        f"{best.name} does better still, by {choice.score.behind:.2f} +- {choice.score.behind_std:.2f} N, but {why}"
    ]


def _about_fit_or_not(group: str, lack: LackOfFit, changes: bool) -> list[str]:
    """What was tested, where no lack was found: that is a result too. A lack is a warning. changes: whether the force
    changes within a run."""
    if lack.found:
        return []
    if not lack.tested:
        return [f"{_of(group)}whether the shape fits was not tested: too few directions in which all of it moves"]
    beside = BESIDE if changes else ""
    return [f"{_of(group)}no lack of fit is seen{beside}: nothing that was tried beside the shape does better"]


def about_lack_of_fit(
    lack: Mapping[str, LackOfFit], choice: ShapeChoice, within: Container[str] = ()
) -> tuple[str, ...]:
    """That no offered shape fits, and what would. within: groups in which the force changes within a run."""
    found = []
    for group, each in lack.items():
        if not each.found:
            continue
        head = f"{_of(group)}no offered shape fits{BESIDE if group in within else ''}: "
        if each.remedies:
            best = each.remedies[0]
            as_well = f"; as well do: {', '.join(best.same_as)}" if best.same_as else ""
            told = (
                f"with {best.words} beside {choice.of(group)} the force in a direction left out is told within "
                f"{best.error:.2g} N, without within {best.error_before:.2g} N{as_well}"
            )
        else:
            told = f"errors repeat when a direction is driven again, {100.0 * each.share:.0f} % of their square"
        found.append(f"{head}{told}; no robot file holds that, and the intervals of the levels do not count it")
    return tuple(found)


def lack_advice(lack: Mapping[str, LackOfFit]) -> tuple[str, ...]:
    """What to do where no shape fits."""
    if not any(each.found for each in lack.values()):
        return ()
    keys = {remedy.key for each in lack.values() for remedy in each.remedies}
    if keys & {"forward and backward", "left and right", "pull"}:
        return ("drive the same again with the robot turned half around: a floor that is not level changes its side, "
                "friction and sensors do not",)  # fmt: skip
    return ("look for what the shapes do not know: azimuths of the wheels in the robot file, rollers that stick, slip",)


def _about_viscous(group: str, level: ViscousLevel, chosen: str, matters: float) -> str:
    key = Key.parse(level.key)
    name, measure = key.symbol, key.unit
    interval = f"{name} = {level.value:.3g} +- {level.std:.2g} {measure}, 95 % [{level.low:.3g}, {level.high:.3g}]"
    turning = key.axis == YAW
    speeds, force = (
        f"from {level.slow:.3g} to {level.fast:.3g} {'rad/s' if turning else 'm/s'}",
        "N m" if turning else "N",
    )
    if level.guesses:
        total = f"{level.value + level.back_emf:.3g} +- {level.sum_std:.2g} {measure}"
        return (
            f"{_of(group)}viscous friction cannot be told from back-EMF, for {' and '.join(level.guesses)} "
            f"{'is a guess' if len(level.guesses) == 1 else 'are guesses'}: together they are {name} + "
            f"{level.back_emf:.3g} = {total}; with the guess {interval}"
        )
    if not level.seen:
        share = f"{100.0 * level.effect / level.level:.1f} %" if level.level > 0.0 else "a part"
        bound = f"{name} may be up to {max(level.high, 0.0):.3g} {measure}"
        size = "no more than" if level.effect <= matters * level.level else "up to"
        return (
            f"{_of(group)}viscous friction is not identifiable here: {interval} contains 0; {speeds} it changes the "
            f"force by {size} {level.effect:.2g} {force} ({share} of {level.level:.3g} {force}); it is left at 0, "
            f"{bound}"
        )
    if level.value < 0.0:
        return f"{_of(group)}the force falls with speed: {interval}, {speeds}; a viscous level cannot say that"
    used = "it is in the shape" if "viscous" in chosen else "the shape predicts no better with it, so it is left at 0"
    return f"{_of(group)}viscous friction is seen: {interval}, {speeds}; {used}"


def _about_difference(each: Difference) -> str:
    key = Key.parse(each.key)
    name, measure = key.symbol, key.unit
    pair = f"{each.first} {each.values[0]:.4g}, {each.second} {each.values[1]:.4g} {measure}"
    span = f"{each.difference:+.3g} [{each.low:.3g}, {each.high:.3g}] {measure}"
    verdict = "differs" if each.differs else "no difference seen"
    return f"{name}: {pair}: {verdict}, {span} (95 %)"


def about_points(points: ForcePoints, choice: ShapeChoice, turning: bool) -> tuple[str, ...]:
    """What is weak about the points or the comparison."""
    found = []
    along = points.along[np.isfinite(points.along)]
    wrong = int((along < 0.0).sum())
    if wrong > WRONG_WAY * max(len(along), 1):
        found.append(
            f"in {wrong} of {len(along)} points the force points against the motion, as if friction drove the robot: "
            f"{LOST[points.force_from]}, or a wheel is swapped"
        )
    if points.force_from == "voltage":
        found.append("forces are from eq (11): as right as the R, K_t and K_v of the robot file")
    if not turning:
        found.append("the robot hardly turned: friction about yaw is not in these data")
    reasons: dict[str, list[str]] = {}
    for name, why in choice.missing.items():
        reasons.setdefault(why, []).append(name)
    found += [f"not compared, {why}: {', '.join(names)}" for why, names in reasons.items()]
    return tuple(found)


def about_fit(fit: ShapeFit, robust: bool, kept: Mapping[str, float]) -> tuple[str, ...]:
    """What is weak about the levels of one group."""
    found = []
    for key, free in zip(fit.keys, fit.free, strict=True):
        if free < 0.0:
            found.append(f"{key} is at bound: the best fit has {free:.4g} {unit(key)}, friction cannot be negative")
    low = int((fit.weight < LOW_WEIGHT).sum())
    if robust and low:
        found.append(f"{low} of {len(fit.weight)} points lie far from the shape and count less than half")
    found += [f"{key} stays at {level:.4g} {unit(key)}, as in the robot file" for key, level in kept.items()]
    return tuple(found)


def about_back_emf(keys: Sequence[str], guesses: Sequence[str]) -> tuple[str, ...]:
    """What a viscous level is worth where the back-EMF beside it is a guess."""
    found = [key for key in keys if Key.parse(key).level == VISCOUS]
    if not found or not guesses:
        return ()
    return (
        f"{', '.join(found)}: right together with the back-EMF of this file only, for {', '.join(guesses)} "
        f"{'is a guess' if len(guesses) == 1 else 'are guesses'}; log currents, or measure the no-load speed",
    )


def advice(
    choice: ShapeChoice, viscous: Mapping[str, Sequence[ViscousLevel]], turning: bool, force_from: str
) -> tuple[str, ...]:
    """What to measure next."""
    found = []
    if not turning:
        found.append("turn on the spot, both ways, at two speeds or more: that gives the friction about yaw")
    if not any(viscous.values()):
        found.append("drive at speeds a factor of three apart: that shows, or bounds, viscous friction")
    elif not all(level.seen for levels in viscous.values() for level in levels):
        found.append("drive much faster than now: the viscous part grows with speed, the rest does not")
    tie = next((s for s in choice.scores[1:] if not s.told_apart and s.apart > 0.0), None)
    if tie is not None:
        found.append(_more_directions(choice.scores[0], tie))
    if force_from == CURRENT:
        found.append("pull the robot with a spring scale once: all forces here are as right as the torque constant")
    return tuple(found)


def _more_directions(best: ShapeScore, tie: ShapeScore) -> str:
    factor = (APART / tie.apart) ** 2
    amount = f"about {np.ceil(factor):.0f} times as many runs" if factor < 50.0 else "far more runs than is practical"
    return f"to tell {tie.name} from {best.name}: {amount}, in other directions"
