"""What a fit costs: one log, an hour at 1 kHz, and the whole command from CSV to report, start-up included."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import omnidyn
from benchmarks.identification.identify_log import cpu
from benchmarks.table import Table
from benchmarks.wrong_worlds.kinds import by_name
from benchmarks.wrong_worlds.log import logged, right_case, robot_of
from benchmarks.wrong_worlds.remedies import FRICTION
from benchmarks.wrong_worlds.score import drawn
from omnidyn.identification.structure.missing.laws import TRACTION, slippery
from omnidyn.model.robot import Robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import excitation, noisy_draw

FIRST = 10.0  # [s] of the command's first run
MOST = 10.0  # [s] of the diagnosis of 25 s at 1 kHz
GRIP = 0.3  # of the floor, from which wheels that slip are fitted
DIAGNOSED = (
    "gain",
    "weak motor",
    "turning frame",
    "mass",
    "Stribeck",
    "cogging",
)  # kinds of wrong_worlds, two logs each


def speed(table: Table, robot: Robot, clean: Run) -> None:
    """One log of 60 s."""
    log = noisy_draw(clean, 0)
    spent = cpu(lambda: omnidyn.identify(log, robot, omnidyn.OutputError(start="rest", nuisances=())), 30)
    table.add("<= 5", spent <= 5.0, what="fit of one log, six numbers", value=spent, unit="ms")


_CHILD = """
import json, resource, sys, time
import numpy as np
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
with np.load(sys.argv[1]) as f:
    run = Run(**{name: f[name] for name in f.files})
robot, options = load_robot("axebot"), json.loads(sys.argv[2])
short = Run(t=run.t[:2000], **{name: value[:2000] for name, value in run.channels.items()})
identify(short, robot, OutputError(**options))
start = time.process_time()
fit = identify(run, robot, OutputError(**options))
spent = time.process_time() - start
try:  # on Linux the other counter begins at what the parent had
    peak = next(int(line.split()[1]) * 1024 for line in open("/proc/self/status") if line.startswith("VmHWM"))
