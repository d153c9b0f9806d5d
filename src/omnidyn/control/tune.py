"""tune: gains by simulation, over the robots that may be meant and not only the one the numbers say.

    J(g) = geometric mean over the paths of  sqrt(mean over the robots of (position rmse^2 + (b heading rmse)^2))

b is the radius of the robot [m]: an error of the heading counts as far as its rim moves. The robots are draws from the
std and the correlations of the robot file; each is driven with the same noise for every g, so that J has no noise of
its own. A search by Nelder and Mead (1965) finds the least J; what it says of that is checked on other draws.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize

from omnidyn.arguments import check_order
from omnidyn.arrays import FloatArray
from omnidyn.control.closed_loop import Circumstances, told_of_loop, tracked
from omnidyn.control.controllers import ControllerFile, controller_spec, options_of
from omnidyn.control.feedforward import DT
from omnidyn.control.mpc.settings import Settings
from omnidyn.control.paths.motion import Path
from omnidyn.control.paths.path import is_several
from omnidyn.control.paths.path import path as path_named
from omnidyn.control.tracking import Tracking
from omnidyn.document import Document, Part, Points, Table, all_of, plain
from omnidyn.errors import InputError
from omnidyn.model.known.told import told
from omnidyn.model.known.uncertainty import plausible
from omnidyn.model.robot import Robot
from omnidyn.progress import Progress, Report, silent
from omnidyn.shown import Displayable
from omnidyn.statement import NOTE, Statement, as_verdict

DRAWS, EVALUATIONS, NOISE = 8, 30, 0.005
MOST_DRAWS, MOST_EVALUATIONS = 1000, 10_000
SPREAD = 0.15  # of the range of each gain: the first step of the search
GAIN_TOLERANCE = 1e-3  # of J: a search that gains less has ended


class Range(NamedTuple):
    """Between which values a gain is looked for, and whether on a logarithmic scale."""

    low: float
    high: float
    log: bool = True

    def at(self, place: float) -> float:
        """The value at a place from 0 to 1, four digits of it."""
        share = min(1.0, max(0.0, place))
        value = self.low * (self.high / self.low) ** share if self.log else self.low + share * (self.high - self.low)
        return float(f"{value:.4g}")

    def of(self, value: float) -> float:
        """The place of a value."""
        inside = min(self.high, max(self.low, value))
        return (
            math.log(inside / self.low) / math.log(self.high / self.low)
            if self.log
            else ((inside - self.low) / (self.high - self.low))
        )


# Controller -> option -> where its best value is looked for.
TUNED: dict[str, dict[str, Range]] = {
    "pid": {"faster": Range(0.3, 20.0), "integral": Range(0.0, 1.0, log=False)},
    "speed": {"faster": Range(0.3, 20.0)},
    "mpc": {"volts": Range(1e-6, 1.0), "scale_walk": Range(5e-4, 0.1)},
}


class TuningScore(NamedTuple):
    """What gains come to over the robots: J [m], the mean and the worst position rmse [m], restlessness [V]."""

    cost: float
    mean: float
    worst: float
    restless: float


@dataclass(frozen=True, eq=False, repr=False)
class Tuned(Displayable):
    """What `tune` found.

    robot, paths: names. controller: with the gains found, as a file has it. start: the gains it began with. before,
    after: of these and of those found, over robots and noise that the search has not seen. own_before, own_after: on
    the robot of the file itself.
    draws: robots the search drove, 0 where the file says nothing of how far its numbers may be off: then it was the
    robot of the file alone. evaluations: gains that were tried. noise [m/s], delay [steps], dt [s]: of the loops.
    """

    robot: str
    paths: tuple[str, ...]
    controller: ControllerFile
    start: Mapping[str, float]
    before: TuningScore
    after: TuningScore
    own_before: TuningScore
    own_after: TuningScore
    draws: int
    evaluations: int
    noise: float
    delay: int
    dt: float

    def __repr__(self) -> str:
        return f"<Tuned {self.controller.controller} for {self.robot}: {dict(self.gains)}>"

    @property
    def gains(self) -> dict[str, float]:
        """The gains found."""
        return {name: self.controller.options[name] for name in self.start}

    @property
    def better(self) -> bool:
        """Whether they are better than those it began with, on robots that the search has not seen."""
        return self.after.cost < self.before.cost

    @property
    def verdict(self) -> Statement:
        """What tuning brought."""
        errors = {"before": self.before.mean, "after": self.after.mean}
        if not self.better:
            return Statement("gains_kept", NOTE, self.controller.controller, errors)
        gains = {"names": [*self.gains], "gains": [*self.gains.values()]}
        return Statement("gains_tuned", NOTE, self.controller.controller, errors | gains)

    def statements(self) -> list[Statement]:
        """What was optimised, and what that gave up."""
        names = ("paths", "draws", "noise", "delay", "dt", "evaluations")
        statements = [Statement("optimised", NOTE, numbers={name: getattr(self, name) for name in names})]
        statements += [Statement("judged_on_other_draws", NOTE)] if self.draws else []
        errors = {
            "given_up_rest": (self.before.restless, self.after.restless),
            "given_up_on_file": (self.own_before.mean, self.own_after.mean),
            "given_up_on_worst": (self.before.worst, self.after.worst),
        }
        losses = [
            Statement(code, NOTE, numbers={"before": before, "after": after})
            for code, (before, after) in errors.items()
            if after > 1.02 * before
        ]
        return [*statements, *(losses or [Statement("given_up_nothing", NOTE)])]

    def document(self) -> Document:
        """What it says."""
        rows = [
            (
                name,
                f"{1e3 * own_score.mean:.3f}",
                f"{1e3 * score.mean:.3f}",
                f"{1e3 * score.worst:.3f}",
                f"{score.restless:.3f}",
            )
            for name, own_score, score in (
                ("before", self.own_before, self.before),
                ("tuned", self.own_after, self.after),
            )
        ]
        head = ("", "this robot mm", "robots mm", "worst mm", "change V")
        scores, words = Table(head, rows, "<>", name="scores"), Points(self.statements(), "-", "statements")
        parts: list[Part] = [scores, "", words, "", self.controller.to_toml()]
        return Document(parts, self.to_dict(), verdict=self.verdict)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        scores = {name: getattr(self, name)._asdict() for name in ("before", "after", "own_before", "own_after")}
        return plain(
            {
                "robot": self.robot,
                "paths": self.paths,
                "controller": self.controller.controller,
                "options": dict(self.controller.options),
                "start": dict(self.start),
                **scores,
                "draws": self.draws,
                "evaluations": self.evaluations,
                "better": self.better,
                "statements": self.statements(),
                **as_verdict(self.verdict),
            }
        )


def tune(
    robot: Robot,
    path: Any,
    controller: str = "pid",
    *,
    draws: int = DRAWS,
    evaluations: int = EVALUATIONS,
    noise: float = NOISE,
    delay: int = 0,
    dt: float = DT,
    duration: float | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> Tuned:
    """Find the gains of a controller by simulation, over the robots that the file says may be meant.

    Returns a Tuned, whose `controller` is what `track` reads from a file (`save_controller`).

    Args:
        robot: The robot, its std with it.
        path: A Path or what `omnidyn.path` takes; or a list of several.
        controller: A name or a controller file: its options are where the search begins.
        draws: Robots that are driven.
        evaluations: Settings that are tried, at the most.
        noise: As for `track` [m/s]; noise 0 and no delay make gains as large as dt allows.
        delay: As for `track`.
        dt: As for `track` [s].
        duration: As for `track` [s].
        seed: As for `track`.
        progress: Hears what is being driven.

    Raises InputError for a controller without gains, or a number out of range.
    """
    paths: list[Any] = list(path) if is_several(path) else [path]
    kinds = (Path, str) if isinstance(path, Robot) else object
    check_order("tune(robot, path, controller)", (robot, Robot), (paths, kinds), (controller, str))
    _check_counts(draws, evaluations, paths)
    around = Circumstances(dt, duration, noise=noise, delay=delay, seed=seed)
    follow = [path_named(item) for item in paths]
    spec = controller_spec(controller)
    ranges = _ranges(spec)
    uncertain = bool(told(robot).keys)
    training = plausible(robot, draws, seed) if uncertain else [robot]
    held_out = plausible(robot, draws, seed + 1) if uncertain else [robot]
    trials: list[tuple[float, dict[str, float]]] = []

    def cost(places: FloatArray) -> float:
        gains = {
            name: interval.at(float(place)) for (name, interval), place in zip(ranges.items(), places, strict=True)
        }
        outside = float(np.sum(np.maximum(np.abs(places - 0.5) - 0.5, 0.0)))
        progress(Report(f"trying {', '.join(f'{name} {value:g}' for name, value in gains.items())}"))
        value = _score(robot, training, follow, _with(spec, gains), around).cost
        trials.append((value, gains))
        return math.log(value) + outside

    defaults = options_of(spec.controller)
    if "volts" in ranges:  # by default it follows from the robot
        defaults["volts"] = Settings().of(robot).volts
    start = {name: float(spec.options.get(name, defaults[name])) for name in ranges}
    first = np.array([interval.of(start[name]) for name, interval in ranges.items()])
    corners = np.vstack([first, *(first + _aside(first, k) for k in range(len(first)))])
    options = {"maxfev": evaluations, "initial_simplex": corners, "xatol": 1e-2, "fatol": GAIN_TOLERANCE}
    minimize(cost, first, method="Nelder-Mead", options=options)
    best = min(trials, key=lambda trial: trial[0])[1]
    old, new = _with(spec, start), _with(spec, best)
    fresh = replace(around, seed=seed + 1)
    before, after = (_score(robot, held_out, follow, gains, fresh) for gains in (old, new))
    own_before, own_after = (_score(robot, [robot], follow, gains, fresh) for gains in (old, new))
    if after.cost >= before.cost:
        new, after, own_after = old, before, own_before
    names = tuple(route.name for route in follow)
    source = f"tuned for {robot.name} on {all_of(names)}, {draws if uncertain else 0} draws, seed {seed}"
    return Tuned(
        robot.name,
        names,
        replace(new, source=source),
        start,
        before,
        after,
        own_before,
        own_after,
        draws if uncertain else 0,
        len(trials),
        noise,
        delay,
        dt,
    )


def _check_counts(draws: int, evaluations: int, paths: Sequence[Any]) -> None:
    for name, value, largest in (("draws", draws, MOST_DRAWS), ("evaluations", evaluations, MOST_EVALUATIONS)):
        if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= largest:
            raise InputError("out of range", got=value, expected=f"1 to {largest}", where=name)
    if not paths:
        raise InputError("nothing to follow", got="no path", expected="a path, or several", where="path")


def _ranges(spec: ControllerFile) -> dict[str, Range]:
    """The gains of a controller that are looked for. Raises InputError where it has none."""
    if spec.controller not in TUNED:
        raise InputError(
            "this controller has no gains",
            got=spec.controller,
            expected=" or ".join(TUNED),
            remedy="it follows from the robot alone",
            where="controller",
        )
    return TUNED[spec.controller]


def _with(spec: ControllerFile, gains: Mapping[str, float]) -> ControllerFile:
    return replace(spec, options={**spec.options, **gains})


def _aside(first: FloatArray, k: int) -> FloatArray:
    """A step along one gain, inwards."""
    step = np.zeros(len(first))
    step[k] = SPREAD if first[k] < 0.5 else -SPREAD
    return step


def _score(
    robot: Robot, plants: Sequence[Robot], paths: Sequence[Path], spec: ControllerFile, around: Circumstances
) -> TuningScore:
    """What a controller for one robot comes to when it drives the others."""
    control = spec.make(robot, **told_of_loop(robot, around))
    rim = float(np.mean(robot.wheels.robot_radius))
    runs = [[tracked(plant, path, control, around) for plant in plants] for path in paths]
    all_runs = [run for row in runs for run in row]
    logs = [math.log(max(math.sqrt(float(np.mean([_square(run, rim) for run in row]))), 1e-9)) for row in runs]
    errors = [run.rmse_position for run in all_runs]
    return TuningScore(
        math.exp(float(np.mean(logs))),
        float(np.mean(errors)),
        max(errors),
        float(np.mean([run.restlessness for run in all_runs])),
    )


def _square(tracking: Tracking, rim: float) -> float:
    """Squared error of a run, heading at the rim included [m^2]."""
    return tracking.rmse_position**2 + (rim * tracking.rmse_heading) ** 2
