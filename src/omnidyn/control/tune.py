"""tune: settings by simulation, over the robots that may be meant and not only the one the numbers say.

    J(g) = geometric mean over the paths, free and, with half the weight, pushed, of
           sqrt(position error x heading error),   each the rms over robots and time, and what does not count

So a setting is judged by how many times less both are off. The robots are draws from the std and the correlations of
the robot file; each is measured with its own sensors, with the same noise and the same pushes for every g, so that J
has no noise of its own. One setting after the other is made larger or smaller by a factor as long as J falls, then by a
smaller one; what is found is judged on other draws, noise, pushes and paths.

One robot in three has outputs that act LATENCY later, one LATENCY earlier and sensors a step worse. Settings of a loop
that does not settle where its outputs act LEAST_DELAY later are not taken; from such a start the search goes back to
the settings that the controller has by itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Unpack

import numpy as np

from omnidyn.arguments import check_order, is_whole
from omnidyn.control.circumstances import Circumstances, TuneOptions, circumstances
from omnidyn.control.closed_loop import told_of_loop, tracked
from omnidyn.control.controllers import ControllerFile, controller_spec, options_of
from omnidyn.control.demand import path_demand
from omnidyn.control.instruments import Instruments, instruments
from omnidyn.control.margins import Margins, has_delay_margin, loop_margins
from omnidyn.control.mpc.controller import Mpc
from omnidyn.control.paths.motion import Path
from omnidyn.control.paths.path import is_several
from omnidyn.control.paths.path import path as path_named
from omnidyn.control.pushes import PUSHED, push_force, pushes
from omnidyn.control.readings import with_sensors
from omnidyn.control.tracking import Tracking
from omnidyn.document import Document, Part, Points, Table, all_of, plain
from omnidyn.errors import InputError
from omnidyn.model.known.told import uncertainty_of
from omnidyn.model.known.uncertainty import plausible
from omnidyn.model.robot import Robot
from omnidyn.model.value import PerWheel
from omnidyn.progress import Progress, Report, silent
from omnidyn.shown import Displayable
from omnidyn.statement import NOTE, Statement, as_verdict

DRAWS, EVALUATIONS, NOISE = 3, 30, 0.005
MOST_DRAWS, MOST_EVALUATIONS = 1000, 10_000
FACTORS, FARTHEST = (4.0, 2.0), 16.0  # by which a setting is changed, round by round; and from the start at the most
MOST_RESTLESS = 2.0  # times the start: beyond, what voltages change by from step to step counts as an error
NEGLIGIBLE = (5e-5, 2e-4)  # [m], [rad] of an error that no robot can be told apart by
LEAST_GAIN = 0.03  # of J: what gains less is not taken
SECONDS, SKIP = 6.0, 1.0  # [s] that the paths below are followed for, and from the start that count for nothing
# Turning, through rest on all axes, and at rest: those of the search, and those that it has not seen.
TRAINING = ("eight:period_s={0},heading=turning,turn_rad_s={1}", "zigzag", "goal:x_m=0,travel_s=1,hold_s=5")
HELD_OUT = ("circle:period_s={0},turn_rad_s={1}", "goal:x_m=0.5,y_m=0.3,heading_rad=1.5,travel_s=3,hold_s=3")
PERIODS = (6.0, 12.0, 24.0, 48.0, 96.0)  # [s] of their first, the shortest that the robot can follow
TURNED = 3.6  # [rad] in a period
# Controller -> option -> the values that it may have.
TUNED: dict[str, dict[str, tuple[float, float]]] = {
    "pid": {"faster": (0.05, 1000.0), "integral": (0.01, 1.0)},
    "speed": {"faster": (0.05, 1000.0)},
    "mpc": {
        "push_walk": (0.0, 1e9),  # beside noise, which is best on a plant that is ours and not on another
        "pose_noise": (0.0, 1e9),
        "pose": (0.0, 1e9),
        "volts": (1e-9, 1e9),
        "horizon": (10, 60),
    },
}
Setting = float | tuple[float, ...]
Gains = Mapping[str, Setting]


class TuningScore(NamedTuple):
    """What gains come to over the robots.

    J; the mean rmse of position [m] and heading [rad], the worst position rmse [m]; restlessness [V].
    """

    cost: float
    mean: float
    heading: float
    worst: float
    restless: float


@dataclass(frozen=True, eq=False, repr=False)
class Tuned(Displayable):
    """What `tune` found.

    robot, paths, judged_on: names. controller: with the gains chosen, as a file has it. start: the gains it began with.
    before, after: of these and of those chosen, over robots, noise, pushes and paths that the search has not seen;
    tried: of the best of the search there. own_before, own_after: on the robot of the file itself.
    draws: robots the search drove; uncertain: whether the file says how far its numbers may be off: else they are near
    it. margins: of the loop with the gains chosen. evaluations: gains that were tried. noise [m/s], delay
    [steps], dt [s], sensors: of the loops.
    """

    robot: str
    paths: tuple[str, ...]
    judged_on: tuple[str, ...]
    controller: ControllerFile
    start: Gains
    before: TuningScore
    after: TuningScore
    tried: TuningScore
    own_before: TuningScore
    own_after: TuningScore
    draws: int
    uncertain: bool
    evaluations: int
    noise: float
    delay: int
    dt: float
    sensors: str
    margins: Margins

    def __repr__(self) -> str:
        return f"<Tuned {self.controller.controller} for {self.robot}: {dict(self.gains)}>"

    @property
    def gains(self) -> dict[str, Setting]:
        """The gains chosen."""
        return {name: self.controller.options[name] for name in self.start}

    @property
    def better(self) -> bool:
        """Whether they are better than those it began with, where the search has not been."""
        return self.after.cost < self.before.cost

    @property
    def verdict(self) -> Statement:
        """What tuning brought."""
        scores = {"before": self.before, "after": self.tried}
        numbers: dict[str, Any] = {name: score.mean for name, score in scores.items()}
        numbers |= {f"heading_{name}": score.heading for name, score in scores.items()}
        numbers |= {"less": 1.0 - self.tried.cost / self.before.cost, "evaluations": self.evaluations}
        if not self.better:
            return Statement("gains_kept", NOTE, self.controller.controller, numbers)
        changed = {name: value for name, value in self.gains.items() if value != self.start[name]}
        numbers |= {"names": [*changed], "gains": [*changed.values()]}
        return Statement("gains_tuned", NOTE, self.controller.controller, numbers)

    def statements(self) -> list[Statement]:
        """What was optimised, and what that gave up."""
        names = ("paths", "draws", "uncertain", "noise", "delay", "dt", "evaluations", "sensors")
        numbers = {name: getattr(self, name) for name in names} | {
            "resistance": RESISTANCE,
            "mass": MASS,
            "radius": RADIUS,
        }
        statements = [
            Statement("optimised", NOTE, numbers=numbers),
            Statement("tuned_margins", NOTE, numbers={"delay": self.margins.delay, "gain": self.margins.gain}),
            Statement("judged_elsewhere", NOTE, numbers={"paths": self.judged_on}),
        ]
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
        scores = (("before", self.own_before, self.before), ("tuned", self.own_after, self.after))
        rows = [
            (
                name,
                f"{1e3 * own_score.mean:.3f}",
                f"{1e3 * score.mean:.3f}",
                f"{1e3 * score.heading:.2f}",
                f"{1e3 * score.worst:.3f}",
                f"{score.restless:.3f}",
            )
            for name, own_score, score in scores
        ]
        head = ("", "this robot mm", "robots mm", "mrad", "worst mm", "change V")
        table, words = Table(head, rows, "<>", name="scores"), Points(self.statements(), "-", "statements")
        parts: list[Part] = [table, "", words, "", self.controller.to_toml()]
        return Document(parts, self.to_dict(), verdict=self.verdict)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        names = ("before", "after", "tried", "own_before", "own_after")
        scores = {name: getattr(self, name)._asdict() for name in names}
        return plain(
            {
                "robot": self.robot,
                "paths": self.paths,
                "judged_on": self.judged_on,
                "controller": self.controller.controller,
                "options": dict(self.controller.options),
                "start": dict(self.start),
                **scores,
                "draws": self.draws,
                "uncertain": self.uncertain,
                "sensors": self.sensors,
                "evaluations": self.evaluations,
                "better": self.better,
                "delay_margin_s": self.margins.delay,
                "gain_margin": self.margins.gain,
                "statements": self.statements(),
                **as_verdict(self.verdict),
            }
        )


def tune(
    robot: Robot,
    path: Any = None,
    controller: str = "pid",
    *,
    draws: int = DRAWS,
    evaluations: int = EVALUATIONS,
    progress: Progress = silent,
    **options: Unpack[TuneOptions],
) -> Tuned:
    """Find the settings of a controller by simulation, over the robots that the file says may be meant.

    Every path is driven free, and with pushes that come and go. Returns a Tuned, whose `controller` is what `track`
    reads from a file (`save_controller`); the settings it began with where none that was found is better. One robot in
    three acts 10 ms later, one 10 ms earlier with sensors a step worse; settings whose loop does not settle with 15 ms
    more of delay are not taken.

    Args:
        robot: The robot, its std and its sensors with it.
        path: A Path or what `omnidyn.path` takes; or a list of several. By default paths that turn, go through rest and
            stay there; what is found is then judged on others.
        controller: A name or a controller file: its options are where the search begins.
        draws: Robots that are driven.
        evaluations: Settings that are tried, at the most.
        progress: Hears what is being driven.
        options: Of the loop, by name, as for `track`: dt=0.02, duration, noise=0.005, delay=0, sensors, and rng=0, that
            of the draws and pushes too. Noise 0 and no delay make gains as large as dt allows.

    Raises InputError for a controller without gains, or a number out of range.

    >>> import omnidyn
    >>> tuned = omnidyn.tune(omnidyn.load_robot("axebot"), "circle", "speed", draws=1, evaluations=2, duration=0.5)
    >>> omnidyn.track(omnidyn.load_robot("axebot"), "circle", tuned.controller, duration=0.5).controller
    'speed'
    """
    paths: list[Any] = [] if path is None else list(path) if is_several(path) else [path]
    kinds = (Path, str) if isinstance(path, Robot) else object
    check_order("tune(robot, path, controller)", (robot, Robot), (paths, kinds), (controller, str))
    _check_counts(draws, evaluations, path is None or paths)
    seconds = options.get("duration", SECONDS if path is None else None)
    around = circumstances(robot, (*TuneOptions.__annotations__,), **{"noise": NOISE, **options, "duration": seconds})
    around = replace(around, skip=min(SKIP, 0.5 * (seconds or SECONDS)))
    kit, seed = around.sensors or instruments(None, robot), around.seed
    robot = with_sensors(robot, options.get("sensors"))
    spec = controller_spec(controller)
    start = _start(spec, robot, around.dt)
    follow, judged = [[path_named(item) for item in paths]] * 2 if paths else _paths(robot)
    uncertain = bool(uncertainty_of(robot).keys)
    training, held_out = (
        _variants(
            plausible(robot, draws, k) if uncertain else _near(robot, draws, k, 0.0 if kit.odometry else RADIUS), kit
        )
        for k in (seed, seed + 1)
    )
    count, rest = 0, math.inf

    def cost(gains: Gains) -> float:
        nonlocal count, rest
        count += 1
        progress(Report(f"trying {', '.join(f'{name} {_text(value)}' for name, value in gains.items())}"))
        score = _score(robot, training, follow, _with(spec, gains), around)
        rest = min(rest, MOST_RESTLESS * score.restless) if count == 1 else rest
        return score.cost * max(1.0, score.restless / rest) * (1.0 if is_steady(_with(spec, gains)) else UNSTEADY)

    def is_steady(settings: ControllerFile) -> bool:
        control = settings.make(robot, **told_of_loop(robot, around))
        return has_delay_margin(robot, control, around, LEAST_DELAY)

    begin = start if is_steady(_with(spec, start)) else _start(replace(spec, options={}), robot, around.dt)
    best = _search(begin, TUNED[spec.controller], cost, evaluations)
    old, new, fresh = _with(spec, start), _with(spec, best), replace(around, seed=seed + 1)
    before, tried = (_score(robot, held_out, judged, gains, fresh) for gains in (old, new))
    if tried.cost > (1.0 - LEAST_GAIN) * before.cost and (is_steady(old) or not is_steady(new)):
        new = old
    after = before if new is old else tried
    itself = [_Variant(robot, kit)]
    own_before, own_after = (_score(robot, itself, judged, gains, fresh) for gains in (old, new))
    margins = loop_margins(robot, new.make(robot, **told_of_loop(robot, around)), around)
    names, judged_names = (tuple(route.name for route in routes) for routes in (follow, judged))
    source = f"tuned for {robot.name} on {all_of(names)}, {draws} draws, seed {seed}"
    return Tuned(
        robot.name,
        names,
        judged_names,
        replace(new, source=source),
        start,
        before,
        after,
        tried,
        own_before,
        own_after,
        draws,
        uncertain,
        count,
        around.noise,
        around.delay,
        around.dt,
        str(kit),
        margins,
    )


def _check_counts(draws: int, evaluations: int, paths: Any) -> None:
    for name, value, largest in (("draws", draws, MOST_DRAWS), ("evaluations", evaluations, MOST_EVALUATIONS)):
        if not is_whole(value) or not 1 <= value <= largest:
            raise InputError("out of range", got=value, expected=f"1 to {largest}", where=name)
    if not paths:
        raise InputError("nothing to follow", got="no path", expected="a path, or several", where="path")


def _start(spec: ControllerFile, robot: Robot, dt: float) -> dict[str, Setting]:
    """The settings that are looked for, as they are at first. Raises InputError where a controller has none."""
    if spec.controller not in TUNED:
        raise InputError(
            "this controller has no gains",
            got=spec.controller,
            expected=" or ".join(TUNED),
            remedy="it follows from the robot alone",
            where="controller",
        )
    defaults = options_of(spec.controller)
    if "volts" in defaults:  # some follow from the robot
        defaults |= vars(Mpc(robot, dt=dt).robot_settings)
    values = {name: spec.options.get(name, defaults[name]) for name in TUNED[spec.controller]}
    return {name: tuple(value) if isinstance(value, list) else value for name, value in values.items()}


def _paths(robot: Robot) -> tuple[list[Path], list[Path]]:
    """Those of the search, and those that judge it: as fast as the robot can."""
    words = [(f"{period:g}", f"{TURNED / period:.3g}") for period in PERIODS]
    able = (pair for pair in words if path_demand(robot, TRAINING[0].format(*pair)).follows)
    period, turn = next(able, words[-1])
    training, held_out = ([path_named(name.format(period, turn)) for name in names] for names in (TRAINING, HELD_OUT))
    return training, held_out


LATENCY, LEAST_DELAY = 0.01, 0.015  # [s]
WORSE = 2.0  # times as few counts and new poses, as much noise
UNSTEADY = 1e3  # times the cost of settings without that delay margin


class _Variant(NamedTuple):
    """A robot that is driven, and with which it is measured."""

    plant: Robot
    kit: Instruments


def _variants(robots: Sequence[Robot], kit: Instruments) -> list[_Variant]:
    """Robots in loops that may be: a little later, a little earlier with worse sensors, as they are."""
    variants = []
    for k, robot in enumerate(robots):
        latency = max(0.0, robot.drive.latency + LATENCY * (1.0, -1.0, 0.0)[k % 3])
        plant = robot.replace(drive=robot.drive.replace(latency=latency))
        variants.append(_Variant(plant, _worse(kit) if k % 3 == 1 else kit))
    return variants


def _worse(kit: Instruments) -> Instruments:
    """Sensors a step worse."""
    sensors = kit.sensors
    names = ("gyro_noise", "gyro_bias", "pose_noise", "heading_noise")
    noise = {name: WORSE * value for name in names if (value := getattr(sensors, name)) is not None}
    fewer = {name: value / WORSE for name in ("pose_rate",) if (value := getattr(sensors, name)) is not None}
    counts = sensors.encoder_counts
    rounded = {} if counts is None else {"encoder_counts": max(1.0, round(counts / WORSE))}
    return replace(kit, sensors=sensors.replace(**noise, **fewer, **rounded))


RESISTANCE, MASS, RADIUS = 0.15, 0.1, 0.003  # by which a robot may be off whose file says nothing of that


def _near(robot: Robot, count: int, seed: int, radius: float) -> list[Robot]:
    """Robots near one: heavier or lighter, with stronger or weaker motors, and wheels whose radius is off.

    radius: share of it; 0 where the pose comes from these wheels alone: no setting makes good what that costs.
    """
    random, near = np.random.default_rng([seed, 2]), []
    even = (2.0 * np.arange(count) + 1.0) / count - 1.0  # few draws, but of all sizes
    off = np.stack([random.permutation(even) for _ in range(3)], axis=1)
    for motor, mass, size in (1.0 + off * (RESISTANCE, MASS, radius)).tolist():
        heavier = {name: _times(getattr(robot.body, name), mass) for name in ("mass", "inertia")}
        near.append(
            robot.replace(
                motor=robot.motor.replace(resistance=_times(robot.motor.resistance, motor)),
                body=robot.body.replace(**heavier),
                wheels=robot.wheels.replace(wheel_radius=_times(robot.wheels.wheel_radius, size)),
            )
        )
    return near


def _times(value: PerWheel, factor: float) -> PerWheel:
    """A number, or one for each wheel, times a factor."""
    return tuple(factor * number for number in value) if isinstance(value, tuple) else factor * value


def _search(
    start: Gains, bounds: Mapping[str, tuple[float, float]], cost: Callable[[Gains], float], evaluations: int
) -> Gains:
    """The best settings found: one after the other is changed by a factor, either way, as long as the cost falls."""
    best, least, left = start, cost(start), evaluations - 1
    for factor in FACTORS:
        for name, bound in bounds.items():
            for change in (factor, 1.0 / factor):
                value = _changed(best[name], change, bound)
                went = False
                while left > 0 and value != best[name] and _is_near(value, start[name]):
                    left -= 1
                    candidate = {**best, name: value}
                    found = cost(candidate)
                    if not found < (1.0 - LEAST_GAIN) * least:
                        break
                    best, least, went = candidate, found, True
                    value = _changed(value, change, bound)
                if went:
                    break
    return best


def _changed(value: Setting, factor: float, bound: tuple[float, float]) -> Setting:
    """A setting times a factor, within its bounds, to four digits; an integer stays one."""
    if isinstance(value, tuple):
        return tuple(float(f"{factor * number:.4g}") for number in value)
    changed = min(max(factor * value, bound[0]), bound[1])
    return round(changed) if isinstance(value, int) else float(f"{changed:.4g}")


def _is_near(value: Setting, start: Setting) -> bool:
    """Whether a setting is within FARTHEST times of that at the start, either way."""
    now, before = (entry[0] if isinstance(entry, tuple) else entry for entry in (value, start))
    return before <= FARTHEST * now * 1.01 and now <= FARTHEST * before * 1.01


def _text(value: Setting) -> str:
    """A setting in words."""
    numbers = value if isinstance(value, tuple) else (value,)
    return " ".join(f"{number:.4g}" for number in numbers)


def _with(spec: ControllerFile, gains: Gains) -> ControllerFile:
    return replace(spec, options={**spec.options, **gains})


def _score(
    robot: Robot, variants: Sequence[_Variant], paths: Sequence[Path], spec: ControllerFile, around: Circumstances
) -> TuningScore:
    """What a controller for one robot comes to when it drives the others, free and pushed."""
    control = spec.make(robot, **told_of_loop(robot, around))
    force = push_force(robot)
    rows: list[list[Tracking]] = []
    weights: list[float] = []
    for path in paths:
        for pushed in (False, True) if force.any() else (False,):
            row = []
            weights.append(PUSHED if pushed else 1.0)
            for k, (plant, kit) in enumerate(variants):
                seed = [around.seed, k, len(rows)]
                push = pushes(force, around.duration or path.duration, np.random.default_rng(seed)) if pushed else None
                number = int(np.random.default_rng(seed).integers(2**31))
                under = replace(around, seed=number, sensors=kit, **({} if push is None else {"push": push}))
                row.append(tracked(plant, path, control, under))
            rows.append(row)
    runs = [run for row in rows for run in row]
    squares = np.array([[_squares(run) for run in row] for row in rows]).mean(axis=1)
    logs = 0.5 * np.log(squares + np.square(NEGLIGIBLE)).mean(axis=1)
    errors = [run.rmse_position for run in runs]
    return TuningScore(
        math.exp(float(np.average(logs, weights=weights))),
        float(np.mean(errors)),
        float(np.mean([run.rmse_heading for run in runs])),
        max(errors),
        float(np.mean([run.restlessness for run in runs])),
    )


def _squares(tracking: Tracking) -> tuple[float, float]:
    """Squared errors of a run: of the position [m^2], of the heading [rad^2]."""
    return tracking.rmse_position**2, tracking.rmse_heading**2
