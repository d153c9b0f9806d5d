"""Small runs and fits that need every kernel: where these were made once, nobody waits for a compiler."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.compiled.parallel import compiled_elsewhere
from omnidyn.identification.estimate import Estimate
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.engines.row_sums import row_squares, row_terms
from omnidyn.identification.output_error.memory.autoregression import autoregression
from omnidyn.model.drive import SPEED
from omnidyn.model.dynamics import acceleration
from omnidyn.model.friction import WheelFriction
from omnidyn.model.motor import DYNAMIC
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.batch.batch import simulate_batch
from omnidyn.simulation.batch.result import BatchRun
from omnidyn.simulation.exact.exact_march import why_not_exact
from omnidyn.simulation.simulate import simulate

ROWS, HOLD, DT = 200, 40, 0.01  # rows of a run; rows and [s] that a command holds
NOISE = {"twist": 0.005, "current": 0.05, "pose": 0.002}  # [m/s, rad/s], [A], [m, rad]
TWIST, VOLTAGE = (0.4, 0.4, 2.0), 10.0  # the largest commands [m/s, m/s, rad/s], [V]
# Of autocorrelated errors, beside white noise: what is left of one in the rows after it.
MEMORY: FloatArray = 0.95 ** np.arange(80.0) + 3.0 * (np.arange(80) == 0)
TICK = 2.0 * np.pi / 200.0  # of a counted angle [rad]


def first_runs() -> list[tuple[str, Callable[[], object]]]:
    """(what it stands for, how to make it), in the order in which they are wanted. Compiled, each takes below 1 s."""
    paper, four, mecanum, loop_robot = (load_robot(name) for name in ("axebot", "four-wheel", "mecanum", "robotino"))
    slips = paper.replace(wheels=paper.wheels.replace(traction_mu=0.4, wheel_inertia=2e-5))
    axes = paper.friction.axes
    falls = axes.replace(breakaway=tuple(2.0 * level for level in axes.coulomb), stribeck_speed=(0.05, 0.05, 0.5))
    falling_robot = paper.replace(friction=paper.friction.replace(axes=falls))
    held = mecanum.replace(friction=mecanum.friction.replace(wheels=WheelFriction(coulomb=1.0)))
    held_loop = loop_robot.replace(friction=held.friction)
    lekiwi = load_robot("lekiwi")
    limited = lekiwi.replace(motor=lekiwi.motor.replace(current_limit=1.0))
    winding = four.replace(motor=four.motor.replace(electrical=DYNAMIC, inductance=1e-3))
    return [
        ("simulation, friction of the axes", partial(_run, paper)),
        ("fit of speeds", partial(_fit, paper, "twist")),
        ("fit of speeds alone", partial(_fit, paper, "twist", nuisances=(), start="rest")),
        ("fit of speeds whose errors are autocorrelated", partial(_fit, paper, "twist", memory=MEMORY)),
        ("autocorrelated errors while the robot moves", _remember),
        ("fit of speeds, currents and poses", partial(_fit, paper, "twist", "current", "pose")),
        ("fit of a force in the room", partial(_fit, paper, "twist", "current", "pose", nuisances=("tilt",))),
        ("fit of counted angles", partial(_fit, paper, "wheel_angle")),
        ("simulation, friction along the direction of travel", partial(_run, mecanum)),
        ("fit, friction along the direction of travel", partial(_fit, mecanum, "twist", "wheel_angle")),
        ("fit in a speed loop", partial(_fit, loop_robot, "twist")),
        ("simulation, any friction", partial(_run, held)),
        ("acceleration, any friction", partial(acceleration, loop_robot, np.zeros(3), np.ones(3))),
        ("fit, any friction", partial(_fit, held, "twist")),
        ("fit in a speed loop, any friction", partial(_fit, held_loop, "twist")),
        ("simulation, inductance", partial(_run, winding)),
        ("simulation, friction that falls with speed", partial(_run, falling_robot)),
        ("simulation, wheels that slip", partial(_run, slips)),
        ("batch, twist alone", partial(_batch, paper, None)),
        ("batch, fast poses", partial(_batch, paper, "fast")),
        ("batch, exact poses", partial(_batch, paper, "exact")),
        ("batch, friction of the direction of travel", partial(_batch, lekiwi, "exact")),
        ("batch, a limit of the current", partial(_batch, limited, None)),
        ("batch, speed loops", partial(_batch, lekiwi, None, "wheel_speed_command")),
    ]


def _batch(robot: Robot, pose: str | None, command: str = "voltage") -> BatchRun:
    commands: dict[str, Any] = {command: np.zeros((1, robot.wheels.count))}
    return simulate_batch([robot], dt=DT, pose=pose, **commands)


def shared_out(robot: Robot) -> AbstractContextManager[None]:
    """While it holds, another process compiles what a fit of this robot needs late, where that is not on disk."""
    if not why_not_exact(robot) or robot.drive.kind == SPEED or robot.wheels.traction_mu is not None:
        return nullcontext()
    return compiled_elsewhere(row_squares, needed_late)  # which stands for all of them


def needed_late() -> None:
    """What a fit by steps needs beside its march: the kernels that add up rows, called as the fit calls them."""
    row_terms(np.zeros((1, 2)), np.ones(1), 0.0, None, np.ones(1), False)
    row_squares(np.zeros((1, 2, 1)), np.zeros((1, 2)))
    _remember()


def _remember() -> None:
    """Errors of every kind of memory, filtered."""
    series = np.convolve(np.random.default_rng(2).standard_normal(ROWS), MEMORY)[:ROWS, None]
    model = autoregression([series], moves=[np.arange(ROWS) % HOLD > 0])
    replace(model, moving=(0.5, 0.5)).new(series, np.arange(ROWS), np.ones(ROWS, bool))


def _run(robot: Robot) -> Run:
    """From rest, with reversals: under voltages, or under set points where the drive takes those."""
    has_loop = robot.drive.kind == SPEED
    steps = np.random.default_rng(0).uniform(-1.0, 1.0, (ROWS // HOLD, 3 if has_loop else robot.wheels.count))
    steps[0] = 0.0
    inputs = np.repeat(steps, HOLD, axis=0)
    return simulate(robot, dt=DT, twist_command=inputs * TWIST) if has_loop else simulate(robot, inputs * VOLTAGE, DT)


def _fit(robot: Robot, *sensors: str, memory: FloatArray = MEMORY[:1], **options: Any) -> Estimate:
    """A fit to what these sensors show of that run, with errors of that memory."""
    random, run = np.random.default_rng(1), _run(robot)
    measured_channels = {
        name: value + NOISE[name] * _remembered(random.standard_normal(value.shape), memory)
        for name, value in run.channels.items()
        if name in NOISE
    }
    measured_channels["wheel_angle"] = np.round(np.cumsum(run.channels["wheel_speed"], axis=0) * DT / TICK) * TICK
    logged_run = Run(
        t=run.t, voltage=None if robot.drive.kind == SPEED else run.voltage, twist_command=run.twist_command
    )
    log = logged_run.replace(**{name: measured_channels[name] for name in sensors})
    return identify(log, robot, OutputError(**options)).estimate


def _remembered(errors: FloatArray, memory: FloatArray) -> FloatArray:
    """Errors (rows, columns) that stay for some rows."""
    return np.column_stack([np.convolve(column, memory)[: len(column)] for column in errors.T])
