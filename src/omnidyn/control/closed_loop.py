"""track: a controller drives a simulated robot along a path, step by step; Tracking says how near it came."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Unpack

import numpy as np

from omnidyn.arguments import check_order
from omnidyn.arrays import FloatArray
from omnidyn.control.circumstances import Circumstances, LoopOptions, circumstances
from omnidyn.control.controller import OK, Controller
from omnidyn.control.controllers import ControllerFile, controller_named, told_apart
from omnidyn.control.instruments import instruments
from omnidyn.control.margins import loop_margins
from omnidyn.control.paths.motion import Path
from omnidyn.control.paths.path import path as path_named
from omnidyn.control.readings import Readings, with_sensors
from omnidyn.control.tracking import Tracking
from omnidyn.errors import InputError
from omnidyn.model.drive import DUTY, SPEED
from omnidyn.model.robot import Robot
from omnidyn.progress import Progress, Report, silent
from omnidyn.run import Run
from omnidyn.simulation.live import LiveRobot, check_supply

STEPS_OF_REPORT = 64  # from one report of progress to the next
# What a noise of 1 m/s on the speeds is on the others: x, y [m], heading [rad], v_x, v_y [m/s], omega [rad/s].
NOISE = np.array([0.2, 0.2, 0.4, 1.0, 1.0, 4.0])


def track(
    robot: Robot,
    path: Any,
    controller: Controller | ControllerFile | str | Sequence[Controller | ControllerFile | str] = "pid",
    *,
    plant: Robot | None = None,
    progress: Progress = silent,
    **options: Unpack[LoopOptions],
) -> Tracking:
    """Drive a simulated robot along a path with a controller, and see how near it comes; or with several, one by one.

    The robot starts on the path, at rest. A controller that can take a delay into account is told of it, and the loop
    begins as many steps before the path does: a path is known ahead, and who waits where it begins can be in motion on
    time.

    Args:
        robot: That the controller believes to drive.
        path: A Path, or what `omnidyn.path` takes: a name, a file, a Run, an array, a function, an object of your own.
        controller: A Controller, or the name of one ("feedforward", "speed", "pid", ..), or a controller file, by path
            or as `omnidyn.load_controller` reads it; or a list of these: the Tracking of the first has the others
            beside it, and is a sequence of all.
        plant: The robot that is driven in truth; the same by default.
        progress: Hears how far each controller is.
        options: Of the loop, by name, in any number of:
            dt=0.02, time between two steps [s];
            duration, that is tracked [s], that of the path by default;
            skip=0.5, errors before it count for nothing [s]: the start from rest is no error of tracking;
            noise=0.0, std of the measured speeds [m/s]; on omega 4 times as many rad/s, on x and y 0.2 s, on the
            heading 0.4 s times as much; nothing that an encoder counts has it;
            delay=0, steps until an output acts;
            rng=0, a seed or a numpy.random.Generator of the noise;
            push=(0, 0, 0), a wrench on the body [N, N, N m] that no model knows: a constant, or a function of t [s];
            supply, behind a duty [V];
            sensors, with which the robot is measured, such as "encoder:2048,pose:60Hz,40ms" (control/instruments.py); a
            controller that is made here knows of them. By default those of the [sensors] of the plant's file.

    Raises InputError for what cannot be driven, or a number out of range.

    >>> import omnidyn
    >>> robot = omnidyn.load_robot("axebot")
    >>> several = omnidyn.track(robot, "circle", ["feedforward", "pid"], duration=2.0, noise=0.005)
    >>> [tracking.controller for tracking in several], several.best.run.pose.shape
    (['feedforward', 'pid'], (101, 3))
    """
    kinds = (Path, Run, str) if isinstance(path, Robot) else object
    check_order("track(robot, path, controller)", (robot, Robot), (path, kinds), (controller, object))
    around = circumstances(plant or robot, **options)
    believed = with_sensors(robot, options.get("sensors"))
    follow = path_named(path)
    wanted = list(controller) if isinstance(controller, list | tuple) else [controller]
    if not wanted:
        raise InputError("no controller", got="an empty list", expected="one controller or more", where="controller")
    of_loop = {"supply": around.supply, **told_of_loop(believed, around)}
    controllers = told_apart([_controller(entry, believed, of_loop) for entry in wanted], wanted)
    driven = plant or robot
    first, *others = [tracked_with_margins(driven, follow, follower, around, progress) for follower in controllers]
    return replace(first, others=tuple(others))


def _controller(wanted: Any, robot: Robot, options: Mapping[str, Any]) -> Controller:
    """A controller for a robot, by name, from a file, or as it is."""
    if isinstance(wanted, str | os.PathLike):
        return controller_named(wanted, robot, **options)
    if isinstance(wanted, ControllerFile):
        return wanted.make(robot, **options)
    if not hasattr(wanted, "step"):
        raise InputError(
            "not a controller",
            got=type(wanted).__name__,
            expected="a Controller, the name of one, or a list of them",
            remedy='controller="pid", or one made for the robot, such as Mpc(robot)',
            where="controller",
        )
    return wanted


def told_of_loop(robot: Robot, around: Circumstances) -> dict[str, Any]:
    """What a controller is told of the loop it is in: the time between steps, and by how many of them it is late."""
    late = round(robot.drive.latency / around.dt) + around.delay
    return {"dt": around.dt, **({"delay": late} if around.delay else {})}


def tracked_with_margins(
    plant: Robot, path: Path, controller: Controller, around: Circumstances, progress: Progress = silent
) -> Tracking:
    """`tracked`, and by how much its outputs may be later and stronger."""
    _check_match(plant, controller, around.supply)
    margins = loop_margins(plant, controller, around)
    return replace(tracked(plant, path, controller, around, progress), margins=margins)


def tracked(
    plant: Robot, path: Path, controller: Controller, around: Circumstances, progress: Progress = silent
) -> Tracking:
    """`track`, with all there is to it. Raises InputError where the robots take different outputs."""
    _check_match(plant, controller, around.supply)
    around.steps(path)
    dt, n, kit = around.dt, plant.wheels.count, around.sensors or instruments(None, plant)
    random = np.random.default_rng([around.seed, 1])
    lengths = kit.lengths(dt, path.duration if around.duration is None else around.duration, random)
    count, push = len(lengths), around.push if callable(around.push) else None
    t: FloatArray = np.arange(count + 1, dtype=np.float64) * dt
    if kit.jitter or kit.missed:
        t[1:] = np.cumsum(lengths)
    steady = (0.0, 0.0, 0.0) if callable(around.push) else around.push
    live = LiveRobot(plant, dt, pose=path.at(0.0).pose, delay=around.delay, supply=around.supply, push=steady)
    controller.reset()
    early = round(plant.drive.latency / dt) + around.delay
    draws = np.random.default_rng(around.seed).standard_normal((count + early, 6))
    lost = random.random(count + early) < kit.dropouts
    readings = Readings(kit, live, -early * dt, around.noise * NOISE, controller.robot.wheels, random)
    sent, volts, state = np.empty((count, n)), np.empty((count, n)), np.empty((count + 1, 6 + n))
    for k in range(-early, 0):  # it waits where the path begins; what is sent now acts when it does
        live.step(controller.step(k * dt, *readings.seen(draws[k], bool(lost[k])), path))
        readings.passed(dt)
    state[0] = *live.pose, *live.twist, *live.wheel_speed
    took, words = np.empty(count), dict[str, int]()
    for k in range(count):
        if k % STEPS_OF_REPORT == 0:
            progress(Report(f"tracking with {controller.name}", k, count))
        pose, twist = readings.seen(draws[k], bool(lost[k]))
        start = time.perf_counter()
        sent[k] = controller.step(float(t[k]), pose, twist, path)
        took[k] = time.perf_counter() - start
        if push is not None:
            live.push(push(float(t[k])))
        live.step(sent[k], float(lengths[k]))
        readings.passed(float(lengths[k]))
        volts[k] = live.voltage
        state[k + 1] = *live.pose, *live.twist, *live.wheel_speed
        status = controller.info.status
        if status != OK:
            words[status] = words.get(status, 0) + 1
    limit = np.asarray(controller.limit)
    run = _run(plant, controller, t, sent, volts, state, around).replace(
        warnings=(*live.warnings, *controller.robot.pose_lag_of_log)
    )
    full = float(np.mean((np.abs(sent) >= limit * (1.0 - 1e-9)).any(axis=1)))
    return Tracking(
        controller.name,
        plant.name,
        path.name,
        run,
        path.at(t).pose,
        around.skip,
        dt,
        full,
        took,
        words,
        str(kit),
    )


def _check_match(plant: Robot, controller: Controller, supply: float | None) -> None:
    """Raises InputError where plant and controller do not fit each other."""
    check_supply(plant, supply)
    believed = controller.robot
    if believed.wheels.count != plant.wheels.count or believed.drive.kind != plant.drive.kind:
        raise InputError(
            "the controller is made for another drive",
            got=f"{believed.wheels.count} wheels, {believed.drive.kind}",
            expected=f"{plant.wheels.count} wheels, {plant.drive.kind}",
            where="plant",
        )


def _run(
    plant: Robot,
    controller: Controller,
    t: FloatArray,
    sent: FloatArray,
    volts: FloatArray,
    state: FloatArray,
    around: Circumstances,
) -> Run:
    """What the instruments of the robot would have recorded, without noise."""

    def last(rows: FloatArray) -> FloatArray:
        return np.concatenate([rows, rows[-1:]])

    kind = plant.drive.kind
    battery = around.supply if around.supply is not None else plant.drive.supply
    return Run(
        t=t,
        voltage=last(volts),
        duty=last(sent) if kind == DUTY else None,
        wheel_speed=state[:, 6:],
        wheel_speed_command=last(sent) if kind == SPEED else None,
        twist=state[:, 3:6],
        pose=state[:, :3],
        supply=np.full(len(t), battery) if kind == DUTY and battery is not None else None,
        source=f"simulated: {plant.name} driven by {controller.name}",
    )
