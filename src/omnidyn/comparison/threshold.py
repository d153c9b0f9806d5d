"""Thresholds on a comparison, such as "vx.rmse>0.05": for a build that must fail when a model no longer fits."""

from __future__ import annotations

import operator
import re
from collections.abc import Sequence
from typing import NamedTuple

from omnidyn.comparison.metrics import METRICS
from omnidyn.comparison.result import Comparison
from omnidyn.errors import InputError, InsufficientDataError, ThresholdError, did_you_mean
from omnidyn.logs.channels import place

_OPERATORS = {">": operator.gt, ">=": operator.ge, "<": operator.lt, "<=": operator.le}
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?"
_FORM = re.compile(rf"\s*(\w{{1,40}})\.(\w{{1,40}})\s*([<>]=?)\s*({_NUMBER})\s*", re.ASCII)


class Threshold(NamedTuple):
    """Fails where `metric` of `component` stands in the relation `sign` to `number` (SI units, percent)."""

    component: str
    metric: str
    sign: str
    number: float

    def __str__(self) -> str:
        return f"{self.component}.{self.metric}{self.sign}{self.number:g}"


def parse_threshold(text: str) -> Threshold:
    """Read COMPONENT.METRIC OPERATOR NUMBER, such as "vx.rmse>0.05". Raises InputError, with the nearest name."""
    match = _FORM.fullmatch(text)
    if match is None:
        raise InputError(
            "cannot read this threshold",
            got=text,
            expected='such as "vx.rmse>0.05", with > >= < or <=',
            where="`fail_if`",
        )
    component, metric, sign, number = match.groups()
    if metric not in METRICS:
        raise _unknown("no such metric", metric, METRICS)
    if place(component) is None:
        raise _unknown("no such component", component, ["vx", "vy", "omega", "w1", "i1", "u1", "x", "y", "heading"])
    if not abs(float(number)) < 1e300:
        raise InputError("not a finite number", got=number, where="`fail_if`")
    return Threshold(component, metric, sign, float(number))


def refuse_absent(requests: Sequence[Threshold | str], compared: Sequence[str], where: str = "`fail_if`") -> None:
    """Raises InputError when a threshold, or a component asked for, is about what will not be compared."""
    for request in requests:
        name = request if isinstance(request, str) else request.component
        if name not in compared:
            raise _unknown("the logs cannot judge this component", name, compared, where)


def exceeded(comparison: Comparison, thresholds: Sequence[Threshold], robot: str | None = None) -> list[str]:
    """The thresholds that fail for a robot (by default the first), in words with the numbers.

    Raises InsufficientDataError where the metric is not known, such as the fit of a signal that never changes.
    """
    scores, words = comparison.overall[robot or comparison.robots[0]], []
    for threshold in thresholds:
        value = getattr(scores[threshold.component], threshold.metric) if threshold.component in scores else None
        if value is None:
            raise InsufficientDataError(
                f"the data do not tell {threshold.component}.{threshold.metric}",
                got=str(threshold),
                expected="a signal that changes, and enough samples",
                where="`fail_if`",
            )
        if _OPERATORS[threshold.sign](value, threshold.number):
            name = f"{threshold.component}.{threshold.metric}"
            words.append(f"{name} = {value:.6g} ({threshold.sign} {threshold.number:g})")
    return words


def refuse_exceeded(comparison: Comparison, thresholds: Sequence[Threshold]) -> None:
    """Raises ThresholdError when any threshold fails for the first robot, naming all that do."""
    words = exceeded(comparison, thresholds)
    if words:
        count = f"{len(words)} of {len(thresholds)} rules of `fail_if` hold"
        raise ThresholdError(f"{count} for {comparison.robots[0]}: {', '.join(words)}")


def _unknown(problem: str, name: str, names: Sequence[str], where: str = "`fail_if`") -> InputError:
    return InputError(problem, got=name, expected=", ".join(names), remedy=did_you_mean(name, names), where=where)
