"""Which engine has what a fit asks for: the only place that names them."""

from __future__ import annotations

from omnidyn.identification.output_error.engines.engine import FitEngine
from omnidyn.identification.output_error.engines.exact import ExactEngine
from omnidyn.identification.output_error.engines.implicit import ImplicitEngine
from omnidyn.identification.output_error.engines.speed_loop import LoopEngine
from omnidyn.identification.output_error.problem.problem import Problem

Kind = type[FitEngine[Problem]]  # of an engine


def kind_with(*, has_loop: bool = False, exact: bool = False) -> Kind:
    """The kind of engine with these properties, see `Engine`; without any, the one that serves every robot."""
    if has_loop:
        return LoopEngine
    return ExactEngine if exact else ImplicitEngine


def rolling_engine(problem: Problem, tol: float | None = None) -> FitEngine[Problem]:
    """The engine that serves every robot, wheels as if they rolled; this tolerance [m/s] for a path, too."""
    return ImplicitEngine(problem, tol)
