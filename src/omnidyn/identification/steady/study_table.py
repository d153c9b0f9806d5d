"""A steady-state study: what was found, its tables and words, and its values for machines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from omnidyn.document import Document, Points, Table, all_of, interval_cell, plain
from omnidyn.identification.estimate import Estimate
from omnidyn.identification.lack_of_fit import LackOfFit
from omnidyn.identification.steady.choice import ShapeChoice
from omnidyn.identification.steady.moment import Moment
from omnidyn.identification.steady.operating_points import FORCES, SPEEDS, ForcePoints
from omnidyn.model.keys import Key
from omnidyn.model.robot import Robot
from omnidyn.shown import FIGURE, Displayable, make
from omnidyn.statement import Statement, by_severity

if TYPE_CHECKING:
    from matplotlib.figure import Figure


from omnidyn.identification.steady.group_numbers import Difference, Travel, Viscous
from omnidyn.identification.steady.study_statements import of_group


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
        fits = [of_group(group, warning) for group, fit in self.estimates.items() for warning in fit.warnings]
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
