"""c-model: the step in C agrees with the engine; the same source, so the speeds are the same to the last bits."""

import shutil
import subprocess

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import InputError, UnsupportedError
from omnidyn.export.code.c_model import c_model
from omnidyn.model.deadzone import breakaway_voltage
from tests.support.exported import STRICT, Stepper, exact_robot, init_robot, program
from tests.support.friction_shapes import implicit
from tests.support.mixed_robots import random_robot, with_band, with_bristles, with_stribeck

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here")
ROBOT = omnidyn.load_robot("axebot")


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.some(5)
def test_it_is_the_engine(seed, tmp_path):
    robot = exact_robot(seed)
    volts = program(robot, seed)
    run = omnidyn.simulate(robot, volts, 2e-3)
    assert "exact engine" in run.source
    twist, pose = Stepper(robot, tmp_path / "c").run(volts, 2e-3)
    np.testing.assert_allclose(twist, run.twist, rtol=0, atol=1e-12)
    np.testing.assert_allclose(pose, run.pose, rtol=0, atol=1e-12)
    assert np.array_equal(twist == 0.0, run.twist == 0.0)


@pytest.mark.parametrize("seed", range(4))
def test_single_precision_follows(seed, tmp_path):
    robot = exact_robot(seed)
    volts = program(robot, seed, 200)
    twist, pose = Stepper(robot, tmp_path / "c", "single").run(volts, 2e-3)
    run = omnidyn.simulate(robot, volts, 2e-3)
    np.testing.assert_allclose(twist, run.twist, rtol=0, atol=2e-4)
    np.testing.assert_allclose(pose, run.pose, rtol=0, atol=1e-4)


@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize("electrical", ["quasi-static", "dynamic"])
def test_at_rest_in_its_dead_zone_for_a_minute_it_is_exactly_at_rest(precision, electrical, tmp_path):
    robot = ROBOT.replace(motor=ROBOT.motor.replace(electrical=electrical))
    volts = np.tile([0.0, 0.5, -0.5], (6000, 1)) * breakaway_voltage(robot, [0.0, 1.0, -1.0])
    twist, pose = Stepper(robot, tmp_path / "c", precision).run(volts, 1e-2)
    assert not twist.any()
    assert not pose.any()


def test_one_long_step_is_many_short_ones(tmp_path):
    step = Stepper(ROBOT, tmp_path / "c")
    volts = np.array([[1.5, 5.5, -2.5]])
    long, short = step.run(volts, 0.5), step.run(np.repeat(volts, 500, axis=0), 1e-3)
    for one, other in zip(long, short, strict=True):
        np.testing.assert_allclose(one[-1], other[-1], rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["*/ int x; /*", "bot\\", "Größe??/", "a\nb", "//"])
def test_whatever_the_robot_is_called(name, tmp_path):
    Stepper(ROBOT.replace(name=name), tmp_path / "c")


def test_it_is_cpp_too(tmp_path):
    if shutil.which("g++") is None:
        pytest.skip("no g++ here")
    c_model(ROBOT).write(tmp_path / "c")
    (tmp_path / "c" / "use.cpp").write_text(
        '#include "omnidyn_step.h"\nint main() { omnidyn_real u[OMNIDYN_WHEELS] = {};\n'
        "omnidyn_real t[3] = {}, p[3] = {}; omnidyn_step(u, 0.01, t, p); return t[0] != 0; }"
    )
    for command in (
        ["gcc", *STRICT, "-c", "omnidyn_step.c"],
        ["g++", "-o", "use", "use.cpp", "omnidyn_step.o", "-lm"],
        ["./use"],
    ):
        subprocess.run(command, cwd=tmp_path / "c", check=True)


@pytest.mark.parametrize("seed", [2, 3, 11])  # a disc and a dead band; a box behind a latency; an ellipse that holds
def test_robots_of_init_are_the_engine_at_its_tolerance(seed, tmp_path):
    """Reversals and rests. What a latency does is left out: the volts of the C act at once.

    C has the implicit engine; what `simulate` takes for such a robot is within both tolerances.
    """
    robot, dt = init_robot(seed), 2.0**-9
    volts = program(robot, seed, 300) * robot.motor.voltage_limit / 6.0
    at_once = robot.replace(drive=robot.drive.replace(latency=0.0))
    run = omnidyn.simulate(implicit(at_once), volts, dt)
    assert "implicit engine, tol 1e-06" in run.source
    assert (np.abs(omnidyn.simulate(at_once, volts, dt).twist - run.twist) <= [2e-6, 2e-6, 2e-5]).all()
    assert 0.1 < np.mean(run.twist == 0.0) < 0.95
    twist, pose = Stepper(robot, tmp_path / "c").run(volts, dt)
    np.testing.assert_allclose(twist, run.twist, rtol=0, atol=1e-7)
    np.testing.assert_allclose(pose, run.pose, rtol=0, atol=1e-8)
    assert np.array_equal(twist == 0.0, run.twist == 0.0)


