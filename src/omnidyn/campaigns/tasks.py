"""Tasks: what is done with a sample, and what is measured of it: a closed loop, a simulation, a fit, or a function.

A function takes a Sample and returns its numbers by name. Whatever it is, it must depend on the sample alone: then any
machine gives the same bytes.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from omnidyn.arguments import unknown_option
from omnidyn.arrays import FloatArray
from omnidyn.campaigns.design import numbers, points, sample_count, seed_of
from omnidyn.campaigns.fits import LOG, Row, check_fit, fit_row
from omnidyn.campaigns.spec import INPUTS, IdentifyTask, SimulateTask, Spec, TrackTask
from omnidyn.control.circumstances import Circumstances
from omnidyn.control.closed_loop import told_of_loop, tracked
from omnidyn.control.controller import Controller
from omnidyn.control.controllers import ControllerFile, check_options, controller_spec
from omnidyn.control.instruments import instruments
from omnidyn.control.paths.motion import Path as Route
from omnidyn.control.paths.path import path as path_named
from omnidyn.errors import InputError
from omnidyn.logs.command_file import KINDS, HeldCommands, read_commands
from omnidyn.model.keys import Key, expand
from omnidyn.model.known.breakaway_levels import holding
from omnidyn.model.known.uncertainty import Draws
from omnidyn.model.motor import settled_current
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate

SETTLED = 0.02  # of the final speed: the twist of a simulation has settled within it
FAR = 3.0  # std that a normal is taken to reach
ON_LIMIT = 1e-9  # of a limit: so near, it is met
TRACK_METRICS = (
    "rmse_position_m",
    "worst_position_m",
    "final_position_m",
    "rmse_heading_rad",
    "settling_s",
    "saturated_share",
    "effort_V",
    "restlessness_V",
    "energy_J",
)
SIMULATE_METRICS = (
    "final_vx_m_s",
    "final_vy_m_s",
    "final_omega_rad_s",
    "drift_m",
    "turned_rad",
    "settling_s",
    "saturated_share",
    "energy_J",
)
OWNERS = {"path": "track", "controller": "track", "robot": "identify", LOG: "identify"}  # what varies of which task
_FIELD = re.compile(r"(\w+)(?:\[(\d+)\])?", re.ASCII)


@dataclass(frozen=True)
class CampaignSample:
    """A sample: its index, the robot as it is varied, all its values by key, and a seed of its own."""

    index: int
    robot: Robot
    values: Mapping[str, Any]
    seed: int


Function = Callable[[CampaignSample], Mapping[str, float]]


@dataclass(frozen=True, eq=False)
class LoadedSpec:
    """A spec with the files that it names, read from a folder. function: the task of a user, in place of its tables.

    hashes: file of a log -> sha256 that it had when the campaign began; empty before it has.
    """

    spec: Spec
    folder: Path
    function: Function | None = None
    hashes: Mapping[str, str] = field(default_factory=dict)

    @cached_property
    def robot(self) -> Robot:
        """The robot of the file."""
        return load_robot(self.name_of(self.spec.robot))

    def name_of(self, text: str) -> str:
        """Where a file of the spec stands; another text as it is."""
        return str(self.folder / text) if text.startswith(INPUTS) else text

    @cached_property
    def draws(self) -> Draws | None:
        """The robots that the file says may be meant, where they are drawn."""
        return Draws(self.robot, sample_count(self.spec), self.spec.seed) if self.spec.robot_draws else None

    @cached_property
    def keys(self) -> dict[str, tuple[Key, ...]]:
        """Variable -> the numbers of the robot that it stands for; none for what is no key of the robot file."""
        keys = {}
        for name in self.spec.vary:
            head = name.partition(".")[0]
            other = head in (*OWNERS, "track", "simulate", "identify", "sensors", "task")
            keys[name] = () if other else tuple(map(Key.parse, expand(name, self.robot)))
        return keys

    @cached_property
    def ends(self) -> dict[str, tuple[float, float, float] | None]:
        """Variable -> its low end, what the file says (of a factor 1, else the middle), its high end; None: values."""
        ends = dict[str, tuple[float, float, float] | None]()
        for name, variable in self.spec.vary.items():
            nominal = self.keys[name][0].get(self.robot) if len(self.keys[name]) == 1 else None
            if variable.std is not None and nominal is not None:
                ends[name] = (nominal - FAR * variable.std, nominal, nominal + FAR * variable.std)
            elif variable.ends is None:
                ends[name] = None
            else:
                (low, high), centre = variable.ends, 1.0 if variable.factor else nominal
                inside = centre is not None and low <= centre <= high
                ends[name] = (low, centre if centre is not None and inside else 0.5 * (low + high), high)
        return ends

    def check(self) -> None:
        """Raises InputError for a key that nothing has, a word that names nothing, or a first sample that cannot be."""
        tables = {"track": self.spec.track, "simulate": self.spec.simulate, "identify": self.spec.identify}
        tasks = {**tables, "task": self.function}
        if not any(tasks.values()):
            expected = "a table [track], [simulate] or [identify], or task=function in Python"
            raise InputError("no task", expected=expected)
        for name, variable in self.spec.vary.items():
            head = name.partition(".")[0]
            owner = OWNERS.get(head, head)
            if owner in tasks and tasks[owner] is None:
                raise InputError(f"no [{owner}] that could be varied", got=name, where="[vary]")
            if variable.factor is not None and not self.keys[name]:
                raise InputError(
                    "not a number of the robot file", got="a factor", expected="a range", where=f"[vary] {name}"
                )
            if variable.std is not None and len(self.keys[name]) != 1:
                raise InputError(
                    "not one number of the robot file", got="a std", expected="a factor", where=f"[vary] {name}"
                )
            for word in variable.values or ():
                self._check_word(name, word)
        if self.spec.identify is not None and self.function is None:
            self._check_fits(self.spec.identify)
            return
        self._check_metrics()
        for sample in self.samples(0, 1):
            self._check_sample(sample)

    def _check_fits(self, task: IdentifyTask) -> None:
        """Everything that varies, with the first log."""
        if self.spec.metrics:
            raise InputError("a fit keeps all its numbers", got="metrics", expected="none", remedy="leave it out")
        for sample in self.samples(0, sample_count(self.spec) // len(task.logs)):
            check_fit(self._fit_task(sample, task), sample.robot)

    def _fit_task(self, sample: CampaignSample, base: IdentifyTask) -> IdentifyTask:
        """[identify] of a sample, the map by where it stands."""
        task: IdentifyTask = _changed(base, "identify", sample.values)
        return task.replace(map=self.name_of(task.map))

    def _check_metrics(self) -> None:
        metric_names = TRACK_METRICS if self.spec.track is not None else SIMULATE_METRICS
        for name in self.spec.metrics if self.function is None else ():
            if name not in metric_names:
                raise unknown_option("the task", name, metric_names, "metrics")

    def _check_word(self, name: str, word: Any) -> None:
        if name == "path":
            path_named(self.name_of(str(word)))
        if name == "controller":
            controller_spec(self.name_of(str(word)))

    def _check_sample(self, sample: CampaignSample) -> None:
        if self.function is None and self.spec.track is not None:
            ClosedLoop.of(self, sample, self.spec.track)
        elif self.function is None and self.spec.simulate is not None:
            commands_of(self, sample, self.spec.simulate)

    def columns(self, start: int, stop: int) -> dict[str, Any]:
        """What varies, of the samples start to stop: a column for each variable."""
        place = points(self.spec, start, stop)
        nominal = [keys[0].get(self.robot) if len(keys) == 1 else 0.0 for keys in self.keys.values()]
        triples = zip(self.spec.vary.items(), place.T, nominal, strict=True)
        return {name: numbers(variable, u, value) for (name, variable), u, value in triples}

    def samples(self, start: int, stop: int) -> Iterator[CampaignSample]:
        """The samples start to stop."""
        columns = self.columns(start, stop)
        plain = {
            name: column.tolist() if isinstance(column, np.ndarray) else column for name, column in columns.items()
        }
        for k in range(stop - start):
            values = {name: column[k] for name, column in plain.items()}
            robot = self.robot if self.draws is None else self.draws.robot(start + k)
            if "robot" in values:
                robot = load_robot(self.name_of(str(values["robot"])))
            yield CampaignSample(start + k, self._varied(robot, values), values, seed_of(self.spec, start + k))

    def _varied(self, robot: Robot, values: Mapping[str, Any]) -> Robot:
        """The robot of a sample."""
        for name, value in values.items():
            relative = self.spec.vary[name].factor is not None
            for key in self.keys[name]:
                robot = with_number(robot, key, value * key.get(robot) if relative else value)
            if name.startswith("sensors."):
                table = robot.sensor_model.model_dump(by_alias=True) | {name.removeprefix("sensors."): value}
                robot = robot.replace(sensors=table)
        return robot

    def fit(self, sample: CampaignSample) -> Row:
        """What a fit says."""
        assert self.spec.identify is not None
        task = self._fit_task(sample, self.spec.identify)
        return fit_row(str(sample.values[LOG]), sample.robot, task, self.hashes)

    def measure(self, sample: CampaignSample) -> dict[str, float]:
        """What is measured of a sample, by name."""
        if self.function is not None:
            measured = _checked(self.function(sample))
        elif self.spec.track is not None:
            measured = ClosedLoop.of(self, sample, self.spec.track).measure()
        else:
            assert self.spec.simulate is not None
            measured = _simulated(self, sample, self.spec.simulate)
        return {name: measured[name] for name in self.spec.metrics or measured}


def with_number(robot: Robot, key: Key, value: float) -> Robot:
    """The robot with one number changed; breakaway stays at least the Coulomb level. Raises InputError out of range."""
    if not key.level:
        return key.set(robot, value)
    robot = holding(key.set(robot, value, checked=False))
    getattr(robot.friction, key.table.rpartition(".")[2]).replace()
    return robot


def _checked(measured: Any) -> dict[str, float]:
    """Numbers by name, as a function of a user gives them."""
    if not isinstance(measured, Mapping) or not measured:
        raise InputError("a task returns numbers by name", got=type(measured).__name__, expected="{'name': number, ..}")
    return {str(name): float(value) for name, value in measured.items()}


def _options(head: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """The values whose key begins with a head, without it."""
    return {name.removeprefix(f"{head}."): value for name, value in values.items() if name.startswith(f"{head}.")}


def _changed(task: Any, head: str, values: Mapping[str, Any]) -> Any:
    """The table of a task with the values of a sample in it."""
    table = task.model_dump(by_alias=True)
    for name, value in _options(head, values).items():
        match = _FIELD.fullmatch(name)
        field, index = (match[1], match[2]) if match else (name, None)
        if index is None:
            table[field] = value
        else:
            rows = list(table.get(field) or ())
            if int(index) >= len(rows):
                raise InputError("no such entry", got=name, expected=f"an entry of {len(rows)}", where=f"[{head}]")
            rows[int(index)] = value
            table[field] = rows
    try:
        return type(task)(**table)
    except InputError as error:
        raise error.at(f"[{head}]") from None


@dataclass(frozen=True, eq=False)
class ClosedLoop:
    """A closed loop: the controller believes in the robot of the file, and drives that of the sample."""

    plant: Robot
    route: Route
    spec: ControllerFile
    believed: Robot
    around: Circumstances
    settling: float

    @classmethod
    def of(cls, problem: LoadedSpec, sample: CampaignSample, base: TrackTask) -> ClosedLoop:
        """Of a sample."""
        task: TrackTask = _changed(base, "track", sample.values)
        route = path_named(
            problem.name_of(str(sample.values.get("path", task.path))), **_options("path", sample.values)
        )
        spec = controller_spec(problem.name_of(str(sample.values.get("controller", task.controller))))
        options = _options("controller", sample.values)
        check_options(spec.controller, options)
        spec = replace(spec, options={**spec.options, **options})
        seed = sample.seed if task.seed is None else task.seed
        around = Circumstances(task.dt, task.duration, task.skip, task.noise, task.delay, seed)
        around = replace(around, sensors=instruments(task.sensors or None, sample.robot))
        return cls(sample.robot, route, spec, problem.robot, around, task.settling)

    def controller(self) -> Controller:
        """A new one, which has seen nothing."""
        return self.spec.make(self.believed, **told_of_loop(self.believed, self.around))

    def measure(self) -> dict[str, float]:
        """How near it came, and at what expense."""
        tracking = tracked(self.plant, self.route, self.controller(), self.around)
        off = np.hypot(*tracking.error[:, :2].T)
        measured = (
            tracking.rmse_position,
            tracking.worst_position,
            float(off[-1]),
            tracking.rmse_heading,
            settled_from(tracking.run.t, off, self.settling),
            tracking.saturated_share,
            tracking.effort,
            tracking.restlessness,
            energy(self.plant, tracking.run),
        )
        return dict(zip(TRACK_METRICS, measured, strict=True))


def commands_of(problem: LoadedSpec, sample: CampaignSample, base: SimulateTask) -> HeldCommands:
    """What a simulation of a sample is given."""
    task: SimulateTask = _changed(base, "simulate", sample.values)
    if task.voltage is None:
        held = read_commands(problem.name_of(task.voltages), sample.robot.wheels.count, task.duration)
        return replace(held, rows=task.scale * held.rows)
    assert task.duration is not None
    rows = max(1, round(task.duration / task.dt))
    volts = np.tile(task.scale * np.array(task.voltage), (rows, 1))
    return HeldCommands(KINDS[0], volts, np.full(rows, task.duration / rows), 0.0, "")


def _simulated(problem: LoadedSpec, sample: CampaignSample, base: SimulateTask) -> dict[str, float]:
    """Where a robot comes to under given commands."""
    held = commands_of(problem, sample, base)
    applied: dict[str, Any] = {held.kind: held.rows, "dt": held.dt, "supply": held.supply}
    run = simulate(sample.robot, **applied)
    assert run.twist is not None
    assert run.pose is not None
    assert run.voltage is not None
    moved, last = run.pose[-1] - run.pose[0], run.twist[-1]
    rim = np.array([1.0, 1.0, float(np.mean(sample.robot.wheels.robot_radius))])
    off = np.linalg.norm((run.twist - last) * rim, axis=1)
    limit = np.asarray(sample.robot.motor.voltage_limit)
    measured = (
        *last.tolist(),
        float(np.hypot(*moved[:2])),
        float(moved[2]),
        settled_from(run.t, off, SETTLED * float(np.linalg.norm(last * rim))),
        float(np.mean((abs(run.voltage[:-1]) >= limit * (1.0 - ON_LIMIT)).any(axis=1))),
        energy(sample.robot, run),
    )
    return dict(zip(SIMULATE_METRICS, measured, strict=True))


def settled_from(t: FloatArray, off: FloatArray, bound: float) -> float:
    """Time from which on `off` stays within a bound [s]; NaN where it ends beyond it."""
    beyond = np.flatnonzero(off > bound)
    if not beyond.size:
        return float(t[0])
    return float(t[beyond[-1] + 1]) if beyond[-1] + 1 < len(t) else float("nan")


def energy(robot: Robot, run: Run) -> float:
    """Electrical energy into the motors, sum over rows of u i dt [J], i settled at the mean wheel speed of the row."""
    assert run.voltage is not None
    assert run.wheel_speed is not None
    volts, speed = run.voltage[:-1], 0.5 * (run.wheel_speed[1:] + run.wheel_speed[:-1])
    power = np.sum(volts * settled_current(robot.motor, volts, speed), axis=1)
    return float(power @ np.diff(run.t))
