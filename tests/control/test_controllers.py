"""Every controller keeps the contract: within limits, never raising, a word for what is wrong; does what it says."""

import math

import numpy as np
import pytest

import omnidyn
from omnidyn.control.controller import (
    BACKWARDS,
    BAD_PATH,
    BAD_POSE,
    BAD_TIME,
    BAD_TWIST,
    BRIDGED,
    MOST_BRIDGED,
    OK,
    PATH_ENDED,
    TIME_STANDS_STILL,
)
from omnidyn.control.controllers import (
    NAMES,
    ControllerFile,
    controller_named,
    load_controller,
    save_controller,
    several,
)
from omnidyn.control.feedforward import Feedforward
from omnidyn.control.mpc.controller import Mpc
from omnidyn.control.pid import Pid, summed
from omnidyn.control.pid_batch import summed_each
from omnidyn.control.speed_loop import SpeedLoop
from omnidyn.errors import InputError, Terminated
from omnidyn.model.drive import Drive
from omnidyn.model.log_effects import Sensors
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.live import LiveRobot
from tests.support.friction_shapes import shaped
from tests.support.mixed_robots import random_robot

AXEBOT = load_robot("axebot")
EIGHT = omnidyn.path("eight")
REST = np.zeros(3)
DUTY = AXEBOT.replace(drive=AXEBOT.drive.replace(kind="duty", supply=7.2))
SPEED = AXEBOT.replace(drive=AXEBOT.drive.replace(kind="speed", kp=0.3, ki=2.0, rate=100.0))
ROBOTS = {
    "axebot": AXEBOT,
    "duty": DUTY,
    "speed": SPEED,
    "all friction": shaped("all", current_limit=1.0),
    **{f"mixed {seed}": random_robot(seed) for seed in (2, 5, 8)},
}


@pytest.fixture(params=list(NAMES))
def name(request):
    return request.param


@pytest.mark.parametrize("robot", list(ROBOTS))
def test_its_output_fits_the_drive_and_its_limit(name, robot):
    control = controller_named(name, ROBOTS[robot])
    assert control.output == {"duty": "duty", "speed": "wheel_speed"}.get(robot, "voltage")
    for k in range(30):
        sent = control.step(0.02 * k, [0.3, -0.2, 0.1], [0.1, 0.0, -0.5], EIGHT)
        assert sent.shape == control.limit.shape == (ROBOTS[robot].wheels.count,)
        assert (np.abs(sent) <= control.limit).all()
        assert control.info.ok
        assert control.info.time > 0.0


@pytest.mark.parametrize(
    "pose, twist, path, word",
    [
        (None, REST, EIGHT, BAD_POSE),
        ([0.0, math.nan, 0.0], REST, EIGHT, BAD_POSE),
        ([0.0, 0.0], REST, EIGHT, BAD_POSE),
        (REST, "fast", EIGHT, BAD_TWIST),
        (REST, [math.inf, 0.0, 0.0], EIGHT, BAD_TWIST),
        (REST, [1e300, 0.0, 0.0], EIGHT, BAD_TWIST),
        (REST, REST, None, BAD_PATH),
        (REST, REST, 3.0, BAD_PATH),
    ],
)
def test_what_is_missing_gives_zeros_and_a_word(name, pose, twist, path, word):
    control = controller_named(name, AXEBOT)
    control.step(0.0, [0.1, 0.1, 0.1], REST, EIGHT)
    bridged = 0 if word == BAD_PATH else MOST_BRIDGED
    for k in range(bridged):
        assert control.step(0.02 + 0.02 * k, pose, twist, path).any()
        assert control.info.status == BRIDGED[word]
    np.testing.assert_array_equal(control.step(0.02 + 0.02 * bridged, pose, twist, path), np.zeros(3))
    assert control.info.status == word
    assert control.step(0.04 + 0.02 * bridged, [0.1, 0.1, 0.1], REST, EIGHT).shape == (3,)
    assert control.info.status == OK


def test_time_that_stands_still_or_goes_back(name):
    control = controller_named(name, AXEBOT)
    first = control.step(1.0, REST, REST, EIGHT)
    np.testing.assert_array_equal(control.step(1.0, [0.5, 0.5, 0.5], REST, EIGHT), first)
    assert control.info.status == TIME_STANDS_STILL
    assert not control.step(0.5, REST, REST, EIGHT).any()
    assert control.info.status == BACKWARDS
    control.step(0.52, REST, REST, EIGHT)
    assert control.info.status == OK
    for t in (math.nan, None, "soon", math.inf):
        assert not control.step(t, REST, REST, EIGHT).any()
        assert control.info.status == BAD_TIME


