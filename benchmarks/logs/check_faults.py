"""Twelve faults to put into clean logs (tests/support/random_logs.py), with sizes from a published range.

A fault goes into a log either before the simulation (saturation, sag) or into what was recorded.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from omnidyn.findings.finding import Verdict
from omnidyn.logs.log import Log
from omnidyn.model.robot import Robot
from tests.support.random_logs import FloatArray, Rng, Scene, plain, play, program, random_scene, record


class Fault(NamedTuple):
    """A fault. range: of its size, with unit; larger is worse. needs: what the scene must have. put: makes the log.

    found: whether a verdict names it, given what was broken.
    """

    low: float
    high: float
    unit: str
    needs: Callable[[Scene], bool]
    put: Callable[[Rng, Scene, float], tuple[Log, Scene, dict] | None]
    found: Callable[[Verdict, dict], bool]
    also: tuple[str, ...] = ()  # codes that are true consequences of it


def _named(verdict: Verdict, codes: tuple[str, ...], where: str) -> bool:
    return any(f.code in codes and set(f.subject.split()) == set(where.split()) for f in verdict.findings)


def _full_floor(scene: Scene) -> bool:
    return scene.has_speed and scene.floor in ("twist", "pose")


def _any_check(scene: Scene) -> bool:
    return _full_floor(scene) or (scene.has_speed and scene.has_current)


LETTER = {"voltage": "u", "duty": "d", "current": "i", "wheel_speed": "w"}


def _columns(rng: Rng, scene: Scene, log: Log) -> list[str]:
    """A channel whose wiring the log can show, or all of them: a motor at the wrong place."""
    drive = scene.drive
    choices = [["wheel_speed"]]
    if scene.has_current and scene.has_speed:
        choices += [[drive], ["current"]]
    if _full_floor(scene):
        choices += [[name for name in ("voltage", "duty", "current", "wheel_speed") if name in log.channels]]
    return choices[rng.integers(len(choices))]


def _where(names: list[str], wheels: list[int]) -> str:
    letter = LETTER[names[0]] if len(names) == 1 else "w"
    return " ".join(f"{letter}{k + 1}" for k in wheels)


def _changed(log: Log, **channels: FloatArray) -> Log:
    return replace(log, channels={**log.channels, **channels})


def put_swapped(rng: Rng, scene: Scene, size: float):
    log = plain(rng, scene)
    names = _columns(rng, scene, log)
    a, b = rng.choice(scene.robot.wheels.count, 2, replace=False)
    order = np.arange(scene.robot.wheels.count)
    order[[a, b]] = b, a
    for name in names:
        change = log.channels[name][:, a] - log.channels[name][:, b]
        if np.sqrt(np.mean(change**2)) < 0.2 * np.sqrt(np.mean(log.channels[name] ** 2)):
            return None  # the robot turns on the spot: the two do the same
    broken = {name: log.channels[name][:, order] for name in names}
    return _changed(log, **broken), scene, {"where": _where(names, [a, b])}


def put_inverted(rng: Rng, scene: Scene, size: float):
    log = plain(rng, scene)
    names = _columns(rng, scene, log)
    k = int(rng.integers(scene.robot.wheels.count))
    sign = np.ones(scene.robot.wheels.count)
    sign[k] = -1.0
    for name in names:
        if np.sqrt(np.mean(log.channels[name][:, k] ** 2)) < 0.2 * np.sqrt(np.mean(log.channels[name] ** 2)):
            return None  # that wheel hardly turns
    broken = {name: log.channels[name] * sign for name in names}
    return _changed(log, **broken), scene, {"where": _where(names, [k])}


def put_rpm(rng: Rng, scene: Scene, size: float):
    log = plain(rng, scene)
    return _changed(log, wheel_speed=log.channels["wheel_speed"] * 60.0 / (2.0 * np.pi)), scene, {}


def put_lag(rng: Rng, scene: Scene, size: float):
    log = plain(rng, scene)
    names = ["wheel_speed"] if _full_floor(scene) else []
    names += ["twist"] if scene.floor == "twist" and scene.has_speed else []
    names += ["current"] if scene.has_current and scene.has_speed else []
    name = names[rng.integers(len(names))]
    late = np.vstack([log.channels[name][:1], log.channels[name][:-1]])
    return _changed(log, **{name: late}), scene, {"name": name}


def found_lag(verdict: Verdict, broken: dict) -> bool:
    names = {"wheel_speed": ("wheel_speed", "current"), "twist": ("twist",), "current": ("current",)}[broken["name"]]
    return any(f.code == "lag" and any(name in f.subject for name in names) for f in verdict.findings)


def put_gap(rng: Rng, scene: Scene, size: float):
    log = plain(rng, scene)
    at = int(rng.integers(20, len(log) - 20 - int(size)))
    keep = np.ones(len(log), dtype=bool)
    keep[at : at + int(size)] = False
    line = int(log.lines[at - 1])
    return log.rows(keep), scene, {"line": line}


def found_gap(verdict: Verdict, broken: dict) -> bool:
    return any(f.code == "gap" and any(a == broken["line"] for a, _ in f.rows) for f in verdict.findings)


def put_repeats(rng: Rng, scene: Scene, size: float):
    log = plain(rng, scene)
    rows = rng.choice(np.arange(5, len(log) - 5), int(size), replace=False)
    t = log.t.copy()
    for row in np.sort(rows):
        t[row] = t[row - 1]
    return replace(log, t=t), scene, {"count": int((np.diff(t) == 0.0).sum())}


def found_repeats(verdict: Verdict, broken: dict) -> bool:
    return any(f.code == "time_repeats" and f.count == broken["count"] for f in verdict.findings)


def put_saturation(rng: Rng, scene: Scene, size: float):
    """Commands beyond the limit in `size` % of the rows, clipped by the driver."""
    seed = int(rng.integers(2**32))
    n, dt = round(scene.seconds * scene.rate), 1.0 / scene.rate
    sub = np.random.default_rng(seed)
    sub.normal(size=n)
    share = np.abs(program(sub, scene, n, dt)).max(axis=1)
    level = float(np.quantile(share, 1.0 - size / 100.0))
    if level < 0.05:
        return None
    driven = replace(scene, amplitude=scene.amplitude / level, clip=1.0)
    truth = play(np.random.default_rng(seed), driven)
    return record(rng, driven, truth), driven, {"share": float((np.abs(truth.share) >= 0.997).any(axis=1).mean())}


def found_saturation(verdict: Verdict, broken: dict) -> bool:
    return any(
        f.code == "saturation" and abs(f.numbers["share"] - broken["share"]) < 0.01 + 0.3 * broken["share"]
        for f in verdict.findings
    )


def put_sag(rng: Rng, scene: Scene, size: float):
    weak = replace(scene, sag=size / 100.0, drive="duty")
    return record(rng, weak, play(rng, weak)), weak, {"drop": size / 100.0}


def found_sag(verdict: Verdict, broken: dict) -> bool:
    return any(
        f.code == "sag" and abs(f.numbers["drop"] - broken["drop"]) < 0.02 + 0.4 * broken["drop"]
        for f in verdict.findings
    )


def put_slip(rng: Rng, scene: Scene, size: float):
    """The floor sees less than the wheels roll: for 2 s or more, up to 60 % of the log; or (1 in 4) all of it."""
    truth = play(rng, scene)
    rows, t = len(truth.run), truth.run.t
    slip = np.ones(rows)
    everywhere = bool(rng.random() < 0.25)
    length = rng.uniform(2.0, max(2.5, 0.6 * scene.seconds))
    start = rng.uniform(0.0, t[-1] - length)
    inside = (t >= start) & (t < start + length) | everywhere
    slip[inside] = 1.0 - size / 100.0
    assert truth.run.wheel_speed is not None
    path = np.abs(truth.run.wheel_speed).sum(axis=1)
    if path[inside].sum() < 0.05 * path.sum():
        return None  # it stands there
    return record(rng, scene, truth, slip), scene, {"everywhere": everywhere, "from": start, "to": start + length}


def found_slip(verdict: Verdict, broken: dict) -> bool:
    for f in verdict.findings:
        if broken["everywhere"]:
            if f.code in ("slip", "path_ratio") and "rows" not in f.numbers and f.numbers.get("from_s") is None:
                return True
        elif f.code == "slip" and "from_s" in f.numbers:
            shared = min(f.numbers["to_s"], broken["to"]) - max(f.numbers["from_s"], broken["from"])
            if shared > 0.5 * (broken["to"] - broken["from"]):
                return True
    return False


def put_stuck(rng: Rng, scene: Scene, size: float):
    """A wheel's speed keeps its value for `size` seconds, from a row where that wheel turns."""
    truth = play(rng, scene)
    log = record(rng, scene, truth)
    speed = log.channels["wheel_speed"].copy()
    k, rows = int(rng.integers(speed.shape[1])), max(5, round(size * scene.rate))
    turning = np.flatnonzero(np.abs(speed[: -rows - 5, k]) > 0.2 * np.abs(speed[:, k]).max())
    if not turning.size:
        return None
    a = int(rng.choice(turning))
    before = speed[a : a + rows, k].copy()
    speed[a : a + rows, k] = speed[a, k]
    if np.abs(before - speed[a, k]).max() < 0.05 * np.abs(speed[:, k]).max():
        return None  # it would have read the same
    return _changed(log, wheel_speed=speed), scene, {"where": f"w{k + 1}"}


