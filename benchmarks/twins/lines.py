"""What each twin must show: lines of figures against bounds, from logs whose numbers are known."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.table import Table
from benchmarks.twins.answers import (
    BY_DEFAULT,
    MOTOR_METHODS,
    NO_LINE,
    Answer,
    ask,
    contradictions,
    driver_map,
    examined,
)
from benchmarks.twins.worlds import CURVE, WORLDS, Twin, two_floors
from omnidyn.comparison.compare import compare
from omnidyn.logs.read_log import read_log
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import parse_robot

CLOSE, SHARE = 0.05, 0.9
AS_GOOD = 1.05  # times the error of the true model
LATE, WHEN, LEVEL = 0.010, 1.0, 0.1  # [s], [s], share of a level
WITHIN = "changes within a run"  # in an error
CROSSING, SINGLE, FALSE = 40, 100, 2  # runs over two floors, runs over one, alarms there
PUSH = "friction.direction.coulomb[{}]", "friction.wheels.coulomb[{}]"


@contextmanager
def made(name: str, seed: int) -> Iterator[Twin]:
    """A twin with its logs, as long as it is needed."""
    with tempfile.TemporaryDirectory() as folder:
        yield WORLDS[name](Path(folder), seed)


class Lines:
    """Rows of a table, one a line; a share meets its goal within one counting error of it."""

    def __init__(self, table: Table, twin: str) -> None:
        self._table, self._twin = table, twin

    def _add(self, goal: str, met: bool | None, **cells: Any) -> None:
        self._table.add(goal, met, twin=self._twin, **cells)

    def note(self, words: str) -> None:
        """A note under the table."""
        self._table.notes.append(f"{self._twin}: {words}")

    def at_most(self, what: str, values: Sequence[float | None], most: float, **how: Any) -> None:
        """The largest of numbers that must be small; None: the number is not there. how: `pick` another one than the
        largest, and how many `logs` there are."""
        known = [value for value in values if value is not None]
        missing = len(values) - len(known)
        value = float(how.get("pick", np.max)(known)) if known else None
        words = f"{what} (not there in {missing})" if missing else what
        met = not missing and value is not None and value <= most
        self._add(f"<= {most:g}", met, what=words, value=value, logs=how.get("logs", len(values)))

    def share(self, what: str, hits: Sequence[bool], least: float = SHARE) -> None:
        """The share of logs in which something holds."""
        count = max(len(hits), 1)
        value = sum(hits) / count
        met = value >= least - math.sqrt(least * (1.0 - least) / count) - 1e-9
        self._add(f">= {least:g}", bool(hits) and met, what=what, value=value, logs=len(hits))

    def told(self, what: str, value: float | None, logs: int) -> None:
        """A figure without a goal."""
        self._add("", None, what=what, value=value, logs=logs)


def offset_axis(lines: Lines, seeds: Sequence[int]) -> None:
    answers = _motors("offset_axis", seeds)
    for way in MOTOR_METHODS:
        seen = [(answer, truth) for answer, truth in answers[way]]
        names = {"inertia": "inertia", "slope": "viscous", "dead_band": "coulomb"}
        off = [_most(_off(answer.value(name), truth[true]) for name, true in names.items()) for answer, truth in seen]
        lines.at_most(f"M, Fv, Fc off by, {way}", off, CLOSE)
        lines.share(f"offset in its interval, {way}", [a.holds("offset", t["offset"]) for a, t in seen])
        _calm(lines, [answer for answer, _ in seen], way)


def late_motor(lines: Lines, seeds: Sequence[int]) -> None:
    answers = _motors("late_motor", seeds)
    for way in MOTOR_METHODS:
        seen = answers[way]
        lines.share(f"dead band in its interval, {way}", [a.holds("dead_band", t["dead_band"]) for a, t in seen])
        _calm(lines, [answer for answer, _ in seen], way)
    late = [(_latency(answer), truth["latency"]) for answer, truth in answers[BY_DEFAULT]]
    lines.told("latency off by, in ms, by default, largest", 1e3 * max(abs(x - y) for x, y in late), len(late))


def freewheeling_bridge(lines: Lines, seeds: Sequence[int]) -> None:
    answers = _motors("freewheeling_bridge", seeds)
    for way in MOTOR_METHODS:
        seen = answers[way]
        good = [_map_off(answer, truth) for answer, truth in seen]
        mapped = [off is not None and off <= CLOSE for off in good]
        lines.share(f"map within 5 % of the curve, {way}", mapped, 0.8)
        others = [answer for answer, hit in zip((a for a, _ in seen), mapped, strict=True) if not hit]
        said = [NO_LINE in answer.codes() for answer in others]
        if others:
            lines.share(f"said to be no line, of the others, {way}", said, 1.0)
        _calm(lines, [answer for answer, _ in seen], way)


def wrong_radius(lines: Lines, seeds: Sequence[int]) -> None:
    ratio, late, seconds = [], [], []
    for seed in seeds:
        seen = examined("wrong_radius", seed)
        assert seen.robot is not None
        true = true_robot(seen.robot, seen.truth)
        ratio.append(_ratio(seen.answer, true, seen.runs[1]) if seen.answer.found else None)
        late.append(_latency(seen.answer))
        seconds.append(seen.answer.seconds)
    share = [value is not None and value <= AS_GOOD for value in ratio]
    lines.share("free run of a second log <= 1.05 of the true robot's error", share)
    lines.at_most("... times the true robot's error, median", ratio, AS_GOOD, pick=np.median)
    lines.share("latency within 10 ms, or none", [value == 0.0 or abs(value - 0.02) <= LATE for value in late])
    lines.told("... latency in ms, median", 1e3 * float(np.median(late)), len(late))
    lines.told("processor time of a log, s, median", float(np.median(seconds)), len(seconds))


def true_robot(robot: Robot, truth: Mapping[str, float]) -> Robot:
    """The robot with the numbers that made its logs."""
    axes = robot.friction.axes
    levels = {name: tuple(truth[f"{name}{k}"] for k in range(3)) for name in ("viscous", "coulomb")}
    return robot.replace(
        body=robot.body.replace(inertia=truth["inertia"]),
        wheels=robot.wheels.replace(wheel_radius=truth["radius"]),
        drive=robot.drive.replace(latency=truth["latency"]),
        friction=robot.friction.replace(axes=axes.replace(**levels)),
    )


def _ratio(answer: Answer, true: Robot, run: Any) -> float:
    assert answer.found is not None
    ours, best = (compare(robot, run).rmse for robot in (answer.found.estimate.robot, true))
    return float(np.exp(np.mean([np.log(ours[name] / best[name]) for name in best])))


def floors(lines: Lines, seeds: Sequence[int]) -> None:
    """All runs of one study, as a user has them in a folder: as many seeds as ten of each, in tens."""
    share = len(seeds) / 10.0
    many = [
        _floor_study(max(round(share * count), 1), changes) for count, changes in ((CROSSING, True), (SINGLE, False))
    ]
    (answer, truths), (calm, singles) = many
    found = {moment["source"]: moment for moment in answer.record.get("moments", ())}
    pairs = [(found.get(name), truth) for name, truth in truths.items()]
    seen = [(moment, truth) for moment, truth in pairs if moment is not None]
    lines.share("change of floor found, in one study", [moment is not None for moment, _ in pairs])
    lines.share("... time within 1 s, of those", [abs(m["at"] - t["time"]) <= WHEN for m, t in seen])
    good = [max(abs(m["before"] / t["first"] - 1.0), abs(m["after"] / t["second"] - 1.0)) for m, t in seen]
    lines.share("... both levels within 10 %, of those", [off <= LEVEL for off in good])
    alarms = len(calm.record.get("moments", ())) if calm.record else None
    most = FALSE * len(singles) / SINGLE
    lines.at_most(
        "false alarms in runs of one floor",
        [None if alarms is None else float(alarms)],
        max(most, 1.0),
        logs=len(singles),
    )
    with made("two_floors", 0) as twin:
        robot = parse_robot(twin.robot)
        alone = ask([read_log(twin.logs[0], robot, current_unsigned=True)], robot)
    lines.share("said of a log alone", [bool(alone.record.get("moments")) or WITHIN in alone.error], 1.0)
    for error in filter(None, (answer.error, calm.error)):
        lines.note(error)


def _floor_study(count: int, changes: bool) -> tuple[Answer, dict[str, dict[str, float]]]:
    """(the answer, log -> its truth) of that many runs in one call."""
    with tempfile.TemporaryDirectory() as folder:
        truths, runs, robot = {}, [], None
        for seed in range(count):
            place = Path(folder) / f"{seed:03}"
            place.mkdir()
            twin = two_floors(place, seed, changes=changes)
            path = twin.logs[0].rename(Path(folder) / f"floors{seed:03}.csv")
            robot = robot or parse_robot(twin.robot)
            runs.append(read_log(path, robot, current_unsigned=True))
            truths[runs[-1].source] = twin.truth
        return ask(runs, robot), truths


def unequal_wheels(lines: Lines, seeds: Sequence[int]) -> None:
    """A round ellipse is a disc: there any form with a level of each wheel is the true one."""
    off, wheels, chosen = [], [], []
    for seed in seeds:
        with made("unequal_wheels", seed) as twin:
            robot = parse_robot(twin.robot)
            answer = ask([read_log(path, robot, current_unsigned=True) for path in twin.logs], robot)
            truth = twin.truth
            levels = [answer.value(PUSH[0].format(k)) or answer.value(PUSH[0].removesuffix("[{}]")) for k in range(2)]
            off.append(_most(_off(value, truth[axis]) for value, axis in zip(levels, "xy", strict=True)))
            each = [answer.value(PUSH[1].format(k)) or answer.value(PUSH[1].removesuffix("[{}]")) for k in range(3)]
            size = math.sqrt(truth["x"] * truth["y"])
            wheels.append(
                _most(abs(v - truth[f"wheel{k}"]) / size if v is not None else None for k, v in enumerate(each))
            )
            shape, round_ = answer.record.get("shape", ""), abs(truth["x"] / truth["y"] - 1.0) < CLOSE
            chosen.append("wheels" in shape and (round_ or "plain" in shape))
    lines.at_most("levels of the ellipse off by", off, CLOSE)
    lines.at_most("levels of the wheels off by, over that of the ellipse", wheels, CLOSE)
    lines.share("the plain ellipse with a level of each wheel is chosen", chosen)


TWINS: dict[str, Callable[[Lines, Sequence[int]], None]] = {
    "offset_axis": offset_axis, "wrong_radius": wrong_radius, "late_motor": late_motor, "two_floors": floors,
    "freewheeling_bridge": freewheeling_bridge, "unequal_wheels": unequal_wheels,
}  # fmt: skip


def _motors(name: str, seeds: Sequence[int]) -> dict[str, list[tuple[Answer, Mapping[str, float]]]]:
    """Way -> (answer, truth) of the first log of each seed."""
    every = {way: [examined(name, seed, way) for seed in seeds] for way in MOTOR_METHODS}
    return {way: [(one.answer, one.truth) for one in seen] for way, seen in every.items()}


def _calm(lines: Lines, answers: Sequence[Answer], way: str) -> None:
    """The share of answers that do not contradict themselves."""
    found = [contradictions(answer) for answer in answers]
    lines.share(f"no claims that exclude each other, {way}", [not words for words in found], 1.0)
    for words in dict.fromkeys(word for answer in found for word in answer):
        lines.note(f"{way}, in {sum(words in answer for answer in found)} of {len(found)} logs: {words}")
    for error in dict.fromkeys(answer.error for answer in answers if answer.error):
        lines.note(f"{way}: {error}")


def _map_off(answer: Answer, truth: Mapping[str, float]) -> float | None:
    """The largest error of the map over the top speed, at the duties of the curve; None where there is no map."""
    points = driver_map(answer)
    if not points:
        return None
    x, y = np.array(points).T
    true = np.array([truth[f"{duty:g}"] for duty in CURVE])
    return float(np.max(np.abs(np.interp([100.0 * duty for duty in CURVE], x, y) - true)) / true.max())


def _latency(answer: Answer) -> float:
    """The latency that was fitted [s], 0 where there is none."""
    numbers = {**answer.numbers, **answer.record.get("nuisances", {})}
    return next((n["value"] for name, n in numbers.items() if "latency" in name and n["value"] is not None), 0.0)


def _off(value: float | None, truth: float) -> float | None:
    return None if value is None else abs(value / truth - 1.0)


def _most(values: Any) -> float | None:
    known = list(values)
    return None if None in known else max(known)
