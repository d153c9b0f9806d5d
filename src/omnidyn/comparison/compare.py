"""compare: one or two models against the logs of a robot, as free runs under the logged inputs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from omnidyn.arguments import Rng, check_order, seed_of
from omnidyn.comparison.errors_from_start import errors_for_whiteness
from omnidyn.comparison.metrics import Metrics, metrics
from omnidyn.comparison.model_bands import with_bands
from omnidyn.comparison.nearer_model import ModelDifference, changes, difference
from omnidyn.comparison.replay import HOLD, Replay, choose_input, refuse_other_robot, replay
from omnidyn.comparison.result import Comparison, Segment
from omnidyn.comparison.traces import Trace, compared_components, counts_from_start, is_counted, trace_of
from omnidyn.errors import InputError, InsufficientDataError, OmnidynError
from omnidyn.logs.channels import components
from omnidyn.model.first_guess import rests_on
from omnidyn.model.log_effects import LogEffects
from omnidyn.model.robot import Robot
from omnidyn.progress import Progress, Report, silent
from omnidyn.run import Run, as_list
from omnidyn.sensors import PREDICTED, SHOWN
from omnidyn.simulation.engine import TOLERANCE
from omnidyn.statement import Statement

EACH = 0.1  # [s] over which wheels turn, where two models are compared by angles
ABSENT = Trace(np.zeros(0), np.zeros(0), np.zeros(0))


def compare(
    robot: Robot,
    run: Run | Sequence[Run],
    other: Robot | None = None,
    *,
    apply: str | None = None,
    hold: float = HOLD,
    current_unsigned: bool = False,
    tol: float | None = TOLERANCE,
    rng: Rng = 0,
    progress: Progress = silent,
    band: bool = False,
    log: LogEffects | None = None,
) -> Comparison:
    """Replay logs against one robot, or two, and measure how near each comes.

    The logged input drives the model: voltage, else duty times supply, else the speed loop of the robot file. Each
    segment between gaps is a free run from the measured start; the model never sees what was measured after it.

    Args:
        robot: The model.
        run: One Run or several.
        other: A second robot under the same inputs.
        apply: Another input than the first that was logged.
        hold: How long a missing input keeps its value [s].
        current_unsigned: Compare currents by size, for a sensor without sign.
        tol: As in `simulate`.
        rng: A seed or a numpy.random.Generator of the bootstrap.
        progress: Hears what is being replayed.
        band: Whether to add how far each model may be off by the std of its robot file, from a hundred plausible
            robots (`with_bands`).
        log: What the logs do beside the robot, such as `robot.log` of a fit; None: what the file of a robot says of its
            own logs, which are known by what they hold; others get none of it.

    Raises InputError when a log does not fit a robot, InsufficientDataError when there is nothing to compare.

    >>> import omnidyn
    >>> robot = omnidyn.load_robot("axebot")
    >>> run = omnidyn.simulate(robot, [[0.0, 3.0, -3.0]] * 200, dt=0.01)
    >>> heavier = robot.replace(body=robot.body.replace(mass=1.8))
    >>> comparison = omnidyn.compare(robot, run, heavier)
    >>> [bool(comparison.overall[name]["vx"].rmse < 1e-9) for name in comparison.robots]
    [True, False]
    """
    other_robot = (Robot, type(None))
    check_order("compare(robot, run) or compare(robot, run, other)", (robot, Robot), (run, Run), (other, other_robot))
    runs, seed = tuple(as_list(run)), seed_of(rng)
    robots = _named(robot, other)
    channels = what_is_compared([*robots.values()], runs, apply)
    replays: dict[str, list[Replay]] = {name: [] for name in robots}
    for k, log_run in enumerate(runs):
        progress(Report(f"replaying {log_run.source or 'a run'}, {k + 1} of {len(runs)}"))
        for name, model in robots.items():
            replays[name].append(replay(model, log_run, apply=apply, hold=hold, tol=tol, log=log))
    segments = _segments(runs, next(iter(replays.values())))
    traces = {name: _traces(runs, parts, segments, channels, current_unsigned) for name, parts in replays.items()}
    overall = {name: _overall(by) for name, by in traces.items()}
    components = tuple(key for key in channels if all(key in metrics_of for metrics_of in overall.values()))
    if not components:
        raise InsufficientDataError("no measured value falls into a replayed segment", expected="speeds or a pose")
    comparison = Comparison(
        robots=tuple(robots),
        measured=runs,
        simulated={name: tuple(part.run for part in parts) for name, parts in replays.items()},
        applied={name: tuple(dict.fromkeys(part.driver for part in parts)) for name, parts in replays.items()},
        channels=components,
        segments=segments,
        overall=overall,
        by_segment={name: _by_segment(by, components) for name, by in traces.items()},
        difference=_differences([*traces.values()], components, seed) if len(robots) == 2 else {},
        current_unsigned=current_unsigned,
        rests_on={name: tuple(rests_on(model)) for name, model in robots.items()},
        warnings=(*_warnings(runs, replays), *_sign_warnings(runs, traces, current_unsigned)),
    )
    if not band:
        return comparison
    progress(Report("replaying plausible robots for the band"))
    return with_bands(comparison, [*robots.values()], apply=apply, hold=hold, seed=seed, log=log)


def what_is_compared(robots: Sequence[Robot], runs: Sequence[Run], apply: str | None = None) -> tuple[str, ...]:
    """Components that a comparison will hold, before anything is simulated; refuses what cannot be replayed.

    Raises InputError and InsufficientDataError as `compare` does.
    """
    if not runs:
        raise InsufficientDataError("no log to compare with", got="0 runs", expected="at least one")
    components: dict[str, None] = {}
    for run in runs:
        try:
            for robot in robots:
                refuse_other_robot(robot, run)
                components |= dict.fromkeys(compared_components(run, choose_input(robot, run, apply)))
        except OmnidynError as error:
            raise error.at(run.source) if run.source else error from None
    if not components:
        raise InsufficientDataError(
            "the logs hold nothing that a model predicts",
            got=", ".join(runs[0].channels),
            expected=f"{', '.join(PREDICTED[:-1])} or {PREDICTED[-1]}",
            remedy="map the columns of speeds, angles, currents or the pose",
        )
    return in_order(components, robots[0].wheels.count)


def in_order(names: Mapping[str, None], wheels: int) -> tuple[str, ...]:
    """Components in the order they are shown in: speeds first."""
    return tuple(name for channel in SHOWN for name in components(channel, wheels) if name in names)


def _named(robot: Robot, other: Robot | None) -> dict[str, Robot]:
    if other is None:
        return {robot.name: robot}
    if robot.wheels.count != other.wheels.count:
        raise InputError(
            "the two robots cannot both be that of the logs",
            got=f"{robot.wheels.count} and {other.wheels.count} wheels",
        )
    if robot.name == other.name:
        return {f"{robot.name} (A)": robot, f"{other.name} (B)": other}
    return {robot.name: robot, other.name: other}


def _segments(runs: Sequence[Run], replays: Sequence[Replay]) -> tuple[Segment, ...]:
    return tuple(
        Segment(k, rows.start, rows.stop, float(run.t[rows.start]), float(run.t[rows.stop - 1]))
        for k, (run, driven) in enumerate(zip(runs, replays, strict=True))
        for rows in driven.pieces
    )


def _traces(
    runs: Sequence[Run], replays: Sequence[Replay], segments: Sequence[Segment], channels: Sequence[str], unsigned: bool
) -> dict[str, list[Trace]]:
    """Component -> a trace per segment, an empty one where its log does not hold the component."""
    logged = [compared_components(run, driven.applied) for run, driven in zip(runs, replays, strict=True)]

    def trace(name: str, at: Segment) -> Trace:
        if name not in logged[at.log]:
            return ABSENT
        return trace_of(name, runs[at.log], replays[at.log].run, at.rows, unsigned)

    return {name: [trace(name, at) for at in segments] for name in channels}


def _overall(traces: Mapping[str, list[Trace]]) -> dict[str, Metrics]:
    """Component -> metrics over all traces. What counts from the start has no lag: a speed would look the same."""
    overall: dict[str, Metrics] = {}
    for key, rows in traces.items():
        anchored = counts_from_start(key)
        scores = metrics(rows, errors_for_whiteness(key, traces), with_lag=not anchored, start_known=anchored)
        if scores is not None:
            overall[key] = scores
    return overall


def _by_segment(traces: Mapping[str, list[Trace]], channels: Sequence[str]) -> dict[str, tuple[Metrics | None, ...]]:
    """Component -> metrics of each segment, without a lag."""
    by_component = {}
    for key in channels:
        pairs = zip(traces[key], errors_for_whiteness(key, traces), strict=True)
        by_component[key] = tuple(metrics([trace], [error], with_lag=False) for trace, error in pairs)
    return by_component


def _differences(
    traces: Sequence[Mapping[str, list[Trace]]], channels: Sequence[str], seed: int
) -> dict[str, ModelDifference]:
    """Which model is nearer in each component. An angle of a wheel counts from its start, and a free run wanders off:
    one log is one piece, which could tell nothing. How far the wheel turns in each tenth of a second tells."""
    first, second = traces
    pairs = []
    for key in channels:
        a, b, each_s = first[key], second[key], EACH if is_counted(key) else 0.0
        if each_s:
            a, b = ([changes(trace, each_s) for trace in side if len(trace.t)] for side in (a, b))
        gap = difference(a, b, len(channels), seed, whole=counts_from_start(key) and not each_s)
        pairs.append((key, gap and replace(gap, each_s=each_s)))
    return {key: gap for key, gap in pairs if gap is not None}


def _sign_warnings(
    runs: Sequence[Run], traces: Mapping[str, Mapping[str, list[Trace]]], current_unsigned: bool
) -> Iterator[Statement]:
    """Currents that are never negative where a model has them both ways: the sensor may have no sign."""
    logged = [run.current for run in runs if run.current is not None]
    if current_unsigned or not logged or min(np.nanmin(currents, initial=np.inf) for currents in logged) < 0.0:
        return
    names = components("current", logged[0].shape[1])
    models = [trace.model for by in traces.values() for name in names for trace in by.get(name, [])]
    if any((model < 0.0).any() for model in models):
        yield Statement("currents_never_negative")


def _warnings(runs: Sequence[Run], replays: Mapping[str, Sequence[Replay]]) -> Iterator[Statement]:
    """What readers of the logs and the replays warned of, once each, with the logs where there are several."""
    logs: dict[Statement, list[str]] = {}
    for k, run in enumerate(runs):
        warnings = [*run.warnings, *(warning for parts in replays.values() for warning in parts[k].warnings)]
        for warning in dict.fromkeys(warnings):
            logs.setdefault(warning, []).append(run.source or f"log {k + 1}")
    for warning, names in logs.items():
        yield warning if len(runs) == 1 else warning.of(*names)
