"""MotorEstimate: what logs say of one motor, however it was fitted.

u = slope w + dead_band sgn w + inertia w',   inertia = slope lag,   u in volts, percent of duty, or ampere
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from omnidyn.arrays import FloatArray
from omnidyn.document import plain

SLOPE, BAND, LAG, INERTIA, LATENCY = "slope", "dead_band", "lag", "inertia", "latency"
WINDOWS, FREE_RUN = "windows", "free run"
PAYS = 0.01  # share by which the error on held-out logs must fall for a dead band to pay
HEAD = ("motor", "from", "dead band fitted", "slope", "+-", "dead band", "+-", "95 % interval", "lag ms", "+-", "unit",
        "rmse rad/s", "held out rad/s")  # fmt: skip


@dataclass(frozen=True, eq=False)
class MotorEstimate:
    """value, std, ci95: slope [unit s/rad], dead_band [unit], lag [s], inertia [unit s^2/rad], and of each channel that
    may be late "latency.CHANNEL" [s]; NaN for what the logs do not determine.

    motor: its number from 0, None for all together. kind, unit: of the input. way: "windows" in integral form, or "free
    run" of whole logs. correlation: of slope and dead band. rmse [rad/s]: of the speed; of windows, of their mean
    speed. count: windows, or rows. at_bound, unidentifiable: names. left_out: rows that do not count, because the log
    does not resolve the input there. one_way: it turned one way only, so a dead band and an offset of the input are
    one. held_out [rad/s]: error of free runs on logs that were not fitted. warnings: in words. source: the logs.
    Of windows: rest, the largest input under which the motor stayed at rest, NaN where it never rested; draws: of the
    bootstrap, by name. Of a free run: between, noise by channel, kind of the covariance, whether the fit converged.
    """

    motor: int | None
    kind: str
    unit: str
    way: str
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
    warnings: tuple[str, ...] = ()
    rest: float = math.nan
    draws: Mapping[str, FloatArray] = field(default_factory=dict)
    between: str = ""
    noise: Mapping[str, float] = field(default_factory=dict)
    covariance: str = ""
    converged: bool = True

    @property
    def name(self) -> str:
        return "all motors" if self.motor is None else f"motor {self.motor + 1}"

    @property
    def dead_band_seen(self) -> bool:
        """Whether the interval of the dead band lies above 0, and that of the slope too: else there is no line."""
        known = BAND in self.value and BAND not in self.unidentifiable
        return known and self.ci95[BAND][0] > 0.0 and self.ci95[SLOPE][0] > 0.0

    def bounded(self, turned: float, rested: float = math.nan) -> MotorEstimate:
        """The same with a dead band that is not above an input under which the motor turned steadily, `turned`.

        A value above that is none. Where there is none, it lies between that and `rested`, the largest input under
        which the motor rested.
        """
        if BAND not in self.value or not math.isfinite(turned):
            return self
        low, high = self.ci95[BAND]
        lost = BAND in self.unidentifiable or not self.value[BAND] <= turned
        if not lost:
            return replace(self, ci95={**self.ci95, BAND: (low, min(high, turned))})
        blind = tuple(dict.fromkeys((*self.unidentifiable, BAND)))
        ends = (rested if rested < turned else 0.0, turned)
        return replace(self, std={**self.std, BAND: math.nan}, ci95={**self.ci95, BAND: ends}, unidentifiable=blind)

    @property
    def late(self) -> dict[str, float]:
        """The latencies that were fitted [s]."""
        return {name: value for name, value in self.value.items() if name.startswith(LATENCY)}

    def statement(self, *, started: bool = False) -> str:
        """The estimate in a sentence. started: its starts from rest were seen, so that they are its dead band, and not
        where the line meets speed 0.
        """
        spread = f" +- {self.std[SLOPE]:.2g}" if math.isfinite(self.std[SLOPE]) else ""
        words = f"{self.name}: slope {self.value[SLOPE]:.5g}{spread} {self.unit} s/rad"
        if LAG in self.unidentifiable:
            words += ", lag not determined"
        elif self.ci95[LAG][0] > 0.0:
            words += f", lag {1e3 * self.value[LAG]:.3g} ms"
        for name, value in self.late.items():
            sure = f"+- {1e3 * self.std[name]:.2g} ms"
            known = sure if name not in self.unidentifiable else "ms (the end of what was searched: not determined)"
            words += f", {name.partition('.')[2]} late by {1e3 * value:.3g} {known}"
        if self.left_out:
            words += f" ({self.left_out} rows left out: their input changes too much from row to row)"
        if started and self.dead_band_seen:
            low, high = self.ci95[BAND]
            band = f"{self.value[BAND]:.3g} +- {self.std[BAND]:.2g} {self.unit}, 95 % [{low:.3g}, {high:.3g}]"
            line = "its line" if self.one_way else "its line, both ways together,"
            return f"{words}; {line} meets speed 0 at {band}"
        return f"{words}; {self._of_dead_band()}"

    def _of_dead_band(self) -> str:
        if BAND not in self.value:
            return "no dead band asked for"
        blind = "dead band not identifiable here"
        if BAND in self.unidentifiable:
            low, high = self.ci95[BAND]
            between = f"between {low:.3g} and {high:.3g}" if low > 0.0 else f"at most {high:.3g}"
            known = f"; it is {between} {self.unit}, for it turned steadily under that" if high < math.inf else ""
            if math.isfinite(self.value[BAND]):
                return f"{blind}: {self.value[BAND]:.3g} {self.unit} is no estimate{known}"
            told = "with one speed or one input only they cannot be told apart"
            return f"{blind}, and any is in the slope: {told}{known}"
        low, high = self.ci95[BAND]
        band = f"{self.value[BAND]:.3g} +- {self.std[BAND]:.2g} {self.unit}, 95 % [{low:.3g}, {high:.3g}]"
        if self.dead_band_seen:
            return f"dead band{' or offset (it turned one way only)' if self.one_way else ''} {band}"
        if high < 0.0:
            return (
                f"{blind}: the line meets speed 0 at {band}, below 0, and no friction does that; the input has an "
                "offset, or the speeds are wrong"
            )
        if low > 0.0:
            return f"{blind}: the slope may as well be 0 ({band})"
        return f"{blind}: {band} contains 0; it is at most {max(high, 0.0):.3g} {self.unit}, and none is needed"

    def row(self) -> tuple[str, ...]:
        """Cells under HEAD."""
        band = BAND in self.value
        return (
            self.name.removeprefix("motor "), f"{self.count} windows" if self.way == WINDOWS else self.way,
            "yes" if band else "no", f"{self.value[SLOPE]:.5g}", f"{self.std[SLOPE]:.2g}",
            *((f"{self.value[BAND]:.3g}", f"{self.std[BAND]:.2g}", "[{:.3g}, {:.3g}]".format(*self.ci95[BAND]))
              if band and math.isfinite(self.std[BAND]) else ("-", "-", self._interval_alone())),
            *(f"{1e3 * each:{form}}" if math.isfinite(each) and LAG not in self.unidentifiable else "-"
              for each, form in ((self.value[LAG], ".3g"), (self.std[LAG], ".2g"))),
            f"{self.unit}, s/rad", f"{self.rmse:.4g}",
            f"{self.held_out:.4g}" if math.isfinite(self.held_out) else "-",
        )  # fmt: skip

    def _interval_alone(self) -> str:
        """Of a dead band without a value."""
        low, high = self.ci95.get(BAND, (math.nan, math.nan))
        return f"[{low:.3g}, {high:.3g}]" if math.isfinite(high) else "-"

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        parameters = {
            name: {"value": value, "std": self.std[name], "ci95": self.ci95[name]} for name, value in self.value.items()
        }
        of_way = (
            {"rest": self.rest, "one_way": self.one_way} if self.way == WINDOWS
            else {"between": self.between, "noise": self.noise, "covariance": self.covariance,
                  "converged": self.converged, "left_out": self.left_out}
        )  # fmt: skip
        return plain({
            "motor": "all" if self.motor is None else self.motor + 1, "unit": self.unit, "from": self.way,
            "count": self.count, "parameters": parameters, "dead_band_seen": self.dead_band_seen,
            "rmse_rad_s": self.rmse, "held_out_rmse_rad_s": self.held_out, "at_bound": self.at_bound,
            "unidentifiable": self.unidentifiable, "warnings": self.warnings, "data": self.source, **of_way,
        })  # fmt: skip


def named(sources: Sequence[str]) -> str:
    """Some logs in a few words."""
    names = list(dict.fromkeys(sources))
    return names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more logs"
