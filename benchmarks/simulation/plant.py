"""The implicit engine: cost of a fixed step and of each law, iterations of its solver, error against cost beside peers.

One run, one thread. Whole call: simulate() from arrays to a Run, divided by its steps; kernel: the march alone.
Peers solve the paper's law on the work item of tests/reference (10 s at 1 kHz, 50-digit truth every 10 ms). MuJoCo runs
where it can be imported; Siconos and DART do not install beside us, their figures are quoted from EVIDENCE.md (other
machine, same kind of work item), and say so.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.simulation.tanh import run_tanh
from benchmarks.table import Table, Times, machine, one_core
from omnidyn.model.dynamics import state_space
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.layout import new_state
from omnidyn.model.robot import Robot
from omnidyn.model.stick_slip.plant import plant
from omnidyn.simulation.implicit.implicit_march import run_implicit
from omnidyn.simulation.simulate import simulate
from omnidyn.simulation.slip.plant import slip_plant
from omnidyn.simulation.slip.slip_march import SlipOutcome, rolling, run_slipping
from omnidyn.simulation.speed_loop import no_loop
from tests.reference.make import FILE
from tests.support.robots import TABLE_3, robot_of, table_3_voltages

DT = 1e-3
GOAL_PAPER, GOAL_FULL = 2.0, 5.0  # us a step
EVENTS_ROWS = 1000  # scipy with events is slow: the first second
QUOTED = [  # us/step, m/s, rad/s; EVIDENCE.md section 3
    ("Siconos EulerMoreau + Lemke, 1 ms (quoted)", 7.5, 3.3e-3, 3.0e-2),
    ("DART, joint Coulomb friction, 1 ms (quoted)", 7.5, 3.3e-3, 3.1e-2),
]
FALLING: dict[str, Any] = {"breakaway": (2.8, 1.9, 0.13), "stribeck_speed": (0.02, 0.02, 0.2)}
BENT = {"stiffness": (1e4, 1e4, 1e2)}
LAWS: dict[str, dict[str, Any]] = {  # on the axes; breakaway above Coulomb friction where a law has it
    "Coulomb": {},
    "breakaway": {"breakaway": FALLING["breakaway"]},
    "Stribeck": FALLING,
    "Karnopp": {"law": "karnopp", "karnopp_speed": (2e-3, 2e-3, 2e-2), "breakaway": FALLING["breakaway"]},
    "Dahl": {"law": "dahl", **BENT},
    "LuGre": {"law": "lugre", **BENT, **FALLING},
    "elasto-plastic": {"law": "elastoplastic", **BENT, **FALLING},
}
LEVELS_ALONG: dict[str, Any] = {"coulomb": (2.2, 1.5), "viscous": 0.95, "yaw_coulomb": 0.099, "yaw_viscous": 0.01}
HELD_ALONG: dict[str, Any] = {"breakaway": (2.8, 1.9), "yaw_breakaway": 0.13}
FALLING_ALONG: dict[str, Any] = {**HELD_ALONG, "stribeck_speed": 0.02, "yaw_stribeck_speed": 0.2}
BENT_ALONG: dict[str, Any] = {"stiffness": 1e4, "yaw_stiffness": 1e2}
ALONG: dict[str, dict[str, Any]] = {  # the same along the direction of travel
    "Coulomb": {},
    "Karnopp": {"law": "karnopp", "karnopp_speed": 2e-3, "yaw_karnopp_speed": 2e-2, **HELD_ALONG},
    "Dahl": {"law": "dahl", **BENT_ALONG},
    "LuGre": {"law": "lugre", **BENT_ALONG, **FALLING_ALONG},
    "elasto-plastic": {"law": "elastoplastic", **BENT_ALONG, **FALLING_ALONG},
}
SLIPPERY = {"traction_mu": 0.2, "wheel_inertia": 2e-5}
COLUMNS = ["engine", "us/step", "cpu us/step", "kernel us/step", "error m/s", "error rad/s", "p50", "p99", "max"]
NO_MUJOCO = "MuJoCo skipped: not installed here (python -m pip install -r benchmarks/peers.txt)"

XML = """<mujoco><option timestep="{dt}" gravity="0 0 0" integrator="implicitfast"><flag contact="disable"/></option>
<worldbody>
<body><joint name="x" type="slide" axis="1 0 0" damping="{b[0]}" frictionloss="{c[0]}" {sol}/>
<geom type="sphere" size=".1" mass="{m[0]}"/></body>
<body><joint name="y" type="slide" axis="0 1 0" damping="{b[1]}" frictionloss="{c[1]}" {sol}/>
<geom type="sphere" size=".1" mass="{m[1]}"/></body>
<body><joint name="w" type="hinge" axis="0 0 1" damping="{b[2]}" frictionloss="{c[2]}" {sol}/>
<inertial pos="0 0 0" mass="1" diaginertia="{m[2]} {m[2]} {m[2]}"/></body>
</worldbody><actuator><motor joint="x"/><motor joint="y"/><motor joint="w"/></actuator></mujoco>"""
STIFFEST = 'solreffriction="{} 1" solimpfriction="0.9999 0.9999 0.001"'  # the best setting found: 2 steps


def paper() -> Robot:
    """Table 3, kept from the exact engine by a limit that is never reached."""
    robot = robot_of(TABLE_3, "paper's law")
    return robot.replace(motor=robot.motor.replace(current_limit=1e3))


def full() -> Robot:
    """Ellipse and wheels, turning frame, current limit that is reached."""
    robot = robot_of(TABLE_3, "ellipse + wheels + rotating frame + limit")
    return robot.replace(
        body=robot.body.replace(rotating_frame=True),
        motor=robot.motor.replace(current_limit=1.5),
        friction=Friction(
            direction=DirectionFriction(coulomb=(1.2, 0.8), viscous=0.5, yaw_coulomb=0.04, yaw_viscous=0.005),
            wheels=WheelFriction(coulomb=0.4, viscous=0.2),
        ),
    )


def with_law(name: str) -> Robot:
    """The paper's robot with a law on its axes, at the levels of Table 3."""
    robot = paper()
    levels = {"viscous": robot.friction.axes.viscous, "coulomb": robot.friction.axes.coulomb}
    return robot.replace(friction=Friction(axes=AxesFriction(**levels, **LAWS[name])))


