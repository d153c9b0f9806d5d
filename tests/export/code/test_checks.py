"""What exported C refuses: it says so, leaves its state alone, never hangs, and takes all that robots do."""

import math
import shutil
import subprocess

import numpy as np
import pytest

import omnidyn
from tests.support.cases import case
from tests.support.exported import WARNINGS, Stepper, exact_robot, init_robot
from tests.support.mixed_robots import random_robot, with_band, with_bristles
from tests.support.random_calls import ANY, MOST_MEANS, VALID, of_fmu, of_step

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here")
ROBOT, WOUND = omnidyn.load_robot("axebot"), exact_robot(3)
OK, BAD_VOLTS, BAD_TIME, BAD_TWIST, BAD_POSE, BAD_FORCE, TOO_LONG = range(7)
FMI_OK, FMI_ERROR = 0, 3
NAN, INF = math.nan, math.inf


@pytest.mark.parametrize("robot", [ROBOT, WOUND], ids=["settled", "inductance"])
def test_each_input_is_checked_and_nothing_moves(robot, tmp_path):
    step = Stepper(robot, tmp_path / "c")
    bad = {
        BAD_VOLTS: [{"u": value} for value in (NAN, INF, -INF)],
        BAD_TIME: [{"h": value} for value in (NAN, INF, 0.0, -1e-3, 3600.1, 1e300)],
        BAD_TWIST: [{"twist": value} for value in (NAN, INF, 1e10, 1001.0, -1001.0)],
        BAD_POSE: [{"pose": value} for value in (NAN, -INF, 1.1e9)],
        BAD_FORCE: [{"force": value} for value in (NAN, INF, 1e300)] if step.states == 3 else [],
    }
    for status, changes in bad.items():
        for change in changes:
            for place in range(3):
                assert called(step, place, **change) == (status, True), change
    assert called(step, 0, h=3600.0, twist=1.0)[0] in (OK, TOO_LONG)
    assert called(step, 2, twist=1000.0, h=1.0) == (OK, False)
    assert called(step, 2, twist=1000.0, h=100.0) == (TOO_LONG, True)
    assert called(step, 0, u=1e308) == (OK, False)  # kept within the limit, as in `simulate`


def called(step, place, u=3.0, h=0.01, twist=0.0, pose=0.0, force=0.0):
    """(what a step returns, whether its state is what it was)."""
    volts = np.array([1.0, 3.0, -2.0, 1.0, 2.0, 3.0])
    volts[place] = u
    state = np.zeros((3, 3))
    state[:, place] = twist, pose, force
    before = state.copy()
    status = step._step(volts.ctypes.data, h, *(state[i].ctypes.data for i in range(step.states)))
    return status, np.array_equal(before, state, equal_nan=True)


LONG = pytest.mark.long


@pytest.mark.parametrize(
    "robot, precision, count",
    [
        (ROBOT, "double", 20_000),
        (WOUND, "double", 2_000),
        pytest.param(ROBOT, "single", 20_000, marks=LONG),
        pytest.param(exact_robot(7), "single", 20_000, marks=LONG),
        pytest.param(exact_robot(2), "double", 20_000, marks=LONG),
    ],
)
def test_random_calls_under_sanitizers(robot, precision, count, tmp_path):
    program = of_step(robot, tmp_path / "c", precision=precision)
    found, valid = program.run(count, ANY), program.run(1000, VALID)
    assert found.kept
    assert max(found.slowest, valid.slowest) < MOST_MEANS * valid.mean
    assert all(found.returned[status] for status in (OK, BAD_VOLTS, BAD_TIME, BAD_TWIST, BAD_POSE, TOO_LONG))
    assert valid.returned[OK] == 1000


@pytest.mark.parametrize(
    "robot, options, most",
    [
        (init_robot(11), {"tol": None}, MOST_MEANS),
        pytest.param(init_robot(2), {"tol": None, "precision": "single"}, MOST_MEANS, marks=LONG),
        pytest.param(with_band(random_robot(4), 4), {"tol": None}, MOST_MEANS, marks=LONG),
        pytest.param(with_bristles(random_robot(1), 1), {"tol": None}, MOST_MEANS, marks=LONG),
        pytest.param(init_robot(11), {}, math.inf, marks=LONG),
    ],
)
def test_random_calls_of_the_implicit_step_under_sanitizers(robot, options, most, tmp_path):
    """A fixed step takes no long time, whatever it is given; to a tolerance a call may take a second."""
    program, count = of_step(robot, tmp_path / "c", **options), 3000 if options else 100
    found, valid = program.run(count, ANY), program.run(count, VALID)
    assert found.kept
    assert all(found.returned[status] for status in (OK, BAD_VOLTS, BAD_TIME, BAD_TWIST, BAD_POSE, BAD_FORCE))
    assert valid.returned[OK] + valid.returned[TOO_LONG] == count
    assert max(found.slowest, valid.slowest) < most * valid.mean


