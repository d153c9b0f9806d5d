"""MotorEstimate: what logs say of one motor, however it was fitted.

u = slope w + dead_band sgn w + offset + inertia w',   inertia = slope lag,   u in volts, percent of duty, or ampere

An offset is the same as friction that is unequal by direction: dead_band + offset forward, dead_band - offset backward.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from omnidyn.arrays import FloatArray
from omnidyn.document import plain
from omnidyn.identification.estimate import HeldOut
from omnidyn.identification.selection.blocks import BlockComparison
from omnidyn.statement import NOTE, WARNING, Statement

SLOPE, BAND, OFFSET, LAG, INERTIA, LATENCY = "slope", "dead_band", "offset", "lag", "inertia", "latency"
WINDOWS, FREE_RUN = "windows", "free run"
LATE_ROWS = 2.0  # rows: a drive that is later is rare
HEAD = (
    "motor",
    "from",
    "dead band fitted",
    "slope",
    "+-",
    "dead band",
    "+-",
    "95 % interval",
    "offset",
    "95 % interval",
    "lag ms",
    "+-",
    "unit",
    "rmse",
    "held out",
)


@dataclass(frozen=True, eq=False)
class MotorEstimate:
    """value, std, ci95: slope [unit s/rad], dead_band and offset [unit], lag [s], inertia [unit s^2/rad], and of each
    channel that may be late "latency.CHANNEL" [s]; NaN for what the logs do not determine.

    motor: its number from 0, None for all together. kind, unit: of the input. basis: "windows" in integral form, or
    "free run" of whole logs. correlation: of slope and dead band. rmse [rad/s]: of the speed; of windows, of their mean
    speed. count: windows, or rows. at_bound, unidentifiable: names. left_out: rows that do not count, because the log
    does not resolve the input there. one_way: it turned one way only, so a dead band and an offset of the input are
    one. held_out [rad/s]: error of free runs on logs that were not fitted. source: the logs. answers: whether its
    speed goes with its input. travel: "rad", or "m" of a linear axis: what stands here in rad is in that.
    on_held_out: of blocks of these logs with those that slope and lag alone leave.
    rejected: numbers that held-out blocks do not need, with their intervals; comparisons: of them, by these blocks.
    Of windows: rest, the largest input under which the motor stayed at rest, NaN where it never rested; draws: of the
    bootstrap, by name. Of a free run: between, noise by channel, kind of the covariance, whether the fit converged.
    """

    motor: int | None
    kind: str
    unit: str
    basis: str
    value: Mapping[str, float]
    std: Mapping[str, float]
    ci95: Mapping[str, tuple[float, float]]
    correlation: float
    rmse: float
    count: int
    source: str
    at_bound: tuple[str, ...] = ()
    unidentifiable: tuple[str, ...] = ()
    left_out: int = 0
    one_way: bool = False
    held_out: float = math.nan
    warnings: tuple[Statement, ...] = ()
    rest: float = math.nan
    draws: Mapping[str, FloatArray] = field(default_factory=dict)
    between: str = ""
    noise: Mapping[str, float] = field(default_factory=dict)
    covariance: str = ""
    converged: bool = True
    answers: bool = True
    blocks: HeldOut | None = None
    on_held_out: BlockComparison | None = None
    rejected: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    comparisons: Mapping[str, BlockComparison] = field(default_factory=dict)
    travel: str = "rad"

    @property
    def name(self) -> str:
        return "all motors" if self.motor is None else f"motor {self.motor + 1}"

    @property
    def dead_band_seen(self) -> bool:
        """Whether held-out blocks improve by the dead band, its interval lies above 0, and that of the slope too: else
        there is no line.
        """
        is_determined = BAND in self.value and BAND not in self.unidentifiable and BAND not in self.rejected
        return is_determined and self.ci95[BAND][0] > 0.0 and self.ci95[SLOPE][0] > 0.0

    @property
    def dead_band_needed(self) -> bool:
        """Whether a dead band was fitted that held-out blocks need, however well its size is known."""
        has_value = BAND in self.value and BAND not in (*self.rejected, *self.unidentifiable)
        comparison = self.blocks.comparison if self.blocks else None
        return has_value and comparison is not None and comparison.is_better

    @property
    def offset_seen(self) -> bool:
        """Whether the interval of the offset lies on one side of 0."""
        return OFFSET in self.value and OFFSET not in self.unidentifiable and not _holds_zero(self.ci95[OFFSET])

    def bounded(self, turning_input: float, resting_input: float = math.nan) -> MotorEstimate:
        """The same with a dead band that is not above an input under which the motor turned steadily, `turning_input`.

        A value above that is none. Where there is none, it lies between that and `resting_input`, the largest input
        under which the motor rested.
        """
        if BAND not in self.value or not math.isfinite(turning_input):
            return self
        low, high = self.ci95[BAND]
        lost = BAND in self.unidentifiable or not self.value[BAND] <= turning_input
        if not lost:
            return replace(self, ci95={**self.ci95, BAND: (low, min(high, turning_input))})
        undetermined_names = tuple(dict.fromkeys((*self.unidentifiable, BAND)))
        ends = (resting_input if resting_input < turning_input else 0.0, turning_input)
        return replace(
            self, std={**self.std, BAND: math.nan}, ci95={**self.ci95, BAND: ends}, unidentifiable=undetermined_names
        )

    @property
    def late(self) -> dict[str, float]:
        """The latencies that were fitted [s]."""
        return {name: value for name, value in self.value.items() if name.startswith(LATENCY)}

    def statement(self, *, has_start: bool = False) -> Statement:
        """The line of the motor. has_start: its starts from rest were seen, so that they are its dead band, and not
        where the line meets speed 0.
        """
        latencies = [
            (name.partition(".")[2], value, None if name in self.unidentifiable else self.std[name])
            for name, value in self.late.items()
        ]
        numbers = {
            "slope": self.value[SLOPE],
            "slope_std": self.std[SLOPE],
            "unit": self.unit,
            "travel": self.travel,
            "lag": self.value[LAG],
            "lag_known": LAG not in self.unidentifiable,
            "lag_seen": self.ci95[LAG][0] > 0.0,
            "late": latencies,
            "left_out": self.left_out,
            "dead_band": self._of_dead_band(has_start),
            "offset": self._of_offset(),
        }
        return Statement("motor_line", NOTE, self.name, numbers)

    def _of_offset(self) -> Statement | None:
        """The offset, told as friction that is unequal by direction too; None where none was fitted."""
        if OFFSET not in self.value or OFFSET in self.unidentifiable:
            return None
        band, value = self.value.get(BAND, 0.0), self.value[OFFSET]
        numbers = {"value": value, "std": self.std[OFFSET], "unit": self.unit, "ci95": self.ci95[OFFSET]}
        levels = {"forward": band + value, "backward": band - value}
        is_seen = self.offset_seen and abs(value) <= band
        return Statement("offset_as_friction" if is_seen else "offset_of_input", NOTE, numbers=numbers | levels)

    def of_blocks(self) -> Statement | None:
        """How free runs predict held-out blocks, and those of a plain fit; None where none were held out."""
        if self.blocks is None:
            return None
        numbers = {"written": self.blocks.written, "plain": self.blocks.plain, "rejected": tuple(self.rejected)}
        if comparison := self.blocks.comparison:
            numbers |= {"better": comparison.better, "blocks": comparison.blocks}
        return Statement("motor_held_out_blocks", NOTE, self.name, numbers)

    def late_statements(self, row: float) -> list[Statement]:
        """What to say of latencies beside the time of a row [s]: longer than LATE_ROWS; half a row of a speed."""
        statements = []
        for name, latency in self.late.items():
            if name in self.unidentifiable:
                continue
            numbers, (low, high) = {"latency": latency, "rows": latency / row}, self.ci95[name]
            if latency > LATE_ROWS * row:
                statements.append(Statement("late_by_rows", WARNING, name.partition(".")[2], numbers))
            elif self.between == "hold" and name == f"{LATENCY}.wheel_speed" and 0.0 < low <= 0.5 * row <= high:
                statements.append(Statement("late_by_half_a_row", NOTE, "wheel_speed", numbers))
        return statements

    def _of_dead_band(self, has_start: bool) -> Statement:
        if has_start and BAND in self.value and not (self.dead_band_seen or self.dead_band_needed):
            return Statement("dead_band_of_starts", NOTE)
        if BAND in self.rejected:
            numbers = {"high": max(self.rejected[BAND][1], 0.0), "unit": self.unit, "better": None, "blocks": None}
            if comparison := self.comparisons.get(BAND):
                numbers |= {"better": comparison.better, "blocks": comparison.blocks}
            return Statement("dead_band_rejected", NOTE, numbers=numbers)
        if BAND not in self.value:
            return Statement("dead_band_not_asked", NOTE)
        low, high = self.ci95[BAND]
        numbers = {"value": self.value[BAND], "std": self.std[BAND], "unit": self.unit, "ci95": (low, high)}
        one_way = {"one_way": self.one_way}
        if self.dead_band_seen:
            return Statement("line_meets_zero" if has_start else "dead_band_seen", NOTE, numbers=numbers | one_way)
        if BAND in self.unidentifiable:
            return Statement("dead_band_bounded", NOTE, numbers=numbers)
        if self.dead_band_needed:
            return Statement("dead_band_hardly_known", NOTE, numbers=numbers)
        if high < 0.0:
            return Statement("dead_band_negative", WARNING, numbers=numbers)
        return Statement("slope_may_be_zero" if low > 0.0 else "dead_band_not_needed", NOTE, numbers=numbers)

    def row(self) -> tuple[str, ...]:
        """Cells under HEAD."""
        band, (low, high) = BAND in self.value, self.ci95.get(BAND, (math.nan, math.nan))
        return (
            self.name.removeprefix("motor "),
            f"{self.count} windows" if self.basis == WINDOWS else self.basis,
            "yes" if band else "no",
            f"{self.value[SLOPE]:.5g}",
            f"{self.std[SLOPE]:.2g}",
            *(
                (f"{self.value[BAND]:.3g}", f"{self.std[BAND]:.2g}", "[{:.3g}, {:.3g}]".format(*self.ci95[BAND]))
                if band and math.isfinite(self.std[BAND])
                else ("-", "-", f"[{low:.3g}, {high:.3g}]" if math.isfinite(high) else "-")
            ),
            *(
                (f"{self.value[OFFSET]:.3g}", "[{:.3g}, {:.3g}]".format(*self.ci95[OFFSET]))
                if OFFSET in self.value
                else ("-", "-")
            ),
            *(
                f"{1e3 * number:{form}}" if math.isfinite(number) and LAG not in self.unidentifiable else "-"
                for number, form in ((self.value[LAG], ".3g"), (self.std[LAG], ".2g"))
            ),
            f"{self.unit}, s/{self.travel}",
            f"{self.rmse:.4g}" if math.isfinite(self.rmse) else "-",
            f"{self.held_out:.4g}" if math.isfinite(self.held_out) else "-",
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        parameters = {
            name: {"value": value, "std": self.std[name], "ci95": self.ci95[name]} for name, value in self.value.items()
        }
        of_basis: dict[str, Any] = (
            {"rest": self.rest, "one_way": self.one_way}
            if self.basis == WINDOWS
            else {
                "between": self.between,
                "noise": self.noise,
                "covariance": self.covariance,
                "converged": self.converged,
                "left_out": self.left_out,
                "held_out_blocks": None if self.blocks is None else asdict(self.blocks),
            }
        )
        of_basis["rejected"] = {
            name: {"ci95": ends} | ({"blocks": asdict(self.comparisons[name])} if name in self.comparisons else {})
            for name, ends in self.rejected.items()
        }
        return plain(
            {
                "motor": "all" if self.motor is None else self.motor + 1,
                "unit": self.unit,
                "travel_unit": self.travel,
                "from": self.basis,
                "count": self.count,
                "parameters": parameters,
                "answers": self.answers,
                "dead_band_seen": self.dead_band_seen,
                f"rmse_{self.travel}_s": self.rmse,
                f"held_out_rmse_{self.travel}_s": self.held_out,
                "at_bound": self.at_bound,
                "unidentifiable": self.unidentifiable,
                "warnings": self.warnings,
                "data": self.source,
                **of_basis,
            }
        )


def _holds_zero(ends: tuple[float, float]) -> bool:
    return ends[0] <= 0.0 <= ends[1]


def named(sources: Sequence[str]) -> str:
    """Some logs in a few words."""
    names = list(dict.fromkeys(sources))
    return names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more log{'s' if len(names) > 2 else ''}"
