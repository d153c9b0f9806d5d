"""What a comparison says in tables and words: one row per component."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from omnidyn.comparison.difference import ModelDifference
from omnidyn.comparison.metrics import Metrics
from omnidyn.comparison.traces import unit
from omnidyn.document import Table, cell, chance_cell

HEAD = ("", "unit", "samples", "rmse", "max", "bias", "fit %", "VAF %", "white p", "lag s")
WIDTHS = (8, 6, 7, 9, 9, 9, 7, 7, 7, 6)  # the same for all tables, so that they can be read below each other


def metrics_table(names: Sequence[str], found: Mapping[str, Metrics | None], head: Sequence[str] = HEAD) -> Table:
    """How near a model comes, a row per component."""
    return Table(head, [_row(name, found[name]) for name in names], "<<>", WIDTHS)


def _row(name: str, each: Metrics | None) -> tuple[str, ...]:
    if each is None:
        return name, unit(name), "0"
    return (
        name, unit(name), f"{each.samples}", f"{each.rmse:.4g}", f"{each.max:.4g}", f"{each.bias:+.3g}",
        cell(each.fit_percent, ".1f"), cell(each.vaf, ".1f"), chance_cell(each.whiteness), cell(each.lag, "+.3f"),
    )  # fmt: skip


def band_table(half_widths: Mapping[str, float], found: Mapping[str, Metrics]) -> Table:
    """How wide the band of a model is, a row per component, beside how far the model is off."""
    rows = [(name, unit(name), f"{half:.4g}", f"{found[name].rmse:.4g}") for name, half in half_widths.items()]
    return Table(("", "unit", "half width", "rmse"), rows, "<<>", (8, 6, 10, 9))


def difference_table(robots: Sequence[str], found: Mapping[str, ModelDifference]) -> Table:
    """Which of two robots is better, a row per component."""
    rows = []
    for name, each in found.items():
        told = "the same" if each.std_error == 0.0 else "cannot tell"
        told = told if each.better is None else robots[each.better]
        rows.append((name, f"{each.rmse_difference:+.4g}", cell(each.std_error, ".2g"), f"{each.blocks}", told))
    return Table(("", "difference", "std error", "blocks", "better"), rows, "<>>><", (8, 12, 9, 6))


def legend(shown: Sequence[Metrics]) -> Iterator[str]:
    """What the columns mean, where it is not plain."""
    yield "error = model - measured."
    if any(each.lag for each in shown):
        yield "lag: the robot is later than the model by so much, where that explains clearly more; a hint."
    if any(each.fit_percent is None for each in shown):
        yield "no fit and no VAF where the measured signal never changes."
