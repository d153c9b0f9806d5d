"""Clean logs of random robots, and twelve faults to put into them, with sizes from a published range.

A clean log is a simulated run of a random robot (box or disc friction or a turning frame, three or four wheels, its
robot file exact) under commands that a user would give, seen through sensors with noise, steps and jitter. A fault
goes into it either before the simulation (saturation, sag) or into what was recorded.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from omnidyn.logs.findings import Verdict
from omnidyn.logs.log import Log
from omnidyn.model.frames import body_to_world
from omnidyn.model.motor import settled_current
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import robot_from_dict
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate

FloatArray = NDArray[np.float64]
Rng = np.random.Generator

LIMIT = 12.0  # [V] of every random robot
AXES = ("vx", "vy", "omega")


@dataclass(frozen=True)
class Scene:
    """What is drawn before anything is simulated. floor: twist, pose, gyro or none. drive: voltage or duty."""

    robot: Robot
    rate: float
    seconds: float
    jitter: float
    drive: str
    floor: str
    has_current: bool
    has_speed: bool
    amplitude: float
    clip: float = np.inf  # share of the limit at which the driver gives up
    sag: float = 0.0


def random_robot(rng: Rng) -> Robot:
    """A robot that exists in shops: 1 to 10 kg, 0.8 to 2 m/s, friction of 3 to 12 % of its weight."""
    n = int(rng.choice([3, 4]))
    start = float(rng.choice([180.0, 60.0, 30.0, 0.0])) if n == 3 else float(rng.choice([45.0, 0.0]))
    mass, b, r = rng.uniform(1.0, 10.0), rng.uniform(0.08, 0.22), rng.uniform(0.02, 0.06)
    gear, top = float(np.round(rng.uniform(8.0, 40.0))), rng.uniform(0.8, 2.0)
    constant = LIMIT / (gear * top / r)
    coulomb = mass * 9.81 * rng.uniform(0.03, 0.12)
    resistance = gear * constant * LIMIT / r * 2.0 / (coulomb * rng.uniform(3.0, 8.0))
    kind, ratio, yaw = str(rng.choice(["box", "disc"])), rng.uniform(0.7, 1.3), 0.6 * coulomb * b
    viscous = coulomb / top * rng.uniform(0.0, 0.4)
    friction = {
        "box": {"axes": {"viscous": [viscous, viscous, viscous * b**2], "coulomb": [coulomb, coulomb * ratio, yaw]}},
        "disc": {"direction": {"coulomb": [coulomb, coulomb * ratio], "viscous": viscous, "yaw_coulomb": yaw,
                               "yaw_viscous": viscous * b**2}},
    }[kind]  # fmt: skip
    return robot_from_dict({
        "schema": 1, "name": f"random-{kind}-{n}",
        "body": {"mass_kg": mass, "inertia_kg_m2": 0.5 * mass * b**2, "rotating_frame": bool(rng.random() < 0.3)},
        "wheels": {"azimuth_deg": [start + 360.0 * k / n - 360.0 * (start + 360.0 * k / n > 180.0) for k in range(n)],
                   "robot_radius_m": b, "wheel_radius_m": r},
        "motor": {"resistance_ohm": resistance, "torque_constant_Nm_A": constant, "emf_constant_Vs_rad": constant,
                  "gear_ratio": gear, "voltage_limit_V": LIMIT},
        "drive": {"kind": "voltage"}, "friction": friction,
    })  # fmt: skip


def random_scene(rng: Rng) -> Scene:
    """A robot and a way to log it: 10 to 60 s at 50 to 200 Hz; some sensors are missing."""
    return Scene(
        random_robot(rng), float(rng.choice([50.0, 100.0, 125.0, 200.0])), rng.uniform(10.0, 60.0),
        float(rng.choice([0.0, 0.02, 0.1])), str(rng.choice(["voltage", "duty"])),
        str(rng.choice(["twist", "pose", "gyro", "none"], p=[0.45, 0.25, 0.2, 0.1])), bool(rng.random() < 0.8),
        bool(rng.random() < 0.95), rng.uniform(0.5, 0.85),
    )  # fmt: skip


def program(rng: Rng, scene: Scene, n: int, dt: float) -> FloatArray:
    """Share of the limit for each wheel, shape (n, wheels): rest, then pushes in many directions, ramps and pauses."""
    wheels = scene.robot.wheels
    out = np.zeros((n, wheels.count))
    k = round(rng.uniform(0.3, 1.0) / dt)
    push = wheels.wrench_matrix.T / np.array([1.0, 1.0, float(np.mean(wheels.robot_radius))])
    while k < n:
        length = round(rng.uniform(0.3, 1.5) / dt)
        direction = rng.normal(size=3) * (1.0, 1.0, rng.choice([0.0, 0.3, 1.0]))
        if rng.random() < 0.25:
            direction = np.eye(3)[rng.integers(3)] * rng.choice([-1.0, 1.0])
        pattern = push @ direction
        level = scene.amplitude * rng.uniform(0.35, 1.0) * pattern / np.abs(pattern).max()
        shape = np.linspace(0.0, 1.0, length) if rng.random() < 0.2 else np.ones(length)
        if rng.random() < 0.1:
            level = 0.0 * level
        out[k : k + length] = np.outer(shape, level)[: max(0, n - k)]
        k += length
    return out


class Truth(NamedTuple):
    """A simulated run, and the supply."""

    run: Run
    supply: FloatArray
    share: FloatArray  # of the supply that was asked for


def play(rng: Rng, scene: Scene) -> Truth:
    """The run of a scene."""
    n, dt = round(scene.seconds * scene.rate), 1.0 / scene.rate
    steps = dt * (1.0 + scene.jitter * np.clip(rng.normal(size=n), -3.0, 3.0))
    share = np.round(np.clip(program(rng, scene, n, dt), -scene.clip, scene.clip) * 1000.0) / 1000.0
    supply = np.full(n, LIMIT)
    if scene.sag:
        # A weak battery: it gives way under load, a little later than the load comes.
        load = np.abs(share).sum(axis=1)
        for k in range(1, n):
            load[k] += (load[k - 1] - load[k]) * np.exp(-dt / 0.1)
        supply = LIMIT * (1.0 - scene.sag * load / load.max())
    run = simulate(scene.robot, share * supply[:, None], steps, tol=None)
    return Truth(run, np.append(supply, supply[-1]), np.vstack([share, share[-1:]]))


def stepped(values: FloatArray, step: float) -> FloatArray:
    """As a sensor counts."""
    return np.round(values / step) * step


def record(rng: Rng, scene: Scene, truth: Truth, ground_slip: FloatArray | None = None) -> Log:
    """What the sensors make of a run. ground_slip: share of the wheels' path that the floor sees, per row."""
    run, robot = truth.run, scene.robot
    rows = len(run)
    channels: dict[str, FloatArray] = {}
    assert run.voltage is not None
    assert run.current is not None
    assert run.wheel_speed is not None
    assert run.twist is not None
    if scene.drive == "voltage":
        channels["voltage"] = np.round(run.voltage, 3)
    else:
        channels["duty"] = truth.share
        channels["supply"] = stepped(truth.supply + 0.02 * rng.normal(size=rows), 0.01)
    stall = float(np.max(settled_current(robot.motor, np.full(robot.wheels.count, LIMIT), 0.0 * run.current[0])))
    if scene.has_current:
        noise = stall * rng.uniform(0.003, 0.02)
        channels["current"] = stepped(
            run.current + noise * rng.normal(size=run.current.shape), stall * rng.uniform(0.001, 0.01)
        )
    top = float(np.abs(run.wheel_speed).max()) or 1.0
    if scene.has_speed:
        channels["wheel_speed"] = encoder(rng, run.t, run.wheel_speed, top)
    slip = np.ones(rows) if ground_slip is None else ground_slip
    twist = run.twist * slip[:, None]
    size = np.maximum(np.abs(run.twist).max(axis=0), 0.05)
    if scene.floor in ("twist", "gyro"):
        seen = twist + rng.uniform(0.003, 0.02) * size * rng.normal(size=twist.shape)
        if scene.floor == "gyro":
            seen[:, :2] = np.nan
        channels["twist"] = seen
    if scene.floor == "pose":
        channels["pose"] = tracked(rng, run, twist)
    return Log(run.t, channels, np.arange(rows) + 2, source="simulated")