def along(name: str) -> Robot:
    """The paper's robot with a law along its direction of travel."""
    return paper().replace(friction=Friction(direction=DirectionFriction(**LEVELS_ALONG, **ALONG[name])))


def slipping(robot: Robot) -> Robot:
    """The same robot on a floor so slippery that its wheels slip under these voltages."""
    return robot.replace(wheels=robot.wheels.replace(**SLIPPERY))


def march(robot: Robot, voltage: np.ndarray, tol: float) -> Any:
    """A call of the compiled march alone, all arrays made before, and what it returns."""
    if robot.wheels.traction_mu is not None:
        return _march_of_slip(robot, voltage, tol)
    numbers = plant(robot)
    bound = np.full(voltage.shape, np.inf if robot.motor.current_limit is None else robot.motor.current_limit)
    dt, state = np.full(len(voltage), DT), new_state(numbers)
    return partial(run_implicit, numbers, voltage, bound, dt, state, np.zeros(3), no_loop(len(voltage.T)), tol)


def _march_of_slip(robot: Robot, voltage: np.ndarray, tol: float) -> Any:
    numbers = slip_plant(robot)
    bound, dt, state = np.full(voltage.shape, np.inf), np.full(len(voltage), DT), rolling(numbers, np.zeros(3))
    return partial(run_slipping, numbers, voltage, bound, dt, state, np.zeros(3), no_loop(len(voltage.T)), tol)


def ours(robot: Robot, voltage: np.ndarray, tol: float | None, repeats: int) -> tuple[dict[str, Any], np.ndarray]:
    """(cells of our row, twist)."""
    whole, kernel, call = Times(), Times(), march(robot, voltage.copy(), tol or 0.0)
    run = whole.measure(partial(simulate, robot, voltage, DT, tol=tol), repeats)
    outcome = kernel.measure(call, repeats)
    assert run.twist is not None
    cells = per_step(whole, len(voltage)) | {"kernel us/step": min(kernel.cpu) * 1e3 / len(voltage)}
    if isinstance(outcome, SlipOutcome):
        assert np.array_equal(outcome.twist, run.twist)
        assert outcome.contact.any()
        return cells, run.twist
    assert np.array_equal(outcome.state.x[:, :2], run.twist[:, :2])
    p50, p99 = np.percentile(outcome.iterations, [50, 99])
    return cells | {"p50": int(p50), "p99": int(p99), "max": int(outcome.iterations.max())}, run.twist


