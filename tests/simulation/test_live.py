"""A robot driven step by step does what `simulate` says of all commands at once."""

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import InputError, UnsupportedError
from omnidyn.model.friction import AxesFriction, Friction
from omnidyn.model.log_effects import LogEffects
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation import engine
from omnidyn.simulation.live import LiveRobot
from tests.support.friction_shapes import shaped
from tests.support.prbs import prbs

AXEBOT = load_robot("axebot")


def driven(**drive):
    return AXEBOT.replace(drive=AXEBOT.drive.replace(**drive))


SPEED = {"kind": "speed", "kp": 0.3, "ki": 2.0}
CASES = {
    "exact": (AXEBOT, "voltage", 1e-14),
    "windings": (AXEBOT.replace(motor=AXEBOT.motor.replace(electrical="dynamic")), "voltage", 1e-13),
    "implicit": (shaped("ellipse"), "voltage", 5e-6),
    "late": (driven(latency=0.033, dead_band=0.2), "voltage", 1e-12),
    "duty": (driven(kind="duty", supply=6.0), "duty", 1e-14),
    "coasting": (driven(kind="duty", supply=6.0, off="coast"), "duty", 5e-6),
    "speed loop, fast": (driven(**SPEED, rate=130.0), "wheel_speed_command", 5e-6),
    "speed loop, slow": (driven(**SPEED, rate=40.0), "wheel_speed_command", 5e-6),
}
SIZE = {"voltage": 1.0, "duty": 1.0 / 6.0, "wheel_speed_command": 5.0}


@pytest.mark.parametrize("name", list(CASES))
def test_step_by_step_is_all_at_once(name):
    robot, kind, near = CASES[name]
    rows = SIZE[kind] * prbs([4.0] * 3, 0.1, 1.5, 0.02, 1)
    run = omnidyn.simulate(robot, dt=0.02, **{kind: rows})
    live = LiveRobot(robot, 0.02)
    for k, row in enumerate(rows):
        live.step(row)
        np.testing.assert_allclose(live.twist, run.twist[k + 1], atol=near * 10)
        np.testing.assert_allclose(live.pose, run.pose[k + 1], atol=near * 10)
        assert live.voltage == pytest.approx(run.voltage[k], abs=1e-3)


@pytest.mark.parametrize("latency", [13e-6, 0.02, 0.033])
@pytest.mark.parametrize("kind", ["voltage", "wheel_speed_command"])
def test_stretches_of_rows_are_row_by_row_under_a_latency(latency, kind):
    """What is under way goes on from one stretch to the next, and into single steps."""
    drive = {"latency": latency} if kind == "voltage" else {"latency": latency, **SPEED, "rate": 130.0}
    robot, rows = driven(**drive), SIZE[kind] * prbs([4.0] * 3, 0.1, 0.6, 0.02, 1)
    whole, live = LiveRobot(robot, 0.02, tol=1e-9), LiveRobot(robot, 0.02, tol=1e-9)
    twists = [whole.run(stretch)[0][1:] for stretch in (rows[:1], rows[1:17], rows[17:20])]
    for row in rows[:20]:
        live.step(row)
        twists.append(live.twist[None])
    np.testing.assert_allclose(np.concatenate(twists[:3]), np.concatenate(twists[3:]), atol=1e-7)
    for one in (whole, live):
        one.step(rows[20])
    np.testing.assert_allclose(whole.pose, live.pose, atol=1e-7)
    assert whole.voltage == pytest.approx(live.voltage, abs=1e-4)


def test_a_delay_moves_commands_by_whole_steps():
    rows = prbs([4.0] * 3, 0.1, 1.0, 0.02, 1)
    late, now = LiveRobot(AXEBOT, 0.02, delay=2), LiveRobot(AXEBOT, 0.02)
    for row in [*np.zeros((2, 3)), *rows[:-2]]:
        now.step(row)
    for row in rows:
        late.step(row)
    np.testing.assert_array_equal(late.twist, now.twist)
    np.testing.assert_array_equal(late.pose, now.pose)


