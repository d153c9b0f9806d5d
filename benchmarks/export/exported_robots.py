"""Robots of `init` and of presets in C and as FMU beside the Python engine: differences, rest, sizes, stack, tools.

Twenty robots drawn from fixed seeds (`init_robot`) under 600 rows of 2^-9 s with reversals, rests and volts beyond the
limit. What a latency does is left out of both formats: the C gets the volts as late as the robot does. Sizes are those
of clang -Oz for a Cortex-M4: code and constants, less libm and the routines of doubles.
The stack is that of the deepest chain of calls (gcc -Os -fcallgraph-info=su, x86-64).
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np

import omnidyn
from benchmarks.size import scaled
from benchmarks.table import Table, machine
from omnidyn.arrays import FloatArray
from omnidyn.export.code.fmu import OUTPUTS
from omnidyn.model.drive import Drive
from omnidyn.model.robot import Robot
from tests.support.exported import WARNINGS, Stepper, init_robot, program
from tests.support.random_calls import VALID, of_step

ROBOTS, ROWS, DT = scaled(20, 2), scaled(600, 100), 2.0**-9
PRESETS = ("robotino", "four-wheel", "mecanum")
NEAR = 1e-6  # [m/s], and 10 times as much in rad/s: the tolerance of the engine
CALLS = scaled(20_000, 200)
MATH_H = """#define INFINITY __builtin_inf()
#define NAN __builtin_nan("")
double sqrt(double), sin(double), cos(double), exp(double), pow(double, double), hypot(double, double), fabs(double);
double copysign(double, double), ceil(double), expm1(double), log1p(double);
float sqrtf(float), sinf(float), cosf(float), expf(float), powf(float, float), hypotf(float, float), fabsf(float);
float copysignf(float, float), ceilf(float);
"""
M4 = [
    "clang",
    "--target=thumbv7em-none-eabi",
    "-mcpu=cortex-m4",
    "-mfloat-abi=soft",
    "-std=c99",
    "-Oz",
    "-ffreestanding",
]


def measure() -> Table:
    """A row for each robot."""
    differences = ["C m/s", "C rad/s", "C m, rad", "FMU m/s, rad/s", "at rest"]
    costs = ["us/step", "M4 kB", "stack B", "fixed us/step", "fixed slowest us", "fixed M4 kB", "fixed stack B"]
    costs += ["single m/s, rad/s", "single us/step", "single M4F kB", "single stack B"]
    table = Table(
        "exported robots: C and FMU beside the Python engine", ["robot", "engine", *differences, *costs, "tools"]
    )
    table.notes.append(machine())
    robots = [*map(init_robot, range(ROBOTS)), *map(omnidyn.load_robot, PRESETS)]
    with tempfile.TemporaryDirectory() as name, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for k, robot in enumerate(robots):
            row, met = _row(robot, k, Path(name, str(k)))
            table.add(f"<= {NEAR:g} m/s, rest the same, tools silent", met, **row)
    table.notes.append("at rest: share of the samples of all axes; the C and the FMU are at rest in the same ones")
    table.notes.append("fixed: one step a call (tol None); slowest: of random calls up to 1000 m/s and 1 s, gcc -O2")
    table.notes.append(
        "single: the fixed step in float32 beside the fixed step of the engine; M4F: with a unit for floats"
    )
    table.notes.append("tools: gcc and clang with all warnings, cppcheck, the sanitizers of gcc, fmpy's validation")
    return table


def _row(robot: Robot, seed: int, folder: Path) -> tuple[dict[str, Any], bool]:
    folder.mkdir()
    volts = program(robot, seed, ROWS) * np.max(robot.motor.voltage_limit) / 6.0
    plain = robot.replace(drive=Drive(dead_band=robot.drive.dead_band, latency=robot.drive.latency))
    run = omnidyn.simulate(plain, volts, DT)
    assert run.twist is not None
    assert run.pose is not None
    late = round(robot.drive.latency / DT)
    acting = np.concatenate([np.zeros((late, volts.shape[1])), volts])[: len(volts)]
    exact = "exact" in run.source
    step = Stepper(robot, folder / "c")
    begun = time.process_time()
    twist, pose = step.run(acting, DT)
    cost = (time.process_time() - begun) * 1e6 / len(volts)
    outputs, problems = _by_fmpy(robot, folder, acting)
    same = np.array_equal(twist == 0.0, run.twist == 0.0) and np.array_equal(outputs[:, :3] == 0.0, run.twist == 0.0)
    off, unit_off = np.abs(twist - run.twist).max(axis=0), np.abs(outputs[:, :3] - run.twist).max(axis=0)
    said = problems + _tools(folder / "c", robot, folder)
    row = {
        "robot": robot.name,
        "engine": "exact" if exact else "implicit",
        "C m/s": float(off[:2].max()),
        "C rad/s": float(off[2]),
        "C m, rad": float(np.abs(pose - run.pose).max()),
        "FMU m/s, rad/s": float(unit_off.max()),
        "at rest": f"{np.mean(run.twist == 0.0):.0%}{'' if same else ' OTHERS'}",
        "us/step": cost,
        **_size(folder / "c"),
        "tools": "; ".join(said) or "silent",
    }
    if not exact:
        row |= _fixed(robot, folder) | _single(robot, folder, plain, volts, acting)
    shares = np.array([1.0, 1.0, 10.0]) * NEAR
    return row, bool((off <= shares).all() and (unit_off <= shares).all() and same and not said)


def _by_fmpy(robot: Robot, folder: Path, volts: FloatArray) -> tuple[FloatArray, list[str]]:
    """(outputs at the end of each step, what fmpy says against the unit)."""
    import fmpy
    from fmpy.validation import validate_fmu

    path = omnidyn.export.fmu(robot).write(folder / "robot.fmu")[0]
    kinds = [("time", float), *((f"u{k + 1}_V", float) for k in range(volts.shape[1]))]
    given = np.array([(k * DT, *row) for k, row in enumerate(volts)], dtype=kinds)
    out = fmpy.simulate_fmu(str(path), stop_time=len(volts) * DT, step_size=DT, output_interval=DT, input=given)
    return np.stack([out[name] for name in OUTPUTS], axis=1), [str(problem) for problem in validate_fmu(str(path))]


def _tools(sources: Path, robot: Robot, folder: Path) -> list[str]:
    """What compilers, cppcheck and sanitizers say; gcc compiled the step with its warnings as errors before."""
    said = []
    for command in (["clang", "-std=c99", *WARNINGS, "-fsyntax-only"], ["cppcheck", "--quiet", "--error-exitcode=9"]):
        if shutil.which(command[0]) is None:
            said.append(f"no {command[0]}")
        elif subprocess.run([*command, "omnidyn_step.c"], cwd=sources, capture_output=True).returncode:
            said.append(command[0])
    of_step(robot, folder / "sanitized", tol=None).run(CALLS // 10, VALID)  # fails where one has something to say
    return said


def _fixed(robot: Robot, folder: Path) -> dict[str, Any]:
    """Time, size and stack of one fixed step a call."""
    program = of_step(robot, folder / "fixed", flags=("-std=c99", "-O2"), tol=None)
    found = program.run(CALLS, VALID)
    sizes = {f"fixed {name}": value for name, value in _size(folder / "fixed").items()}
    return {"fixed us/step": 1e3 * found.mean, "fixed slowest us": 1e3 * found.slowest, **sizes}


def _single(robot: Robot, folder: Path, plain: Robot, volts: FloatArray, acting: FloatArray) -> dict[str, Any]:
    """The fixed step in single precision beside that of the engine in double: difference, time, size, stack."""
    run = omnidyn.simulate(plain, volts, DT, tol=None)
    assert run.twist is not None
    twist, _ = Stepper(robot, folder / "single", "single", tol=None).run(acting, DT)
    calls = of_step(robot, folder / "float", flags=("-std=c99", "-O2"), precision="single", tol=None).run(CALLS, VALID)
    size = _size(folder / "float", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard")
    return {
        "single m/s, rad/s": float(np.abs(twist - run.twist).max()),
        "single us/step": 1e3 * calls.mean,
        "single M4F kB": size.get("M4 kB", ""),
        "single stack B": size["stack B"],
    }


def _size(sources: Path, *unit: str) -> dict[str, Any]:
    """Code and constants for a Cortex-M4 [kB], stack on x86-64 [bytes]. unit: flags of one for float32."""
    found: dict[str, Any] = {"stack B": deepest(sources)}
    if shutil.which("clang") and shutil.which("size"):
        (sources / "m4").mkdir(exist_ok=True)
        (sources / "m4" / "math.h").write_text(MATH_H)
        command = [*M4, *unit, "-ffreestanding", "-Im4", "-c", "omnidyn_step.c", "-o", "m4.o"]
        if subprocess.run(command, cwd=sources, capture_output=True).returncode == 0:  # a clang that knows ARM
            said = subprocess.run(["size", "m4.o"], cwd=sources, capture_output=True, text=True, check=True).stdout
            found["M4 kB"] = int(said.split("\n")[1].split()[0]) / 1e3
    return found


def deepest(sources: Path) -> int:
    """Bytes of stack of the deepest chain of calls from `omnidyn_step`, math.h apart."""
    command = ["gcc", "-std=c99", "-Os", "-fcallgraph-info=su", "-c", "omnidyn_step.c", "-o", "stack.o"]
    subprocess.run(command, cwd=sources, check=True, capture_output=True)
    text = (sources / "stack.ci").read_text()
    own = {name: int(size) for name, size in re.findall(r'node: { title: "([^"]+)" label: "[^"]*?(\d+) bytes', text)}
    calls = re.findall(r'edge: { sourcename: "([^"]+)" targetname: "([^"]+)"', text)

    def below(name: str) -> int:
        return own.get(name, 0) + max((below(callee) for caller, callee in calls if caller == name), default=0)

    return below("omnidyn_step")


if __name__ == "__main__":
    print(measure().as_text())