def per_step(times: Times, steps: int) -> dict[str, float]:
    """The least times of a call [us a step]."""
    return {"us/step": min(times.wall) * 1e3 / steps, "cpu us/step": min(times.cpu) * 1e3 / steps}


def errors(twist: np.ndarray, truth: np.ndarray) -> dict[str, float]:
    """Largest error over the samples that the truth has, every tenth; `twist` may be shorter."""
    kept = twist[::10]
    error = np.abs(kept - truth[: len(kept)]).max(axis=0)
    return {"error m/s": float(error[:2].max()), "error rad/s": float(error[2])}


def scipy_events(robot: Robot, voltage: np.ndarray) -> np.ndarray:
    """solve_ivp with sgn kept: a terminal event at every zero of an axis, a restart at every row."""
    system = state_space(robot)
    rate, level, drive = -np.diag(system.A), -np.diag(system.K), voltage @ system.B.T
    out, v = np.zeros((len(voltage) + 1, 3)), np.zeros(3)
    for k, force in enumerate(drive):
        for j in range(3):
            t = 0.0
            while t < DT:
                sign = np.sign(v[j]) if v[j] != 0.0 else np.sign(force[j]) * (abs(force[j]) > level[j])
                if sign == 0.0:
                    break

                def crosses(t: float, y: np.ndarray) -> float:
                    return y[0]

                crosses.terminal, crosses.direction = True, -sign  # type: ignore[attr-defined]
                g, a = force[j] - sign * level[j], rate[j]
                part = solve_ivp(
                    lambda t, y, a=a, g=g: [g - a * y[0]], (t, DT), [v[j]], rtol=1e-9, atol=1e-12, events=crosses
                )
                t = part.t[-1]
                v[j] = 0.0 if part.status == 1 else part.y[0, -1]
        out[k + 1] = v
    return out


