"""c-model: the exact step in C agrees with the engine; the same source, so the speeds are the same to the last bit."""

import shutil
import subprocess

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import InputError, UnsupportedError
from omnidyn.export.code.c_model import c_model
from tests.support.exported import STRICT, Stepper, exact_robot, program

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here")
ROBOT = omnidyn.load_robot("axebot")


@pytest.mark.parametrize("seed", range(12))
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
    volts = np.tile([0.0, 0.5, -0.5], (6000, 1)) * omnidyn.breakaway_voltage(robot, [0.0, 1.0, -1.0])
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


def test_robots_without_an_exact_step_are_refused_by_name():
    turning = ROBOT.replace(body=ROBOT.body.replace(rotating_frame=True))
    limited = turning.replace(motor=turning.motor.replace(current_limit=1.0))
    with pytest.raises(UnsupportedError, match=r"exact step.*turning frame .*; a current limit"):
        c_model(limited)


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