@pytest.mark.parametrize(
    "robot",
    [
        random_robot(3),
        with_stribeck(random_robot(5), 5),
        with_bristles(random_robot(1), 1),
        with_band(random_robot(4), 4),
    ],
    ids=["limits, losses and windings", "stribeck", "bristles", "karnopp"],
)
@pytest.mark.some(2)
def test_fixed_steps_are_the_engine_whatever_the_law(robot, tmp_path):
    volts = program(robot, 1, 200)
    run = omnidyn.simulate(robot, volts, 2e-3, tol=None)
    twist, pose = Stepper(robot, tmp_path / "c", tol=None).run(volts, 2e-3)
    np.testing.assert_allclose(twist, run.twist, rtol=0, atol=1e-12)
    np.testing.assert_allclose(pose, run.pose, rtol=0, atol=1e-12)
    assert np.array_equal(twist == 0.0, run.twist == 0.0)


@pytest.mark.parametrize("robot", [init_robot(11), with_stribeck(random_robot(5), 5)], ids=["of init", "stribeck"])
def test_fixed_steps_in_single_precision_follow(robot, tmp_path):
    volts = program(robot, 1, 200) * np.max(robot.motor.voltage_limit) / 6.0
    run = omnidyn.simulate(robot, volts, 2e-3, tol=None)
    twist, pose = Stepper(robot, tmp_path / "c", "single", tol=None).run(volts, 2e-3)
    np.testing.assert_allclose(twist, run.twist, rtol=0, atol=2e-4)
    np.testing.assert_allclose(pose, run.pose, rtol=0, atol=1e-4)


def test_an_observer_may_correct_the_twist_of_a_robot_of_init(tmp_path):
    """What a call before did not leave is a start as `simulate` knows it: what moves slides, what does not is held."""
    robot, volts = init_robot(2), np.zeros((1, 5))
    step = Stepper(robot, tmp_path / "c", tol=None)
    twist, pose, memory = (np.zeros(size) for size in step.sizes)
    for start in ((0.0, 0.0, 0.0), (0.3, -0.1, 0.0), (0.0, 0.0, 2.0), (0.3, -0.1, 1.0)):
        twist[:], pose[:] = start, 0.0
        assert step._step(volts.ctypes.data, 2e-3, *(array.ctypes.data for array in (twist, pose, memory))) == 0
        run = omnidyn.simulate(robot, volts, 2e-3, twist=start, tol=None)
        np.testing.assert_allclose(twist, run.twist[-1], rtol=0, atol=1e-12)
        assert np.array_equal(twist == 0.0, run.twist[-1] == 0.0)


def test_robots_whose_wheels_slip_are_refused_by_name():
    with pytest.raises(UnsupportedError, match=r"wheels that roll; got .*traction_mu"):
        c_model(ROBOT.replace(wheels=ROBOT.wheels.replace(traction_mu=0.5)))
    with pytest.raises(UnsupportedError, match=r"single precision to a tolerance.*; got rotating frame"):
        c_model(init_robot(3), precision="single")


def test_other_requests_are_refused():
    with pytest.raises(InputError, match="no such precision; got half; expected double or single"):
        c_model(ROBOT, precision="half")
    tiny = ROBOT.replace(friction=ROBOT.friction.replace(axes=ROBOT.friction.axes.replace(coulomb=(1e-40, 1.0, 0.1))))
    with pytest.raises(InputError, match="does not fit single precision"):
        c_model(tiny, precision="single")
    assert c_model(tiny).files


def test_what_is_left_out_is_said_in_the_file_and_in_the_result():
    late = ROBOT.replace(drive=ROBOT.drive.replace(latency=0.01))
    made = c_model(late)
    assert any("latency" in words for words in made.missing)
    assert "latency" in made.files["omnidyn_step.h"]
    assert not c_model(ROBOT).missing
