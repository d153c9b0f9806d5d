"""The controller on its contract: what it sends, what it says, and that nothing in its loop raises."""

import math

import numpy as np
import pytest

from omnidyn import load_robot, simulate, track
from omnidyn.control.mpc.controller import Mpc
from omnidyn.control.mpc.model import numbers
from omnidyn.control.mpc.settings import Settings
from omnidyn.control.mpc.stages import friction_at
from omnidyn.control.paths.path import path
from omnidyn.errors import InputError
from omnidyn.model.friction import Friction
from omnidyn.model.friction.direction import DirectionFriction
from omnidyn.model.friction.stribeck import SHAPES
from omnidyn.model.log_effects import Sensors
from omnidyn.model.mass import per_mass
from omnidyn.model.sliding import sliding_wrench
from omnidyn.simulation.live import LiveRobot

ROBOT = load_robot("axebot")
DT = 0.02


def drive(controller, along, steps, plant=ROBOT, delay=0, noise=0.0, pose=None, seed=3):
    """Poses, twists and outputs of a closed loop from rest. Shapes (steps + 1, 3), (steps + 1, 3), (steps, wheels)."""
    rng = np.random.default_rng(seed)
    live = LiveRobot(plant, controller.dt, pose=along.at(0.0).pose if pose is None else pose, delay=delay)
    poses, twists, sent = [np.array(live.pose)], [np.array(live.twist)], []
    for k in range(steps):
        off = noise * rng.standard_normal(6) * [0.2, 0.2, 0.4, 1.0, 1.0, 4.0]
        sent.append(controller.step(k * controller.dt, poses[-1] + off[:3], twists[-1] + off[3:], along))
        live.step(sent[-1])
        poses.append(np.array(live.pose))
        twists.append(np.array(live.twist))
    return np.array(poses), np.array(twists), np.array(sent)


def rmse(poses, along, dt=DT, skip=0.5):
    """Error of the position after `skip` [m]."""
    t = np.arange(len(poses)) * dt
    off = (poses - along.at(t).pose)[t >= skip, :2]
    return float(np.sqrt((off**2).sum(axis=1).mean()))


@pytest.mark.parametrize("name", ["eight", "zigzag", "circle"])
def test_it_follows_a_path(name):
    along = path(name)
    poses, _, sent = drive(Mpc(ROBOT), along, 200)
    assert rmse(poses, along) < 0.8e-3  # what turns round inside a step, as zigzag does, costs half a millimetre
    assert np.all(np.abs(sent) <= 6.0)


def predicted_off(robot, believed, along):
    """How far what is predicted 20 steps ahead is from what a simulation of the volts does, by step [m, m, rad]."""
    controller = Mpc(believed)
    poses, twists, _ = drive(controller, along, 60, plant=robot)
    controller.step(60 * DT, poses[-1], twists[-1], along)
    run, predicted = (
        simulate(robot, controller._memory.u.copy(), DT, twist=twists[-1], pose=poses[-1]),
        controller.info.predicted,
    )
    assert predicted is not None
    assert run.pose is not None
    return np.abs(predicted - run.pose[1:])


def test_what_it_predicts_is_what_the_simulator_does():
    # 20 steps ahead, the model knows no better than mm: where friction turns round, inside of a step.
    off = predicted_off(ROBOT, ROBOT, path("eight"))
    assert off.max() < 2e-3
    assert off[:3, :2].max() < 1e-4


def test_it_predicts_a_centre_of_mass_beside_the_wheels():
    """Without dry friction and turning: what turns round is not in the way. A centre in the middle would not do."""
    smooth = ROBOT.friction.axes.replace(coulomb=(0.0, 0.0, 0.0))
    beside = ROBOT.body.replace(centre=(0.05, -0.04), rotating_frame=True)
    robot = ROBOT.replace(friction=Friction(axes=smooth), body=beside)
    middle = robot.replace(body=beside.replace(centre=(0.0, 0.0)))
    along = path("eight:heading=turning,turn_rad_s=3")
    known, guessed = predicted_off(robot, robot, along), predicted_off(robot, middle, along)
    assert known.max() < 1e-3
    assert known.max() < 0.1 * guessed.max()