def test_a_push_moves_it_as_far_as_its_motors_would():
    """A constant force in the steady state: v = (F - C)/(B + k G G^T)."""
    live = LiveRobot(AXEBOT, 0.02, push=(4.0, 0.0, 0.0))
    for _ in range(200):
        live.step(np.zeros(3))
    system = omnidyn.state_space(AXEBOT)
    assert live.twist[0] == pytest.approx((4.0 - 2.2) / 1.5 / -system.A[0, 0], rel=1e-9)


def test_a_push_adds_to_what_motors_at_their_limit_give():
    """Closed form: at |i| = i_max and without viscous friction M v = (F_max + push - C) t. Volts could not push so."""
    none, some = (0.0,) * 3, (1.0,) * 3
    robot = AXEBOT.replace(
        motor=AXEBOT.motor.replace(current_limit=1.0), friction=Friction(axes=AxesFriction(viscous=none, coulomb=some))
    )
    live, rim = LiveRobot(robot, 0.02, push=(0.7, 0.0, 0.0)), robot.motor.torque_constant * robot.motor.gear_ratio
    for _ in range(10):
        live.step(np.array([0.0, 6.0, -6.0]))
    force = 2.0 * np.cos(np.radians(30.0)) * rim / robot.wheels.wheel_radius + 0.7 - 1.0
    assert live.twist[0] == pytest.approx(force / robot.body.mass * 0.2, abs=1e-5)


@pytest.mark.parametrize("name", [name for name in CASES if name != "late"])
def test_a_push_is_what_simulate_makes_of_it(name):
    """Through a speed loop too, which pushes back."""
    robot, kind, _ = CASES[name]
    rows, push = np.tile(SIZE[kind] * np.array([0.0, 3.0, -3.0]), (40, 1)), (6.0, -4.0, 0.2)
    run = omnidyn.simulate(robot, dt=0.02, **{kind: rows}, log=LogEffects(push=push))
    live = LiveRobot(robot, 0.02, push=push)
    for k, row in enumerate(rows):
        live.step(row)
        np.testing.assert_allclose(live.twist, run.twist[k + 1], atol=5e-5)
    unpushed = omnidyn.simulate(robot, dt=0.02, **{kind: rows})
    assert np.abs(run.twist - unpushed.twist).max() > 0.05


def test_a_push_that_volts_cannot_stand_for_is_refused():
    wheels = AXEBOT.wheels.replace(traction_mu=0.5, wheel_inertia=2e-5)
    robot = driven(**SPEED, rate=100.0).replace(wheels=wheels)
    with pytest.raises(UnsupportedError, match=r"wheels may slip .*; got drive = \"speed\".*leave the push out"):
        LiveRobot(robot, 0.02, push=(4.0, 0.0, 0.0))
    with pytest.raises(UnsupportedError, match=r"wheels may slip .*; got drive = \"speed\".*leave the push out"):
        omnidyn.simulate(robot, wheel_speed_command=np.ones((3, 3)), dt=0.02, log=LogEffects(push=(4.0, 0.0, 0.0)))


def test_a_start_that_is_none_is_refused():
    with pytest.raises(InputError, match="cannot start there"):
        LiveRobot(AXEBOT, 0.02, pose=[np.nan, 0.0, 0.0])


@pytest.mark.parametrize("steps", [1, 5])
def test_rows_in_which_the_solver_hits_its_cap_are_counted_over_the_way(monkeypatch, steps):
    """At once and step by step: a run that did not converge is never silent."""
    monkeypatch.setattr(engine, "capped", lambda outcome: len(outcome.iterations))
    robot, volts = shaped("wheels"), np.tile([0.0, 3.0, -3.0], (steps, 1))
    live = LiveRobot(robot, 0.02)
    for row in volts:
        live.step(row)
    for warnings in (omnidyn.simulate(robot, volts, 0.02).warnings, live.warnings):
        (warning,) = warnings
        assert (warning.code, warning.numbers) == ("not_converged", {"stopped": steps, "rows": steps})
