"""The predictive controller in C: step by step that of Python, to what float32 holds; small; it drives a robot."""

import ctypes
import re
import shutil
import subprocess

import numpy as np
import pytest

import omnidyn
from omnidyn.control.controllers import ControllerFile, controller_named, save_controller
from omnidyn.control.mpc.columns import CP, CV, GX, GY, HP, HV, PULL, WEIGHT, E, V
from omnidyn.control.paths.path import path
from omnidyn.errors import UnsupportedError
from omnidyn.export.code.c_controller import c_controller
from omnidyn.model.drive import Drive
from omnidyn.model.friction import DirectionFriction, Friction, WheelFriction
from omnidyn.model.log_effects import Sensors
from omnidyn.simulation.live import LiveRobot
from tests.support.controlled import CController
from tests.support.exported import STRICT
from tests.support.mpc_programs import Solver, random_program

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here")
ROBOT = omnidyn.load_robot("axebot")
TURNING = ROBOT.body.replace(rotating_frame=True)
BESIDE = TURNING.replace(centre=(0.05, -0.04))
ELLIPSE = Friction(direction=DirectionFriction(coulomb=(2.6, 1.9), viscous=0.9, yaw_coulomb=0.11, yaw_viscous=0.01))
FOUR = ROBOT.wheels.replace(azimuth_deg=(45.0, 135.0, 225.0, 315.0))
DUTY = Drive.model_validate({"kind": "duty", "supply_V": 7.0, "latency_s": 0.04})
LOOP = Drive.model_validate({"kind": "speed", "rate_Hz": 200.0, "kp_V_s_rad": 0.1})
SUMMED = LOOP.replace(kp=0.2, ki=2.0, latency=0.04)
MEAN = Sensors(twist="mean")
VARIANTS = {
    "duty, two steps late": (ROBOT.replace(drive=DUTY), {}),
    "ellipse in a turning frame": (ROBOT.replace(friction=ELLIPSE, body=TURNING), {}),
    "a centre of mass beside the wheels": (ROBOT.replace(body=BESIDE), {}),
    "four wheels, current, slew": (
        ROBOT.replace(
            wheels=FOUR,
            friction=Friction(wheels=WheelFriction(coulomb=0.7, viscous=0.3)),
            motor=ROBOT.motor.replace(current_limit=2.2, voltage_limit=(6.0, 5.5, 6.0, 5.0)),
        ),
        {"slew": 300.0},
    ),
    "no observer, five ahead": (ROBOT, {"observer": False, "horizon": 5}),
    "speeds that are means": (ROBOT.replace(sensors=MEAN), {}),
    "speeds that are means, no observer": (ROBOT.replace(sensors=MEAN), {"observer": False}),
    "no friction, a loop in the firmware": (ROBOT.replace(drive=LOOP), {"friction": False}),
    "a loop with a sum, two steps late": (ROBOT.replace(drive=SUMMED), {}),
    "a loop with a sum, no observer": (ROBOT.replace(drive=SUMMED.replace(latency=0.0)), {"observer": False}),
    "a loop with a sum, speeds that are means": (ROBOT.replace(drive=SUMMED, sensors=MEAN), {}),
}
OK, LIMITED, STILL, SWINGS, BACKWARDS, BAD_TIME, BAD_POSE, BAD_TWIST, BAD_PATH = range(9)


def controller_file(folder, options):
    """A file of the controller with these options."""
    save_controller(ControllerFile("mpc", options), folder / "mpc.toml")
    return folder / "mpc.toml"


@pytest.mark.parametrize("robot, options", VARIANTS.values(), ids=VARIANTS)
@pytest.mark.some(4)
def test_every_step_is_that_of_python(robot, options, tmp_path):
    follow, rng, apart = path("zigzag"), np.random.default_rng(1), []
    live = LiveRobot(robot, 0.02, pose=follow.at(0.0).pose)
    with CController(robot, tmp_path / "c", controller_file(tmp_path, options)) as control:
        before = np.array(live.twist)
        for k in range(80):
            off = rng.standard_normal(6) * [2e-4, 2e-4, 4e-4, 1e-3, 1e-3, 4e-3]
            after = np.array(live.twist)
            twist = after if robot.sensors is None else 0.5 * (before + after)
            seen, before = np.float32(np.concatenate([live.pose, twist]) + off).astype(float), after
            own = control.own.step(k * 0.02, seen[:3], seen[3:], follow)
            apart.append(np.abs(control.step(k * 0.02, seen[:3], seen[3:], follow) - own).max() / control.limit.max())
            live.step(own)
    assert np.median(apart) < 1e-3
    assert np.percentile(apart, 90) < 1e-2  # where friction turns round, the last bit of a float decides when


