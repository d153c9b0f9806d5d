"""c-controller: in C as in Python, to what float32 holds; clean under sanitizers; it drives the simulated robot."""

import shutil
import subprocess

import numpy as np
import pytest

import omnidyn
from omnidyn.control.controller import SWINGS as SWINGS_WORD
from omnidyn.control.controllers import NAMES, UNLISTED_NAMES, ControllerFile, save_controller
from omnidyn.control.paths.motion import Path, Reference
from omnidyn.errors import InputError, UnsupportedError
from omnidyn.export.code.c_controller import c_controller
from omnidyn.export.features import CONTROLLERS, REFUSES, Cell
from omnidyn.model.drive import Drive
from omnidyn.model.log_effects import Lateness, LogEffects, Sensors
from omnidyn.simulation.live import LiveRobot
from tests.support.controlled import CController
from tests.support.exported import STRICT, exact_robot
from tests.support.mixed_robots import random_robot, with_centre, with_spin

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here")
ROBOT = omnidyn.load_robot("axebot")
WRITTEN = [name for name, cell in CONTROLLERS.items() if cell.does != REFUSES and name != "mpc"]  # see mpc/
OK, LIMITED, STILL, SWINGS, BACKWARDS, BAD_TIME, BAD_POSE, BAD_TWIST, BAD_PATH = range(9)


def without_losses(robot):
    """The robot with gears that lose nothing."""
    return robot.replace(motor=robot.motor.replace(gear_efficiency=1.0))


def driven(kind):
    """The axebot with another drive."""
    loop = {"rate_Hz": 200.0, "kp_V_s_rad": 0.1} if kind == "speed" else {"supply_V": 7.0}
    return ROBOT.replace(drive=Drive.model_validate({"kind": kind, "latency_s": 0.03, **loop}))


def late(name, latency):
    """A preset whose yaw is faster than the loop may be."""
    robot = omnidyn.load_robot(name)
    return robot.replace(drive=robot.drive.replace(latency=latency))


ROBOTS = [
    ROBOT,
    *(without_losses(random_robot(seed)) for seed in range(4)),
    *(without_losses(with_spin(random_robot(seed), seed)) for seed in (6,)),
    exact_robot(2),
    driven("duty"),
    driven("speed"),
    driven("speed").replace(drive=driven("speed").drive.replace(ki=2.0)),
    omnidyn.load_robot("lekiwi"),
    without_losses(with_centre(random_robot(7), 7)),
    late("mecanum", 0.03),
]


class Given(Path):
    """A path that is asked for three times, now, as late as outputs are, and a step later, and knows those."""

    name, duration, end = "given", 1.0, np.inf

    def __init__(self, pose, velocity):
        self.pose, self.velocity = pose, velocity

    def at(self, t):
        count = len(np.atleast_1d(t))
        return Reference(self.pose[-count:].copy(), self.velocity[-count:].copy(), np.zeros((count, 3)))


def steps(seed, count):
    """Random steps near a path: (elapsed, pose, twist, poses, velocities), as float32 holds them."""
    rng = np.random.default_rng(seed)
    for k in range(count):
        velocity = rng.uniform(-0.5, 0.5, 3) * [1.0, 1.0, 3.0] * rng.choice([0.0, 0.01, 1.0], p=[0.1, 0.2, 0.7])
        slower = rng.uniform(0.9, 1.1, (3, 1)) * velocity
        place = rng.uniform(-3.0, 3.0, 3)
        poses = place + np.outer([0.0, 0.5, 1.0], 0.02 * velocity)
        pose = place + rng.normal(0.0, [1e-3, 1e-3, 3e-3]) + [0.0, 0.0, rng.choice([0.0, 2.0 * np.pi])]
        twist = rng.normal(0.0, [0.3, 0.3, 1.0])
        given = (0.0 if k == 0 else rng.uniform(0.015, 0.025), pose, twist, poses, slower)
        yield tuple(np.asarray(each, np.float32).astype(float) for each in given)


@pytest.mark.parametrize("name", WRITTEN)
@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: f"{robot.name} {robot.drive.kind}".replace(" ", "-"))
@pytest.mark.some(11)
def test_it_is_the_controller_of_python(name, robot, tmp_path):
    t, apart = 0.0, []
    with CController(robot, tmp_path / "c", name) as control:
        for elapsed, pose, twist, poses, velocities in steps(1, 400):
            t += float(elapsed)
            own = control.own.step(t, pose, twist, Given(poses, velocities))
            says, output = control.call(elapsed, pose, twist, poses, velocities)
            assert says == (SWINGS if control.own._swinging else LIMITED if control.own.info.limits else OK)
            apart.append(np.max(np.abs(output - own) / control.limit))
    assert np.max(apart) < 1e-4
    assert np.median(apart) < 1e-5


