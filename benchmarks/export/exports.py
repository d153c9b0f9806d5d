"""One robot in every tool: the paper's, exported, read back by the tool, run beside our engine.

The paper's steps (Table 1) forward and back with rest in between, 1 kHz; then a minute within the dead zone.
"""

from __future__ import annotations

import importlib
import importlib.util
import re
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

import omnidyn
from benchmarks.export import exports_read
from benchmarks.size import scaled
from benchmarks.table import Table, Times, machine
from omnidyn.arrays import FloatArray
from omnidyn.model.deadzone import axis_patterns, breakaway_voltage
from omnidyn.model.robot import Robot
from omnidyn.paper.tables import TABLE_1
from tests.support.exported import Stepper

DT, HELD, REST = 1e-3, 400, 200
STEPS = scaled(400_000, 4000)  # of the loop in C that is timed
NEAR = 1e-9
CREEP = 0.1  # [mm] in a minute
TURNING = (1.5, 5.5, -2.5)  # [V] settles at another speed with the turning frame than without
LOOP = """
#include "omnidyn_step.h"
void many(const omnidyn_real *u, int rows, int steps, omnidyn_real h, omnidyn_real *t, omnidyn_real *p);
void many(const omnidyn_real *u, int rows, int steps, omnidyn_real h, omnidyn_real *t, omnidyn_real *p)
{
    int k;
    for (k = 0; k < steps; k++) omnidyn_step(u + OMNIDYN_WHEELS * (k % rows), h, t, p);
}
"""


def volts() -> FloatArray:
    """The rows of Table 1, one after the other: each forward, rest, back, rest. Shape (rows, 3)."""
    rows = [np.array(row.voltage, dtype=float) for axis in TABLE_1.values() for row in axis]
    return np.concatenate(
        [np.repeat([row, np.zeros(3), -row, np.zeros(3)], [HELD, REST, HELD, REST], axis=0) for row in rows]
    )


def resting(robot: Robot, rows: int) -> FloatArray:
    """Half of the breakaway voltage forward. Shape (rows, 3)."""
    pattern = axis_patterns(robot)[0]
    return np.tile(0.5 * breakaway_voltage(robot, pattern) * pattern, (rows, 1))


def measure() -> Table:
    """Errors of speeds and pose against our engine, drift of a minute at rest, time of a step, size."""
    columns = ["tool", "v m/s", "omega rad/s", "x, y m", "drift mm/min", "ns/step", "kB", exports_read.COLUMN]
    table = Table("exports: the paper's robot in other tools", columns)
    table.notes.append(machine())
    robot = omnidyn.load_robot("axebot")
    with tempfile.TemporaryDirectory() as name:
        for row in chain(_rows(robot, Path(name)), exports_read.rows(robot)):
            goal, met = row.pop("goal", ("", None))
            table.add(goal, met, **row)
    table.notes.append(
        f"largest difference to our exact engine over {len(volts())} steps of 1 ms: the steps of Table 1"
    )
    table.notes.append("turning: the feet of the MuJoCo model take its friction along, as ours turns with the body")
    table.notes.append("drift: a minute at half of the breakaway voltage; MuJoCo: of 6 s, times 10")
    table.notes.append("off: largest relative error of what the tool reads; covariances are those of other logs")
    table.notes.append("ns/step: least of 5; the FMU through fmpy, whose loop is Python; C with gcc -O2")
    return table


def _rows(robot: Robot, folder: Path) -> Iterator[dict[str, Any]]:
    program = volts()
    run = omnidyn.simulate(robot, program, DT)
    assert run.twist is not None
    assert run.pose is not None
    rest = omnidyn.simulate(robot, resting(robot, 6000), 0.01)
    assert rest.pose is not None
    yield {
        "tool": "omnidyn, exact engine",
        "v m/s": 0.0,
        "omega rad/s": 0.0,
        "x, y m": 0.0,
        "drift mm/min": float(np.abs(rest.pose).max() * 1e3),
        "ns/step": _least(lambda: omnidyn.simulate(robot, program, DT)) / len(program),
    }
    for precision in ("double", "single"):
        yield _c(robot, folder / precision, precision, program, run)
    for name, make in {"fmpy": _fmu, "mujoco": _mujoco, "control": _control, "wpimath": _wpilib}.items():
        if importlib.util.find_spec(name) is None:
            yield {"tool": f"{name}: not installed"}
        else:
            yield from make(robot, folder, program, run)