def test_a_path_that_fails_is_told(name):
    class Broken:
        end = "never"

        def at(self, t):
            raise ZeroDivisionError

    control = controller_named(name, AXEBOT)
    assert not control.step(0.0, REST, REST, Broken()).any()
    assert control.info.status.startswith("no output found")


@pytest.mark.parametrize("error", [KeyboardInterrupt, Terminated])
def test_an_interrupt_in_compiled_code_ends_the_loop(name, error):
    """Python calls it a SystemError there, with the interrupt as its cause."""
    control = controller_named(name, AXEBOT)

    class Stopped:
        end = 5.0

        def at(self, t):
            raise SystemError("a kernel returned a result with an exception set") from error()

        twist_at = at

    with pytest.raises(error):
        control.step(0.0, REST, REST, Stopped())


def test_a_path_that_is_nothing_once_is_forgotten(name):
    """The sum of the errors of a PID stayed NaN for good."""

    class Blank:
        end = EIGHT.end

        def at(self, t):
            motion = EIGHT.at(t)
            return type(motion)(*(np.nan * each for each in vars(motion).values()))

    control = controller_named(name, AXEBOT)
    control.step(0.0, REST, REST, EIGHT)
    assert not control.step(0.02, REST, REST, Blank()).any()
    control.step(0.04, REST, REST, EIGHT)
    assert control.step(0.06, REST, REST, EIGHT).any()
    assert control.info.status == OK


def test_a_path_that_ends_is_held(name):
    goal = omnidyn.path("goal:x_m=0.3,travel_s=0.5")
    control = controller_named(name, AXEBOT)
    control.step(9.0, [0.3, 0.0, 0.0], REST, goal)
    assert control.info.status == PATH_ENDED
    assert control.info.ok


def test_reset_forgets_all_steps(name):
    control = controller_named(name, AXEBOT)

    def steps():
        return [control.step(0.02 * k, [0.05, 0.02, 0.1], [0.1, 0.0, 0.0], EIGHT) for k in range(20)]

    first = steps()
    control.reset()
    np.testing.assert_array_equal(steps(), first)


def test_another_robot_takes_over_what_is_remembered(name):
    control, other = controller_named(name, AXEBOT), controller_named(name, AXEBOT)
    for k in range(10):
        near = [0.01, -0.02, 0.03] + EIGHT.twist_at(0.02 * k)[0]
        control.step(0.02 * k, near, REST, EIGHT)
        other.step(0.02 * k, near, REST, EIGHT)
    same, heavy = (
        control.replace(robot=AXEBOT),
        control.replace(robot=AXEBOT.replace(body=AXEBOT.body.replace(mass=3.0))),
    )
    assert heavy.robot.body.mass == 3.0
    pose, twist, _ = EIGHT.twist_at(0.2)
    pose = np.array([0.01, -0.02, 0.03]) + pose
    sent = other.step(0.2, pose, twist, EIGHT)
    np.testing.assert_array_equal(same.step(0.2, pose, twist, EIGHT), sent)
    assert (heavy.step(0.2, pose, twist, EIGHT) != sent).any()
    assert control.replace(robot=random_robot(0)).step(0.2, REST, REST, EIGHT).shape == (random_robot(0).wheels.count,)


VALUES = [
    0.0,
    -1.0,
    1e-300,
    1e9,
    1e300,
    math.inf,
    -math.inf,
    math.nan,
    None,
    "x",
    [],
    (1, 2, 3),
    {},
    True,
    1e400,
    10**400,
]


def fuzz(name, calls, seed):
    """Random calls, most of them wrong."""
    random = np.random.default_rng(seed)
    robots = [AXEBOT, DUTY, SPEED, shaped("all", current_limit=0.7)]
    paths = [omnidyn.path(each) for each in ("eight", "square", "zigzag", "goal", "circle:heading=along")]
    controls = [controller_named(name, robot) for robot in robots]

    def some(size):
        if random.random() < 0.2:
            return VALUES[random.integers(len(VALUES))]
        array = random.normal(size=size) * 10.0 ** random.integers(-3, 4)
        if random.random() < 0.1:
            array[random.integers(size)] = [math.nan, math.inf, 1e200][random.integers(3)]
        return array if random.random() < 0.5 else array.tolist()

    t = 0.0
    for _ in range(calls):
        control = controls[random.integers(len(controls))]
        t += float(random.choice([0.02, 0.02, 0.02, 0.0, -0.3, 5.0, 1e-9]))
        when = t if random.random() < 0.95 else VALUES[random.integers(len(VALUES))]
        sent = control.step(
            when, some(3), some(3), paths[random.integers(len(paths))] if random.random() < 0.95 else None
        )
        assert sent.shape == (control.robot.wheels.count,)
        assert (np.abs(sent) <= control.limit).all()
        assert control.info.status