@pytest.mark.parametrize("kind", ["voltage", "duty", "speed"])
@pytest.mark.parametrize("path", ["eight", "square"])
@pytest.mark.some(3)
def test_it_drives_the_simulated_robot_as_python_does(kind, path, tmp_path):
    robot = driven(kind) if kind != "voltage" else ROBOT
    with CController(robot, tmp_path / "c") as control:
        in_c, own = (omnidyn.track(robot, path, each, duration=4.0) for each in (control, "pid"))
    assert in_c.rmse_position == pytest.approx(own.rmse_position, rel=0.01)
    assert in_c.rmse_heading == pytest.approx(own.rmse_heading, rel=0.01, abs=1e-4)


@pytest.mark.parametrize("name", ["pid", "mpc"])
@pytest.mark.some(1)
def test_a_loop_that_swings_says_so_in_c_as_in_python(name, tmp_path):
    follow = omnidyn.path("eight:period_s=4")
    with CController(ROBOT, tmp_path / "c", name) as control:
        for latency, expected in ((0.0, False), (0.06, True)):
            plant = ROBOT.replace(drive=Drive.model_validate({"kind": "voltage", "latency_s": latency}))
            control.reset()
            live, found = LiveRobot(plant, 0.02, pose=follow.at(0.0).pose), []
            for k in range(150):
                now = 0.02 * k, np.array(live.pose), np.array(live.twist), follow
                control.own.step(*now)
                sent = control.step(*now)
                found.append((control.own.info.status == SWINGS_WORD, control.says == SWINGS))
                live.step(sent)
            assert np.mean([a == b for a, b in found]) > 0.95  # float32 may be a step early or late
            assert (found[-1][0], found[-1][1]) == (expected, expected)


@pytest.mark.parametrize("kind, most", [("voltage", 2.5e-3), ("duty", 5e-3), ("speed", 0.018)])
@pytest.mark.some(2)
def test_a_robot_that_was_held_overshoots_little(kind, most, tmp_path):
    robot, follow = ROBOT if kind == "voltage" else driven(kind), omnidyn.path("circle:radius_m=0.5,speed_m_s=0.1")
    with CController(robot, tmp_path / "c") as control:
        for each in (control, control.own):
            control.reset()
            pose, overshoot, twist = np.array(follow.at(0.0).pose), 0.0, np.zeros(3)
            live = LiveRobot(robot, 0.02, pose=pose)
            for k in range(400):
                sent = each.step(0.02 * k, pose, twist, follow)
                if 50 <= k < 200:
                    live = LiveRobot(robot, 0.02, pose=pose)
                else:
                    live.step(sent)
                pose, twist = np.array(live.pose), np.array(live.twist)
                on = follow.at(0.02 * (k + 1))
                ahead = (pose - on.pose)[:2] @ on.velocity[:2] / np.hypot(*on.velocity[:2])
                overshoot = max(overshoot, ahead) if k > 200 else 0.0
            assert overshoot < most  # 13, 17 and 24 mm with all errors of three seconds in the sum


def test_nothing_that_is_no_step_gets_through(tmp_path):
    nan, zeros, path = float("nan"), np.zeros(3), (np.zeros((3, 3)), np.zeros((3, 3)))
    place = np.array([0.01, 0.0, 0.0])
    with CController(ROBOT, tmp_path / "c") as control:
        says, first = control.call(0.0, place, zeros, *path)
        assert says in (OK, LIMITED)
        assert first.any()
        says, again = control.call(0.0, zeros, zeros, *path)
        assert says == STILL
        assert np.array_equal(again, first)
        for wrong, word in (
            ((nan, place, zeros, *path), BAD_TIME),
            ((-0.02, place, zeros, *path), BACKWARDS),
            ((0.02, [nan, 0.0, 0.0], zeros, *path), BAD_POSE),
            ((0.02, [1e30, 0.0, 0.0], zeros, *path), BAD_POSE),
            ((0.02, place, [0.0, 0.0, np.inf], *path), BAD_TWIST),
            ((0.02, place, zeros, np.full((3, 3), nan), path[1]), BAD_PATH),
        ):
            says, output = control.call(*wrong)
            assert says == word
            assert not output.any()
        rng = np.random.default_rng(3)
        for _ in range(2000):  # whatever comes, a number within the limits
            size = 10.0 ** rng.uniform(-40.0, 12.0, 25) * rng.choice([-1.0, 1.0, nan], 25, p=[0.45, 0.549, 0.001])
            _, output = control.call(0.02, size[:3], size[3:6], size[6:15].reshape(3, 3), size[15:24].reshape(3, 3))
            assert np.all(np.abs(output) <= np.float32(6.0))


def test_its_size_is_small_and_it_asks_for_no_memory(tmp_path, capsys):
    c_controller(ROBOT).write(tmp_path / "c")
    subprocess.run(["gcc", *STRICT, "-Os", "-c", "omnidyn_control.c"], cwd=tmp_path / "c", check=True)
    needs = subprocess.run(["nm", "-u", "omnidyn_control.o"], cwd=tmp_path / "c", capture_output=True, text=True)
    assert {line.split()[-1] for line in needs.stdout.splitlines()} <= {
        "cosf",
        "sinf",
        "sincosf",
        "remainderf",
        "__stack_chk_fail",
        "_GLOBAL_OFFSET_TABLE_",
    }
    size = subprocess.run(["size", "omnidyn_control.o"], cwd=tmp_path / "c", capture_output=True, text=True)
    text, data, bss = map(int, size.stdout.splitlines()[1].split()[:3])
    with capsys.disabled():
        print(f"\npid of the axebot in C: {text} bytes of code, {data + bss} of memory of its own")
    assert text < 4096
    assert data + bss == 0


