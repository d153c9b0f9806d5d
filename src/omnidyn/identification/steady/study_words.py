"""What a steady-state study says in words: plain, with numbers, and with what to do next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from omnidyn.identification.steady.choice import APART, ShapeChoice, ShapeScore
from omnidyn.identification.steady.operating_points import CURRENT, SPEEDS, ForcePoints
from omnidyn.identification.steady.shape_fit import ShapeFit
from omnidyn.identification.steady.study_parts import Difference, Viscous
from omnidyn.model.keys import Key, unit

FORCES = {"current": "motor currents, eqs (7)-(10)", "voltage": "voltage and speed, eq (11)"}
LOW_WEIGHT = 0.5
WRONG_WAY = 0.05  # share of points whose force points against the motion from which a sign is doubted


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
    choice: ShapeChoice, viscous: Mapping[str, Sequence[Viscous]], differences: Sequence[Difference],
    internal: Mapping[str, float], matters: float,
) -> tuple[str, ...]:  # fmt: skip
    """What the data say, one sentence each."""
    found = [_about_choice(choice), *_about_ties(choice), *_about_comparison(choice)]
    for group, levels in viscous.items():
        found += [_about_viscous(group, level, choice.chosen, matters) for level in levels]
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
    why = "no robot file can hold it" if not best.in_model else "a level of it came out below 0"
    return [
        f"{best.name} does better still, by {choice.score.behind:.2f} +- {choice.score.behind_std:.2f} N, but {why}"
    ]


def _about_viscous(group: str, level: Viscous, chosen: str, matters: float) -> str:
    key = Key.parse(level.key)
    name, measure = key.symbol, key.unit
    interval = f"{name} = {level.value:.3g} +- {level.std:.2g} {measure}, 95 % [{level.low:.3g}, {level.high:.3g}]"
    speeds = f"from {level.slow:.3g} to {level.fast:.3g} m/s"
    if not level.seen:
        share = f"{100.0 * level.effect / level.level:.1f} %" if level.level > 0.0 else "a part"
        bound = f"{name} may be up to {max(level.high, 0.0):.3g} {measure}"
        size = "no more than" if level.effect <= matters * level.level else "up to"
        return (
            f"{_of(group)}viscous friction is not identifiable here: {interval} contains 0; {speeds} it changes the "
            f"force by {size} {level.effect:.2g} N ({share} of {level.level:.3g} N); it is left at 0, {bound}"
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


def doubts(points: ForcePoints, choice: ShapeChoice, turning: bool) -> tuple[str, ...]:
    """What is weak about the points or the comparison."""
    found = []
    along = points.along[np.isfinite(points.along)]
    wrong = int((along < 0.0).sum())
    if wrong > WRONG_WAY * max(len(along), 1):
        found.append(
            f"in {wrong} of {len(along)} points the force points against the motion, as if friction drove the robot: "
            "the sign of the currents is lost (--current-unsigned), or a wheel is swapped"
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


def advice(
    choice: ShapeChoice, viscous: Mapping[str, Sequence[Viscous]], turning: bool, force_from: str
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