except OSError:
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
print(spent, peak / 2**30, fit.iterations)
"""


def long(table: Table, robot: Robot, clean: Run) -> None:
    """(b) One hour at 1 kHz, each in a process of its own for its memory."""
    hour = simulate(robot, excitation(3600.0, 1000.0), 1e-3)
    rng = np.random.default_rng(3)
    plain = noisy_draw(hour, 0)
    every = plain.replace(
        wheel_speed=hour.wheel_speed + 0.5 * rng.standard_normal(hour.wheel_speed.shape),
        current=hour.current + 0.05 * rng.standard_normal(hour.current.shape),
    )
    del hour
    options = {"nuisances": ["latency", "gain", "dead_band", "fade"], "start": "free"}
    spent, memory = _in_child(plain, {"nuisances": [], "start": "rest"})
    table.add("<= 5", spent <= 5.0, what="1 h at 1 kHz, six numbers", value=spent, unit="s")
    table.add("<= 1", memory <= 1.0, what="... memory of the whole process", value=memory, unit="GiB")
    spent, memory = _in_child(every, options)
    table.add("<= 60", spent <= 60.0, what="1 h at 1 kHz, nine outputs, nine nuisances", value=spent, unit="s")
    table.add(what="... memory of the whole process", value=memory, unit="GiB")


def _in_child(run: Run, options: dict[str, object]) -> tuple[float, float]:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "run.npz"
        np.savez(file, t=run.t, **run.channels)
        out = subprocess.run(
            [sys.executable, "-c", _CHILD, file, json.dumps(options)], capture_output=True, text=True, check=True
        )
    spent, memory, _ = out.stdout.split()
    return float(spent), float(memory)


def command(table: Table, robot: Robot, clean: Run) -> None:
    """`omnidyn identify LOG --report`, as a child: with nothing compiled yet, three times, and then with everything."""
    log = noisy_draw(clean, 0)
    assert log.voltage is not None
    assert log.twist is not None
    heads = ",".join(["t_s", *(f"u{k + 1}_V" for k in range(log.voltage.shape[1])), "vx_m_s,vy_m_s,omega_rad_s"])
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        rows = np.column_stack([log.t, log.voltage, log.twist])
        np.savetxt(place / "log.csv", rows, delimiter=",", header=heads, comments="", fmt="%.6f")
        first = [_command(place, f"cache{k}") for k in range(3)]
        again = [_command(place, "cache0") for _ in range(3)]
    table.add(
        f"<= {FIRST:g}",
        max(first) <= FIRST,
        what="CSV to report, one command, nothing compiled: worst of 3",
        value=max(first),
        unit="s",
    )
    table.add(f"<= {FIRST:g}", max(again) <= FIRST, what="... compiled before: worst of 3", value=max(again), unit="s")


def _command(place: Path, cache: str) -> float:
    """Processor time of the command and its start-up [s]."""
    before = sum(os.times()[2:4])
    source = str(Path(omnidyn.__file__).resolve().parents[1])  # PYTHONPATH may be relative, and the child is elsewhere
    subprocess.run(
        [
            sys.executable,
            "-m",
            "omnidyn",
            "identify",
            "log.csv",
            "--robot",
            "axebot",
            "-o",
            "fit.toml",
            "--report",
            "fit.html",
            "--force",
        ],
        cwd=place,
        env=os.environ | {"NUMBA_CACHE_DIR": str(place / cache), "PYTHONPATH": source},
        capture_output=True,
        check=True,
    )
    return sum(os.times()[2:4]) - before


def diagnosis(table: Table, _robot: Robot, _clean: Run) -> None:
    """What `lack_of_fit` costs, in fits of the log by the slowest engine that a candidate needs: where something is
    found that of wheels that slip. And by the slower of the robot's own and that of a turning frame, which asks more.
    """
    by_slowest, by_implicit, slow = [], [], []
    for name in DIAGNOSED:
        for number in range(2):
            case, seed, _ = drawn(by_name(name), number)
            log, robot = logged(case, seed), robot_of(case.told)
            own, asked, found = _diagnosed(log, robot)
            turning = robot.replace(body=robot.body.replace(rotating_frame=True))
            implicit = max(own, _spent(log, turning, FRICTION))
            by_implicit.append(asked / implicit)
            slowest = implicit
            if found:
                slow.append(_spent(log, slippery(robot, GRIP), (*FRICTION, TRACTION), 1))  # the diagnosis compiled it
                slowest = max(implicit, slow[-1])
            by_slowest.append(asked / slowest)
    worst = max(by_slowest)
    table.add(
        "<= 2",
        worst <= 2.0,
        what="diagnosis of wrong logs, in fits by the slowest engine it needs: worst",
        draws=len(by_slowest),
        value=worst,
        unit="fits",
    )
    table.add(
        what="... such a fit, of wheels that slip: median", draws=len(slow), value=float(np.median(slow)), unit="s"
    )
    for words, value in (("median", float(np.median(by_implicit))), ("worst", max(by_implicit))):
        table.add(
            what=f"... in fits of a turning frame instead: {words}", draws=len(by_implicit), value=value, unit="fits"
        )


def default_diagnosis(table: Table, _robot: Robot, _clean: Run) -> None:
    """The default diagnosis of a right robot that turns in its frame, by the implicit engine: 25 s at 1 kHz, and three
    logs of 40 s at 200 Hz."""
    for rate, seconds, logs, limit in ((1000.0, 25.0, 1, MOST), (200.0, 40.0, 3, None)):
        case = right_case(2).setup_but(rate=rate, seconds=seconds)
        runs = [logged(case, seed).replace(source=f"log {seed}") for seed in range(logs)]
        spent = []
        for _ in range(2):  # the first compiles
            began = time.process_time()
            fit = omnidyn.identify(runs, robot_of(case.told))
            fitted = time.process_time()
            assert fit.lack_of_fit is not None
            spent.append((time.process_time() - fitted, fitted - began))
        asked, own = min(spent)
        words = f"default diagnosis, {logs} of {seconds:g} s at {rate:g} Hz"
        table.add(*([] if limit is None else [f"<= {limit:g}", asked <= limit]), what=words, value=asked, unit="s")
        table.add(what="... the fit itself", value=own, unit="s")


def _diagnosed(log: Run, robot: Robot) -> tuple[float, float, bool]:
    """Processor time of a fit and of its diagnosis [s], the less of two, as the first compiles; what it found."""
    spent = []
    for _ in range(2):
        began = time.process_time()
        fit = omnidyn.identify(log, robot, omnidyn.OutputError(free=FRICTION))
        fitted = time.process_time()
        found = bool(fit.lack_of_fit and fit.lack_of_fit.found)
        spent.append((fitted - began, time.process_time() - fitted))
    own, asked = (min(each) for each in zip(*spent, strict=True))
    return own, asked, found


def _spent(log: Run, robot: Robot, free: Sequence[str], times: int = 2) -> float:
    """Processor time of a fit [s], the least of some."""
    spent = []
    for _ in range(times):
        began = time.process_time()
        omnidyn.identify(log, robot, omnidyn.OutputError(free=free))
        spent.append(time.process_time() - began)
    return min(spent)