def in_double(text):
    """The same C with double in place of float."""
    text = re.sub(r"\b(cos|sin|fabs|sqrt|remainder)f\b", r"\1", re.sub(r"\bfloat\b", "double", text))
    return re.sub(r"(?<=[0-9.])f\b", "", text)


@pytest.mark.parametrize("sensors", [None, MEAN])
@pytest.mark.parametrize(
    "drive", [ROBOT.drive, SUMMED.replace(latency=0.0), SUMMED], ids=["volts", "loop", "late loop"]
)
@pytest.mark.some(2)
def test_in_double_precision_its_formulas_are_those_of_python(sensors, drive, tmp_path):
    """What float32 hides: every number of the observer, the model and the program."""
    robot = ROBOT.replace(sensors=sensors, drive=drive)
    for name, text in c_controller(robot, controller="mpc").files.items():
        (tmp_path / name).write_text(in_double(text))
    (tmp_path / "one.c").write_text('#include "omnidyn_control.c"\nomnidyn_control one;\n')
    subprocess.run(["gcc", *STRICT, "-shared", "-fPIC", "-o", "one.so", "one.c", "-lm"], cwd=tmp_path, check=True)
    library = ctypes.CDLL(str(tmp_path / "one.so"))
    one, own = ctypes.addressof(ctypes.c_char.in_dll(library, "one")), controller_named("mpc", robot)
    follow = path("eight")
    library.omnidyn_control_reset(ctypes.c_void_p(one))
    live, rng, apart = LiveRobot(ROBOT, 0.02, pose=follow.at(0.0).pose), np.random.default_rng(2), []
    times = 0.02 * np.arange(80)
    times[20:48] += rng.uniform(-0.004, 0.004, 28)  # a loop that trembles, and no step at all
    times[60:] += 0.02
    before = np.array(live.twist)
    for k, t in enumerate(times):
        twist, before = np.array(live.twist) if sensors is None else 0.5 * (before + live.twist), np.array(live.twist)
        seen = np.concatenate([live.pose, twist]) + rng.standard_normal(6) * [2e-4, 2e-4, 4e-4, 1e-3, 1e-3, 4e-3]
        seen[3:] += [0.06, 0.0, -0.3] if k == 40 else [0.0, 0.0, 0.0]  # a knock
        seen[:3] += np.nan if k in (50, 51) else 0.0
        motion, found = follow.at(t + drive.latency + 0.02 * np.arange(21)), np.zeros(3)
        rows = np.ascontiguousarray(np.concatenate([motion.pose, motion.velocity], axis=1))
        given = [each.ctypes.data_as(ctypes.c_void_p) for each in (seen[:3].copy(), seen[3:].copy(), rows, found)]
        library.omnidyn_control_step(ctypes.c_void_p(one), ctypes.c_double(t - times[k - 1] if k else 0.0), *given)
        sent = own.step(t, seen[:3], seen[3:], follow)
        apart.append(np.abs(found - sent).max() * 6.0 / own.limit.max())
        for _ in range(1 + (k == 59)):
            live.step(sent)
    assert np.median(apart) < 1e-5  # [V]; its numbers have nine digits
    assert np.max(apart) < 1e-2


@pytest.mark.parametrize("name", ["eight", "eight:period_s=3.2"])
@pytest.mark.some(1)
def test_it_drives_the_simulated_robot_as_python_does(name, tmp_path):
    with CController(ROBOT, tmp_path / "c", "mpc") as control:
        in_c, own = (omnidyn.track(ROBOT, name, each, duration=4.0) for each in (control, "mpc"))
    assert in_c.rmse_position == pytest.approx(own.rmse_position, rel=0.01)
    assert in_c.rmse_heading == pytest.approx(own.rmse_heading, rel=0.05, abs=1e-5)