@pytest.mark.parametrize("electrical", ["quasi-static", "dynamic"])
@pytest.mark.parametrize("precision", ["double", "single"])
def test_a_robot_of_20_grams_is_not_too_fast(electrical, precision, tmp_path):
    """Its rates are 20000 per second: a second at full volts, forward and back, is one call."""
    small = ROBOT.replace(
        body=ROBOT.body.replace(mass=0.02, inertia=2e-6),
        motor=ROBOT.motor.replace(electrical=electrical),
        wheels=ROBOT.wheels.replace(robot_radius=0.015, wheel_radius=0.005),
    )
    volts = np.random.default_rng(1).uniform(-100.0, 100.0, (200, 3))
    volts[::2] = np.sign(volts[::2, :1])
    twist, pose = Stepper(small, tmp_path / "c", precision).run(100.0 * volts, 1.0)
    assert np.isfinite(pose).all()
    assert np.abs(twist[:, 2]).max() > 10.0


def test_the_fmu_under_sanitizers(tmp_path):
    program = of_fmu(ROBOT, tmp_path / "fmu")
    found, valid = program.run(2000, ANY), program.run(500, VALID)
    assert max(found.slowest, valid.slowest) < MOST_MEANS * valid.mean
    assert found.returned[FMI_OK] + found.returned[FMI_ERROR] == 2000
    assert min(found.returned[FMI_OK], found.returned[FMI_ERROR]) > 100
    assert valid.returned[FMI_OK] == 500


@pytest.mark.parametrize("electrical, source", [("quasi-static", "th.c"), ("dynamic", "ti.c")])
def test_the_cases_that_never_returned(electrical, source, tmp_path):
    robot = ROBOT.replace(motor=ROBOT.motor.replace(electrical=electrical))
    omnidyn.export.c_model(robot).write(tmp_path / "c")
    shutil.copy(case(f"code/c_hangs/{source}"), tmp_path / "c")
    build = ["gcc", "-O1", "-std=c99", source, "omnidyn_step.c", "-o", "t", "-lm"]
    subprocess.run(build, cwd=tmp_path / "c", check=True)
    for arguments in (["1e5", "3"], ["nan", "3"], ["0.01", "nan"], ["0.01", "3", "1e10"], ["0.01", "3", "1e308"]):
        given = arguments if source == "th.c" else [*arguments, "0", "0", "0"][:2] + [*arguments, "0"][2:3] * 3
        run = ["./t", *given]
        said = subprocess.run(run, cwd=tmp_path / "c", check=False, capture_output=True, text=True, timeout=200)
        assert "twist" in said.stdout


CLANG = ["clang", "-std=c99", *WARNINGS, "-fsyntax-only"]
CPPCHECK = ["cppcheck", "--quiet", "--error-exitcode=9"]


@pytest.mark.parametrize("command", [CLANG, CPPCHECK], ids=["clang", "cppcheck"])
def test_other_tools_have_nothing_to_say(command, tmp_path):
    if shutil.which(command[0]) is None:
        pytest.skip(f"no {command[0]} here")
    sources = []
    for robot, name in ((ROBOT, "settled"), (WOUND, "inductance")):
        for precision in ("double", "single"):
            folder = tmp_path / f"{name}-{precision}"
            omnidyn.export.c_model(robot, precision=precision).write(folder)
            sources.append(folder / "omnidyn_step.c")
    for robot, options in (
        (init_robot(4), {}),
        (init_robot(11), {"tol": None, "precision": "single"}),
        (with_bristles(random_robot(1), 1), {"tol": None}),
    ):
        omnidyn.export.c_model(robot, **options).write(tmp_path / robot.name)
        sources.append(tmp_path / robot.name / "omnidyn_step.c")
    for controller in ("feedforward", "pid", "speed", "mpc"):
        omnidyn.export.ros2_node(ROBOT, controller=controller).write(tmp_path / controller)
        sources += [tmp_path / controller / "omnidyn_control.c", tmp_path / controller / "control_shared.c"]
    omnidyn.export.fmu(ROBOT, compiled=False).write(tmp_path / "robot.fmu")
    shutil.unpack_archive(tmp_path / "robot.fmu", tmp_path / "fmu", "zip")
    sources.append(tmp_path / "fmu" / "sources" / "axebot.c")
    said = subprocess.run([*command, *map(str, sources)], cwd=tmp_path, capture_output=True, text=True)
    assert (said.returncode, said.stderr) == (0, "")
