"""Results: what the shards say together, opened lazily: one column is read at a time.

Variance shares are first-order indices of Sobol (1993), S = Var E[y|x] / Var y, from the samples as they are: sorted by
x they are cut into sqrt(n) groups, whose means vary. Of random draws, what scatters within groups moves the means too,
and is taken off as in a one-way analysis of variance; groups of a Sobol sequence or a grid are balanced in all other
variables. Intervals by a jackknife over blocks of neighbours, which of a Sobol sequence are balanced too.

Total-order indices stand in total_shares.py.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.campaigns.design import points, sample_count
from omnidyn.campaigns.fits import ENDS, VERDICT
from omnidyn.campaigns.folder import CHECKED, SAMPLE, Folder, Status
from omnidyn.campaigns.spec import GRID, SOBOL
from omnidyn.campaigns.tasks import LoadedSpec
from omnidyn.campaigns.total_shares import BLOCKS, total_shares
from omnidyn.document import Document, Part, Points, Table, plain
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.logs.readers.parquet import import_pyarrow
from omnidyn.shown import DATASET, FIGURE, FRAME, Displayable, make
from omnidyn.statement import NOTE, WARNING, Statement, as_verdict, quoted
from omnidyn.statistics import t_quantile

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FEWEST = 40  # samples from which on shares are told
QUANTILES = (0.025, 0.5, 0.975)
SUMMARY = ("mean", "low", "median", "high", "largest", "none")
BEST_METRICS = ("worst_position_m", "drift_m")  # what a limit is about, where none is named


class Share(NamedTuple):
    """Share of the variance of a metric that one variable makes by itself, with the ends of its 95 % interval.

    total: the share in which it has a part, alone or together with others, with the ends of its interval.
    """

    variable: str
    share: float
    low: float
    high: float
    total: float
    total_low: float
    total_high: float


class Tolerance(NamedTuple):
    """How far variables may be off together: share of their ranges, variable -> (low, high), samples in there."""

    share: float
    ends: dict[str, tuple[float, float]]
    inside: int


@dataclass(frozen=True, eq=False, repr=False)
class Campaign(Displayable):
    """A campaign in its folder, complete or not."""

    folder: Folder

    def __repr__(self) -> str:
        status = self.status
        return f"<Campaign {self.folder.path}: {len(status.done)} of {status.shards} shards>"

    @cached_property
    def status(self) -> Status:
        """What was there when it was first asked for."""
        return self.folder.status()

    @property
    def variables(self) -> tuple[str, ...]:
        """What varies."""
        return tuple(self.folder.spec.vary)

    @cached_property
    def metrics(self) -> tuple[str, ...]:
        """Numbers that were measured. None where no shard is there."""
        return tuple(name for name, is_number in self._measured.items() if is_number)

    @cached_property
    def _measured(self) -> dict[str, bool]:
        """Column that was measured -> whether it holds numbers."""
        schema = self.dataset().schema if self.status.done else ()
        pyarrow, _ = import_pyarrow(str(self.folder.path))
        ours = (SAMPLE, *self.variables)
        return {field.name: pyarrow.types.is_floating(field.type) for field in schema if field.name not in ours}

    def dataset(self) -> Any:
        """All shards as a pyarrow Dataset, which reads nothing yet."""
        import_pyarrow(str(self.folder.path))
        from pyarrow.dataset import ParquetFileFormat, ParquetFragmentScanOptions, dataset

        done = self.status.done
        checked = ParquetFileFormat(default_fragment_scan_options=ParquetFragmentScanOptions(**CHECKED))
        schema = self.folder.schema(done) if done and self.folder.spec.identify is not None else None
        return dataset([str(self.folder.shard_path(shard)) for shard in done], schema, format=checked)

    def column(self, name: str) -> Any:
        """One column of all samples that are there, in their order. Raises InputError for a name that none has."""
        if not self.status.done:
            raise InsufficientDataError("no shard is there yet", where=str(self.folder.path))
        if name not in self.dataset().schema.names:
            raise InputError("no such column", got=name, expected=", ".join((*self.metrics, *self.variables)))
        return self.dataset().to_table(columns=[name])[name].to_numpy()

    def to_dataframe(self, library: str = "pandas") -> Any:
        """A data frame of pandas or polars, a row for each sample."""
        return make(FRAME, self, library=library)

    def to_xarray(self) -> Any:
        """An xarray Dataset over the samples; over the variables where they are a grid."""
        return make(DATASET, self)

    def plot(self, metric: str = "", limit: float | None = None) -> Figure:
        """Response surface of the two variables that matter most, histogram with the limit, shares of the variance."""
        return make(FIGURE, self, metric=metric, limit=limit)

    def metric(self, name: str = "") -> str:
        """The name of a metric; "" stands for the one that limits are mostly about."""
        if name and name not in self.metrics:
            raise InputError("no such metric", got=name, expected=", ".join(self.metrics), where="metric")
        return name or next((best for best in BEST_METRICS if best in self.metrics), (*self.metrics, "")[0])

    def within(self, limit: float, metric: str = "") -> tuple[float, float, float]:
        """Share of the samples whose metric is at most a limit, and its 95 % interval (Wilson 1927).

        A sample without a value (NaN) is beyond it.
        """
        values = self.column(self.metric(metric))
        return wilson(int(np.sum(values <= limit)), len(values))

    def tolerance(self, limit: float, metric: str = "") -> Tolerance:
        """The largest box in the ranges within which every sample keeps a limit; words and values do not bound it.

        It grows from what the file says, or from the middle of a range that does not hold that, to all sides alike.
        """
        beyond = ~(self.column(self.metric(metric)) <= limit)
        sides = {name: ends for name, ends in LoadedSpec(self.folder.spec, self.folder.path).ends.items() if ends}
        reach = np.zeros(len(beyond))
        for name, (low, centre, high) in sides.items():
            x = self.column(name)
            with np.errstate(invalid="ignore", divide="ignore"):
                off = np.where(x > centre, (x - centre) / (high - centre), (centre - x) / (centre - low))
            reach = np.maximum(reach, np.nan_to_num(off))
        share = min(1.0, float(reach[beyond].min(initial=np.inf)))
        ends = {name: (c - share * (c - low), c + share * (high - c)) for name, (low, c, high) in sides.items()}
        return Tolerance(share, ends, int(np.sum((reach < share) | ~beyond & (reach <= share))))

    def shares(self, metric: str = "") -> list[Share]:
        """Which variables matter: share of the variance of a metric that each makes by itself, the largest first."""
        values = self.column(self.metric(metric)).astype(float)
        there = np.isfinite(values)
        if there.sum() < FEWEST or not np.ptp(values[there]) > 0.0:
            return []
        spec, y = self.folder.spec, values[there]
        balanced = spec.sampling in (SOBOL, GRID) and spec.correlation is None
        columns = {name: self.column(name)[there] for name in self.variables}
        totals = total_shares(self._places()[there], y, self._levels, spec.sampling == GRID and bool(there.all()))
        if spec.correlation is not None:
            totals = [(math.nan,) * 3] * len(totals)  # their variance has no parts
        shares = [
            Share(name, *variance_share(x, y, balanced), *total)
            for (name, x), total in zip(columns.items(), totals, strict=True)
        ]
        return sorted(shares, key=lambda share: -share.share)

    @property
    def _levels(self) -> tuple[int, ...]:
        """How many values each variable has; 0 of a range."""
        spec = self.folder.spec
        if spec.sampling == GRID:
            return spec.levels
        return tuple(len(variable.values or ()) for variable in spec.vary.values())

    def _places(self) -> FloatArray:
        """Where the samples that are there lie, as `total_shares` takes it. Shape (samples, variables)."""
        spec = self.folder.spec
        places = points(spec, 0, sample_count(spec))[self.column(SAMPLE)]
        for k, levels in enumerate(self._levels):
            if levels:
                values = spec.sampling == GRID and [*spec.vary.values()][k].values is None
                scaled = np.round(places[:, k] * (levels - 1)) if values else np.floor(places[:, k] * levels)
                places[:, k] = np.clip(scaled, 0, levels - 1)
        return places

    def _is_end(self, name: str) -> bool:
        """Whether a column is the end of the interval of another one."""
        number, _, end = name.rpartition(".")
        return end in ENDS and number in self.metrics

    @property
    def verdict(self) -> Statement:
        """How far it is."""
        status = self.status
        numbers = {
            "done": len(status.done),
            "shards": status.shards,
            "failed": len(status.failed),
            "samples": status.samples,
        }
        code = "campaign_failed" if status.failed else "campaign_done" if status.complete else "campaign_open"
        bad = int(np.sum(~self.column("ok").astype(bool))) if VERDICT in self._measured else 0
        if bad and code == "campaign_done":
            code, numbers["failed"] = "fits_failed", bad
        return Statement(code, WARNING if status.failed or bad else NOTE, self.folder.spec.name, numbers)

    def statements(self) -> list[Statement]:
        """Shards that failed, the last line of each traceback; the first fit of each verdict that does not stand."""
        failed = [
            Statement(
                "shard_failed", WARNING, str(self.folder.shard_path(shard, ".failed")), {"error": _last_line(words)}
            )
            for shard, words in self.status.failed.items()
        ]
        return [*failed, *self._refused()]

    def _refused(self) -> list[Statement]:
        """What the first fit says of each verdict that does not stand."""
        if VERDICT not in self._measured:
            return []
        rows = zip(self.column(VERDICT), self.column("words"), self.column("ok"), strict=True)
        words = {verdict: text for verdict, text, is_ok in reversed([*rows]) if not is_ok}
        return [quoted(text) for text in words.values()]

    def document(self, metric: str = "", limit: float | None = None) -> Document:
        """What it says: numbers of each metric, the share within a limit, and which variables matter."""
        summaries = {name: summary(self.column(name)) for name in self.metrics if not self._is_end(name)}
        rows = [(name, *(f"{value:.4g}" for value in values)) for name, values in summaries.items()]
        head = ("metric", "mean", "2.5 %", "median", "97.5 %", "largest", "none")
        parts: list[Part] = [Table(head, rows, "<>", name="metrics")] if rows else []
        data: dict[str, Any] = {**as_verdict(self.verdict), "folder": str(self.folder.path), "metrics": {}}
        if VERDICT in self._measured:
            counts = Counter(self.column(VERDICT).tolist())
            data["verdicts"] = dict(counts.most_common())
            cells = [(code, str(count)) for code, count in counts.most_common()]
            parts = [Table(("verdict", "fits"), cells, "<>", name="verdicts"), "", *parts]
        data["metrics"] = {key: dict(zip(SUMMARY, values, strict=True)) for key, values in summaries.items()}
        name = self.metric(metric) if rows else ""
        if rows and limit is not None:
            share, low, high = self.within(limit, name)
            data["within"] = {"metric": name, "limit": limit, "share": share, "low": low, "high": high}
            statement = Statement(
                "within_limit", NOTE, name, {"limit": limit, "share": share, "low": low, "high": high}
            )
            tolerance = self.tolerance(limit, name)
            data["tolerance"] = tolerance._asdict()
            box = {"keys": [*tolerance.ends], "low": [e[0] for e in tolerance.ends.values()]}
            box |= {"high": [e[1] for e in tolerance.ends.values()], "limit": limit, "inside": tolerance.inside}
            kept = [Statement("tolerance" if tolerance.inside else "no_tolerance", NOTE, name, box)]
            parts += ["", Points([statement, *(kept if tolerance.ends else [])], "-", "within")]
        if rows and (shares := self.shares(name)):
            cells = [
                (s.variable, *_percent(s.share, s.low, s.high), *_percent(s.total, s.total_low, s.total_high))
                for s in shares
            ]
            head = (f"what makes {name} vary", "alone, %", "95 %", "with others, %", "95 %")
            parts += ["", Table(head, cells, "<>", name="shares")]
            data["shares"] = {s.variable: s._asdict() for s in shares}
        statements = self.statements()
        parts += ["", Points(statements[:3], "-", "failed")] if statements else []
        data["warnings"] = plain(statements)
        return Document(parts, plain(data), statements, verdict=self.verdict)


def _percent(share: float, low: float, high: float) -> tuple[str, str]:
    """A share and its interval, in per cent."""
    if math.isnan(share):
        return "", ""
    return f"{100 * share:.0f}", f"[{100 * low:.0f}, {100 * high:.0f}]"


def _last_line(words: str) -> str:
    lines = words.strip().splitlines()
    return lines[-1][:300] if lines else ""


def summary(values: FloatArray) -> tuple[float, ...]:
    """Mean, quantiles, the largest of what is a number; and how many are none."""
    numbers = values[np.isfinite(values)]
    if not len(numbers):
        return (math.nan,) * 5 + (float(len(values)),)
    return (
        float(np.mean(numbers)),
        *np.quantile(numbers, QUANTILES).tolist(),
        float(numbers.max()),
        float(len(values) - len(numbers)),
    )


def wilson(hits: int, count: int) -> tuple[float, float, float]:
    """A share and its 95 % interval, E. B. Wilson, JASA 22 (1927)."""
    z, share = 1.959964, hits / count
    middle, spread = share + z**2 / (2 * count), z * math.sqrt(share * (1 - share) / count + z**2 / (4 * count**2))
    scale = 1.0 + z**2 / count
    return share, max(0.0, (middle - spread) / scale), min(1.0, (middle + spread) / scale)


def variance_share(x: Sequence[Any] | FloatArray, y: FloatArray, balanced: bool = False) -> tuple[float, float, float]:
    """Share of the variance of y that x makes by itself, and the ends of its 95 % interval. Shapes (n,), (n,).

    x: numbers, or words, each of which is a group. balanced: whether samples of any group of x have all the other
    variables even, as those of a Sobol sequence. The interval: a jackknife over BLOCKS blocks of neighbours, Student's
    quantile.
    """
    levels, rank = np.unique(np.asarray(x), return_inverse=True)
    most = len(y) if levels.dtype.kind in "OU" else max(2, round(math.sqrt(len(y))))
    whole, block = _share(rank, y, balanced, most), np.arange(len(y)) * BLOCKS // len(y)
    parts = np.array([_share(rank[block != k], y[block != k], balanced, most) for k in range(BLOCKS)])
    error = math.sqrt((BLOCKS - 1) * float(np.mean((parts - parts.mean()) ** 2)))
    reach = t_quantile(BLOCKS - 1) * error
    low, high = np.clip([whole - reach, whole + reach], 0.0, 1.0).tolist()
    return max(0.0, whole), low, high


def _share(rank: Any, y: FloatArray, balanced: bool, most: int) -> float:
    """First-order index by the variance between groups of x, of which there are at most so many."""
    count = len(y)
    levels, group = np.unique(rank, return_inverse=True)
    if len(levels) > most:  # many numbers: groups of neighbours, as many in each
        group = np.empty(count, int)
        group[np.argsort(rank, kind="stable")] = np.arange(count) * most // count
    sizes = np.bincount(group)
    used = int((sizes > 0).sum())
    if used < 2 or used >= count:
        return 0.0
    means = np.bincount(group, y) / np.maximum(sizes, 1)
    between = float(sizes @ (means - y.mean()) ** 2)
    within = float(np.sum((y - means[group]) ** 2))
    if balanced:
        return between / (between + within)
    # E(between) = (count - sum sizes^2/count) V + (used - 1) W, E(within) = (count - used) W
    noise = within / (count - used)
    explained = (between - (used - 1) * noise) / (count - float(sizes @ sizes) / count)
    return explained / (explained + noise) if explained + noise > 0.0 else 0.0  # below 0 where there is nothing


def load_campaign(folder: Any) -> Campaign:
    """A campaign from its folder, complete or not. Raises InputError where there is none."""
    from pathlib import Path

    home = Folder(Path(folder))
    home.manifest  # noqa: B018  refused here
    return Campaign(home)