@pytest.mark.some(2)
def test_random_calls(name):
    fuzz(name, 3_500, 1)


@pytest.mark.long
def test_many_random_calls(name):
    fuzz(name, 20_000, 2)


def test_feed_forward_takes_the_model_where_it_wants():
    """A smooth path from rest to rest, the model being the robot: it stays on it to 0.1 %, without any measurement."""
    path = omnidyn.path("goal:x_m=0.5,y_m=0.3,heading_rad=1.0,travel_s=2")
    found = omnidyn.track(AXEBOT, path, Feedforward(AXEBOT, dt=0.005), dt=0.005)
    assert found.worst_position < 2e-3
    assert omnidyn.track(AXEBOT, path, Feedforward(AXEBOT, dt=0.005, friction=False), dt=0.005).worst_position > 0.1


def test_a_speed_loop_reaches_its_command_without_error_whatever_the_floor():
    """Friction 40 % off: integral action brings the error to 0."""
    rough = AXEBOT.friction.axes.replace(coulomb=(3.0, 2.1, 0.14))
    live, loop = LiveRobot(AXEBOT.replace(friction=AXEBOT.friction.replace(axes=rough)), 0.02), SpeedLoop(AXEBOT)
    for k in range(200):
        live.step(loop.step(0.02 * k, live.twist, [0.4, -0.2, 1.0]))
    np.testing.assert_allclose(live.twist, [0.4, -0.2, 1.0], rtol=1e-6)
    assert loop.info.status == OK


def test_a_speed_loop_does_not_wind_up():
    """A command beyond reach for a while: then it stops as if it had never been asked."""
    live, loop = LiveRobot(AXEBOT, 0.02), SpeedLoop(AXEBOT)
    for k in range(150):
        live.step(loop.step(0.02 * k, live.twist, [9.0, 0.0, 0.0]))
    assert "voltage" in loop.info.limits
    for k in range(150, 190):
        live.step(loop.step(0.02 * k, live.twist, REST))
    assert not live.twist.any()


@pytest.mark.parametrize(
    "twist, command, word", [([1.0], REST, BAD_TWIST), (REST, [1, 2, math.nan], "command missing")]
)
def test_a_speed_loop_without_its_input(twist, command, word):
    loop = SpeedLoop(AXEBOT)
    assert not loop.step(0.0, twist, command).any()
    assert loop.info.status == word


def test_what_friction_in_the_model_is_worth_at_a_goal():
    """Without a sum of errors: a PD that does not know of friction stops where it no longer breaks loose, C/(M k_p)."""
    path = omnidyn.path("goal:x_m=3,travel_s=6,hold_s=4")
    plain, knowing = (Pid(AXEBOT, integral=0.0, friction=which) for which in (False, True))
    stuck = omnidyn.track(AXEBOT, path, plain)
    assert not stuck.run.twist[-50:].any()
    assert abs(stuck.error[-1, 0]) <= 2.2 / 1.5 / plain.gains.place[0]
    assert omnidyn.track(AXEBOT, path, knowing).rmse_position < 0.05 * stuck.rmse_position
    assert stuck.controller == "pid_no_friction"


def test_names_files_and_what_they_do_without(tmp_path):
    made = several(["pid", "pid_no_friction", "pid"], AXEBOT)
    assert [each.name for each in made] == ["pid", "pid_no_friction", "pid 2"]
    assert several(["speed"], AXEBOT, no_friction=True)[0].name == "speed_no_friction"
    spec = ControllerFile("pid", {"faster": 1.5, "integral": 0.0}, 'a "test" of \\ names\n')
    save_controller(spec, tmp_path / "own.toml")
    assert load_controller(tmp_path / "own.toml").options == spec.options
    assert controller_named(str(tmp_path / "own.toml"), AXEBOT, dt=0.01).faster == 1.5


def test_two_files_of_one_controller_are_told_apart_by_their_names(tmp_path):
    files = [tmp_path / "slow.toml", tmp_path / "other" / "slow.toml", tmp_path / "fast.toml"]
    files[1].parent.mkdir()
    for k, file in enumerate(files):
        save_controller(ControllerFile("pid", {"faster": 1.0 + k}), file)
    found = [str(file) for file in files]
    assert [made.name for made in several(["pid", found[0], found[2]], AXEBOT)] == ["pid", "slow.toml", "fast.toml"]
    assert [made.name for made in several(found, AXEBOT)] == [found[0], found[1], "fast.toml"]
    assert [made.name for made in several([found[0]], AXEBOT)] == ["pid"]
    tracked = omnidyn.track(AXEBOT, "circle", ["pid", files[2]], duration=0.2)
    assert [tracking.controller for tracking in tracked] == ["pid", "fast.toml"]