def _least(call: Callable[[], Any]) -> float:
    """The least time of five calls [ns]."""
    times = Times()
    times.measure(call, 5)
    return min(times.wall) * 1e6


def _errors(twist: FloatArray, pose: FloatArray, run: Any) -> dict[str, Any]:
    return {
        "v m/s": float(np.abs(twist - run.twist)[:, :2].max()),
        "omega rad/s": float(np.abs(twist - run.twist)[:, 2].max()),
        "x, y m": float(np.abs(pose - run.pose)[:, :2].max()),
    }


def _c(robot: Robot, folder: Path, precision: str, program: FloatArray, run: Any) -> dict[str, Any]:
    import ctypes

    step = Stepper(robot, folder, precision)
    found = _errors(*step.run(program, DT), run)
    creep = float(np.abs(step.run(resting(robot, 6000), 0.01)[1]).max() * 1e3)
    (folder / "many.c").write_text(LOOP)
    command = ["gcc", "-std=c99", "-O2", "-shared", "-fPIC", "-o", "many.so", "many.c", "omnidyn_step.c", "-lm"]
    subprocess.run(command, cwd=folder, check=True)
    many = ctypes.CDLL(str(folder / "many.so")).many
    real = ctypes.c_float if precision == "single" else ctypes.c_double
    many.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_int, real, ctypes.c_void_p, ctypes.c_void_p]
    given, state = np.ascontiguousarray(program, step.real), np.zeros((2, 3), step.real)
    cost = _least(lambda: many(given.ctypes.data, len(given), STEPS, DT, state[0].ctypes.data, state[1].ctypes.data))
    subprocess.run(["gcc", "-std=c99", "-O2", "-c", "omnidyn_step.c"], cwd=folder, check=True)
    size = (folder / "omnidyn_step.o").stat().st_size / 1e3
    exact = precision == "double"
    met = creep == 0.0 and (not exact or max(found.values()) <= NEAR)
    goal = (f"<= {NEAR:g}, drift 0" if exact else "drift 0", met)
    return {
        "tool": f"c-model, {precision}",
        **found,
        "drift mm/min": creep,
        "ns/step": cost / STEPS,
        "kB": size,
        "goal": goal,
    }


def _fmu(robot: Robot, folder: Path, program: FloatArray, run: Any) -> Iterator[dict[str, Any]]:
    import fmpy

    path = omnidyn.export.fmu(robot).write(folder / "robot.fmu")[0]

    def simulated(rows: FloatArray, dt: float) -> FloatArray:
        kinds = [("time", float), *((f"u{k + 1}_V", float) for k in range(3))]
        given = np.array([(k * dt, *row) for k, row in enumerate(rows)], dtype=kinds)
        out = fmpy.simulate_fmu(str(path), stop_time=len(rows) * dt, step_size=dt, output_interval=dt, input=given)
        names = ("vx_m_s", "vy_m_s", "omega_rad_s", "x_m", "y_m", "heading_rad")
        return np.stack([out[name] for name in names], axis=1)[: len(rows) + 1]

    begun = time.perf_counter()
    # A step of a power of two is told to the unit without rounding: 1 ms is not.
    out = simulated(program, 2.0**-10)
    cost = (time.perf_counter() - begun) * 1e9 / len(program)
    found = _errors(out[:, :3], out[:, 3:], omnidyn.simulate(robot, program, 2.0**-10))
    creep = float(np.abs(simulated(resting(robot, 3840), 2.0**-6)[:, 3:]).max() * 1e3)
    met = max(found.values()) <= NEAR and creep == 0.0
    yield {
        "tool": "fmu, by fmpy",
        **found,
        "drift mm/min": creep,
        "ns/step": cost,
        "kB": path.stat().st_size / 1e3,
        "goal": (f"<= {NEAR:g}, drift 0", met),
    }