@pytest.mark.parametrize("share", [0.7, 1.3])
def test_friction_that_is_another_is_learned(share):
    friction = ROBOT.friction.axes
    other = friction.replace(coulomb=tuple(share * each for each in friction.coulomb))
    plant = ROBOT.replace(friction=ROBOT.friction.replace(axes=other))
    along, controller = path("zigzag"), Mpc(ROBOT)
    poses, _, _ = drive(controller, along, 400, plant=plant)
    right, _, _ = drive(Mpc(ROBOT), along, 400)
    assert rmse(poses, along, skip=4.0) < 1.3 * rmse(right, along, skip=4.0)
    assert np.abs(controller.learned["friction"] - share).max() < 0.15
    blind, _, _ = drive(Mpc(ROBOT, observer=False), along, 400, plant=plant)
    assert rmse(poses, along, skip=4.0) < 0.5 * rmse(blind, along, skip=4.0)


def test_it_comes_to_rest_at_a_goal_inside_the_dead_zone():
    goal = path("goal:x_m=0,y_m=0,heading_rad=0")
    poses, twists, _ = drive(Mpc(ROBOT), goal, 150, pose=(0.03, -0.02, 0.1))
    assert np.hypot(*poses[-1, :2]) < 1e-4
    assert abs(poses[-1, 2]) < 5e-4
    assert not twists[-50:].any()


@pytest.mark.parametrize("delay", [1, 2])
def test_a_delay_that_it_knows_costs_little(delay):
    along = path("eight")
    exact, _, _ = drive(Mpc(ROBOT), along, 300)
    late, _, _ = drive(Mpc(ROBOT, delay=delay), along, 300, delay=delay)
    unknown, _, _ = drive(Mpc(ROBOT, delay=0), along, 300, delay=delay)
    assert rmse(late, along, skip=1.0) < 0.3e-3
    assert rmse(late, along, skip=1.0) < 0.5 * rmse(unknown, along, skip=1.0)
    assert rmse(exact, along, skip=1.0) < 0.3e-3


@pytest.mark.parametrize("robot", ["four-wheel", "mecanum", "axebot-lab", "robotino"])
def test_robots_of_every_shape(robot):
    known = load_robot(robot)
    controller = Mpc(known)
    size = 0.25
    along = path(f"circle:radius_m={size},period_s=8")
    poses, _, sent = drive(controller, along, 250, plant=known)
    assert np.all(np.abs(sent) <= controller.limit + 1e-12)
    assert rmse(poses, along, skip=2.0) < 5e-3


def test_limits_are_kept():
    along = path("square:speed_m_s=0.5")
    for settings, met in (
        (Settings(current=1.0), "current"),
        (Settings(slew=60.0), "slew"),
        (Settings(speed=(0.4, 0.4, 4.0)), "speed"),
    ):
        controller, words = Mpc(ROBOT, settings=settings), set()
        live = LiveRobot(ROBOT, DT, pose=along.at(0.0).pose)
        last, most = np.zeros(3), 0.0
        for k in range(150):
            pose, twist = np.array(live.pose), np.array(live.twist)
            sent = controller.step(k * DT, pose, twist, along)
            words |= set(controller.info.limits)
            if met == "slew":
                assert np.abs(sent - last).max() <= 60.0 * DT + 1e-5
            if met == "current":
                emf = 0.0059 * 19.0 / 0.035 * (ROBOT.wheels.wrench_matrix.T @ controller._memory.x[0, 3:])
                assert np.abs(sent - emf).max() <= 1.69 * 1.0 + 1e-5
            most, last = max(most, np.abs(twist[:2]).max()), sent
            live.step(sent)
        assert met in words
        assert met != "speed" or most < 0.42


def test_new_numbers_while_it_runs():
    heavy = ROBOT.replace(body=ROBOT.body.replace(mass=3.0))
    along, controller = path("eight"), Mpc(ROBOT)
    poses, twists, _ = drive(controller, along, 50)
    other = controller.replace(robot=heavy)
    assert (other.robot, controller.robot) == (heavy, ROBOT)
    sent = other.step(50 * DT, poses[-1], twists[-1], along)
    assert other.info.ok
    assert np.abs(sent - controller.step(50 * DT, poses[-1], twists[-1], along)).max() > 1e-3


def test_many_robots_are_each_as_one():
    along, single = path("eight"), Mpc(ROBOT)
    many = single.batch(3)
    rng, pose = np.random.default_rng(4), along.at(0.0).pose
    poses = twists = np.zeros((3, 3))
    for k in range(20):
        state = np.concatenate([pose, np.zeros(3)]) + 0.001 * rng.standard_normal(6)
        sent = single.step(k * DT, state[:3], state[3:], along)
        poses, twists = np.tile(state[:3], (3, 1)), np.tile(state[3:], (3, 1))
        twists[1] = np.nan
        volts = many.step_batch(k * DT, poses, twists, along)
        assert np.array_equal(volts, np.stack([sent, np.zeros(3), sent]))
    with pytest.raises(InputError, match="wrong shape"):
        many.step_batch(1.0, poses[:2], twists, along)


