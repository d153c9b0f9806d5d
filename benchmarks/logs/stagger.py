"""One run logged by topics with clocks of their own, beside the same with equal stamps: any offsets, jitter and rates.

The plant and its noise are those of tests/support/staggered.py, which shares no code with omnidyn. The sweep reads
tables with blanks, and bags of ROS where the topics are those of a bag.
"""

from __future__ import annotations

import tempfile
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.size import SMALLEST
from benchmarks.table import Table, machine
from omnidyn.findings.check import check
from omnidyn.identification.identify import identify
from omnidyn.logs.geometry import wheel_geometry
from omnidyn.logs.read_log import read_log, recorded_log
from omnidyn.model.robot import Robot
from omnidyn.model.robot_file import load_robot
from tests.support.staggered import PERIOD, ROBOT, Logged, topics

NUMBERS, OFFSETS, JITTERS = (2, 4, 8), (0.0, 1e-6, 20e-6, 3e-3, 0.5 * PERIOD), (0.0, 1e-3)  # topics; [s]; [s]
FITTED = ((4, 1e-6, 0.0), (2, 20e-6, 0.0), (4, 3e-3, 0.0), (4, 0.5 * PERIOD, 0.0), (8, 3e-3, 0.0), (8, 20e-6, 1e-3))
AZIMUTHS = (60.0, 180.0, 300.0)
OFF_AZIMUTH, OFF_RMS, OFF_NUMBER = 1.0, 0.02, 0.25  # goals: [degree]; share; of the width of the 95 % interval


class Seen(NamedTuple):
    """What is said of a log. azimuth: largest error [degree]. rms: of the motion along x, y and about yaw. findings:
    their codes; "jitter" apart where the stamps do jitter."""

    azimuth: float
    rms: np.ndarray
    findings: tuple[str, ...]


def robot_of(folder: Path) -> Robot:
    """The robot file that the logs are checked against, and fits begin from."""
    path = folder / "robot.toml"
    path.write_text(ROBOT)
    return load_robot(str(path))


def seen(path: Path, robot: Robot, jitter: float) -> Seen:
    """`check` and the geometry of a log."""
    log = recorded_log(path)
    verdict, geometry = check(log, robot), wheel_geometry([log.to_run()])
    rms = np.array([verdict.excitation[axis] for axis in ("x", "y", "yaw")])
    codes = (each.code for each in verdict.findings)
    off = float(np.abs(np.subtract(geometry.azimuth_deg, AZIMUTHS)).max())
    return Seen(off, rms, tuple(code for code in codes if not (jitter and code == "jitter")))


def apart(path: Path, equal: Path, robot: Robot) -> float:
    """How far the numbers of two fits are apart, the farthest, in widths of the 95 % interval of equal stamps."""
    one, other = identify([read_log(equal)], robot).estimate, identify([read_log(path)], robot).estimate
    if set(one.value) != set(other.value):
        return np.inf
    width = {name: high - low for name, (low, high) in one.ci95.items()}
    return max(abs(one.value[name] - other.value[name]) / width[name] for name in one.value)


def measure() -> Table:
    """The sweep, a row for each number of topics and rates; then the fits, a row each (about two minutes)."""
    table = Table(
        "stagger: channels that share no stamps", ["logs", "azimuth deg", "rms %", "false findings", "number"]
    )
    table.notes += [
        machine(),
        f"number: off that of equal stamps, of its interval; {OFFSETS} s apart, jitter {JITTERS} s",
    ]
    with tempfile.TemporaryDirectory(prefix="omnidyn-stagger-") as name:
        folder = Path(name)
        robot = robot_of(folder)
        for rates, number in product((False, True), NUMBERS[:1] if SMALLEST else NUMBERS):
            _sweep(table, folder, robot, number, rates)
        for number, offset, jitter in FITTED[:1] if SMALLEST else FITTED:
            equal = Logged.of(topics(number, 0.0)).csv(folder / "equal.csv")
            off = apart(Logged.of(topics(number, offset, jitter)).csv(folder / "log.csv"), equal, robot)
            words = f"identify, {number} topics {1e6 * offset:g} us apart, jitter {1e6 * jitter:g} us"
            table.add(f"at most {OFF_NUMBER}", off <= OFF_NUMBER, logs=words, number=off)
    return table


def _sweep(table: Table, folder: Path, robot: Robot, number: int, rates: bool) -> None:
    equal = seen(Logged.of(topics(number, 0.0, rates=rates)).csv(folder / "log.csv"), robot, 0.0)
    found = []
    for offset, jitter in product(OFFSETS, JITTERS):
        logged = Logged.of(topics(number, offset, jitter, rates))
        found.append(seen(logged.csv(folder / "log.csv"), robot, jitter))
        if number < NUMBERS[-1]:
            found.append(seen(logged.mcap(folder / "log.mcap"), robot, jitter))
    azimuth = max(each.azimuth for each in found)
    rms = max(float(np.abs(each.rms / equal.rms - 1.0).max()) for each in found)
    false = sorted({code for each in found for code in each.findings})
    met = azimuth <= OFF_AZIMUTH and rms <= OFF_RMS and not false
    words = f"{len(found)} logs of {number} topics, {'three rates' if rates else 'one rate'}"
    table.add(
        f"{OFF_AZIMUTH:g} deg, {OFF_RMS:.0%}, none",
        met,
        **{"logs": words, "azimuth deg": azimuth, "rms %": 100.0 * rms, "false findings": ", ".join(false) or "none"},
    )
