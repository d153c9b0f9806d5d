"""What the paper's lines through steady points say: B and C of each axis, and the points themselves."""

from __future__ import annotations

from omnidyn.identification.steady.operating_points import FORCES
from omnidyn.model.keys import unit
from omnidyn.statement import Statement
from omnidyn.telling.sentence import Sentence, either

ORIGIN = {"table": "the table", **FORCES}
AT_REST = {"bound": "bound breakaway", "line": "count as sliding", "ignore": "are not used"}


def _line_method(statement: Statement) -> str:
    """How lines were fitted: weights, origin of the forces, use of rows at rest."""
    numbers = statement.numbers
    weights = "weighted least squares" if numbers["weighted"] else "least squares"
    weights += ", std taken as exact" if numbers["absolute_std"] else ""
    forces = ORIGIN[numbers["force_from"]]
    return f"steady state, eqs (15)-(17), {weights}; forces from {forces}; rows at rest {AT_REST[numbers['rest']]}"


def _coefficient_at_bound(statement: Statement) -> str:
    """A B or C would be negative and is 0."""
    numbers = statement.numbers
    return (
        f"{statement.subject} is at bound: the best line has {numbers['free']:.3g} {unit(statement.subject)}, friction "
        f"is not negative, 0 is taken; it may be up to {numbers['high']:.3g}"
    )


def _interval_contains_zero(statement: Statement) -> str:
    """The interval of a B or C contains 0."""
    low, high = statement.numbers["ci95"]
    key = statement.subject
    return f"{key}: the 95 % interval [{low:.3g}, {high:.3g}] {unit(key)} contains zero: the data do not show it"


def _beyond_no_load(statement: Statement) -> str:
    """The wheels outrun the voltage: at the no-load speed the back-EMF has used all of it."""
    numbers = statement.numbers
    by = " ({:.0f} to {:.0f} % faster)".format(*numbers["excess"]) if numbers["excess"] else ""
    return (
        f"axis {statement.subject}: {numbers['beyond']} of {numbers['moving']} moving rows are faster than the no-load "
        f"speed{by}: the back-EMF is above the voltage, so no motor drives; the speed, the voltage, the EMF constant, "
        "the gear ratio or a radius is wrong"
    )


def _forces_disagree(statement: Statement) -> str:
    """The same force from two measurements, where they disagree."""
    numbers, measure = statement.numbers, "N m" if statement.subject == "yaw" else "N"
    first, second = (ORIGIN[name] for name in numbers["origins"])
    return (
        f"axis {statement.subject}: the force from {second} is {numbers['ratio']:.3g} times the force from {first} "
        f"({numbers['rows']} rows, rms difference {numbers['difference']:.3g} {measure}): check R, K_t, the gear and "
        "the units"
    )


def _breakaway_from_rest(statement: Statement) -> str:
    """A row at rest held more than Coulomb friction: breakaway is at least that."""
    key, numbers = statement.subject, statement.numbers
    return (
        f"{key} set to {numbers['bound']:.3g} {unit(key)}: the robot stayed at rest under that force, more than the "
        f"coulomb friction {numbers['coulomb']:.3g}; it is a lower bound, not an estimate"
    )


def _holds_at_least(statement: Statement) -> str:
    """What an axis held at rest."""
    bound, key = statement.numbers["bound"], statement.numbers["key"]
    return f"axis {statement.subject} holds at least {bound:.3g} {unit(key)}"


SENTENCES = {
    "line_method": Sentence(_line_method),
    "few_degrees": Sentence(
        "axis {subject}: {degrees} {degrees:degree|degrees} of freedom ({rows} rows, 2 parameters): the 95 % "
        "interval reaches {quantile:.3g} standard errors to each side, 1.96 with many rows"
    ),
    "coefficient_at_bound": Sentence(_coefficient_at_bound),
    "interval_contains_zero": Sentence(_interval_contains_zero),
    "speed_std_not_settled": Sentence(
        "axis {subject}: the iteration for speed_std did not settle; the numbers are of its last step"
    ),
    "scatter_contradicts_std": Sentence(
        either(
            "absolute_std",
            "axis {subject}: the points scatter {times:~.2g} times as much as their std says; the intervals follow "
            "the std given",
            "axis {subject}: the points scatter {times:~.2g} times as much as their std says; the intervals follow "
            "the scatter itself",
        )
    ),
    "axis_against_motion": Sentence(
        "axis {subject}: in {wrong} {wrong:row|rows} of {rows} the force points against the motion, as if "
        "friction drove the robot: a sign is lost (an unsigned current sensor?) or a motor constant is wrong"
    ),
    "beyond_no_load": Sentence(_beyond_no_load),
    "forces_disagree": Sentence(_forces_disagree),
    "axis_without_data": Sentence("axis {subject}: no data, B and C stay as they were"),
    "axis_never_moved": Sentence("axis {subject}: the robot never moved, B and C stay as they were"),
    "axis_at_one_speed": Sentence(
        "axis {subject}: all rows have the same speed, {speed:.3g}: B and C are not distinguishable and stay as they "
        "were; only their sum is known there, B speed + C = {sum:.3g}"
    ),
    "axis_beyond_any_robot": Sentence("axis {subject}: the fit gives {level:.3g}, beyond any robot; B and C stay"),
    "rest_as_sliding": Sentence(
        "axis {subject}: {rows} {rows:row|rows} at rest used as a sliding point: there friction only balances the"
        " drive, anywhere up to breakaway, so B and C may be wrong by more than the intervals say"
    ),
    "rest_not_used": Sentence("axis {subject}: {rows} {rows:row|rows} at rest not used"),
    "breakaway_raised": Sentence("{subject} raised from {before:.3g} to the new coulomb friction"),
    "breakaway_kept": Sentence("{subject} stays at {level:.3g}: rows in motion do not show it"),
    "breakaway_from_rest": Sentence(_breakaway_from_rest),
    "holds_at_least": Sentence(_holds_at_least),
}
