"""Estimate: the answer of every identification: a robot with fitted numbers, and how far they can be trusted."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from omnidyn.model.keys import unit
from omnidyn.model.robot import Prior, Robot
from omnidyn.model.robot_file import robot_to_toml

SOURCE_LENGTH = 300  # a robot file takes 400 characters


@dataclass(frozen=True, eq=False)
class Correlation:
    """Correlations of the estimates: matrix[i, j] between names[i] and names[j]. Shape (names, names)."""

    names: tuple[str, ...]
    matrix: NDArray[np.float64]

    def between(self, first: str, second: str) -> float:
        """The correlation of two parameters."""
        return float(self.matrix[self.names.index(first), self.names.index(second)])


@dataclass(frozen=True, eq=False)
class Estimate:
    """What data say about a robot. Parameters are named by their key in the robot file: "friction.axes.viscous[0]".

    robot: with the fitted numbers; its priors hold std and source, so that its file tells where they come from.
    value, std, ci95: name -> estimate, standard error, 95 % interval (low, high), in the unit of the key.
    correlation: between the estimates. degrees_of_freedom: name -> rows minus parameters behind that number.
    at_bound: names of what a bound holds (a friction that came out negative). std is then that of the free fit.
    lower_bound: name -> what the number is at least, where the data say no more (breakaway from rows at rest).
    warnings: what a reader must know, in words. method, data: how it was made, and from what (name, SHA-256).
    """

    robot: Robot
    value: Mapping[str, float]
    std: Mapping[str, float]
    ci95: Mapping[str, tuple[float, float]]
    correlation: Correlation
    degrees_of_freedom: Mapping[str, int]
    at_bound: tuple[str, ...] = ()
    lower_bound: Mapping[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    method: str = ""
    data: str = ""

    def summary(self) -> str:
        """The estimate as a plain table, for reading. ASCII only."""
        lines = [f"{self.robot.name}: {self.method}", f"data: {self.data}", "", *self._table()]
        lines += [f"{name} is at least {bound:.4g} {unit(name)}" for name, bound in self.lower_bound.items()]
        for warning in self.warnings:
            lines += textwrap.wrap(f"warning: {warning}", 100, subsequent_indent="  ")
        return "\n".join(line.encode("ascii", "backslashreplace").decode() for line in lines) + "\n"

    def _table(self) -> list[str]:
        width = max([len(name) for name in self.value] + [len("parameter")])
        rows = [f"{'parameter':{width}}  {'value':>10}  {'std error':>10}  {'95 % interval':>24}  unit"]
        for name, value in self.value.items():
            low, high = self.ci95[name]
            interval = f"{f'[{low:.4g}, {high:.4g}]':>24}"
            mark = "  at bound" if name in self.at_bound else ""
            row = f"{name:{width}}  {value:10.4g}  {self.std[name]:10.3g}  {interval}  {unit(name)}{mark}"
            rows.append(row.rstrip())
        return rows

    def to_dict(self) -> dict[str, Any]:
        """The estimate as JSON can hold it: no NaN, no infinity (null instead); the robot as the text of its file."""
        parameters = {
            name: {
                "value": finite_or_none(value),
                "std": finite_or_none(self.std[name]),
                "ci95": [finite_or_none(bound) for bound in self.ci95[name]],
                "degrees_of_freedom": int(self.degrees_of_freedom[name]),
                "at_bound": name in self.at_bound,
                "unit": unit(name),
            }
            for name, value in self.value.items()
        }
        return {
            "parameters": parameters,
            "lower_bound": {name: finite_or_none(bound) for name, bound in self.lower_bound.items()},
            "correlation": {
                "names": list(self.correlation.names),
                "matrix": [[finite_or_none(entry) for entry in row] for row in self.correlation.matrix.tolist()],
            },
            "warnings": list(self.warnings),
            "method": self.method,
            "data": self.data,
            "robot": robot_to_toml(self.robot),
        }


def identified(std: float | None, source: str) -> Prior:
    """The prior of an identified number: its standard error, where it is one, and "identified: SOURCE"."""
    text = "".join(c if c.isprintable() else " " for c in f"identified: {source}")[:SOURCE_LENGTH]
    known = std is not None and 0.0 < std <= 1e9
    return Prior(std=float(std) if known else None, source=text)  # type: ignore[arg-type]


def finite_or_none(value: float) -> float | None:
    """The number as JSON can hold it."""
    return float(value) if math.isfinite(value) else None
