"""mujoco.sysid on the logs of an ordinary robot of omni wheels: its set-up is MuJoCo's own, not ours.

The body slides along x and y and turns; it stands on one point under its centre, whose elliptic cone of contact is the
disc of friction. A motor is an actuator at a site of the body: it pushes along its wheel, and its speed is that of the
rim. Seven numbers are free, as scipy's least squares and our own fit tell them: what a volt pushes with, back-EMF,
inertia, friction of the disc and of turning. All begin at what `omnidyn init` guesses; rotors are left at 0, as in the
world that made the logs. `error` is the median and the largest of the seven against that world. Differences of 3 %:
with those that its optimiser takes by default (1.5e-8) it stays where it begins, with 1 % it takes twice as long.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import time
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any

import numpy as np

from benchmarks.ten_robots.world import World
from omnidyn.model.robot import Robot
from omnidyn.run import Run

STEP = 0.002  # [s] of MuJoCo
GRAVITY = 9.81
NUMBERS = ("push", "emf", "inertia", "coulomb", "viscous", "yaw_coulomb", "yaw_viscous")
BOUNDS = (0.05, 20.0)  # times the start
DIFFERENCE = 0.03  # relative, of its derivatives: the best of 1e-4, 1e-2, 3e-2
XML = """<mujoco><option timestep="{step}" gravity="0 0 -9.81" integrator="implicitfast" cone="elliptic"
impratio="100"/><worldbody><geom name="floor" type="plane" size="0 0 1" solref="0.004 1" friction="1 0 0"/>
<body name="robot" pos="0 0 0.05"><inertial pos="0 0 0" mass="{mass}" diaginertia="{inertia} {inertia} {inertia}"/>
<joint name="x" type="slide" axis="1 0 0" damping="1"/><joint name="y" type="slide" axis="0 1 0" damping="1"/>
<joint name="z" type="slide" axis="0 0 1"/>
<joint name="yaw" type="hinge" axis="0 0 1" damping="1" frictionloss="1" solreffriction="0.004 1"
solimpfriction="0.99 0.999 0.001"/>
<geom name="foot" type="sphere" size="0.05" mass="0" priority="1" condim="3" solref="0.004 1" friction="1 0 0"/>
<site name="centre"/></body></worldbody><actuator>{motors}</actuator><sensor>{sensors}</sensor></mujoco>"""
MOTOR = '<general name="m{i}" site="centre" gear="{x} {y} 0 0 0 {yaw}" biastype="affine" gainprm="1" biasprm="0 0 -1"/>'


def true_numbers(world: World) -> np.ndarray:
    """The seven of the world."""
    coulomb, viscous = world.coulomb, world.viscous
    motors = float(world.push[0]), float(world.emf[0])
    return np.array([*motors, world.inertia, coulomb[0], viscous[0], coulomb[2], viscous[2]])


def numbers_of(robot: Robot) -> np.ndarray:
    """The seven of a robot file whose friction is a disc; its motors are alike."""
    motor, friction = robot.motor, robot.friction.direction
    assert friction is not None
    gear = float(np.mean(motor.gear_ratio)) / float(np.mean(robot.wheels.wheel_radius))
    push = gear * float(np.mean(motor.torque_constant)) / float(np.mean(motor.resistance))
    emf = gear * float(np.mean(motor.emf_constant))
    level = float(np.mean(friction.coulomb))
    return np.array(
        [push, emf, robot.body.inertia, level, friction.viscous, friction.yaw_coulomb, friction.yaw_viscous]
    )


def model_of(mujoco: ModuleType, world: World) -> Any:
    """The spec of the robot, sizes and mass as given."""
    motors = "".join(
        MOTOR.format(i=i, x=x, y=y, yaw=yaw) for i, (x, y, yaw) in enumerate(world.G.T.astype(float).tolist())
    )
    sensors = "".join(f'<actuatorvel name="s{i}" actuator="m{i}"/>' for i in range(world.G.shape[1]))
    return mujoco.MjSpec.from_string(
        XML.format(step=STEP, mass=world.mass, inertia=world.inertia, motors=motors, sensors=sensors)
    )


def put(spec: Any, name: str, value: float, world: World) -> None:
    """Write one number into the spec."""
    body, joints = spec.body("robot"), {key: spec.joint(key) for key in ("x", "y", "yaw")}
    if name in ("push", "emf"):
        for motor in spec.actuators:
            push = value if name == "push" else float(motor.gainprm[0])
            emf = value if name == "emf" else -float(motor.biasprm[2]) / float(motor.gainprm[0])
            motor.gainprm[0], motor.biasprm[2] = push, -push * emf
    elif name == "inertia":
        body.inertia = np.full(3, value)
    elif name == "coulomb":
        spec.geom("foot").friction = np.array([value / (world.mass * GRAVITY), 0.0, 0.0])
    elif name == "yaw_coulomb":
        joints["yaw"].frictionloss = value
    else:
        for key in ("x", "y") if name == "viscous" else ("yaw",):
            joints[key].damping = np.array([value, 0.0, 0.0]).reshape(np.shape(joints[key].damping))


def putter(name: str, world: World) -> Callable[[Any, Any], None]:
    """What writes a number of sysid into a spec."""

    def write(spec: Any, number: Any) -> None:
        put(spec, name, float(number.value[0]), world)

    return write


def fit(runs: Sequence[Run], start: np.ndarray, world: World) -> tuple[np.ndarray, float]:
    """(The seven numbers, [s] of processor time) by mujoco.sysid from `start`, speeds of wheels as measured."""
    mujoco, sysid = (importlib.import_module(name) for name in ("mujoco", "mujoco.sysid"))
    spec, parameters = model_of(mujoco, world), sysid.ParameterDict()
    for name, value in zip(NUMBERS, start, strict=True):
        parameters.add(
            sysid.Parameter(
                name,
                nominal=value,
                min_value=BOUNDS[0] * value,
                max_value=BOUNDS[1] * value,
                modifier=putter(name, world),
            )
        )
        put(spec, name, float(value), world)
    model = spec.compile()
    data, sequences = mujoco.MjData(model), []
    mujoco.mj_step(model, data, 500)  # it settles on the floor
    data.qvel[:] = 0.0
    for k, run in enumerate(runs):
        assert run.voltage is not None
        assert run.wheel_speed is not None
        rows = round(float(np.median(np.diff(run.t))) / STEP)
        held = np.repeat(run.voltage[:-1], rows, axis=0)
        control = sysid.TimeSeries(np.arange(len(held) + 1) * STEP, np.vstack([held, held[-1]]))
        measured = sysid.TimeSeries.from_names(run.t - run.t[0], run.wheel_speed * world.wheel_radius[0], model)
        state = sysid.create_initial_state(model, data.qpos, data.qvel, data.act)
        sequences.append(sysid.ModelSequences(f"robot{k}", spec, f"log{k}", state, control, measured))
    residual = sysid.build_residual_fn(models_sequences=sequences)
    begun = time.process_time()
    with contextlib.redirect_stdout(io.StringIO()):  # it talks whatever `verbose` says
        found, _ = sysid.optimize(
            initial_params=parameters,
            residual_fn=residual,
            optimizer="mujoco",
            verbose=False,
            eps=DIFFERENCE,
            x_scale="jac",
        )
    return np.array(found.as_vector()), time.process_time() - begun


def errors(found: np.ndarray, world: World) -> str:
    """Median and largest error of the seven, in words."""
    off = 100.0 * np.abs(found / true_numbers(world) - 1.0)
    return f"numbers off by {np.median(off):.2g} % in the median, {NUMBERS[int(np.argmax(off))]} by {off.max():.2g} %"