def put_dead(rng: Rng, scene: Scene, size: float):
    """A sensor or a wheel's column that gives `size` times its noise about 0 for the whole log; 0 is a flat line."""
    log = plain(rng, scene)
    names = ["wheel_speed"] if scene.has_speed else []
    names += ["current"] if scene.has_current and scene.has_speed else []
    name = names[rng.integers(len(names))]
    values = log.channels[name].copy()
    k = int(rng.integers(values.shape[1]))
    values[:, k] = 0.0
    return _changed(log, **{name: values}), scene, {"where": f"{LETTER[name]}{k + 1}"}


def put_gear(rng: Rng, scene: Scene, size: float):
    """The log was made with a gear ratio that is off by +-size %."""
    log = plain(rng, scene)
    off = 1.0 + rng.choice([-1.0, 1.0]) * size / 100.0
    return _changed(log, wheel_speed=log.channels["wheel_speed"] * off), scene, {"ratio": 1.0 / off}


def found_gear(verdict: Verdict, broken: dict) -> bool:
    for f in verdict.findings:
        if f.code in ("gear", "path_ratio"):
            value = f.numbers.get("ratio", f.numbers.get("floor_ratio", f.numbers.get("electric_ratio", np.nan)))
            if abs(value - broken["ratio"]) < 0.02:
                return True
    return False


