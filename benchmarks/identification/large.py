"""Large logs: three of 40 s at 200 Hz, four wheels, currents, gyroscope and pose: whole commands, time and memory.

An X-drive by the simulator of benchmarks/ten_robots, which shares no code with omnidyn; volts in steps of 0.1 V, a
current limit that acts. Fitted by a right model, by one without limit and rotors and with a wrong mass, and by one
without its turning frame. The standard errors of the right one are compared with those of all rows.

python -m benchmarks.identification.large MODEL NUMBERS FOLDER   one command in this process; prints its cost as JSON
"""

from __future__ import annotations

import contextlib
import io
import json
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.size import scaled
from benchmarks.table import Table, machine
from benchmarks.ten_robots.world import ELLIPSE, World, currents, drive

RATE, SECONDS, LOGS = 200.0, float(scaled(40, 6)), 3
CPU_GOAL_S, MEMORY_GOAL_MB, RATIO_GOAL = 60.0, 1000.0, 0.05
AZIMUTH, LEVEL, STEP, STILL = (45.0, 135.0, -135.0, -45.0), 6.0, 0.1, 0.15  # [degree], [V], [V], share of the time
NOISE = {"current": 0.05, "wheel": 0.05, "gyroscope": 0.01, "place": 0.001, "heading": 0.002}
WORLD = World(
    azimuth=AZIMUTH,
    wheel_radius=(0.05,) * 4,
    robot_radius=(0.2,) * 4,
    mass=10.0,
    inertia=0.25,
    resistance=1.0,
    torque_constant=0.022,
    gear_ratio=19.0,
    voltage_limit=12.0,
    coulomb=(18.0, 14.0, 1.6),
    viscous=(3.0, 3.0, 0.05),
    shape=ELLIPSE,
    rotor_inertia=1e-6,
    current_limit=8.0,
)
LIMIT = "current_limit_A = 8.0\nrotor_inertia_kg_m2 = 1e-6\n"
RIGHT = f"""schema = 1
name = "xdrive"
[body]
mass_kg = 10.0
inertia_kg_m2 = 0.25
rotating_frame = true
[wheels]
azimuth_deg = [45.0, 135.0, -135.0, -45.0]
robot_radius_m = 0.2
wheel_radius_m = 0.05
[motor]
resistance_ohm = 1.0
torque_constant_Nm_A = 0.022
emf_constant_Vs_rad = 0.022
gear_ratio = 19.0
voltage_limit_V = 12.0
{LIMIT}[drive]
kind = "voltage"
[friction.direction]
coulomb = [18.0, 14.0]
viscous = 3.0
yaw_coulomb = 1.6
yaw_viscous = 0.05
"""
FRAME = "body.rotating_frame"
MODELS = {
    "right": RIGHT,
    "wrong": RIGHT.replace(LIMIT, "").replace("mass_kg = 10.0", "mass_kg = 9.0"),
    "no frame": RIGHT.replace("rotating_frame = true", "rotating_frame = false"),
}


def measure() -> Table:
    """Each model in a process of its own."""
    table = Table(
        f"large: {LOGS} logs of {SECONDS:g} s at {RATE:g} Hz, 12 channels beside the voltages",
        ["model", "cpu s", "peak MB", "left out", "first remedy", "std error over that of all rows"],
    )
    table.notes.append(machine())
    with tempfile.TemporaryDirectory(prefix="omnidyn-large-") as name:
        folder = Path(name)
        for seed in range(LOGS):
            write_log(seed, folder / f"log{seed}.csv")
        for model, text in MODELS.items():
            (folder / f"{model}.toml").write_text(text)
            took = _child(model, "", folder)
            ratio = _ratio(took, _child(model, "all", folder)) if model == "right" else None
            named = model != "no frame" or FRAME in (took["remedy"], *took["same"])
            met = took["cpu s"] <= CPU_GOAL_S and took["peak MB"] <= MEMORY_GOAL_MB and named
            table.add(
                f"<= {CPU_GOAL_S:g} s, {MEMORY_GOAL_MB:g} MB{'' if model != 'no frame' else ', named'}",
                met,
                model=model,
                **{"cpu s": took["cpu s"], "peak MB": took["peak MB"], "left out": took["found"]},
                **{"first remedy": took["remedy"], "std error over that of all rows": ratio or ""},
            )
            if ratio is not None:
                within = abs(np.log(ratio)) <= np.log1p(RATIO_GOAL)
                table.add(f"within {RATIO_GOAL:.0%}", within, model="... of all rows, the furthest of its numbers")
    return table