def test_it_is_cpp_too(tmp_path):
    if shutil.which("g++") is None:
        pytest.skip("no g++ here")
    c_controller(ROBOT.replace(name="*/ int x; /* Größe??/")).write(tmp_path / "c")
    (tmp_path / "c" / "use.cpp").write_text(
        '#include "omnidyn_control.h"\nint main() { omnidyn_control c; omnidyn_control_reset(&c); return c.begun; }'
    )
    for command in (
        ["gcc", *STRICT, "-c", "omnidyn_control.c"],
        ["g++", "-o", "use", "use.cpp", "omnidyn_control.o", "-lm"],
        ["./use"],
    ):
        subprocess.run(command, cwd=tmp_path / "c", check=True)


def test_a_controller_file_gives_its_options(tmp_path):
    file = tmp_path / "loop.toml"
    save_controller(ControllerFile("pid", {"faster": 1.5, "friction": False}), file)
    made, plain = c_controller(ROBOT, controller=file, dt=0.01), c_controller(ROBOT, dt=0.01)
    assert made.files["omnidyn_control.c"].startswith("/* pid_no_friction of axebot")
    assert made.files["omnidyn_control.c"] != plain.files["omnidyn_control.c"]
    assert "#define OMNIDYN_DT 0.01f" in made.files["omnidyn_control.h"]
    late = c_controller(driven("duty")).files["omnidyn_control.h"]
    assert "#define OMNIDYN_LATE 0.03f" in late
    assert "duties, -1 to 1" in late


def test_controllers_and_robots_without_c_are_refused_by_name(monkeypatch):
    assert set(CONTROLLERS) <= {*NAMES, *UNLISTED_NAMES}
    monkeypatch.setitem(NAMES, "new", "omnidyn.control.pid:Pid")
    with pytest.raises(UnsupportedError, match="the controller new: there is no C code of it"):
        c_controller(ROBOT, controller="new")
    monkeypatch.setitem(CONTROLLERS, "speed", Cell(REFUSES, "no C today"))
    with pytest.raises(UnsupportedError, match=r"the controller speed: no C today.*expected feedforward or pid or mpc"):
        c_controller(ROBOT, controller="speed")
    lossy = ROBOT.replace(motor=ROBOT.motor.replace(gear_efficiency=0.9))
    with pytest.raises(UnsupportedError, match=r"found by trying.*gear efficiency"):
        c_controller(lossy)
    with pytest.raises(InputError, match="step out of range"):
        c_controller(ROBOT, dt=0.0)


def test_a_latency_that_is_no_whole_number_of_steps_is_refused_for_the_predictive_controller():
    robot = omnidyn.load_robot("axebot")
    robot = robot.replace(drive=robot.drive.replace(latency=0.03))
    with pytest.raises(UnsupportedError, match=r"1\.5 steps of 0\.02 s.*export it with `dt` 0\.015"):
        c_controller(robot, controller="mpc")
    assert c_controller(robot, controller="mpc", dt=0.015).files


@pytest.mark.parametrize("name", ["pid", "mpc"])
@pytest.mark.parametrize("twist", ["mean", "instantaneous", "of the log"])
@pytest.mark.some(2)
def test_a_late_pose_is_brought_up_to_now_as_in_python(name, twist, tmp_path):
    """A camera of 30 Hz and 50 ms in a loop that trembles, with a sample that is missing."""
    robot = (
        ROBOT.replace(sensors=Sensors(twist=twist, pose_delay=0.05, pose_rate=30.0))
        if twist != "of the log"
        else (ROBOT.replace(log=LogEffects(latency=Lateness(position=0.06, wheel_angle=0.0))))
    )
    follow, rng, apart = omnidyn.path("eight"), np.random.default_rng(4), []
    times = 0.02 * np.arange(120) + [0.0, *rng.uniform(-0.003, 0.003, 119)]
    with CController(robot, tmp_path / "c", name) as control:
        for k, t in enumerate(times):
            old = follow.at(np.floor((t - 0.05) * 30.0) / 30.0).pose + np.array([1e-3, -2e-3, 4e-3])
            measured = np.array([*old, *follow.twist_at(t - (0.01 if twist == "mean" else 0.0))[1]])
            if k in (50, 51):
                measured[k - 47] = np.nan
            measured = np.float32(measured).astype(float)
            own = control.own.step(t, measured[:3], measured[3:], follow)
            apart.append(np.abs(control.step(t, measured[:3], measured[3:], follow) - own).max() / 6.0)
    assert np.median(apart) < 1e-3  # in the end, volts at their limits make much of rounding
    assert np.percentile(apart[:90], 90) < 1e-2