def test_headings_may_wrap_around(tmp_path):
    way = path("circle:turn_rad_s=3")

    class Wrapped:
        """The same path and its headings within half a turn, as an encoder of one turn says them."""

        end = way.end

        def at(self, t):
            found = way.at(t)
            return found._replace(pose=found.pose - [0.0, 0.0, 2.0 * np.pi] * np.round(found.pose / (2.0 * np.pi)))

    live, apart = LiveRobot(ROBOT, 0.02, pose=way.at(0.0).pose), []
    with CController(ROBOT, tmp_path / "c", "mpc") as control:
        for k in range(150):
            pose = np.array(live.pose)
            pose[2] -= 2.0 * np.pi * round(pose[2] / (2.0 * np.pi))
            live.step(control.step(k * 0.02, pose, np.array(live.twist), Wrapped()))
            apart.append(np.hypot(*(np.array(live.pose) - way.at((k + 1) * 0.02).pose)[:2]))
    assert max(apart[25:]) < 1e-3


def test_nothing_that_is_no_step_gets_through(tmp_path):
    nan, zeros, still = float("nan"), np.zeros(3), (np.zeros((21, 3)), np.zeros((21, 3)))
    place = np.array([0.01, 0.0, 0.0])
    with CController(ROBOT, tmp_path / "c", "mpc") as control:
        says, first = control.call(0.0, place, zeros, *still)
        assert says in (OK, LIMITED)
        assert first.any()
        says, again = control.call(0.0, zeros, zeros, *still)
        assert says == STILL
        assert np.array_equal(again, first)
        for wrong, word in (
            ((nan, place, zeros, *still), BAD_TIME),
            ((-0.02, place, zeros, *still), BACKWARDS),
            ((0.02, [nan, 0.0, 0.0], zeros, *still), BAD_POSE),
            ((0.02, place, [0.0, 0.0, np.inf], *still), BAD_TWIST),
            ((0.02, place, zeros, np.full((21, 3), nan), still[1]), BAD_PATH),
        ):
            says, output = control.call(*wrong)
            assert says == word
            assert not output.any()
        rng = np.random.default_rng(3)
        for _ in range(400):  # whatever comes, a number within the limits
            size = 10.0 ** rng.uniform(-40.0, 12.0, 132) * rng.choice([-1.0, 1.0, nan], 132, p=[0.45, 0.5495, 0.0005])
            _, output = control.call(0.02, size[:3], size[3:6], size[6:69].reshape(21, 3), size[69:].reshape(21, 3))
            assert np.all(np.abs(output) <= np.float32(6.0))
        for _ in range(5):
            says, output = control.call(0.02, place, zeros, *still)
        assert says in (OK, LIMITED)
        assert output.any()


def test_it_is_small_and_asks_for_no_memory(tmp_path, capsys):
    c_controller(ROBOT, controller="mpc").write(tmp_path / "c")
    (tmp_path / "c" / "size.c").write_text('#include "omnidyn_control.h"\nomnidyn_control one;\n')
    without = ["-DOMNIDYN_MOST_BRIDGED=0", "-DOMNIDYN_ELAPSED=0", "-DOMNIDYN_FEW_KNOCKS=0", "-DOMNIDYN_SWING=0"]
    for options, most, most_memory in ((without, 8192, 11 * 1024), ([], 12288, 11776)):
        for name in ("omnidyn_control", "size"):
            command = ["gcc", *STRICT, "-Os", "-fstack-usage", *options, "-c", f"{name}.c"]
            subprocess.run(command, cwd=tmp_path / "c", check=True)
        needs = subprocess.run(["nm", "-u", "omnidyn_control.o"], cwd=tmp_path / "c", capture_output=True, text=True)
        assert {line.split()[-1] for line in needs.stdout.splitlines()} <= {
            "cosf",
            "sinf",
            "sincosf",
            "remainderf",
            "memcpy",
            "memmove",
            "memset",
            "__stack_chk_fail",
            "_GLOBAL_OFFSET_TABLE_",
        }
        size = subprocess.run(
            ["size", "omnidyn_control.o", "size.o"], cwd=tmp_path / "c", capture_output=True, text=True
        )
        (code, *own), (_, *one) = (list(map(int, line.split()[:3])) for line in size.stdout.splitlines()[1:])
        stack = [int(line.split("\t")[1]) for line in (tmp_path / "c" / "omnidyn_control.su").read_text().splitlines()]
        with capsys.disabled():
            words = f"{code} bytes of code, {sum(one)} of memory and at most {sum(stack)} of stack"
            print(f"\nmpc of the axebot in C{' without its new parts' if options else ''}: {words}")
        assert code <= most
        assert sum(own) == 0
        assert sum(one) + sum(stack) <= most_memory