def mujoco_run(robot: Robot, voltage: np.ndarray, friction: str, substeps: int = 1) -> Any:
    """A call that runs three free joints with frictionloss and damping, forces per step. None: not installed.

    Its own loop over the steps, in C (mujoco.rollout), is the fastest way it has.
    """
    try:
        import mujoco
        from mujoco import rollout
    except ImportError:
        return None
    system, mass = state_space(robot), np.array([TABLE_3.mass, TABLE_3.mass, TABLE_3.inertia])
    text = XML.format(dt=DT / substeps, b=-np.diag(system.A) * mass, c=-np.diag(system.K) * mass, m=mass, sol=friction)
    model = mujoco.MjModel.from_xml_string(text)
    data, rest = mujoco.MjData(model), np.zeros(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    force = np.repeat(voltage @ system.B.T * mass, substeps, axis=0)

    def run() -> np.ndarray:
        state, _ = rollout.rollout(model, data, rest, force)
        return np.vstack([np.zeros(3), state[0, substeps - 1 :: substeps, -3:]])

    return run


def measure() -> Table:
    """Ours first and last, rivals between; then whether any of them is both faster and nearer."""
    table = Table("plant: the implicit engine, 10,000 rows of 1 ms", COLUMNS)
    table.notes.append(machine())
    robot, voltage = robot_of(TABLE_3), table_3_voltages()
    with np.load(FILE) as file:
        truth = file["twist_1.0"]
    points: list[tuple[str, float, float, float, bool]] = []

    def add(name: str, cells: dict[str, Any], mine: bool, goal: str = "", met: bool | None = None) -> None:
        table.add(goal, met, engine=name, **cells)
        if "error m/s" in cells:
            cost = cells.get("cpu us/step", cells["us/step"])
            points.append((name, cost, cells["error m/s"], cells["error rad/s"], mine))

    with one_core():
        cells, twist = ours(paper(), voltage, None, 100)
        whole = cells["cpu us/step"]
        add("omnidyn fixed 1 ms, paper's law", cells | errors(twist, truth), True, "<= 2 us", whole <= GOAL_PAPER)
        cells, _ = ours(full(), voltage, None, 50)
        words = "omnidyn fixed 1 ms, ellipse + wheels + rotating frame + current limit"
        add(words, cells, True, "<= 5 us", cells["cpu us/step"] <= GOAL_FULL)
        for name in LAWS:
            add(f"omnidyn fixed 1 ms, law: {name}", ours(with_law(name), voltage, None, 20)[0], True)
        for name in ALONG:
            add(f"omnidyn fixed 1 ms, law: {name} along the way", ours(along(name), voltage, None, 20)[0], True)
        for name in ("Coulomb", "LuGre"):
            words = f"omnidyn fixed 1 ms, law: {name}, wheels slip"
            add(words, ours(slipping(with_law(name)), voltage, None, 20)[0], True)
        for name in ("Coulomb", "Dahl", "LuGre", "elasto-plastic"):
            words = f"omnidyn fixed 1 ms, law: {name} along the way, wheels slip"
            add(words, ours(slipping(along(name)), voltage, None, 20)[0], True)
        for tol in (1e-3, 1e-4, 1e-5, 1e-6, 1e-7):
            cells, twist = ours(paper(), voltage, tol, 3)
            found = errors(twist, truth)
            near = max(found["error m/s"], found["error rad/s"] / 10) <= tol
            add(f"omnidyn adaptive, tol {tol:g}", cells | found, True, "error <= tol, 10 tol", near)
        exact = Times()
        run = exact.measure(partial(simulate, robot, voltage, DT), 20)
        add("omnidyn exact", per_step(exact, len(voltage)) | errors(run.twist, truth), True)
        rivals(robot, voltage, truth, add, table)
    for name, cost, error, turning in QUOTED:
        add(name, {"us/step": cost, "error m/s": error, "error rad/s": turning}, False)
    verdict(table, points)
    return table


def rivals(robot: Robot, voltage: np.ndarray, truth: np.ndarray, add: Any, table: Table) -> None:
    """scipy and MuJoCo on the same rows."""
    for eps, rtol in ((1e-2, 1e-6), (1e-3, 1e-6), (1e-4, 1e-8)):
        times = Times()
        step = DT if eps < 1e-3 else np.inf
        twist = times.measure(partial(run_tanh, robot, voltage, DT, eps, rtol, step), 1)
        add(f"scipy LSODA, tanh(v/{eps:g})", per_step(times, len(voltage)) | errors(twist, truth), False)
    times = Times()
    twist = times.measure(partial(scipy_events, robot, voltage[:EVENTS_ROWS]), 1)
    add("scipy RK45 with events, first second", per_step(times, EVENTS_ROWS) | errors(twist, truth), False)
    for name, friction, substeps in (
        ("MuJoCo default, 1 ms", "", 1),
        ("MuJoCo stiffest friction, 1 ms", STIFFEST.format(0.002), 1),
        ("MuJoCo stiffest friction, 0.1 ms", STIFFEST.format(0.0002), 10),
    ):
        call = mujoco_run(robot, voltage, friction, substeps)
        if call is None:
            table.notes.append(NO_MUJOCO)
            break
        times = Times()
        twist = times.measure(call, 3)
        add(name, per_step(times, len(voltage)) | errors(twist, truth), False)


def verdict(table: Table, points: list[tuple[str, float, float, float, bool]]) -> None:
    """Whether a peer is both faster and nearer than any row of ours, and which of ours beats each of them on both."""
    mine, peers = ([p for p in points if p[4] == side] for side in (True, False))
    better = [p[0] for p in peers if any(p[1] < o[1] and p[2] < o[2] and p[3] < o[3] for o in mine)]
    words = ", ".join(better) or "none"
    table.add("none", not better, engine="peers both faster and nearer than a row of ours: " + words)
    beaten = [p[0] for p in peers if any(o[1] < p[1] and o[2] < p[2] and o[3] < p[3] for o in mine)]
    table.notes.append(f"beaten on both by a row of ours: {len(beaten)} of {len(peers)} peers")
    table.notes += [
        "p50, p99, max: iterations of the friction solver, worst stage of each row, of wheels that roll; work item: "
        "10 s, 10,000 rows",
        "us/step: the whole call, wall time; cpu: the same in processor time; kernel: the compiled march alone (cpu)",
        "peers solve the twist alone; ours includes pose, currents, wheel speeds, and serves every shape of friction",
        "quoted: EVIDENCE.md section 3, measured on another day on a machine of the same kind, not in this run",
    ]
