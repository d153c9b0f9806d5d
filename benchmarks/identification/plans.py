"""A planned minute of driving beside others: how sure the numbers are after it, whether it stays in its room, and
whether what was predicted came true.

Logs are simulated with white noise of 0.02 m/s and 0.1 rad/s, at 100 Hz; the gain of the voltages is fitted beside the
friction. Standard errors are those that `identify` gives, without its diagnosis.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import chirp, lfilter

import omnidyn
from benchmarks.size import scaled
from benchmarks.table import Table, machine, one_core
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.fit import Fit
from omnidyn.model.deadzone import axis_patterns
from omnidyn.model.keys import Key, friction_keys
from omnidyn.model.log_effects import LogEffects
from omnidyn.paper.tables import TABLE_4

ROBOTS = ("axebot", "four-wheel", "mecanum")
NOISE, DT, SECONDS, ROOM = np.array([0.02, 0.02, 0.1]), 0.01, 60.0, 3.0
DRAWN = scaled(200, 4)  # robots that might leave the room
FITTED, LOGS = scaled(20, 2), scaled(10, 2)  # robots, logs of each
OFF, KINDS = (0.0, 0.1, 0.3), ("white", "AR(1) 0.9", "counts")
TICK = 2.0 * np.pi / 4096.0  # [rad]
EACH, SIDE = scaled(20, 2), 30.0  # worlds of each explanation; s of the drive before
EACH_PROGRAM = 4  # logs
PLAIN = ("friction",)
ROWS = round(SECONDS / DT)
Array = np.ndarray[Any, Any]


def log_of(
    robot: omnidyn.Robot,
    voltage: Array,
    rng: np.random.Generator,
    memory: float = 0.0,
    push: tuple[float, ...] = (0.0, 0.0, 0.0),
) -> omnidyn.Run:
    """A noisy log; memory: correlation of neighbours of its noise, of the same size. push: on the body [N, N, N m]."""
    run = omnidyn.simulate(robot, voltage, DT, log=LogEffects(push=push) if any(push) else None)
    noise = rng.normal(size=run.twist.shape) * NOISE
    if memory:
        noise = lfilter([np.sqrt(1.0 - memory**2)], [1.0, -memory], noise, axis=0)
    return omnidyn.Run(t=run.t, voltage=run.voltage, twist=run.twist + noise)


def fitted(log: omnidyn.Run, robot: omnidyn.Robot) -> Any:
    """The friction, beside the gain of the voltages."""
    return omnidyn.identify(log, robot, OutputError(free=PLAIN, nuisances=("gain",)), quick=True)


def spread(fit: Any) -> float:
    """The geometric mean of the standard errors, as shares [%]."""
    return 100.0 * float(np.exp(np.mean([np.log(fit.std[name] / abs(fit.value[name])) for name in fit.value])))


def spread_after(robot: omnidyn.Robot, voltage: Array) -> float:
    """The same in the mean of fits of some logs: one alone is up to 3 % off, by its noise."""
    rng = np.random.default_rng(11)
    return float(np.mean([spread(fitted(log_of(robot, voltage, rng), robot)) for _ in range(EACH_PROGRAM)]))


def off(robot: omnidyn.Robot, share: float, rng: np.random.Generator) -> omnidyn.Robot:
    """Friction and resistance up to so much off."""
    for name in (*friction_keys(robot), "motor.resistance_ohm"):
        key = Key.parse(name)
        robot = key.set(robot, rng.uniform(1.0 - share, 1.0 + share) * key.get(robot))
    return robot


def programs(robot: omnidyn.Robot) -> dict[str, Callable[[np.random.Generator], Array]]:
    """Voltages of a minute [V], shape (rows, wheels), that others would drive."""
    patterns = axis_patterns(robot)
    limit = float(np.min(robot.motor.voltage_limit))
    t = DT * np.arange(ROWS)

    def along(axes: Array) -> Array:
        return np.clip(axes @ patterns, -1.0, 1.0) * limit

    def steps(_: np.random.Generator) -> Array:
        """The nine steps of Table 4, as shares of the limit of the paper's robot."""
        sizes = [max(map(abs, volts)) / 6.0 for axis in TABLE_4 for volts in TABLE_4[axis]]
        axes = np.zeros((ROWS, 3))
        for k, rows in enumerate(np.array_split(np.arange(ROWS), len(sizes))):
            axes[rows[: len(rows) // 2], k // 3] = sizes[k]
        return along(axes)

    def ramps(_: np.random.Generator) -> Array:
        axes = np.zeros((ROWS, 3))
        for k, rows in enumerate(np.array_split(np.arange(ROWS), 12)):
            n, sign = len(rows) * 4 // 5, (-1.0) ** (k // 3)
            axes[rows[:n], k % 3] = sign * (np.linspace(0.0, 0.5, n) if k < 6 else np.full(n, 0.7))
        return along(axes)

    def chirps(_: np.random.Generator) -> Array:
        return along(0.6 * np.stack([chirp(t, 0.05, SECONDS, 2.0 + 0.3 * k, phi=60.0 * k) for k in range(3)], axis=1))

    def multisine(rng: np.random.Generator) -> Array:
        tones = np.arange(1, 31) / SECONDS
        axes = np.stack(
            [np.sin(2 * np.pi * (np.outer(t, tones) + rng.random(30))).sum(axis=1) for _ in range(3)], axis=1
        )
        return along(0.7 * axes / np.abs(axes).max())

    def random(rng: np.random.Generator) -> Array:
        levels = rng.uniform(-1.0, 1.0, (ROWS // 80 + 1, 3))
        return along(0.6 * np.repeat(levels, 80, axis=0)[:ROWS])

    return {"nine steps of Table 4": steps, "ramps and steps": ramps, "chirp": chirps, "multisine": multisine,
            "random levels": random}  # fmt: skip


def measure() -> Table:
    """All of it, some minutes of processor time."""
    table = Table(
        "plans: a minute in a room of 3 m x 3 m",
        ["robot", "what", "standard errors %", "times the plan", "left the room", "of", "ratio", "cpu s"],
    )
    table.notes += [
        machine(),
        "standard errors: geometric mean of those of friction, by identify without its diagnosis, the gain free, "
        f"the mean of {EACH_PROGRAM} logs",
        "predictions: robots 0, 10 and 30 % off, over noise that is white, AR(1) .9 (told as white) and of counts",
        "explanations: each world has one of both; the fit with the smaller BIC is right",
    ]
    for name in ROBOTS:
        robot = omnidyn.load_robot(name)
        with one_core():
            begun = time.process_time()
            plan = omnidyn.plan(robot, (ROOM, ROOM), SECONDS, free=PLAIN, noise={"twist": NOISE})
            took = time.process_time() - begun
        planned = spread_after(robot, plan.commands().voltage)
        lost = _leave(robot, [plan.commands(which).voltage for which in (False, True)])
        table.add("<= 30 s", took <= 30.0, robot=name, what="search", **{"cpu s": took})
        table.add(
            "<= 2 of 100 leave", lost <= 0.02 * DRAWN, robot=name, what="plan", of=DRAWN,
            **{"standard errors %": planned, "left the room": lost},
        )  # fmt: skip
        for other, make in programs(robot).items():
            voltage = make(np.random.default_rng(5))
            sure = spread_after(robot, voltage)
            goal = {"nine steps of Table 4": 2.7, "ramps and steps": 1.2}.get(other) if name == "axebot" else None
            goal = 1.2 if other == "ramps and steps" else goal
            words, met = (f">= {goal:g} times", sure / planned >= goal) if goal else ("", None)
            cells = {"standard errors %": sure, "times the plan": sure / planned}
            table.add(
                words, met, robot=name, what=other, of=DRAWN, **cells, **{"left the room": _leave(robot, [voltage])}
            )
    _slipping(table)
    _predictions(table)
    _wrong_model(table)
    _next(table)
    _explanations(table)
    return table


def _leave(robot: omnidyn.Robot, voltages: list[Array]) -> int:
    """How many of the robots 30 % off leave the room."""
    rng, count = np.random.default_rng(23), 0
    for _ in range(DRAWN):
        drawn = off(robot, 0.3, rng)
        places = [np.abs(omnidyn.simulate(drawn, voltage, DT).pose[:, :2]).max() for voltage in voltages]
        count += max(places) > 0.5 * ROOM
    return count


def _slipping(table: Table) -> None:
    """The search for a robot whose wheels may slip."""
    four = omnidyn.load_robot("four-wheel")
    robot = four.replace(wheels=four.wheels.replace(traction_mu=0.5, wheel_inertia=2e-5))
    omnidyn.simulate(robot, np.zeros((2, 4)), DT)  # compiles
    with one_core():
        begun = time.process_time()
        plan = omnidyn.plan(robot, (ROOM, ROOM), SECONDS, free=PLAIN, noise={"twist": NOISE})
        took = time.process_time() - begun
    half = 50.0 * float(np.exp(np.mean([np.log(number.half) for number in plan.predicted.values()])))
    table.add(
        "<= 30 s", took <= 30.0, robot="four-wheel, mu 0.5", what="search, predicted errors without a gain",
        **{"cpu s": took, "standard errors %": half},
    )  # fmt: skip


def counts_of(robot: omnidyn.Robot, voltage: Array, rng: np.random.Generator) -> omnidyn.Run:
    """A log of whole counts of the wheels, by eight steps a row."""
    fine = 8
    run = omnidyn.simulate(robot, np.repeat(voltage, fine, axis=0), DT / fine)
    turned = np.cumsum(0.5 * (run.wheel_speed[1:] + run.wheel_speed[:-1]), axis=0) * DT / fine
    angle = np.concatenate([np.zeros((1, turned.shape[1])), turned])[::fine]
    counts = TICK * np.floor(angle / TICK + rng.random(angle.shape[1]))
    return omnidyn.Run(
        t=DT * np.arange(len(angle)), voltage=np.concatenate([voltage, voltage[-1:]]), wheel_angle=counts
    )


def _predictions(table: Table) -> None:
    """Predicted beside claimed standard errors, and errors beside both."""
    robot = omnidyn.load_robot("axebot")
    noises = {"white": {"twist": NOISE}, "counts": {"wheel_angle": TICK}}
    plans = {
        kind: omnidyn.plan(robot, (ROOM, ROOM), SECONDS, free=PLAIN, noise=noise) for kind, noise in noises.items()
    }
    plans["AR(1) 0.9"] = plans["white"]
    rng = np.random.default_rng(31)
    errors: dict[str, list[Array]] = {
        kind: [] for kind in KINDS
    }  # over claimed, over predicted, predicted over claimed
    for k in range(FITTED):
        true = off(robot, OFF[k % len(OFF)], rng)
        start = robot.replace(motor=true.motor)
        for number in range(LOGS):
            kind = KINDS[(k // len(OFF) + number) % len(KINDS)]
            volts = plans[kind].commands().voltage
            log = counts_of(true, volts, rng) if kind == "counts" else log_of(true, volts, rng, 0.9 * (kind[0] == "A"))
            fit = omnidyn.identify(log, start, OutputError(free=PLAIN, nuisances=()), quick=True)
            for name, promised in plans[kind].predicted.items():
                error, std = fit.value[name] - Key.parse(name).get(true), fit.std[name]
                half = 0.5 * promised.half * fit.value[name]
                errors[kind].append(np.array([error / std, error / half, half / std]))
    pooled = np.concatenate([np.array(errors[kind]) for kind in KINDS if errors[kind]])
    count = FITTED * LOGS
    std = float(np.std(pooled[:, 0]))
    table.add("0.85 to 1.15", 0.85 <= std <= 1.15, robot="axebot", what="std of z, all noises", of=count, ratio=std)
    for kind, found in errors.items():
        if not found:
            continue
        z, of_half, claimed = np.array(found).T
        rows = {
            "std of z": float(np.std(z)),
            "predicted over spread": 1.0 / float(np.std(of_half)),
            "predicted over claimed": float(np.median(claimed)),
            "coverage of the predicted interval": float(np.mean(np.abs(of_half) < 2.0)),
        }
        for what, value in rows.items():
            table.add(robot="axebot", what=f"{what}; {kind}", of=len(found) // len(plans[kind].predicted), ratio=value)


def _wrong_model(table: Table) -> None:
    """By how much a prediction is too good where the robot has what its model has not: a level that falls."""
    robot = omnidyn.load_robot("axebot")
    true = falling(robot, 1.3)
    plan = omnidyn.plan(robot, (ROOM, ROOM), SECONDS, free=PLAIN, noise={"twist": NOISE})
    off_by = []
    for seed in range(EACH):
        log = log_of(true, plan.commands().voltage, np.random.default_rng(seed))
        fit = omnidyn.identify(log, robot, OutputError(free=PLAIN, nuisances=()), quick=True)
        off_by += [
            (fit.value[name] - Key.parse(name).get(true)) / (0.5 * number.half * fit.value[name])
            for name, number in plan.predicted.items()
        ]
    table.add(
        robot="axebot", what="root mean square of errors over predicted; Stribeck in truth alone", of=EACH,
        ratio=float(np.sqrt(np.mean(np.square(off_by)))),
    )  # fmt: skip


def _next(table: Table) -> None:
    """The widest interval after 30 s, and after 30 s more: by a plan for it, and by the first one once more."""
    robot = omnidyn.load_robot("axebot")
    question, rng = OutputError(free=PLAIN, nuisances=()), np.random.default_rng(3)
    first = omnidyn.plan(robot, (ROOM, ROOM), SIDE, free=PLAIN, noise={"twist": NOISE})
    log = log_of(robot, first.commands().voltage, rng)
    fit = omnidyn.identify(log, robot, question, quick=True)
    after = omnidyn.plan(fit.robot, (ROOM, ROOM), SIDE, aim="next", noise={"twist": NOISE})

    def widest(run: omnidyn.Run) -> float:
        both = omnidyn.identify([log, run], robot, question, quick=True)
        return 50.0 * max(both.half_width(name) for name in both.value)

    promised = 50.0 * max(number.half for number in after.predicted.values())
    aimed, again = (widest(log_of(robot, made.commands().voltage, rng)) for made in (after, first))
    table.add(
        robot="axebot", what="widest of one fit", **{"standard errors %": 50.0 * max(map(fit.half_width, fit.value))}
    )
    table.add(
        "0.8 to 1.25", 0.8 <= promised / aimed <= 1.25, robot="axebot",
        what="widest after plan --next, predicted over got", ratio=promised / aimed, **{"standard errors %": aimed},
    )  # fmt: skip
    table.add(
        ">= 1", again >= aimed, robot="axebot", what="widest after the first plan again",
        **{"standard errors %": again, "times the plan": again / aimed},
    )  # fmt: skip


def falling(robot: omnidyn.Robot, factor: float) -> omnidyn.Robot:
    """The robot with friction that falls from so many times its Coulomb level (Stribeck)."""
    axes = robot.friction.axes
    return robot.replace(
        friction=robot.friction.replace(
            axes=axes.replace(breakaway=tuple(factor * level for level in axes.coulomb), stribeck_speed=(0.1, 0.1, 1.0))
        )
    )


def _criterion(log: omnidyn.Run, robot: omnidyn.Robot, free: tuple[str, ...], nuisances: tuple[str, ...]) -> float:
    """BIC of a fit."""
    fit = Fit.of([log], robot, OutputError(free=free, nuisances=nuisances))
    solution = fit.solve()
    return 2.0 * solution.state.objective + len(solution.solver.problem.parameters) * float(np.log(log.twist.size))


class Explanation(NamedTuple):
    """name: of it. world: a robot that has it, of a size from 0 to 1. believed, free, nuisances: of the fit by it."""

    name: str
    world: Callable[[float], omnidyn.Robot]
    believed: omnidyn.Robot
    free: tuple[str, ...] = PLAIN
    nuisances: tuple[str, ...] = ()


def _explanations(table: Table) -> None:
    """Of two explanations, which is right after the planned minute."""
    robot = omnidyn.load_robot("axebot")
    viscous = tuple(f"friction.axes.viscous[{k}]" for k in range(3))

    def stronger(table: str, size: float) -> omnidyn.Robot:
        made = robot
        for k in range(3):
            key = Key.parse(f"friction.axes.{table}[{k}]")
            made = key.set(made, size * key.get(made))
        return made

    def banded(x: float) -> omnidyn.Robot:
        return robot.replace(drive=robot.drive.replace(dead_band=0.1 + 0.3 * x))

    def tilted(x: float) -> omnidyn.Robot:
        return robot.replace(floor=robot.floor.replace(tilt=0.5 + x, downhill=30.0))

    pairs: dict[str, tuple[Explanation, ...]] = {
        "dead_band,friction.axes.coulomb": (
            Explanation("dead band", banded, robot, viscous, ("dead_band",)),
            Explanation("Coulomb", lambda x: stronger("coulomb", 1.1 + 0.3 * x), robot),
        ),
        "friction.axes.stribeck_speed,friction.axes.viscous": (
            Explanation("Stribeck", lambda x: falling(robot, 1.2 + 0.3 * x), falling(robot, 1.3)),
            Explanation("viscous", lambda x: stronger("viscous", 1.1 + 0.3 * x), robot),
        ),
        "tilt,push": (
            Explanation("tilt", tilted, robot, nuisances=("tilt",)),
            Explanation("push", lambda _: robot, robot, nuisances=("push",)),
        ),
    }
    for pair, sides in pairs.items():
        begun = time.process_time()
        believed = falling(robot, 1.3) if "stribeck" in pair else robot
        plan = omnidyn.plan(believed, (ROOM, ROOM), SECONDS, aim=pair, noise={"twist": NOISE})
        took, volts = time.process_time() - begun, plan.commands().voltage
        for name, world in ((side.name, side.world) for side in sides):
            right = 0
            for seed in range(EACH):
                rng = np.random.default_rng([seed, len(name)])
                true, size = world(rng.random()), 0.1 + 0.3 * rng.random()
                log = log_of(true, volts, rng, push=(size, -size, 0.0) if name == "push" else (0.0, 0.0, 0.0))
                found = {side.name: _criterion(log, side.believed, side.free, side.nuisances) for side in sides}
                right += min(found, key=lambda other: found[other]) == name
            table.add(
                "9 of 10", right >= 0.9 * EACH, robot="axebot", what=f"{pair}: {name} is told", of=EACH,
                ratio=right / EACH, **{"cpu s": took},
            )  # fmt: skip
    words = ""
    try:
        omnidyn.plan(robot, (ROOM, ROOM), SECONDS, aim="gain,wheels.wheel_radius_m", noise={"twist": NOISE})
    except omnidyn.OmnidynError as error:
        words = str(error)
    table.add("refused, with a sensor", "log wheel speeds" in words, robot="axebot", what="gain or wheel radius")
