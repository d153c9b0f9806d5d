"""Exported C on a million random calls: NaN, infinite and huge numbers, steps of hours, under sanitizers.

The goals: no sanitizer has anything to say, no call takes longer than 10 ms of the processor, and a call that is
refused leaves its state alone. Of a thousand calls that robots make none is refused. Seeds are fixed.
"""

from __future__ import annotations

import importlib
import importlib.util
import math
import shutil
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import omnidyn
from benchmarks.size import scaled
from benchmarks.table import Table, machine
from omnidyn.model.robot import Robot
from tests.support.exported import exact_robot, init_robot
from tests.support.random_calls import ANY, VALID, Program, of_fmu, of_step

CALLS, FEWER, VALID_CALLS = (
    scaled(1_000_000, 20_000),
    scaled(100_000, 2000),
    scaled(20_000, 400),
)  # fewer: of variants, and through Python
SLOWEST_MS = 10.0  # of one call
ODD = (math.nan, math.inf, -math.inf, 1e308, -1e308, 0.0, 5e-324, 1e10, 1e5)


def measure() -> Table:
    """What each export returned, and its slowest call."""
    columns = ["export", "calls", "made", "refused", "slowest ms", "valid refused"]
    table = Table("exported C: random calls under the address and undefined-behaviour sanitizers", columns)
    table.notes.append(machine())
    with tempfile.TemporaryDirectory() as name:
        for row in _rows(Path(name)):
            met = row.pop("kept") and row["slowest ms"] < SLOWEST_MS and row["valid refused"] in (0, "")
            table.add(f"< {SLOWEST_MS:g} ms, no finding", met, **row)
    table.notes.append("slowest: processor time of one call, sanitizers included; a finding ends the benchmark")
    table.notes.append(f"valid: {VALID_CALLS} calls, up to 100 V, 1 s, 1000 m/s and 1000 rad/s")
    return table


def _rows(folder: Path) -> Iterator[dict[str, Any]]:
    if shutil.which("gcc") is None:
        return
    plain, wound = omnidyn.load_robot("axebot"), exact_robot(3)
    for name, robot in (("axebot", plain), ("with inductance", wound)):
        for precision in ("double", "single"):
            program = of_step(robot, folder / f"{name}{precision}", precision=precision)
            main = robot is plain and precision == "double"
            yield _counted(f"c-model, {name}, {precision}", program, CALLS if main else FEWER)
        yield _counted(f"fmu, {name}, its sources", of_fmu(robot, folder / name), CALLS if robot is plain else FEWER)
    for robot in (init_robot(11), init_robot(2)):
        program = of_step(robot, folder / robot.name, tol=None)
        yield _counted(f"c-model, {robot.name}, one implicit step", program, FEWER)
    if importlib.util.find_spec("fmpy") is not None:
        yield _by_fmpy(plain, folder / "robot.fmu")


def _counted(name: str, program: Program, count: int) -> dict[str, Any]:
    found, valid = program.run(count, ANY), program.run(VALID_CALLS, VALID)
    return {
        "export": name,
        "calls": count,
        "made": found.returned[0],
        "refused": sum(found.returned[1:]),
        "slowest ms": max(found.slowest, valid.slowest),
        "valid refused": sum(valid.returned[1:]),
        "kept": found.kept,
    }


def _by_fmpy(robot: Robot, path: Path) -> dict[str, Any]:
    """The unit as other tools load it: its library, called through fmpy."""
    fmi2: Any = importlib.import_module("fmpy.fmi2")
    fmpy: Any = importlib.import_module("fmpy")
    omnidyn.export.fmu(robot).write(path)
    refused = importlib.import_module("fmpy.fmi1").FMICallException
    about = fmpy.read_model_description(str(path))
    unit = fmi2.FMU2Slave(
        guid=about.guid,
        unzipDirectory=fmpy.extract(str(path), str(path.with_suffix(""))),
        instanceName="unit",
        modelIdentifier=about.coSimulation.modelIdentifier,
    )
    unit.instantiate()
    unit.setupExperiment(startTime=0.0)
    unit.enterInitializationMode()
    unit.exitInitializationMode()
    rng, made, slowest = np.random.default_rng(1), 0, 0.0
    wheels = robot.wheels.count
    places = [*range(wheels), *range(wheels + 6, wheels + 12)]
    for _ in range(FEWER):
        values = rng.choice([-1.0, 1.0], len(places)) * 10.0 ** rng.uniform(-4.0, 3.2, len(places))
        if rng.random() < 0.3:
            values[rng.integers(len(places))] = ODD[rng.integers(len(ODD))]
        length = ODD[rng.integers(len(ODD))] if rng.random() < 0.1 else 10.0 ** rng.uniform(-6.0, 5.0)
        begun = time.thread_time()
        try:
            unit.setReal(places, values.tolist())
            unit.doStep(currentCommunicationPoint=0.0, communicationStepSize=float(length))
            made += 1
        except refused:
            pass
        slowest = max(slowest, 1e3 * (time.thread_time() - begun))
    unit.terminate()
    unit.freeInstance()
    return {
        "export": "fmu, axebot, by fmpy",
        "calls": FEWER,
        "made": made,
        "refused": FEWER - made,
        "slowest ms": slowest,
        "valid refused": "",
        "kept": True,
    }


if __name__ == "__main__":
    print(measure().as_text())
