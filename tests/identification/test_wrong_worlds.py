"""The simulator of the wrong worlds, and how their logs are scored: `python -m benchmarks wrong_worlds`."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.wrong_worlds import log as making
from benchmarks.wrong_worlds.kinds import KINDS, by_name
from benchmarks.wrong_worlds.log import SPEEDS, clean, friction_of, logged, right_case, robot_of, truths, voltages
from benchmarks.wrong_worlds.remedies import true_value
from benchmarks.wrong_worlds.score import drawn, is_same, is_sure, worst
from benchmarks.wrong_worlds.sizes import SIZES
from benchmarks.wrong_worlds.world import BOX, ELLIPSE, WHEELS, World, drive
from omnidyn.model.robot_file import parse_robot, robot_to_toml
from omnidyn.simulation.simulate import simulate

SEED = 12  # of no log of the benchmark, nor of its pilot


@pytest.fixture
def short(monkeypatch):
    """Logs of 8 s."""
    monkeypatch.setattr(making, "SECONDS", 8.0)


def plain(seed, **changed):
    case = right_case(seed).setup_but(sensor=SPEEDS, memory=0.0)
    b = case.told.viscous
    return case.both_but(**{"viscous": (b[0], b[0], b[2]), **changed})


@pytest.mark.parametrize("frame", [False, True])
@pytest.mark.parametrize("shape", [BOX, ELLIPSE, WHEELS])
def test_a_right_world_moves_as_omnidyn_says(short, shape, frame):
    """Two simulators that share no code: 1e-4 m/s at the rim, stops and releases included."""
    case = plain(SEED, shape=shape, frame=frame)
    text = robot_to_toml(robot_of(case.told))
    robot = parse_robot(text[: text.index("\n[friction")] + "\n" + friction_of(case.told))
    t, voltage = voltages(case, SEED)
    own = drive(case.world, t, voltage, t)
    theirs = simulate(robot, voltage, 1.0 / case.setup.rate, tol=1e-5)
    assert np.abs(own.twist[:, :2]).max() > 0.3
    assert np.abs(own.wheel_speed - theirs.wheel_speed[: len(t)]).max() * case.told.wheel_radius[0] < 1e-4


@pytest.mark.parametrize("shape", [BOX, ELLIPSE, WHEELS])
def test_a_sum_of_frictions_is_the_other_march_where_it_has_one_part(short, shape):
    """Steps of 0.1 ms without events beside RK4 with them: a millimetre a second at the most, a tenth of it in mean."""
    case = plain(SEED, shape=shape, frame=True)
    t, voltage = voltages(case, SEED)
    own = drive(case.world, t, voltage, t)
    rim = case.world.rim[0] if shape == WHEELS else 0.0
    bare = replace(case.world, rim=(case.world.rim[0] - rim, case.world.rim[1]), each_wheel=(rim,) * 3)
    off = (drive(bare, t, voltage, t).wheel_speed - own.wheel_speed) * case.told.wheel_radius[0]
    assert np.abs(off).max() < 2.5e-3
    assert np.sqrt(np.mean(off**2)) < 2e-4


def test_an_ellipse_beside_unequal_wheels_moves_as_omnidyn_says(short):
    """Three wheels and a body hold more than three ways to move: the robot rests with what holds it undetermined."""
    case = plain(SEED, shape=ELLIPSE, frame=True).world_but(each_wheel=(0.3, 1.0, 1.7))
    text = robot_to_toml(robot_of(case.told))
    wheels = "[friction.wheels]\ncoulomb = [0.3, 1.0, 1.7]\n"
    robot = parse_robot(text[: text.index("\n[friction")] + "\n" + friction_of(case.told) + wheels)
    t, voltage = voltages(case, SEED)
    own, rate = drive(case.world, t, voltage, t), case.setup.rate
    off = own.wheel_speed - simulate(robot, voltage, 1.0 / rate, tol=1e-5).wheel_speed[: len(t)]
    assert np.abs(own.twist[:, :2]).max() > 0.3
    assert np.sqrt(np.mean(off**2)) * case.told.wheel_radius[0] < 2e-4


def test_one_axis_against_its_closed_form():
    """M v' = 1.5 k/R (u - k v) - B v - C along x, k = l K_t/r; two wheels push, each with cos 30 degrees."""
    world = World()
    k, ohm, (b, _, _), (c, _, _) = world.ke[0], world.resistance[0], world.viscous, world.coulomb
    t = np.linspace(0.0, 1.0, 101)
    volts = 6.0 * np.array([[-1.0, 0.0, 1.0]])
    own = drive(world, np.zeros(1), volts, t).twist[:, 0]
    rate = (1.5 * k**2 / ohm + b) / world.mass
    top = (2.0 * np.sin(np.pi / 3.0) * k * 6.0 / ohm - c) / (rate * world.mass)
    assert own == pytest.approx(top * (1.0 - np.exp(-rate * t)), abs=1e-6)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
