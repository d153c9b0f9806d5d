"""Tasks of campaigns for tests and benchmarks: functions of a module, which other processes can find."""

import os
import time
from pathlib import Path

MARKS = "OMNIDYN_TEST_MARKS"  # environment: a folder where each sample leaves a mark when it begins


def product(sample):
    """A few numbers of a sample, which its index and seed alone decide; leaves a mark."""
    if marks := os.environ.get(MARKS):
        (Path(marks) / f"{sample.index}-{os.getpid()}-{time.time_ns()}").touch()
    time.sleep(0.001)
    return {"product": sample.values["task.a"] * sample.values["task.b"], "noise": sample.seed / 2**63}


def raising(sample):
    """Sample 5 raises, sample 13 ends its process."""
    if sample.index == 5:
        raise ValueError("no such wheel")
    if sample.index == 13:
        os._exit(3)
    return {"a": sample.values["task.a"]}


def mass(sample):
    """The mass of the robot."""
    return {"mass": sample.robot.body.mass}


def index(sample):
    """Next to nothing."""
    return {"index": sample.index}
