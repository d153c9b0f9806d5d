"""The chain log -> identify -> track on the plants of `control_real`: is a fitted robot better than a guessed one?

Each plant is driven for half a minute in open loop, and its encoders and volts are logged. `identify` begins with a
guess: friction 1.5 times what it is, motors a tenth off, no latency. `pid` and `mpc` with their defaults then drive the
plant by encoders, with the guess and with what was fitted. A cell is lost where the fitted robot is more than 1.1 times
as far off as the guessed one, and by more than a difference that counts. The latency is to be in its interval, or
nearer to it than the time step of the plant.

The last rows are the chain by defaults, on the ordinary robot: four wheels, a turning frame, duty with latency; and on
LeKiwi, whose firmware holds speeds. A file of `init`, which knows sizes, mass and the gains of that loop; a log of
counts and a camera of 30 Hz; `identify` with all defaults; controllers with what it wrote, and tuned for the sensors
that feed the loop, by encoders and by that camera, beside the true robot whose sensors are told. Ratios are of the rms
over the paths.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import omnidyn
from benchmarks.control_real import ALLOWED, COUNTS, DT, Instruments, errors, told
from benchmarks.control_real.paths import paths
from benchmarks.control_real.plant import SUBSTEP, Plant
from benchmarks.control_real.robots import NUMBERS, SLOWER, Numbers, robot_of
from benchmarks.table import Table, machine
from omnidyn.control.mpc.controller import Mpc
from omnidyn.control.pid import Pid
from omnidyn.identification.identification import Identification
from omnidyn.model.first_guess import first_guess
from omnidyn.model.friction import Friction
from omnidyn.model.log_effects import Sensors
from omnidyn.model.robot import Robot
from omnidyn.run import Run

SECONDS, HOLD, SEED = 30.0, 1.0, 1  # [s], [s] between two levels
FRICTION, RESISTANCE = 1.5, 1.1  # times the truth
FREE = ("friction", "motor.resistance_ohm")
CONTROLLERS = {"pid": Pid, "mpc": Mpc}
PLANTS = ("axebot", "xdrive", "mecanum")  # that take volts or duties: a guess of the friction harms them
CAMERA, MOST_RATIO = "camera 1 mm", 1.2  # of CAMERAS; error of the fitted robot over that of the true one
LEAST_DELAY = 15.0  # [ms] by which outputs of a tuned controller may act later
ORDINARY = {"xdrive": NUMBERS["xdrive"] | {"duty": True}, "lekiwi": NUMBERS["lekiwi"]}
DRIVEN = ("clover", "square", "creep")


def driven(numbers: Numbers, seed: int) -> Run:
    """Half a minute of levels on the axes of the body, as encoders and the program of the robot know it."""
    plant, random = Plant(numbers), np.random.default_rng(seed)
    rows, each = round(SECONDS / DT), round(HOLD / DT)
    shares = random.uniform(-1.0, 1.0, (rows // each, 3)) * random.choice([0.0, 0.3, 0.9], (rows // each, 1))
    unit = np.linalg.pinv(plant.directions)
    unit = unit / np.abs(unit).max(axis=0)
    levels = np.repeat(shares @ unit.T, each, axis=0)
    levels /= np.maximum(np.abs(levels).max(axis=1, keepdims=True), 1.0)
    fastest = float(np.min(plant.volts / plant.motors[3] / plant.radius))  # [rad/s] without load
    sent = levels * (fastest if plant.loop else 1.0 if plant.duty else plant.volts)
    angles = [plant.encoders()]
    for row in sent:
        plant.step(row, DT)
        angles.append(plant.encoders())
    speed = np.diff(angles, axis=0, prepend=[angles[0]])[:-1] / DT
    name = "wheel_speed_command" if plant.loop else "duty" if plant.duty else "voltage"
    inputs: dict[str, Any] = {name: sent}
    return Run(t=np.arange(rows, dtype=float) * DT, wheel_speed=speed, source="half a minute", **inputs)


def guess_of(robot: str, numbers: Numbers) -> Robot:
    """What is known before the log."""
    true = robot_of(robot, numbers)
    more = {}
    for place in ("axes", "direction"):
        law = getattr(true.friction, place)
        if law is not None:
            names = [name for name in ("coulomb", "viscous", "yaw_coulomb", "yaw_viscous") if hasattr(law, name)]
            scaled = {name: (FRICTION * np.asarray(getattr(law, name))).tolist() for name in names}
            more[place] = type(law)(**scaled)
    return true.replace(
        friction=Friction(**more),
        motor=true.motor.replace(resistance=RESISTANCE * np.asarray(true.motor.resistance)),
        drive=true.drive.replace(latency=0.0),
        sensors=Sensors(twist="mean"),
        priors={},
    )


def _add_latency(table: Table, robot: str, plant: Plant, fit: Identification) -> None:
    """A row: the latency that was fitted, beside the truth [ms]."""
    late = fit.nuisances.get("latency.wheel_angle")
    low, high = (fit.robot.drive.latency,) * 2 if late is None else late.ci95
    off = max(low - plant.latency, plant.latency - high, 0.0)
    interval = f"{1e3 * low:.3f} to {1e3 * high:.3f} ms" if late else f"{1e3 * low:.3f} ms, not fitted"
    words: dict[str, Any] = {"fitted": interval, "true file": f"{1e3 * plant.latency:.3f} ms"}
    table.add("nearer than 0.4 ms", off < SUBSTEP, robot=robot, path="latency", guessed="0", **words)


def ordinary_log(numbers: Numbers) -> Run:
    """What the ordinary robot logs: its inputs, counts, and poses of a camera that are late."""
    run, plant = driven(numbers, SEED), Plant(numbers)
    sent = run.duty if plant.duty else run.wheel_speed_command
    assert sent is not None
    instruments, angles, poses, last = Instruments(CAMERA, plant, SEED), [plant.encoders()], [], None
    for row in sent:
        pose, _ = instruments.seen()
        poses.append(pose if last is None or not np.array_equal(pose, last) else np.full(3, np.nan))
        last = pose
        instruments.drive(row, DT)
        angles.append(plant.encoders())
    supply = np.full(len(sent), plant.volts) if plant.duty else None
    measured: dict[str, Any] = {"wheel_angle": np.array(angles[:-1]), "pose": np.array(poses), "supply": supply}
    return Run(t=run.t, duty=run.duty, wheel_speed_command=run.wheel_speed_command, **measured)


def add_ordinary(table: Table, robot: str, numbers: Numbers) -> None:
    """Rows of the chain by defaults, and the ratio of each controller and sensor to the true robot."""
    true = robot_of(robot, numbers)
    wheels = true.wheels.replace(wheel_inertia=0.0)
    loop = numbers.get("loop", ())
    guess = first_guess("ordinary", wheels, true.body.mass, float(np.max(true.motor.voltage_limit)), speed_loop=loop)
    fitted = omnidyn.identify(ordinary_log(numbers), guess).robot
    feeds = {"encoder": f"encoder:{numbers['counts']}", CAMERA: None}  # None: as in the log
    slower, seen = paths(SLOWER.get(robot, 1.0)), paths()
    course = [slower[name] if name != "creep" else seen[name] for name in DRIVEN]
    for kind in ("encoder", CAMERA):
        for controller, make in CONTROLLERS.items():
            best = np.array([errors(Plant(numbers), make(told(true, kind)), path, kind) for path in course])
            tuned = omnidyn.tune(fitted, None, controller, sensors=feeds[kind])
            delay = 1e3 * tuned.margins.delay
            words: dict[str, Any] = {"controller": f"{controller}, tuned", "lost": f"{delay:.0f} ms of delay margin"}
            goal = f"at least {LEAST_DELAY:g} ms"
            table.add(goal, delay >= LEAST_DELAY, robot=f"{robot}, {kind}", path="margin", **words)
            makers = {controller: make, f"{controller}, tuned": tuned.controller.make}
            for label, of_robot in makers.items():
                shown = np.array([errors(Plant(numbers), of_robot(fitted), path, kind) for path in course])
                for name, ours, other in zip(DRIVEN, shown, best, strict=True):
                    cells = {"fitted": f"{ours[0]:.2f}/{ours[1]:.2f}", "true file": f"{other[0]:.2f}/{other[1]:.2f}"}
                    table.add(robot=f"{robot}, {kind}", path=name, controller=label, **cells)
                ratio = float(np.sqrt(np.mean(shown[:, 0] ** 2) / np.mean(best[:, 0] ** 2)))
                each = ", ".join(f"{part:.2f}" for part in shown[:, 0] / best[:, 0])
                goal, lost = f"at most {MOST_RATIO:g} times", f"{ratio:.2f} times ({each})"
                table.add(goal, ratio <= MOST_RATIO, robot=f"{robot}, {kind}", controller=label, lost=lost)


def measure() -> Table:
    """The three robots on all paths, and the chain by defaults."""
    columns = ["robot", "path", "controller", "guessed", "fitted", "true file", "lost"]
    table = Table("control_chain: rms of position mm / heading mrad, guessed and fitted robot", columns)
    count, total = 0, 0
    for robot in PLANTS:
        numbers = NUMBERS[robot]
        guess = guess_of(robot, numbers)
        method = omnidyn.OutputError(free=FREE)
        fit = omnidyn.identify([driven(numbers, SEED)], guess, method, quick=True)
        fitted = fit.robot.replace(sensors=guess.sensors)
        true = robot_of(robot, numbers).replace(sensors=guess.sensors)
        plant = Plant(numbers)
        _add_latency(table, robot, plant, fit)
        for name in paths():
            for controller, kind in CONTROLLERS.items():
                off = {
                    label: errors(plant, kind(known), paths()[name], "encoder")
                    for label, known in (("guessed", guess), ("fitted", fitted), ("true file", true))
                }
                beaten = [
                    unit
                    for k, unit in enumerate(("mm", "mrad"))
                    if off["fitted"][k] > max(ALLOWED * off["guessed"][k], off["guessed"][k] + COUNTS[k])
                ]
                count, total = count + len(beaten), total + 2
                words: dict[str, Any] = {label: f"{cell[0]:.2f}/{cell[1]:.2f}" for label, cell in off.items()}
                table.add(robot=robot, path=name, controller=controller, lost=", ".join(beaten), **words)
    table.add("0 cells", count == 0, robot="all", lost=f"{count} of {total}")
    for robot, numbers in ORDINARY.items():
        add_ordinary(table, robot, numbers)
    table.notes.append(machine())
    return table