def test_many_robots_doubt_poses_as_one_does():
    along, single, rng = path("eight"), Mpc(ROBOT), np.random.default_rng(5)
    many, doubts = single.batch(2), set()
    for k in range(60):
        at = along.at(k * DT)
        state = np.concatenate([at.pose, np.zeros(3)]) + 0.05 * rng.standard_normal(6)
        state[:2] += 0.5 * (k == 40)
        sent = single.step(k * DT, state[:3], state[3:], along)
        doubts.add(single.info.status)
        poses, twists = np.tile(state[:3], (2, 1)), np.tile(state[3:], (2, 1))
        assert np.array_equal(many.step_batch(k * DT, poses, twists, along), [sent] * 2)
    assert len(doubts) > 1  # some poses were doubted
    with pytest.raises(InputError, match="as they are"):
        Mpc(ROBOT.replace(sensors=Sensors(twist_filter=0.1))).batch(2)


@pytest.mark.parametrize(
    "t, pose, twist, word",
    [
        (math.nan, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], "time is no finite number"),
        ("soon", [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], "time is no finite number"),
        (None, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], "time is no finite number"),
        (1.0, [0.0, math.nan, 0.0], [0.0, 0.0, 0.0], "pose missing"),
        (1.0, None, [0.0, 0.0, 0.0], "pose missing"),
        (1.0, [0.0, 0.0, 0.0], [0.0, 0.0], "twist missing"),
        (1.0, [0.0, 0.0, 0.0], np.array([0.0, math.inf, 0.0]), "twist missing"),
        (1.0, np.zeros((3, 1)), [0.0, 0.0, 0.0], "pose missing"),
    ],
)
def test_what_is_no_state_gives_zeros_and_a_word(t, pose, twist, word):
    controller, along = Mpc(ROBOT), path("eight")
    controller.step(0.0, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], along)
    assert np.array_equal(controller.step(t, pose, twist, along), np.zeros(3))
    assert controller.info.status == word


def test_times_and_paths_that_are_odd():
    controller, along = Mpc(ROBOT), path("eight")
    here, still = along.at(0.0).pose, np.zeros(3)
    first = controller.step(0.0, here, still, along)
    assert np.array_equal(controller.step(0.0, here, still, along), first)
    assert controller.info.status == "time stands still"
    assert not controller.step(-1.0, here, still, along).any()
    assert controller.info.status == "time went backwards"
    assert not controller.step(-0.98, here, still, "eight").any()
    assert controller.info.status == "no path"
    ended = path("goal:x_m=0.1")
    controller.step(5.0, here, still, ended)
    assert controller.info.ok


def test_any_call_gives_volts_within_the_limit():
    rng, controller, along = np.random.default_rng(6), Mpc(ROBOT, horizon=5), path("square")
    odd = [None, math.nan, "x", [], np.zeros(4), [1.0, math.inf, 0.0], [1e308, 0.0, 0.0], np.array([1, 2, 3])]
    t = 0.0
    for _ in range(2000):
        t += float(rng.choice([0.02, 0.02, 0.02, 0.0, -0.5, 3.0, 0.013]))
        pose = rng.normal(size=3) * 10.0 ** rng.integers(-3, 9) if rng.random() < 0.9 else odd[rng.integers(len(odd))]
        twist = rng.normal(size=3) * 10.0 ** rng.integers(-3, 5) if rng.random() < 0.9 else odd[rng.integers(len(odd))]
        when = t if rng.random() < 0.95 else odd[rng.integers(len(odd))]
        sent = controller.step(when, pose, twist, along if rng.random() < 0.95 else None)
        assert sent.shape == (3,)
        assert np.all(np.abs(sent) <= 6.0)


@pytest.mark.parametrize("wrong", [{"horizon": 0}, {"horizon": 2.5}, {"delay": -1}, {"dt": 0.0}])
def test_what_makes_no_controller(wrong):
    with pytest.raises(InputError, match="|".join(wrong)):
        Mpc(ROBOT, **wrong)


@pytest.mark.parametrize("wrong", [{"pose": (1.0, 2.0)}, {"volts": 0.0}, {"current": -1.0}, {"speed": (1.0, 0.0, 1.0)}])
def test_what_makes_no_settings(wrong):
    with pytest.raises(InputError, match="|".join(wrong)):
        Settings(**wrong)


