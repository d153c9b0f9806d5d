"""Tables of a comparison as plain text: one line per component."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from omnidyn.comparison.difference import Difference
from omnidyn.comparison.metrics import Metrics
from omnidyn.comparison.traces import unit

TINY_P = 0.001
HEAD = (
    f"{'':9} {'unit':6} {'samples':>8} {'rmse':>10} {'max':>10} {'bias':>10} {'fit %':>8} {'VAF %':>8} {'white p':>8} "
    f"{'lag s':>7}"
)


def rows(names: Sequence[str], found: Mapping[str, Metrics | None]) -> Iterator[str]:
    """One line per component."""
    for name in names:
        each = found[name]
        if each is None:
            yield f"{name:9} {unit(name):6} {0:8}"
        else:
            yield (
                f"{name:9} {unit(name):6} {each.samples:8} {each.rmse:10.4g} {each.max:10.4g} {each.bias:+10.3g} "
                f"{_cell(each.fit_percent, '.1f'):>8} {_cell(each.vaf, '.1f'):>8} {_p(each.whiteness):>8} "
                f"{_cell(each.lag, '+.3f'):>7}"
            )


def differences(robots: Sequence[str], found: Mapping[str, Difference]) -> Iterator[str]:
    """Which of two robots is better, one line per component."""
    yield f"rmse of {robots[0]} minus rmse of {robots[1]}, with its standard error (block bootstrap)"
    yield ""
    yield f"{'':9} {'difference':>12} {'std error':>10} {'blocks':>7}  better"
    for name, each in found.items():
        error = "-" if each.std_error is None else f"{each.std_error:.2g}"
        told = "the same" if each.std_error == 0.0 else "cannot tell"
        told = told if each.better is None else robots[each.better]
        yield f"{name:9} {each.rmse_difference:+12.4g} {error:>10} {each.blocks:7}  {told}"


def legend(shown: Sequence[Metrics]) -> Iterator[str]:
    """What the columns mean, where it is not plain."""
    yield "error = model - measured. white p < 0.05: the errors have a memory, the model misses something."
    if any(each.lag for each in shown):
        yield "lag: the robot is later than the model by so much, where that explains clearly more; a hint."
    if any(each.fit_percent is None for each in shown):
        yield "no fit and no VAF where the measured signal never changes."


def _cell(value: float | None, form: str) -> str:
    return "-" if value is None else f"{value:{form}}"


def _p(value: float | None) -> str:
    if value is None:
        return "-"
    return f"<{TINY_P:g}" if value < TINY_P else f"{value:.3f}"