@pytest.mark.parametrize(
    "text, words",
    [
        ('schema = 1\ncontroller = "pid"\n[options]\nfastr = 2', "no such option; got fastr; .*did you mean faster"),
        ('schema = 1\ncontroler = "pid"', "unknown key; got controler; .*did you mean controller"),
        ('schema = 1\ncontroller = "pdi"', "unknown controller; got pdi; .*did you mean pid"),
        ('schema = 2\ncontroller = "pid"', "not a controller file; got schema = 2"),
        ('schema = 1\ncontroller = "pid"\n[options]\nfaster = nan', "not a value of an option; got nan"),
        ('schema = 1\ncontroller = "pid"\noptions = 3', "not a controller file"),
        ('schema = 1\ncontroller = "pid"\n[options]\ndt = 0.1', "no such option; got dt"),
        ("schema = ", "not valid TOML"),
    ],
)
def test_what_is_no_controller_file_is_refused(tmp_path, text, words):
    (tmp_path / "own.toml").write_text(text)
    with pytest.raises(InputError, match=f"own.toml.*{words}"):
        load_controller(tmp_path / "own.toml")


def test_options_that_nobody_has_are_refused():
    with pytest.raises(InputError, match="none of these controllers has that; got pid"):
        several(["pid"], AXEBOT, horizon=20)
    with pytest.raises(InputError, match="none of these controllers has that"):
        several(["pid"], AXEBOT, no_observer=True)


def test_a_supply_measured_now_is_behind_the_duty(name):
    robot = AXEBOT.replace(drive=Drive(kind="duty", supply=12.0))
    moved = [0.01, 0.0, 0.0]
    full, sagged, odd = (controller_named(name, robot) for _ in range(3))
    first = full.step(0.0, moved, REST, EIGHT)
    np.testing.assert_allclose(sagged.step(0.0, moved, REST, EIGHT, supply=10.0), first * 1.2, rtol=1e-12)
    for k, supply in enumerate((None, math.nan, -1.0, 0.0, "12")):
        assert np.isfinite(odd.step(0.02 * k, moved, REST, EIGHT, supply=supply)).all()


@pytest.mark.parametrize("name", ["axebot", "mecanum", "four-wheel", "mean"])
def test_the_law_of_pid_over_arrays_is_that_of_each_robot(name):
    """And so are the limits it meets."""
    robot = load_robot("axebot" if name == "mean" else name)
    pid = Pid(robot.replace(sensors={"twist": "mean"}) if name == "mean" else robot)
    rng = np.random.default_rng(3)
    off, twist, total = (rng.normal(size=(4, 5, 3)) * 0.1 for _ in range(3))
    heading, velocity = rng.uniform(-3.0, 3.0, (4, 5)), rng.normal(size=(3, 3))
    aim = pid.aim(off, heading, twist, velocity)
    effort = pid.effort(aim, total)
    volts, current = pid.volts.beyond(effort)
    for index in np.ndindex(4, 5):
        alone = pid.effort(pid.aim(off[index], heading[index], twist[index], velocity), total[index])
        assert effort.voltage[index] == pytest.approx(alone.voltage, rel=1e-12, abs=1e-12)
        assert effort.current[index] == pytest.approx(alone.current, rel=1e-12, abs=1e-12)
        _, met = pid.volts.within(alone)
        assert met == ("voltage",) * bool(volts[index]) + ("current",) * bool(current[index])


def test_sums_of_many_loops_have_the_bits_of_each():
    rng = np.random.default_rng(0)
    totals, more = rng.normal(size=(2, 500, 3))
    weights = np.minimum(1.0, rng.uniform(0.0, 2.0, (500, 3)))
    rows = zip(totals.ravel().tolist(), more.ravel().tolist(), weights.ravel().tolist(), strict=True)
    assert summed_each(totals, more, weights).ravel().tolist() == [summed(*row) for row in rows]


def test_a_step_of_pid_costs_no_more_than_one_that_looks_ahead():
    """On the median of many steps, its estimator included: it was ten times as much."""
    robot = load_robot("lekiwi").replace(sensors=Sensors(twist="mean", pose_delay=0.06, pose_rate=30.0))
    path, took = omnidyn.path("circle:radius_m=0.3,speed_m_s=0.1"), []
    for control in (Pid(robot), Mpc(robot)):
        motion = path.at(control.dt * np.arange(400))
        for k in range(400):
            control.step(k * control.dt, motion.pose[k], motion.velocity[k], path)
        times = []
        for k in range(400):
            control.step((400 + k) * control.dt, motion.pose[k], motion.velocity[k], path)
            times.append(control.info.time)
        took.append(np.median(times))
    assert took[0] < 1.5 * took[1]
