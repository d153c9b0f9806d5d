"""What identified numbers are worth: robots richer than the paper's, driven by controllers that know them from a log.

Each robot is identified from one minute of volts and noisy wheel speeds. Beside it stands the data sheet: no friction,
no rotors, resistance and motor constants drawn within 10 %. Both drive the same robot along four paths that no gain was
chosen on; what counts is the error with identified numbers over that with the data sheet.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import omnidyn
from benchmarks.table import Table, machine
from omnidyn.control.circumstances import Circumstances
from omnidyn.control.closed_loop import told_of_loop, tracked
from omnidyn.control.controllers import NAMES, ControllerFile
from omnidyn.control.paths.path import path
from omnidyn.model.friction import DirectionFriction, Friction, WheelFriction
from omnidyn.model.robot import Robot

PATHS = (
    "eight:size_m=0.4,period_s=6",
    "circle:radius_m=0.4,speed_m_s=0.45,turn_rad_s=1",
    "square:side_m=0.6,speed_m_s=0.3",
    "zigzag:speed_m_s=0.12,turn_rad_s=0.8,period_s=3",
)
LONGEST, SECONDS, DT, HOLD, NOISE = 6.0, 60, 0.02, 25, 0.2  # [s], [s], [s], rows a level, [rad/s] of a wheel
DATA_SHEET = 0.1  # R, K_t and K_e are drawn within this share
CONTROLLERS: dict[str, dict[str, Any]] = {
    "mpc": {},
    "mpc_no_observer": {"observer": False},
    "pid": {},
    "feedforward": {},
}
GOALS = {"mpc": 0.5, "mpc_no_observer": 0.2}


def robots() -> dict[str, tuple[Robot, tuple[str, ...]]]:
    """Name -> (the robot, what beside its friction is identified)."""
    plain = omnidyn.load_robot("axebot")
    ellipse = DirectionFriction(coulomb=(2.6, 1.9), viscous=0.9, yaw_coulomb=0.11, yaw_viscous=0.01)
    four = plain.replace(wheels=plain.wheels.replace(azimuth_deg=(45.0, 135.0, 225.0, 315.0)))
    turning = plain.body.replace(rotating_frame=True)
    every = {
        "ellipse": plain.replace(friction=Friction(direction=ellipse)),
        "wheels": plain.replace(friction=Friction(wheels=WheelFriction(coulomb=0.9, viscous=0.4))),
        "current limit": plain.replace(motor=plain.motor.replace(current_limit=2.2)),
        "turning frame": plain.replace(body=turning),
        "four wheels": four.replace(body=turning, friction=Friction(wheels=WheelFriction(coulomb=0.7, viscous=0.3))),
        "rotors": plain.replace(motor=plain.motor.replace(rotor_inertia=1.5e-6)),
    }
    more = {"rotors": ("motor.rotor_inertia_kg_m2",)}
    warm = {name: each.replace(motor=each.motor.replace(resistance=1.83)) for name, each in every.items()}
    return {name: (each, ("motor.resistance_ohm", *more.get(name, ()))) for name, each in warm.items()}


def log_of(robot: Robot, seed: int) -> omnidyn.Run:
    """A minute of volts, a new level every half second, and what noisy encoders say of it."""
    random, n = np.random.default_rng(seed), robot.wheels.count
    levels = random.uniform(-5.5, 5.5, (round(SECONDS / DT / HOLD), n))
    run = omnidyn.simulate(robot, np.repeat(levels, HOLD, axis=0), DT)
    assert run.wheel_speed is not None
    seen = run.wheel_speed + NOISE * random.standard_normal(run.wheel_speed.shape)
    return run.replace(twist=None, pose=None, current=None, wheel_speed=seen, source=robot.name)


LEVELS = ("coulomb", "viscous", "breakaway", "yaw_coulomb", "yaw_viscous", "yaw_breakaway")


def guessed(robot: Robot) -> Robot:
    """A robot whose friction has the right shape and half the size, its motors those of the data sheet."""
    halves = {}
    for name in type(robot.friction).model_fields:
        law = getattr(robot.friction, name)
        levels = {key: _half(value) for key, value in dict(law).items() if key in LEVELS and value is not None}
        halves[name] = law.replace(**levels)
    motor = robot.motor.replace(resistance=1.69, rotor_inertia=0.5 * np.max(robot.motor.rotor_inertia))
    return robot.replace(name="guess", friction=robot.friction.replace(**halves), motor=motor)


def _half(value: Any) -> Any:
    return tuple(0.5 * each for each in value) if isinstance(value, tuple) else 0.5 * value


def data_sheet(robot: Robot, seed: int) -> Robot:
    """What is known without a log."""
    random = np.random.default_rng(seed)
    off = 1.0 + DATA_SHEET * random.uniform(-1.0, 1.0, 2)
    motor = robot.motor.replace(
        resistance=1.69 * off[0], torque_constant=0.0059 * off[1], emf_constant=0.0059 * off[1], rotor_inertia=0.0
    )
    return robot.replace(name="data sheet", motor=motor, friction=Friction())


def errors(known: Robot, plant: Robot, name: str, options: dict[str, Any]) -> list[float]:
    """Position rmse along each path [mm]."""
    found = []
    for each in map(path, PATHS):
        around = Circumstances(duration=min(each.duration, LONGEST))
        control = ControllerFile(name.partition("_")[0], options).make(known, **told_of_loop(known, around))
        found.append(1e3 * tracked(plant, each, control, around).rmse_position)
    return found


def geometric_mean(values: list[float]) -> float:
    """The exponential of the mean of the logarithms."""
    return float(np.exp(np.mean(np.log(values))))


def measure() -> Table:
    """A row per controller and robot."""
    columns = ["controller", "robot", "identified mm", "data sheet mm", "ratio"]
    table = Table("control_plants: error with identified numbers over that with the data sheet", columns)
    table.notes.append(machine())
    ratios: dict[str, list[float]] = {}
    shown = {name: options for name, options in CONTROLLERS.items() if name.partition("_")[0] in NAMES}
    for seed, (kind, (plant, more)) in enumerate(robots().items()):
        model = omnidyn.identify(
            [log_of(plant, seed)], guessed(plant), omnidyn.OutputError(free=["friction", *more])
        ).robot
        for name, options in shown.items():
            own, sheet = (
                geometric_mean(errors(each, plant, name, options)) for each in (model, data_sheet(plant, seed))
            )
            ratios.setdefault(name, []).append(own / sheet)
            cells: dict[str, Any] = {
                "identified mm": f"{own:.3g}",
                "data sheet mm": f"{sheet:.3g}",
                "ratio": f"{own / sheet:.3f}",
            }
            table.add(controller=name, robot=kind, **cells)
    for name, found in ratios.items():
        goal = GOALS.get(name)
        met = None if goal is None else float(np.mean(found)) <= goal
        words = "" if goal is None else f"<= {goal:g}"
        table.add(words, met, controller=name, robot="mean of all", ratio=f"{np.mean(found):.3f}")
    return table
