"""A steady-state study: what was found, its tables and words, and its values for machines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from omnidyn.document import Document, Points, Table, all_of, interval_cell, plain
from omnidyn.identification.estimate import Estimate
from omnidyn.identification.steady.choice import ShapeChoice
from omnidyn.identification.steady.lack_of_fit import LackOfFit
from omnidyn.identification.steady.moment import Moment
from omnidyn.identification.steady.operating_points import FORCES, SPEEDS, ForcePoints
from omnidyn.identification.steady.study_parts import Difference, Travel, Viscous
from omnidyn.model.keys import Key
from omnidyn.model.robot import Robot
from omnidyn.shown import FIGURE, Shown, make
from omnidyn.statement import Statement, by_severity

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class SteadyStudy(Shown):
    """All that steady windows say about friction.

    points: what was used. choice: shapes compared. estimates: group -> Estimate, whose robot holds that group's
    friction. travel: group -> force along travel. viscous: group -> what is known of the viscous levels. differences
    between groups. internal: group -> rms of the forces with which the wheels work against each other [N], where there
    are more than three. lack_of_fit: group -> whether any offered shape fits, and what would. moments: changes
    inside a run. statements: what the data say; warnings: what is weak; advice: what to measure next.
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

    @property
    def estimate(self) -> Estimate:
        """The estimate of the first group; the only one where there are no groups."""
        return next(iter(self.estimates.values()))

    def __repr__(self) -> str:
        return f"<SteadyStudy {self.robot.name}, {self.choice.chosen}: {all_of(list(self.estimates))}>"

    def document(self) -> Document:
        """What was used, the shapes, the levels, what it says and what it warns of."""
        return _document(self)

    def plot(self) -> Figure:
        """The force of friction over the direction of travel. Needs matplotlib."""
        return make(FIGURE, self)


def _lack(lack: LackOfFit | None) -> dict[str, Any] | None:
    """As every method tells it, each remedy with its forces beside."""
    if lack is None:
        return None
    told = lack.as_of_whole_logs().to_dict()
    own = [
        {"size_N": each.size, "error_N": each.error, "error_before_N": each.error_before, "chance": each.probability}
        for each in lack.remedies
    ]  # fmt: skip
    remedies = [one | more for one, more in zip(told["remedies"], own, strict=True)]
    return told | {"remedies": remedies, "tested": list(lack.tested)}


def _document(study: SteadyStudy) -> Document:
    """The study: what was used, the shapes, the levels, what it says and what it warns of."""
    points = study.points
    of_fits = [
        warning if group == "all" else warning.of(group)
        for group, estimate in study.estimates.items() for warning in estimate.warnings
    ]  # fmt: skip
    parts = [
        f"{study.robot.name}: steady state from logs; forces from {FORCES[points.force_from]}; friction over the "
        f"{SPEEDS[points.speed_from]}",
        "", _travel_table(study), "", _shape_table(study), "", _level_table(study), *_alone_tables(study), "",
        Points(study.statements, name="statements"),
        by_severity(study.warnings, "warnings"),
        Points(study.advice, "next:", "next"),
        by_severity(of_fits, "warnings of fits"),
    ]  # fmt: skip
    return Document(parts, _data(study), study.warnings)


def _travel_table(study: SteadyStudy) -> Table:
    """What was used, and the force along travel, a row per group."""
    rows = [
        (
            group, f"{each.runs}", f"{each.points}", f"{each.rows}", f"{each.slow:.3g} .. {each.fast:.3g}",
            f"{each.mean:.2f}", f"{each.std:.2f}", f"{each.deviation:.2f}",
        )
        for group, each in study.travel.items()
    ]  # fmt: skip
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
        behind, error = ("", "") if best else (f"{score.behind:.2f}", f"{score.behind_std:.2f}")
        rows.append((
            score.name, f"{score.levels}", f"{score.loo:.2f}", f"{score.loo_std:.2f}", f"{score.along:.2f}", behind,
            error, ", ".join(marks),
        ))  # fmt: skip
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


def _alone_tables(study: SteadyStudy) -> list[Table]:
    """What the intervals of each group owe to what the robot file knows with a std, where that is worth a word."""
    return [table for each in study.estimates.values() if (table := each.alone_table())]


def _data(study: SteadyStudy) -> dict[str, Any]:
    """The study as JSON can hold it."""
    return {
        "force_from": study.points.force_from,
        "speed_from": study.points.speed_from,
        "shape": study.choice.chosen,
        "shapes": [asdict(score) for score in study.choice.scores],
        "not_compared": dict(study.choice.missing),
        "groups": {
            group: {
                **study.estimates[group].to_dict(),
                "shape": study.choice.of(group),
                "along_travel": asdict(study.travel[group]),
                "viscous": [asdict(each) for each in study.viscous[group]],
                "lack_of_fit": _lack(study.lack_of_fit.get(group)),
                "rests_on": study.estimates[group].rests_on,
                "internal_force_N": study.internal.get(group),
            }
            for group in study.estimates
        },
        "lack_of_fit": _lack(next(iter(study.lack_of_fit.values()), None)),
        "moments": [asdict(each) for each in study.moments],
        "differences": [{**asdict(each), "differs": each.differs} for each in study.differences],
        "statements": plain(study.statements),
        "warnings": plain(study.warnings),
        "advice": plain(study.advice),
    }