def test_from_metres_off_it_finds_the_optimum(tmp_path):
    """The interior point method behind the active set, on the same programs as that of Python."""
    c_controller(ROBOT, controller="mpc").write(tmp_path / "c")
    (tmp_path / "c" / "solve.c").write_text(_SOLVE)
    command = ["gcc", *STRICT, "-shared", "-fPIC", "-o", "solve.so", "solve.c", "-lm"]
    subprocess.run(command, cwd=tmp_path / "c", check=True)
    solve, solver = ctypes.CDLL(str(tmp_path / "c" / "solve.so")).solve_program, Solver(20, 3)
    for scale, most in ((0.2, 1e-3), (1.0, 0.01), (5.0, 0.2)):  # [V]; those from five metres off are badly scaled
        rng, off = np.random.default_rng(5), []
        for _ in range(150):
            program = random_program(rng, scale)
            best, found = solver.solve(program)[0], np.zeros(60, np.float32)
            given = [np.ascontiguousarray(each, np.float32) for each in columns_of(program)]
            solve(*(each.ctypes.data_as(ctypes.c_void_p) for each in (*given, found)))
            off.append(np.abs(np.clip(found[:3], -6.0, 6.0) - best[0]).max())
        assert max(off) < most
        assert np.median(off) < 1e-3


_SOLVE = """#include "omnidyn_control.c"

void solve_program(const float *columns, const float *goal, const float *wanted, const float *start, float *found);
void solve_program(const float *columns, const float *goal, const float *wanted, const float *start, float *found)
{
    static omnidyn_control c;
    int j;
    omnidyn_control_reset(&c);
    memcpy(c.columns, columns, sizeof(c.columns));
    memcpy(c.goal[1], goal, sizeof(c.goal) - sizeof(c.goal[0]));
    memcpy(c.x[0], start, sizeof(c.x[0]));
    for (j = 0; j < INPUTS; j++) {
        c.input[j].wanted = wanted[j];
    }
    solve(&c);
    for (j = 0; j < INPUTS; j++) {
        found[j] = c.input[j].volts;
    }
}
"""


def columns_of(program):
    """(columns, goal, wanted, start) of a program as C holds them."""
    stage = program.stage
    columns = np.zeros((len(stage), 8, 6))
    columns[:, 0, :3] = np.stack([stage[:, GX], stage[:, GY], np.ones(len(stage))], axis=-1)
    for first, own in ((1, (E, V)), (5, (HP, HV))):
        for row, at in enumerate(own):
            matrix = stage[:, at : at + 9].reshape(-1, 3, 3)
            columns[:, first : first + 3, 3 * row : 3 * row + 3] = matrix.transpose(0, 2, 1)
    columns[:, 4] = np.concatenate([stage[:, CP : CP + 3], stage[:, CV : CV + 3]], axis=1)
    goal = -stage[:, PULL : PULL + 6] / stage[:, WEIGHT : WEIGHT + 6]
    return columns, goal, program.wanted, program.start


def test_a_limit_of_the_speed_is_refused(tmp_path):
    file = controller_file(tmp_path, {"speed": (0.3, 0.3, 3.0)})
    with pytest.raises(UnsupportedError, match=r"no limit of the speed: float32.*leave `speed` out"):
        c_controller(ROBOT, controller=file)