FAULTS: dict[str, Fault] = {
    "swapped motor": Fault(
        1, 1, "two columns", _any_check, put_swapped, lambda v, b: _named(v, ("swapped",), b["where"])
    ),
    "inverted sign": Fault(
        1, 1, "one column", _any_check, put_inverted, lambda v, b: _named(v, ("inverted",), b["where"])
    ),
    "rpm as rad/s": Fault(
        1,
        1,
        "9.55 times",
        lambda s: s.has_speed,
        put_rpm,
        lambda v, b: any(f.code == "unit" and "rpm" in str(f) for f in v.findings),
    ),
    "one-sample lag": Fault(1, 1, "row", _any_check, put_lag, found_lag),
    "gap": Fault(3, 200, "rows", lambda s: True, put_gap, found_gap),
    "repeated stamps": Fault(1, 20, "rows", lambda s: True, put_repeats, found_repeats),
    "saturation": Fault(2, 40, "% of rows", lambda s: True, put_saturation, found_saturation),
    "sag": Fault(5, 30, "%", lambda s: True, put_sag, found_sag),
    "slip": Fault(5, 50, "% of the path", _full_floor, put_slip, found_slip, ("path_ratio", "robot_radius")),
    "stuck encoder": Fault(
        0.4, 5, "s", lambda s: s.has_speed, put_stuck, lambda v, b: _named(v, ("stuck",), b["where"])
    ),
    "dead channel": Fault(
        1, 1, "a flat line", lambda s: s.has_speed, put_dead, lambda v, b: _named(v, ("dead",), b["where"])
    ),
    "wrong gear": Fault(5, 40, "%", _any_check, put_gear, found_gear),
}


def draw(name: str, seed: int) -> tuple[Log, Robot, dict, float]:
    """(log with that fault, robot file, what was broken, size), for a seed; sizes are even in their logarithm."""
    fault = FAULTS[name]
    rng = np.random.default_rng([seed, sorted(FAULTS).index(name)])
    while True:
        scene = random_scene(rng)
        size = float(np.exp(rng.uniform(np.log(fault.low), np.log(fault.high))))
        size = float(round(size)) if fault.unit == "rows" else size
        if not fault.needs(scene):
            continue
        made = fault.put(rng, scene, size)
        if made is not None:
            log, scene, broken = made
            return log, scene.robot, {**broken, "scene": scene}, size