def encoder(rng: Rng, t: FloatArray, speed: FloatArray, top: float) -> FloatArray:
    """Speed as firmware gives it (steps and noise), or as differences of counts from row to row."""
    if rng.random() < 0.3 and len(t) > 2:
        angle = np.vstack(
            [np.zeros(speed.shape[1]), np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(t)[:, None], axis=0)]
        )
        counts = 2.0 * np.pi / rng.choice([1024.0, 2048.0, 4096.0])
        measured = np.diff(stepped(angle, counts), axis=0) / np.diff(t)[:, None]
        return np.vstack([np.zeros(speed.shape[1]), measured])
    moving = speed != 0.0
    noisy = speed + rng.uniform(0.003, 0.02) * top * rng.normal(size=speed.shape) * moving
    return stepped(noisy, top * rng.uniform(0.002, 0.03))


def tracked(rng: Rng, run: Run, twist: FloatArray) -> FloatArray:
    """A pose as a camera on the ceiling sees it: it starts anywhere, heading wraps."""
    assert run.pose is not None
    # Without slip this is the simulated pose; with slip, the path of the slower twist.
    turned = np.diff(run.t) * 0.5 * (twist[1:, 2] + twist[:-1, 2])
    heading = np.concatenate([[0.0], np.cumsum(turned)])
    world = np.einsum("kij,kj->ki", body_to_world(heading), twist)
    middle = 0.5 * (world[1:] + world[:-1])
    path = np.vstack([np.zeros(3), np.cumsum(middle * np.diff(run.t)[:, None], axis=0)])
    pose = run.pose if np.array_equal(twist, run.twist) else path  # type: ignore[arg-type]
    noise = rng.normal(size=pose.shape) * [rng.uniform(2e-4, 2e-3)] * 3
    return pose + noise + [*rng.uniform(-2.0, 2.0, size=2), 0.0]