def falling(robot, part="axes", shape="exponential"):
    """The robot with friction that falls to the level it had, from 1.6 times that at rest."""
    own = getattr(robot.friction, part)
    speed = (0.1, 0.08, 1.0) if part == "axes" else 0.1
    more = (1.6 * np.asarray(own.coulomb)).tolist()
    law = own.replace(breakaway=more, stribeck_speed=speed, stribeck_exponent=1.3, stribeck_shape=shape)
    return robot.replace(friction=robot.friction.replace(**{part: law}))


def ellipse(robot):
    coulomb, viscous = robot.friction.axes.coulomb, robot.friction.axes.viscous
    along = DirectionFriction(coulomb=coulomb[:2], viscous=viscous[0], yaw_coulomb=coulomb[2], yaw_viscous=viscous[2])
    return robot.replace(friction=Friction(direction=along))


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("robot, part", [(ROBOT, "axes"), (ellipse(ROBOT), "direction")])
def test_friction_that_falls_is_predicted_as_the_law_has_it(robot, part, shape):
    """The force by the law's own numpy formula, its slope by central differences."""
    robot = falling(robot, part, shape)
    own = numbers(robot, DT)
    one = np.ones(3)

    def at(twist):
        return friction_at(own.linear, own.levels, one, tuple(twist), 1.0, False)

    for twist in ([0.05, -0.03, 0.4], [0.2, 0.1, -1.5], [-0.04, 0.3, 0.1]):
        twist = np.array(twist)
        dry = sliding_wrench(robot, twist) - linear_drag(robot, twist)
        force, slope = at(twist)
        np.testing.assert_allclose(force, -per_mass(robot, dry), rtol=1e-9, atol=1e-12)
        steps = 1e-6 * np.eye(3)
        changes = [(np.array(at(twist + d)[0]) - np.array(at(twist - d)[0])) / 2e-6 for d in steps]
        np.testing.assert_allclose(np.reshape(slope, (3, 3)).T, changes, rtol=1e-5, atol=1e-6)


def linear_drag(robot, twist):
    """Viscous friction alone: what is left of the wrench of sliding where it counts for all, at a great speed."""
    far = 1e6 * twist
    return (sliding_wrench(robot, far) - sliding_wrench(robot, 0.5 * far)) / 0.5e6


@pytest.mark.parametrize("name", ["eight:size_m=0.25,period_s=12", "circle:turn_rad_s=2"])
def test_a_law_that_falls_is_followed_along_the_prediction(name):
    """Told of the Coulomb level alone, the observer chases the fall: four times the error, and more."""
    plant, along = falling(ROBOT), path(name)
    told, _, _ = drive(Mpc(plant), along, 300, plant=plant)
    untold, _, _ = drive(Mpc(ROBOT), along, 300, plant=plant)
    assert rmse(told, along) < 0.25 * rmse(untold, along)


def test_weights_that_rounding_cannot_follow_are_said_and_the_output_is_sent():
    settings = Settings(pose=(1e7, 1e7, 1e6), twist=(0.6, 0.6, 0.06), volts=9e-8, last=2e3)
    controller, along = Mpc(ROBOT, observer=False, settings=settings), path("eight")
    _, _, sent = drive(controller, along, 40, noise=0.05)
    assert controller.info.status == "inaccurate"
    assert not controller.info.ok
    assert np.isfinite(sent).all()
    assert (np.abs(sent) <= controller.limit).all()
    assert np.any(sent[-1])


def test_weights_follow_the_robot_and_are_the_paper_s_for_its_own():
    own = Settings().of(ROBOT, DT)
    assert (own.pose, own.volts, own.walk) == ((200.0, 200.0, 20.0), 2e-3, (0.003, 0.003, 0.012))
    heavy = Settings().of(ROBOT.replace(body=ROBOT.body.replace(mass=4.0 * ROBOT.body.mass)), DT)
    np.testing.assert_allclose(heavy.pose, (800.0, 800.0, 80.0))
    np.testing.assert_allclose(heavy.walk, (0.006, 0.006, 0.024))
    assert heavy.volts == pytest.approx(2e-3 / 16.0)
    assert Settings(pose=(1.0, 2.0, 3.0), volts=0.1).of(ROBOT, DT).pose == (1.0, 2.0, 3.0)


@pytest.mark.parametrize("latency", [0.029, 0.03])
def test_a_latency_of_steps_and_a_half_is_taken_as_it_is(latency):
    """Rounded to whole steps it made the robot swing, 25 and 36 mm off its path."""
    robot = ROBOT.replace(drive=ROBOT.drive.replace(latency=latency))
    assert track(robot, "eight:period_s=5", Mpc(robot), duration=3.0).rmse_position < 8e-4
