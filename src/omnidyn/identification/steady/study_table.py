"""A steady-state study: what was found, its tables and words, and its values for machines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from omnidyn.document import Document, Points, Table, all_of, interval_cell, plain
from omnidyn.identification.estimate import Estimate
from omnidyn.identification.lack_of_fit import LackOfFit
from omnidyn.identification.steady.choice import ShapeChoice
from omnidyn.identification.steady.lack_of_fit import TILTED_FLOOR
from omnidyn.identification.steady.moment import Moment
from omnidyn.identification.steady.operating_points import FORCES, SPEEDS, ForcePoints
from omnidyn.model.keys import Key
from omnidyn.model.robot import Robot
from omnidyn.shown import FIGURE, Displayable, make
from omnidyn.statement import Statement, by_severity

if TYPE_CHECKING:
    from matplotlib.figure import Figure
from collections.abc import Collection, Sequence

import numpy as np

from omnidyn.identification.steady.operating_points import CURRENT, VOLTAGE
from omnidyn.identification.steady.shapes import ShapeFit
from omnidyn.model.keys import VISCOUS
from omnidyn.statement import NOTE


@dataclass(frozen=True, eq=False, repr=False)
class SteadyStudy(Displayable):
    """All that steady windows say about friction.

    points: what was used. choice: shapes compared. estimates: group -> Estimate, whose robot holds that group's
    friction. travel: group -> force along travel. viscous: group -> what is known of the viscous levels. differences
    between groups. internal: group -> rms of the forces with which the wheels work against each other [N], where there
    are more than three. lack_of_fit: group -> whether any offered shape fits, and what would. moments: changes
    inside a run; untested: runs that could not be tested for one. statements: what the data say; warnings: what is
    weak; advice: what to measure next.
    """

    robot: Robot
    points: ForcePoints
    choice: ShapeChoice
    estimates: Mapping[str, Estimate]
    travel: Mapping[str, Travel]
    viscous: Mapping[str, tuple[Viscous, ...]]
    differences: tuple[Difference, ...]
    internal: Mapping[str, float]
    lack_of_fit: Mapping[str, LackOfFit]
    statements: tuple[Statement, ...]
    warnings: tuple[Statement, ...]
    advice: tuple[Statement, ...]
    moments: tuple[Moment, ...] = ()
    untested: tuple[str, ...] = ()

    @property
    def estimate(self) -> Estimate:
        """The estimate of the first group; the only one where there are no groups."""
        return next(iter(self.estimates.values()))

    def __repr__(self) -> str:
        return f"<SteadyStudy {self.robot.name}, {self.choice.chosen}: {all_of(list(self.estimates))}>"

    def document(self) -> Document:
        """What was used, the shapes, the levels, what it says and what it warns of."""
        fits = [_of(group, warning) for group, fit in self.estimates.items() for warning in fit.warnings]
        parts = [
            f"{self.robot.name}: steady state from logs; forces from {FORCES[self.points.force_from]}; friction over "
            f"the {SPEEDS[self.points.speed_from]}",
            "",
            _travel_table(self),
            "",
            _shape_table(self),
            "",
            _level_table(self),
            *(table for fit in self.estimates.values() if (table := fit.alone_table())),
            "",
            Points(self.statements, name="statements"),
            by_severity(self.warnings, "warnings"),
            Points(self.advice, "next:", "next"),
            by_severity(fits, "warnings of fits"),
        ]
        return Document(parts, self.to_dict(), self.warnings)

    def to_dict(self) -> dict[str, Any]:
        """The study as JSON can hold it."""
        return {
            "force_from": self.points.force_from,
            "speed_from": self.points.speed_from,
            "shape": self.choice.chosen,
            "shapes": [asdict(score) for score in self.choice.scores],
            "not_compared": dict(self.choice.missing),
            "groups": {
                group: {
                    **fit.to_dict(),
                    "shape": self.choice.of(group),
                    "along_travel": asdict(self.travel[group]),
                    "viscous": [asdict(level) for level in self.viscous[group]],
                    "lack_of_fit": _lack(self.lack_of_fit.get(group)),
                    "rests_on": fit.rests_on,
                    "internal_force_N": self.internal.get(group),
                }
                for group, fit in self.estimates.items()
            },
            "lack_of_fit": _lack(next(iter(self.lack_of_fit.values()), None)),
            "moments": [asdict(moment) for moment in self.moments],
            "not_tested_for_moments": list(self.untested),
            "differences": [{**asdict(pair), "differs": pair.differs} for pair in self.differences],
            "statements": plain(self.statements),
            "warnings": plain(self.warnings),
            "advice": plain(self.advice),
        }

    def plot(self) -> Figure:
        """The force of friction over the direction of travel. Needs matplotlib."""
        return make(FIGURE, self)


def _lack(lack: LackOfFit | None) -> dict[str, Any] | None:
    """As every method tells it, each remedy with its forces beside."""
    if lack is None:
        return None
    forces = [
        {"size_N": force.size, "error_N": force.after, "error_before_N": force.before, "chance": force.p}
        for remedy in lack.remedies
        if (force := remedy.force)
    ]
    record = lack.to_dict()
    remedies = [remedy | force for remedy, force in zip(record["remedies"], forces, strict=True)]
    return record | {"remedies": remedies, "tested": list(lack.tried)}


def _travel_table(study: SteadyStudy) -> Table:
    """What was used, and the force along travel, a row per group."""
    rows = [
        (
            group,
            f"{travel.runs}",
            f"{travel.points}",
            f"{travel.rows}",
            f"{travel.slow:.3g} .. {travel.fast:.3g}",
            f"{travel.mean:.2f}",
            f"{travel.std:.2f}",
            f"{travel.deviation:.2f}",
        )
        for group, travel in study.travel.items()
    ]
    head = ("group", "runs", "points", "rows", "speed m/s", "along travel N", "+-", "scatter N")
    return Table(head, rows, name="travel")


def _shape_table(study: SteadyStudy) -> Table:
    """The shapes compared, best first."""
    rows = []
    for score in study.choice.scores:
        marks = ["chosen"] if score.name == study.choice.chosen else []
        marks += [f"chosen in {group}" for group, name in study.choice.own.items() if name == score.name]
        marks += [] if score.told_apart or score.behind == 0.0 else ["not told apart"]
        marks += [] if score.in_model else ["not in a robot file"]
        marks += ["a level below 0"] if score.at_bound else []
        best = score.behind == 0.0 and score.behind_std == 0.0
        behind_text, error = ("", "") if best else (f"{score.behind:.2f}", f"{score.behind_std:.2f}")
        rows.append(
            (
                score.name,
                f"{score.levels}",
                f"{score.loo:.2f}",
                f"{score.loo_std:.2f}",
                f"{score.along:.2f}",
                behind_text,
                error,
                ", ".join(marks),
            )
        )
    head = ("shape", "levels", "left-out error N", "+-", "along N", "behind best N", "+-", "")
    return Table(head, rows, name="shapes")


def _level_table(study: SteadyStudy) -> Table:
    """The levels of the chosen shape, a row per group and level."""
    rows = []
    for group, estimate in study.estimates.items():
        for key, value in estimate.value.items():
            mark, interval = " at bound" if key in estimate.at_bound else "", interval_cell(estimate.ci95[key])
            name = Key.parse(key)
            std, measure = f"{estimate.std[key]:.2g}", name.unit + mark
            rows.append((group, name.symbol, f"{value:.4g}", std, interval, measure, name.words))
    return Table(
        ("group", "level", "value", "std error", "95 % interval", "unit", "in words"), rows, "<<>>><", name="levels"
    )


# Which statements a steady-state study makes, from its numbers

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
        _of(
            group,
            Statement("no_lack_of_fit", NOTE, numbers={"changes": group in changed_groups})
            if group_lack.tried
            else Statement("fit_not_tested", NOTE),
        )
        for group, group_lack in lack.items()
        if not group_lack.found
    ]
    statements += [
        _of(group, _viscous(level, choice.of(group))) for group, levels in viscous.items() for level in levels
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
        _of(group, Statement("internal_force", NOTE, numbers={"force": force})) for group, force in internal.items()
    ]
    return statements


def _of(group: str, statement: Statement) -> Statement:
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
        statements += [_of(group, Statement("no_shape_fits", numbers=numbers))] if group_lack.found else []
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


# What a steady-state study says of one group, or of two: plain numbers with their uncertainty


@dataclass(frozen=True)
class Travel:
    """Force along travel of one group [N]: mean over the points, its standard error, their standard deviation.

    slow, fast: range of the speeds [m/s]. points, runs, rows: what it was made from.
    """

    mean: float
    std: float
    deviation: float
    slow: float
    fast: float
    points: int
    runs: int
    rows: int


@dataclass(frozen=True)
class Viscous:
    """What the data say about a viscous level of one group: its key, value, standard error and 95 % interval.

    seen: the interval does not contain 0. effect [N]: the most that a viscous force inside the interval changes
    between the slowest and the fastest point. level [N]: the force along travel, to compare. slow, fast [m/s]: range of
    the speeds. About yaw [N m] and [rad/s].
    back_emf: the part of the slope of the drive that the robot file says is back-EMF, where forces are from voltages; 0
    from currents. guesses: motor constants that are guesses; where there are any, only the sum of `value` and
    `back_emf` is known, with standard error `sum_std`: `std` and the interval count the std of the guess.
    """

    key: str
    value: float
    std: float
    low: float
    high: float
    seen: bool
    effect: float
    level: float
    slow: float
    fast: float
    back_emf: float = 0.0
    guesses: tuple[str, ...] = ()
    sum_std: float = 0.0


@dataclass(frozen=True)
class Difference:
    """A level in two groups: second minus first, with standard error and 95 % interval. differs: 0 lies outside."""

    key: str
    first: str
    second: str
    values: tuple[float, float]
    difference: float
    std: float
    low: float
    high: float

    @property
    def differs(self) -> bool:
        """Whether the interval leaves 0 out."""
        return not self.low <= 0.0 <= self.high