# --- faults ---


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


def _plain(rng: Rng, scene: Scene) -> Log:
    return record(rng, scene, play(rng, scene))


def _named(verdict: Verdict, codes: tuple[str, ...], where: str) -> bool:
    return any(f.code in codes and set(f.where.split()) == set(where.split()) for f in verdict.findings)


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
    log = _plain(rng, scene)
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
    log = _plain(rng, scene)
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
    log = _plain(rng, scene)
    return _changed(log, wheel_speed=log.channels["wheel_speed"] * 60.0 / (2.0 * np.pi)), scene, {}


def put_lag(rng: Rng, scene: Scene, size: float):
    log = _plain(rng, scene)
    names = ["wheel_speed"] if _full_floor(scene) else []
    names += ["twist"] if scene.floor == "twist" and scene.has_speed else []
    names += ["current"] if scene.has_current and scene.has_speed else []
    name = names[rng.integers(len(names))]
    late = np.vstack([log.channels[name][:1], log.channels[name][:-1]])
    return _changed(log, **{name: late}), scene, {"name": name}


def found_lag(verdict: Verdict, broken: dict) -> bool:
    names = {"wheel_speed": ("wheel_speed", "current"), "twist": ("twist",), "current": ("current",)}[broken["name"]]
    return any(f.code == "lag" and any(name in f.where for name in names) for f in verdict.findings)


def put_gap(rng: Rng, scene: Scene, size: float):
    log = _plain(rng, scene)
    at = int(rng.integers(20, len(log) - 20 - int(size)))
    keep = np.ones(len(log), dtype=bool)
    keep[at : at + int(size)] = False
    line = int(log.lines[at - 1])
    return log.rows(keep), scene, {"line": line}


def found_gap(verdict: Verdict, broken: dict) -> bool:
    return any(f.code == "gap" and any(a == broken["line"] for a, _ in f.rows) for f in verdict.findings)


def put_repeats(rng: Rng, scene: Scene, size: float):
    log = _plain(rng, scene)
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
    return any(f.code == "saturation" and abs(f.numbers["share"] - broken["share"]) < 0.01 + 0.3 * broken["share"]
               for f in verdict.findings)  # fmt: skip


def put_sag(rng: Rng, scene: Scene, size: float):
    weak = replace(scene, sag=size / 100.0, drive="duty")
    return record(rng, weak, play(rng, weak)), weak, {"drop": size / 100.0}


def found_sag(verdict: Verdict, broken: dict) -> bool:
    return any(f.code == "sag" and abs(f.numbers["drop"] - broken["drop"]) < 0.02 + 0.4 * broken["drop"]
               for f in verdict.findings)  # fmt: skip


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
    log = _plain(rng, scene)
    names = ["wheel_speed"] if scene.has_speed else []
    names += ["current"] if scene.has_current and scene.has_speed else []
    name = names[rng.integers(len(names))]
    values = log.channels[name].copy()
    k = int(rng.integers(values.shape[1]))
    values[:, k] = 0.0
    return _changed(log, **{name: values}), scene, {"where": f"{LETTER[name]}{k + 1}"}


def put_gear(rng: Rng, scene: Scene, size: float):
    """The log was made with a gear ratio that is off by +-size %."""
    log = _plain(rng, scene)
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
    "swapped motor": Fault(1, 1, "two columns", _any_check, put_swapped,
                           lambda v, b: _named(v, ("swapped",), b["where"])),
    "inverted sign": Fault(1, 1, "one column", _any_check, put_inverted,
                           lambda v, b: _named(v, ("inverted",), b["where"])),
    "rpm as rad/s": Fault(1, 1, "9.55 times", lambda s: s.has_speed, put_rpm,
                          lambda v, b: any(f.code == "unit" and "rpm" in f.message for f in v.findings)),
    "one-sample lag": Fault(1, 1, "row", _any_check, put_lag, found_lag),
    "gap": Fault(3, 200, "rows", lambda s: True, put_gap, found_gap),
    "repeated stamps": Fault(1, 20, "rows", lambda s: True, put_repeats, found_repeats),
    "saturation": Fault(2, 40, "% of rows", lambda s: True, put_saturation, found_saturation),
    "sag": Fault(5, 30, "%", lambda s: True, put_sag, found_sag),
    "slip": Fault(5, 50, "% of the path", _full_floor, put_slip, found_slip, ("path_ratio", "robot_radius")),
    "stuck encoder": Fault(0.4, 5, "s", lambda s: s.has_speed, put_stuck,
                           lambda v, b: _named(v, ("stuck",), b["where"])),
    "dead channel": Fault(1, 1, "a flat line", lambda s: s.has_speed, put_dead,
                          lambda v, b: _named(v, ("dead",), b["where"])),
    "wrong gear": Fault(5, 40, "%", _any_check, put_gear, found_gear),
}  # fmt: skip


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


def clean(seed: int) -> tuple[Log, Robot, Scene]:
    """(log without any fault, its robot, how it was made)."""
    rng = np.random.default_rng([seed, 1000])
    scene = random_scene(rng)
    return _plain(rng, scene), scene.robot, scene
