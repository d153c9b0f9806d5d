"""The formula for a microcontroller is `voltage_for` of a robot in motion; compiled, it is the same in float32."""

import ctypes
import shutil
import subprocess

import numpy as np
import pytest

import omnidyn
from omnidyn.control.table import feedforward_table
from omnidyn.errors import UnsupportedError
from omnidyn.model.robot_file import load_robot
from tests.support.friction_shapes import SHAPES, shaped
from tests.support.mixed_robots import random_robot, with_centre, with_spin


def robots():
    drop = {"voltage_drop": 0.3, "rotor_inertia": 1e-6}
    every = {name: shaped(name, **drop) for name in SHAPES} | {"axebot": load_robot("axebot")}
    many = with_spin(random_robot(5), 5)
    beside = with_centre(shaped("ellipse and wheels", **drop), 1)
    every |= {"beside": beside, "beside, axes": with_centre(shaped("axes", **drop), 2)}
    every["mixed"] = many.replace(motor=many.motor.replace(gear_efficiency=1.0))
    return every


@pytest.mark.parametrize("name", list(robots()))
def test_it_is_the_inverse_model(name):
    robot = robots()[name]
    robot = robot.replace(drive=robot.drive.replace(dead_band=0.15))
    table, random = feedforward_table(robot), np.random.default_rng(0)
    for _ in range(20):
        twist, change = random.normal(size=3) * [0.5, 0.5, 2.0], random.normal(size=3) * [2.0, 2.0, 8.0]
        np.testing.assert_allclose(table.volts(twist, change), omnidyn.voltage_for(robot, twist, change), atol=1e-12)


def test_the_paper_s_robot_by_hand():
    """kV of the axis x on motor 2: volts of the steady state, (B + k G G^T)/(g sqrt 3), from the printed numbers."""
    table = feedforward_table(load_robot("axebot"))
    gain, side = 19.0 * 0.0059 / (1.69 * 0.035), np.sqrt(0.75)
    braking = (19.0 * 0.0059 / 0.035) ** 2 / 1.69 * 1.5
    assert table.speed[1, 0] == pytest.approx((0.94 + braking) / (2.0 * side * gain), rel=1e-12)
    assert table.sign[0, 1, 0] == pytest.approx(2.2 / (2.0 * side * gain), rel=1e-12)
    assert "kV x" in str(table)
    assert "u1 = " in str(table)


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here")
@pytest.mark.parametrize("name", ["axebot", "all", "mixed", "beside", "beside, axes"])
def test_its_code_compiles_and_says_the_same(name, tmp_path):
    robot = robots()[name]
    table = feedforward_table(robot)
    wheels = range(1, robot.wheels.count + 1)
    signs = "".join(f"float s{e};\n" for e in range(len(table.directions)))
    body = "\n".join(table.code())
    out = " ".join(f"u[{k - 1}] = u{k};" for k in wheels)
    (tmp_path / "table.c").write_text(
        "#include <math.h>\nfloat sgn(float x) { return (x > 0) - (x < 0); }\n"
        "void volts(float vx, float vy, float w, float ax, float ay, float aw, float *u) {\n"
        f"float d = 0, fx = 0, fy = 0, ft = 0, {', '.join(f'u{k}' for k in wheels)};\n"
        "(void)d; (void)fx; (void)fy; (void)ft;\n"
        f"{signs}{body}\n{out}\n}}\n"
    )
    subprocess.run(
        ["cc", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC", "-O1", "-o", "t.so", "table.c", "-lm"],
        cwd=tmp_path,
        check=True,
    )
    code, random = ctypes.CDLL(str(tmp_path / "t.so")), np.random.default_rng(1)
    for _ in range(20):
        twist, change = random.normal(size=3) * [0.5, 0.5, 2.0], random.normal(size=3) * [2.0, 2.0, 8.0]
        u = (ctypes.c_float * robot.wheels.count)()
        code.volts(*map(ctypes.c_float, (*twist, *change)), u)
        np.testing.assert_allclose(list(u), table.volts(twist, change), atol=2e-4)


def test_gears_that_lose_have_no_formula():
    with pytest.raises(UnsupportedError, match="gears that lose"):
        feedforward_table(shaped("axes", gear_efficiency=0.8))