def _mujoco(robot: Robot, folder: Path, program: FloatArray, run: Any) -> Iterator[dict[str, Any]]:
    mujoco: Any = importlib.import_module("mujoco")
    text = omnidyn.export.mjcf(robot).text
    stiff = r' (solreffriction|solref|solimpfriction|solimp|noslip_iterations|impratio)="[^"]*"'
    plain = re.sub(stiff, "", text)
    for name, model_text in (("mjcf, as exported", text), ("mjcf, MuJoCo's default friction", plain)):
        model = mujoco.MjModel.from_xml_string(model_text)

        def simulated(rows: FloatArray, model: Any = model) -> FloatArray:
            data, out = mujoco.MjData(model), np.zeros((len(rows) + 1, 6))
            for k, row in enumerate(rows):
                data.ctrl[:] = row
                mujoco.mj_step(model, data)
                out[k + 1] = *data.qvel[:3], *data.qpos[:3]
            return out

        begun = time.perf_counter()
        out = simulated(program)
        cost = (time.perf_counter() - begun) * 1e9 / len(program)
        creep = 10.0 * float(np.abs(simulated(resting(robot, 6000))[-1, 3:5]).max() * 1e3)
        goal = (f"drift <= {CREEP:g} mm", creep <= CREEP) if model_text is text else ("", None)
        yield {
            "tool": name,
            **_errors(out[:, :3], out[:, 3:], run),
            "drift mm/min": creep,
            "ns/step": cost,
            "kB": len(model_text) / 1e3,
            "goal": goal,
        }
    yield _turning(robot, mujoco)


def _turning(robot: Robot, mujoco: Any) -> dict[str, Any]:
    """MuJoCo's body is Newtonian: a push that turns the robot, beside our robot with its turning frame on."""
    turning = robot.replace(body=robot.body.replace(rotating_frame=True))
    push = np.tile(TURNING, (1000, 1))
    run = omnidyn.simulate(turning, push, DT)
    model = mujoco.MjModel.from_xml_string(omnidyn.export.mjcf(turning).text)
    data, twist, pose = mujoco.MjData(model), np.zeros((1001, 3)), np.zeros((1001, 3))
    for k, row in enumerate(push):
        data.ctrl[:] = row
        mujoco.mj_step(model, data)
        pose[k + 1] = data.qpos[:3]
        cos, sin = np.cos(data.qpos[2]), np.sin(data.qpos[2])
        twist[k + 1] = cos * data.qvel[0] + sin * data.qvel[1], cos * data.qvel[1] - sin * data.qvel[0], data.qvel[2]
    return {"tool": f"mjcf, u = {TURNING} V for 1 s, turning frame on", **_errors(twist, pose, run)}


def _control(robot: Robot, folder: Path, program: FloatArray, run: Any) -> Iterator[dict[str, Any]]:
    control: Any = importlib.import_module("control")
    rows = 100  # a solver of smooth equations, through one push; what comes to rest it does not follow
    push = np.tile([0.0, 4.0, -4.0], (rows, 1))
    own = omnidyn.simulate(robot, push, 0.01)
    t = np.arange(rows + 1) * 0.01
    begun = time.perf_counter()
    out = control.input_output_response(
        omnidyn.interop.nonlinear_system(robot),
        t,
        np.vstack([push, push[-1:]]).T,
        solve_ivp_kwargs={"rtol": 1e-9, "atol": 1e-10},
    ).outputs.T
    cost = (time.perf_counter() - begun) * 1e9 / rows
    yield {"tool": "python-control, one push of 1 s", **_errors(out[:, :3], out[:, 3:], own), "ns/step": cost}


def _wpilib(robot: Robot, folder: Path, program: FloatArray, run: Any) -> Iterator[dict[str, Any]]:
    controller: Any = importlib.import_module("wpimath.controller")
    from omnidyn.export.feedforward.gains import gains

    found, off = gains(robot), np.zeros(3)
    for axis, goal in enumerate((0.6, 0.6, 5.0)):
        feedforward = controller.SimpleMotorFeedforwardMeters(*found.value[axis].tolist(), 0.02)
        start, end = np.zeros(3), np.zeros(3)
        start[axis], end[axis] = 0.95 * goal, goal
        push = found.pattern[axis] * feedforward.calculate(start[axis], end[axis])
        twist = omnidyn.simulate(robot, [push], 0.02, twist=start).twist
        assert twist is not None
        off[axis] = np.abs(twist[-1] - end).max()
    met = bool(off.max() <= NEAR)
    yield {
        "tool": "WPILib feed-forward, 20 ms to the next speed",
        "v m/s": float(off[:2].max()),
        "omega rad/s": float(off[2]),
        "goal": (f"<= {NEAR:g}", met),
    }


if __name__ == "__main__":
    print(measure().as_text())
