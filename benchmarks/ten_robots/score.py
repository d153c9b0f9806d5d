"""Ten robots examined as their owners meet them: `omnidyn init`, then one `omnidyn identify LOG`, against the truth.

A number that is reported as determined must hold the truth in its 95 % interval; what an independent information
matrix calls determined must be reported. K_t and the inertia of rotors show by the gear only: where the gear is not
determined they are compared at the gear of the file, as K_t l and J l^2. Seeds are numbers of logs.
"""

from __future__ import annotations

import contextlib
import io
import json
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.ten_robots.information import determined, numbers
from benchmarks.ten_robots.robots import Case, simulated, write_log
from benchmarks.ten_robots.world import World
from omnidyn.cli import main
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import load_robot, parse_robot

AXES = ("x", "y", "yaw")
GEAR, TORQUE, ROTOR = "motor.gear_ratio", "motor.torque_constant_Nm_A", "motor.rotor_inertia_kg_m2"


@dataclass
class Score:
    """Of one robot. held: number -> whether each interval holds the truth. asked, told: how many numbers the matrix
    determines, and how many of these were reported. skipped: reported numbers without a truth to compare with.
    exits: of identify, of each log. seconds: of processor time. words: what went wrong."""

    case: str
    held: dict[str, list[bool]] = field(default_factory=lambda: defaultdict(list))
    asked: dict[str, int] = field(default_factory=lambda: defaultdict(int))
    told: dict[str, int] = field(default_factory=lambda: defaultdict(int))
    skipped: set[str] = field(default_factory=set)
    exits: list[int] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    words: list[str] = field(default_factory=list)

    @property
    def pooled(self) -> float:
        """Share of all intervals that hold the truth."""
        every = [each for found in self.held.values() for each in found]
        return float(np.mean(every)) if every else float("nan")

    @property
    def worst(self) -> tuple[str, float]:
        """The number whose intervals hold the truth least often."""
        shares = {name: float(np.mean(found)) for name, found in self.held.items()}
        return min(shares.items(), key=lambda each: each[1]) if shares else ("", float("nan"))

    @property
    def reported(self) -> float:
        """Share of what the matrix determines that was reported as determined."""
        asked = sum(self.asked.values())
        return sum(self.told.values()) / asked if asked else float("nan")


def score(case: Case, seeds: Iterable[int]) -> Score:
    """Logs of a robot, each by itself, from what `init` wrote."""
    found = Score(case.name)
    with tempfile.TemporaryDirectory() as folder:
        robot, log = Path(folder) / "mine.toml", Path(folder) / "log.csv"
        code, _, err = _command("init", "mine", *case.init, "-o", str(robot))
        if code:
            found.words.append(f"init: {_last(err)}")
            return found
        start = load_robot(robot)
        asked: set[str] = set()
        stds = {key: (value, prior.std) for key, value, prior in _guesses(start) if prior.std is not None}
        for seed in seeds:
            write_log(case, seed, log)
            began = time.process_time()
            code, out, err = _command("identify", str(log), "--robot", str(robot), "--json", *case.facts)
            found.seconds.append(time.process_time() - began)
            found.exits.append(code)
            asked = asked or determined(case, _driven(case, seed), stds)  # one log stands for all: they are of a kind
            for key in asked:
                found.asked[key] += 1
            if not out.strip():
                found.words.append(f"log {seed}: exit {code}: {_last(err)}")
                continue
            _compare(found, case.world, json.loads(out), asked)
    return found


def _command(*arguments: str) -> tuple[int, str, str]:
    """(exit code, stdout, stderr) of one command, in this process."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main(list(arguments))
    return code, out.getvalue(), err.getvalue()


def _last(text: str) -> str:
    lines = [line for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else "no words"


def _guesses(robot: Robot) -> list[tuple[str, float, Any]]:
    from omnidyn.model.keys import Key

    return [(key, float(Key.parse(key).get(robot)), prior) for key, prior in robot.priors.items() if prior.std]


def _driven(case: Case, seed: int) -> np.ndarray:
    """What `drive` is given for a log: volts, or set speeds."""
    _, asked, battery = simulated(case, seed)
    return asked / 255.0 * battery[:, None] if case.sensors.duty else asked


def _compare(found: Score, world: World, answer: Mapping[str, Any], asked: set[str]) -> None:
    """Intervals against the truth."""
    fitted = parse_robot(answer["robot"])
    lost = set(answer["unidentifiable"])
    true = truths(world, fitted, GEAR in lost or GEAR not in answer["parameters"])
    for key, own in answer["parameters"].items():
        if key in lost:
            continue
        found.told[key] += key in asked
        _hold(found, key, own["ci95"], true.get(key))
    for one in answer["combinations"]:
        _hold(found, one["name"], one["ci95"], true.get(one["name"]))


def _hold(found: Score, name: str, interval: Any, true: float | None) -> None:
    if true is None or interval[0] is None or interval[1] is None:
        found.skipped.add(name)
    else:
        found.held[name].append(bool(interval[0] <= true <= interval[1]))


def truths(world: World, fitted: Robot, at_its_gear: bool) -> dict[str, float]:
    """Key, or name of a combination -> truth. at_its_gear: the gear is the file's, so that only products compare."""
    true = {number.key: number.of(world) for number in numbers(world)}
    if at_its_gear:
        share = world.gear_ratio / float(np.mean(fitted.motor.gear_ratio))
        true[TORQUE] *= share
        if ROTOR in true:
            true[ROTOR] *= share**2
    drive = world.G * world.push
    patterns = np.linalg.pinv(drive)
    patterns = patterns / np.abs(patterns).max(axis=0)
    braking = np.einsum("ai,i,ai->a", world.G, world.push * world.emf, world.G)
    for k, axis in enumerate(AXES):
        true[f"push.{axis}"] = float(drive[k] @ patterns[:, k])
        true[f"damping.{axis}"] = float(braking[k] + world.viscous[k])
    return true