@pytest.mark.some(14)
def test_a_wrong_world_of_size_0_is_right_and_a_large_one_is_not(short, monkeypatch, kind):
    monkeypatch.setattr("benchmarks.wrong_worlds.kinds.WHEN", 2.0)
    none, large = (kind.make(plain(SEED), size) for size in (0.0, 0.9 * kind.most))
    right = replace(none, world=none.told)
    channel = lambda case: logged(case, SEED, noisy=False)  # noqa: E731
    assert channel(none).wheel_speed == pytest.approx(channel(right).wheel_speed, abs=1e-6)
    wrong, meant = channel(large), channel(clean(large))
    assert np.array_equal(wrong.t, meant.t)
    assert np.abs(wrong.wheel_speed - meant.wheel_speed).max() > 0.05


def test_there_are_forty_kinds_and_a_quarter_that_nothing_describes():
    assert len({kind.name for kind in KINDS}) == 40
    assert sum(not kind.key for kind in KINDS) >= 10
    assert set(SIZES) == {kind.name for kind in KINDS}
    assert all(0.0 < small < large <= by_name(name).most for name, (small, large) in SIZES.items())


def test_half_of_the_logs_are_small_and_each_is_drawn_the_same_again():
    kind = by_name("mass")
    sides = [drawn(kind, number)[2] for number in range(24)]
    assert sum(sides) == 12
    (one, seed, _), (again, _, _) = drawn(kind, 3), drawn(kind, 3)
    assert one == again
    assert np.array_equal(logged(one, seed).wheel_speed, logged(again, seed).wheel_speed)


def test_what_names_a_cause():
    assert is_same("tilt.x", "tilt")
    assert is_same("motor.torque_constant_Nm_A", "motor.torque_constant_Nm_A[1]")
    assert not is_same("motor.torque_constant_Nm_A[0]", "motor.torque_constant_Nm_A[1]")
    assert not is_same("friction.axes.breakaway", "friction.axes")
    assert not is_same("", "gain")


def test_a_gain_is_sure_beyond_two_standard_errors():
    assert is_sure(SimpleNamespace(gain=(0.3, 0.1)))
    assert is_sure(SimpleNamespace(gain=0.3, gain_std=0.1))
    assert not is_sure(SimpleNamespace(gain=SimpleNamespace(value=0.3, std=0.2)))


def test_what_is_off_counts_what_the_file_does_not_know():
    """10 % off at a std of 1 %: off, but not where a radius known to 0.5 % moves the number by 11 % per percent."""
    estimate = SimpleNamespace(value={"b": 1.1}, std={"b": 0.01}, unidentifiable=())
    assert worst(estimate, {}, {"b": 1.0}) == ("b 10.0", True)
    assert not worst(estimate, {"b": {"wheels.wheel_radius_m": -0.11}}, {"b": 1.0})[1]
    assert not worst(estimate, {}, {"b": 1.08})[1]


def test_the_truth_seen_as_another_shape():
    case = by_name("wheels").make(right_case(SEED), 0.2)
    rim = case.told.rim
    box = truths(case.told, BOX)
    assert box["friction.axes.coulomb[0]"] == pytest.approx(2.0 * np.sin(np.pi / 3.0) * rim[0])
    assert box["friction.axes.viscous[0]"] == pytest.approx(1.5 * rim[1])
    assert true_value("motor.resistance_ohm[2]", by_name("resistance").make(case, 0.5).world) == pytest.approx(
        1.5 * case.told.resistance[2]
    )