def write_log(seed: int, path: Path, seconds: float = SECONDS) -> None:
    """Held voltages of random twists, some of them 0, and what is measured of the motion."""
    rng, rows = np.random.default_rng(seed), int(RATE * seconds)
    volts, first = np.zeros((rows, 4)), int(RATE)
    while first < rows:
        last = first + int(RATE * rng.uniform(0.3, 1.5))
        along = rng.uniform(-LEVEL, LEVEL, 3) / [1.0, 1.0, 1.5]
        phi = np.radians(AZIMUTH)
        own = np.stack([-np.sin(phi), np.cos(phi), np.ones(4)], axis=1) @ along
        volts[first:last] = np.clip(own, -12.0, 12.0) * (rng.random() > STILL)
        first = last
    volts = np.round(volts / STEP) * STEP
    motion = drive(WORLD, volts, 1.0 / RATE)
    twist, pose = motion.twist[:rows], motion.pose[:rows]
    wheel = twist @ WORLD.G / WORLD.wheel_radius
    place = pose + rng.normal(size=pose.shape) * [NOISE["place"], NOISE["place"], NOISE["heading"]]
    columns = [
        motion.t[:rows],
        volts,
        currents(WORLD, twist, volts) + NOISE["current"] * rng.normal(size=wheel.shape),
        wheel + NOISE["wheel"] * rng.normal(size=wheel.shape),
        twist[:, 2] + NOISE["gyroscope"] * rng.normal(size=rows),
        place,
    ]
    names = [f"{letter}{k}_{unit}" for letter, unit in (("u", "V"), ("i", "A"), ("w", "rad_s")) for k in (1, 2, 3, 4)]
    header = ",".join(["t_s", *names, "omega_rad_s", "x_m", "y_m", "heading_rad"])
    np.savetxt(path, np.column_stack(columns), delimiter=",", fmt="%.6g", comments="", header=header)


def _child(model: str, rows: str, folder: Path) -> dict[str, Any]:
    """What a process of its own says."""
    run = subprocess.run(
        [sys.executable, "-m", "benchmarks.identification.large", model, str(folder), rows],
        capture_output=True,
        text=True,
        cwd=Path(__file__).resolve().parents[2],
    )
    if run.returncode:
        raise RuntimeError(f"omnidyn identify of {model} ended with {run.returncode}: {run.stderr[-800:]}")
    return json.loads(run.stdout)


def _ratio(own: dict[str, Any], every: dict[str, Any]) -> float:
    """The standard error over that of all rows, of the number of which it differs most."""
    ratios = [own["std"][key] / std for key, std in every["std"].items()]
    return float(max(ratios, key=lambda ratio: abs(np.log(ratio))))


def identified(model: str, folder: Path) -> dict[str, Any]:
    """The whole command, and what it took."""
    from omnidyn.cli import main

    logs, out = sorted(str(path) for path in folder.glob("log*.csv")), io.StringIO()
    with contextlib.redirect_stdout(out):
        code = main(["identify", *logs, "--robot", str(folder / f"{model}.toml"), "--json"])
    if not out.getvalue():
        sys.exit(code)
    told = json.loads(out.getvalue())
    remedies = next(_every(told, "remedies"), [])
    first = remedies[0] if remedies else {"key": "", "same_as": []}
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return {
        "cpu s": round(usage.ru_utime + usage.ru_stime, 1),
        "peak MB": round(usage.ru_maxrss / (1e6 if sys.platform == "darwin" else 1e3)),
        "found": bool(next(_every(told, "found"), False)),
        "remedy": first["key"],
        "same": first["same_as"],
        "std": {key: own["std"] for key, own in told["parameters"].items()},
    }


def errors(model: str, folder: Path) -> dict[str, Any]:
    """The standard errors of a fit alone, by all rows."""
    import omnidyn
    from omnidyn.identification.output_error.problem import problem

    problem.NUMBERS = problem.ROWS = 10**12
    runs = [omnidyn.read_log(path) for path in sorted(folder.glob("log*.csv"))]
    fit = omnidyn.identify(runs, omnidyn.load_robot(folder / f"{model}.toml")).estimate
    return {"std": dict(fit.std)}


def _every(told: Any, name: str) -> Iterator[Any]:
    """What stands under a name anywhere in a result."""
    for key, value in told.items() if isinstance(told, dict) else enumerate(told) if isinstance(told, list) else ():
        if key == name:
            yield value
        yield from _every(value, name)


if __name__ == "__main__":
    print(json.dumps((errors if sys.argv[3] else identified)(sys.argv[1], Path(sys.argv[2]))))
