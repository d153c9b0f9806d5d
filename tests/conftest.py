"""Hypothesis profiles and the robots that many tests share.

OMNIDYN_HYPOTHESIS=thorough tries 50 times as many examples, and other ones in each run. Without --long, Hypothesis
tries a third as many as with it, studies of many draws take a fifth of them (`draws`), and tests of many
near-equal cases a few that they name (`@pytest.mark.some(5)`).
"""

import gc
import os
import signal
import time
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from omnidyn.model.robot_file import load_robot
from tests.support.processor_times import OPTION, ProcessorTimes
from tests.support.sampling import left_out

# Workers of pytest-xdist have the processors already; set before the first test loads NumPy.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

gc.disable()  # until all tests are collected: there is little garbage among so much that stays

# Output is wrapped as it is without a terminal; the processes of pytest-xdist are told 80 columns.
os.environ.pop("COLUMNS", None)

# A shell script's `&` leaves SIGINT ignored, and children inherit that: the tests that send it would wait for ever.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile(
    "ci",
    max_examples=60,
    deadline=None,
    derandomize=True,
    database=None,
    print_blob=True,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.register_profile("thorough", settings.get_profile("ci"), max_examples=3000, derandomize=False)
settings.register_profile("short", settings.get_profile("ci"), max_examples=20)


BEGUN, LAST_LONG = time.monotonic(), 45  # [min] from then on; on most machines all have ended by then


def pytest_addoption(parser):
    parser.addoption("--long", action="store_true", help="run the long studies as well: those marked long")
    parser.addoption(OPTION, type=Path, metavar="FILE", help="write the processor time of each test [s] to this file")


def pytest_configure(config):
    """How many examples Hypothesis tries; processor times are counted where a file is named for them."""
    settings.load_profile(os.environ.get("OMNIDYN_HYPOTHESIS", "ci" if config.getoption("--long") else "short"))
    if config.getoption(OPTION) is not None:
        config.pluginmanager.register(ProcessorTimes(config.getoption(OPTION)))


def pytest_collection_modifyitems(config, items):
    """Without --long the long studies and most of many near-equal cases are left out, and counted as deselected."""
    if not config.getoption("--long"):
        dropped = {item for item in items if item.get_closest_marker("long")}
        dropped |= set(left_out([item for item in items if item not in dropped]))
        config.hook.pytest_deselected(items=[item for item in items if item in dropped])
        items[:] = [item for item in items if item not in dropped]


def pytest_collection_finish():
    """What was collected stays until the end: no collection of garbage walks over it again, and fewer are begun."""
    gc.freeze()
    gc.set_threshold(20_000)  # numba and fits make much that is no garbage: 700, the usual, takes a twentieth of all
    gc.enable()


def pytest_runtest_setup(item):
    """No long study is begun late: a slow machine ends all other tests in time."""
    if item.get_closest_marker("long") and time.monotonic() - BEGUN > 60 * LAST_LONG:
        pytest.skip(f"a long study, and {LAST_LONG} minutes have passed: run it by itself")


@pytest.fixture(scope="session")
def draws(pytestconfig):
    """How many draws of a study are made: all of them with --long, else a fifth, under the same bounds."""

    def number(of_study):
        return of_study if pytestconfig.getoption("--long") else -(-of_study // 5)

    return number


@pytest.fixture
def write(tmp_path):
    """Write text or bytes to a file in an own folder: its path."""

    def to_file(content, name="table.csv"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return to_file


@pytest.fixture(scope="session")
def axebot():
    """The paper's robot, Table 3."""
    return load_robot("axebot")


@pytest.fixture(scope="session")
def four_wheel():
    """Four omni wheels at 45 degrees, otherwise Table 3."""
    return load_robot("four-wheel")
