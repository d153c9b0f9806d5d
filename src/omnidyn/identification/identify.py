"""identify: logs and a robot in, an Estimate out, by the method that they allow."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from typing import Any

from omnidyn.errors import InputError
from omnidyn.identification.estimate import Estimate
from omnidyn.identification.output_error.fit import fit_output_error
from omnidyn.identification.output_error.inputs import why_no_inputs
from omnidyn.identification.steady.settling import why_no_transient
from omnidyn.identification.steady.study import identify_steady
from omnidyn.model.drive import SPEED
from omnidyn.model.robot import Robot
from omnidyn.run import Run

AUTO, OUTPUT_ERROR, STEADY_STATE = "auto", "output-error", "steady-state"
METHODS = (OUTPUT_ERROR, STEADY_STATE)
_FUNCTIONS: dict[str, Callable[..., Any]] = {OUTPUT_ERROR: fit_output_error, STEADY_STATE: identify_steady}


def identify(runs: Run | Sequence[Run], robot: Robot, *, method: str = AUTO, **options: Any) -> Estimate:
    """Fit the robot to logs. Returns an Estimate: robot, value, std, ci95, correlation, warnings.

    method: "output-error" (whole logs by maximum likelihood, see `fit_output_error`), "steady-state" (friction from
    stretches of constant speed, see `identify_steady`), or "auto": the first where robot and logs support it, else the
    second, with a warning that says why. options: those of the method, such as free=, nuisances=, loss= or shape=;
    with "auto" they choose it.
    Raises InputError for options of another method and for what cannot be used, InsufficientDataError where the logs
    cannot answer.
    """
    every = [runs] if isinstance(runs, Run) else list(runs)
    chosen, why = (method, "") if method != AUTO else choose_method(every, robot, [*options])
    refuse_options(chosen, [*options])
    if chosen == OUTPUT_ERROR:
        return fit_output_error(every, robot, **options)
    estimate = identify_steady(every, robot, **options).estimate
    if why:
        from dataclasses import replace

        return replace(estimate, warnings=(why, *estimate.warnings))
    return estimate


def choose_method(runs: Sequence[Run], robot: Robot, options: Sequence[str] = ()) -> tuple[str, str]:
    """(method, why it is not output error; "" where it is, or where an option decides). options: names of those."""
    own = options_of(STEADY_STATE)
    if any(name in own and name not in options_of(OUTPUT_ERROR) for name in options):
        return STEADY_STATE, ""
    why = why_not_output_error(runs, robot)
    if not why or any(name in options_of(OUTPUT_ERROR) for name in options):
        return OUTPUT_ERROR, ""
    return STEADY_STATE, f"steady-state, not output error: {why}"


def why_not_output_error(runs: Sequence[Run], robot: Robot) -> str:
    """Why whole logs are not fitted by output error unless it is asked for, in words; "" where they are."""
    why = why_no_inputs(runs, robot)
    if why or robot.drive.kind != SPEED or any(run.voltage is not None or run.duty is not None for run in runs):
        return why
    return why_no_transient(runs, robot)


def options_of(method: str) -> tuple[str, ...]:
    """Names of the options of a method."""
    parameters = inspect.signature(_FUNCTIONS[method]).parameters.values()
    return tuple(p.name for p in parameters if p.kind is p.KEYWORD_ONLY)


def refuse_options(method: str, options: Sequence[str]) -> None:
    """Raises InputError for an unknown method, and for options that it does not have."""
    if method not in METHODS:
        raise InputError("no such method", got=method, expected=" or ".join(METHODS), where="method")
    own = options_of(method)
    for name in options:
        if name not in own:
            other = [each for each in METHODS if name in options_of(each)]
            remedy = f"it belongs to {other[0]}" if other else ""
            raise InputError(f"{method} has no such option", got=name, expected=", ".join(own), remedy=remedy)
