"""Bands of a comparison: what of the distance between model and robot the std of the robot file may explain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from omnidyn.comparison.replay import HOLD, replay
from omnidyn.comparison.result import Comparison
from omnidyn.model.known.told import uncertainty_of
from omnidyn.model.known.uncertainty import DRAWS, plausible
from omnidyn.model.log_effects import LogEffects
from omnidyn.model.robot import Robot
from omnidyn.simulation.band import Band, band_of, first_order_band
from omnidyn.statement import Statement

BAND_TOLERANCE = 1e-4  # [m/s] of the implicit engine: a band is a hundred times as wide, or of no interest


def with_bands(
    comparison: Comparison,
    robots: Sequence[Robot],
    *,
    logs: Sequence[int] | None = None,
    apply: str | None = None,
    hold: float = HOLD,
    tol: float | None = BAND_TOLERANCE,
    draws: int = DRAWS,
    seed: int = 0,
    log: LogEffects | None = None,
) -> Comparison:
    """The comparison with the band of each model: the same free runs by plausible robots.

    robots: those compared, in order. logs: which logs, all by default. apply, hold, tol, log: as they were compared. A
    robot whose file has no std has no band, and a warning says so.
    """
    indices = range(len(comparison.measured)) if logs is None else logs
    bands: dict[str, Mapping[int, Band]] = {}
    warnings, guessed = [], {}
    for name, robot in zip(comparison.robots, robots, strict=True):
        uncertain = uncertainty_of(robot)
        if not uncertain.keys:
            warnings.append(Statement("no_band", subject=name))
            continue
        candidates = plausible(robot, draws, seed)
        bands[name] = {
            k: band_of(
                candidates,
                lambda candidate, k=k: (
                    replay(candidate, comparison.measured[k], apply=apply, hold=hold, tol=tol, log=log).run
                ),
            )
            for k in indices
        }
        guessed[name] = uncertain.guessed
        if uncertain.guessed:
            warnings.append(Statement("band_rests_on_guesses", subject=name, numbers={"guesses": uncertain.guessed}))
    return replace(comparison, bands=bands, guesses=guessed, warnings=(*comparison.warnings, *warnings))


def with_fitted_band(comparison: Comparison, robot: Robot, log: int = 0) -> Comparison:
    """The comparison with the band of a robot that was fitted, in one of its logs: to first order.

    That is what a fit knows of its numbers, and some of them it knows only together: see `first_order_std`. The runs
    that slopes are taken from have one step a row, as those of the fit. No band where no number has a std.
    """
    (name,) = comparison.robots
    if not uncertainty_of(robot).keys:
        return comparison
    run = comparison.simulated[name][log]
    band = first_order_band(
        robot, run, lambda candidate: replay(candidate, comparison.measured[log], tol=None, log=robot.log).run
    )
    return replace(comparison, bands={name: {log: band}})
