"""A floor that is not level: a pull that stays in the room, against closed forms, energy and solve_ivp mode by mode."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import omnidyn
from omnidyn.errors import UnsupportedError
from omnidyn.model.deadzone import breakaway_voltage
from omnidyn.model.dynamics import drive_wrench, state_space
from omnidyn.model.friction import AxesFriction, Friction
from omnidyn.model.robot_file import load_robot
from omnidyn.model.surroundings import GRAVITY, Floor
from omnidyn.simulation.live import LiveRobot
from omnidyn.simulation.sensitivity.derivatives import derivatives
from tests.support.friction_shapes import shaped

AXEBOT = load_robot("axebot")
MASS = AXEBOT.body.mass


def on_slope(robot, tilt, downhill=0.0, **body):
    return robot.replace(floor=Floor(tilt=tilt, downhill=downhill), body=robot.body.replace(**body))


def without_dry_friction(robot):
    axes = AxesFriction(viscous=robot.friction.axes.viscous, coulomb=(0.0, 0.0, 0.0))
    return robot.replace(friction=Friction(axes=axes))


# --- the reference: each axis forward, backward or stuck; DOP853 between events ---------------------------------------


def modes(robot, voltage, dt, steps):
    """Twist and heading of a robot with friction on the axes after each row of held voltage; no engine of omnidyn."""
    mass = np.array([robot.body.mass, robot.body.mass, robot.body.inertia])
    system, axes = state_space(without_dry_friction(robot)), robot.friction.axes
    coulomb, hold = np.array(axes.coulomb), np.array(axes.breakaway or axes.coulomb)
    force = mass[0] * 9.81 * np.sin(np.radians(robot.floor.tilt))
    angle, frame = np.radians(robot.floor.downhill), robot.body.rotating_frame

    def smooth(state, u):
        heading = state[3] - angle
        pulled = np.array([force * np.cos(heading), -force * np.sin(heading), 0.0])
        turning = mass[0] * state[2] * np.array([state[1], -state[0], 0.0]) * frame
        return mass * (system.A @ state[:3] + system.B @ u) + pulled + turning

    def rate(_, state, u, sign):
        total = smooth(state, u) - sign * coulomb
        return [*np.where(sign == 0, 0.0, total / mass), state[2]]

    state, found = np.zeros(4), [np.zeros(4)]
    for u in voltage[:steps]:
        left = dt
        while left > 1e-13:
            drive = smooth(state, u)
            sign = np.sign(np.where(np.abs(state[:3]) > 1e-13, state[:3], np.where(np.abs(drive) > hold, drive, 0.0)))

            def event(axis, sign=sign, u=u):
                def meets(_, y, *__):
                    return y[axis] if sign[axis] else hold[axis] - abs(smooth(y, u)[axis])

                meets.terminal, meets.direction = True, -sign[axis] if sign[axis] else -1.0
                return meets

            out = solve_ivp(
                rate,
                (0.0, left),
                state,
                args=(u, sign),
                method="DOP853",
                rtol=1e-11,
                atol=1e-13,
                max_step=0.02,
                events=[event(axis) for axis in range(3)],
            )
            state, left = out.y[:, -1].copy(), left - out.t[-1]
            if out.status == 1:
                (axis,) = [a for a in range(3) if len(out.t_events[a])][:1]
                if sign[axis]:
                    state[axis] = 0.0
                else:  # gives way: a step in which it begins to move
                    state[axis] = 1e-12 * np.sign(smooth(state, u)[axis])
            state[:3][sign == 0] = np.where(np.abs(state[:3][sign == 0]) > 2e-12, 0.0, state[:3][sign == 0])
        found.append(state.copy())
    return np.array(found)


@pytest.mark.parametrize("seed, frame, hold", [(1, False, 1.0), (2, True, 1.0), (3, False, 1.3), (4, True, 1.2)])
def test_against_the_modes(seed, frame, hold):
    """Levels that start, stop and turn a robot on a steep floor: within tol [m/s], 10 tol [rad/s], of a DOP853 run."""
    axes = AXEBOT.friction.axes
    robot = AXEBOT.replace(friction=Friction(axes=axes.replace(breakaway=tuple(hold * c for c in axes.coulomb))))
    robot = on_slope(robot, 6.0, 40.0, rotating_frame=frame)
    levels = np.random.default_rng(seed).uniform(-4.0, 4.0, (12, 3))
    levels[4] = levels[9] = 0.0
    truth = modes(robot, levels, 0.25, 12)
    run = omnidyn.simulate(robot, levels, 0.25, tol=1e-6)
    assert "implicit" in run.source
    error = np.abs(run.twist - truth[:, :3]) / [1.0, 1.0, 10.0]
    print(f"error {error.max():.1e} m/s, heading {np.abs(run.pose[:, 2] - truth[:, 3]).max():.1e} rad")
    assert error.max() < 1e-6
    assert np.abs(run.pose[:, 2] - truth[:, 3]).max() < 1e-5


# --- closed forms -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("heading", [0.0, 0.7, -2.5])
def test_below_what_holds_it_it_stands_still(heading):
    """m g sin(tilt) below Coulomb on both axes: a literal 0, for a minute, whichever way it faces."""
    robot = on_slope(AXEBOT, 5.0, 20.0)
    assert robot.floor.pull(MASS) @ robot.floor.pull(MASS) < min(AXEBOT.friction.axes.coulomb[:2]) ** 2
    run = omnidyn.simulate(robot, np.zeros((600, 3)), 0.1, pose=(1.0, 2.0, heading))
    assert not run.twist.any()
    assert (run.pose == [1.0, 2.0, heading]).all()
    fixed = omnidyn.simulate(robot, np.zeros((600, 3)), 0.1, pose=(0.0, 0.0, heading), tol=None)
    assert not fixed.twist.any()


@pytest.mark.parametrize("name", ["disc", "ellipse", "wheels"])
def test_other_frictions_hold_it_as_well(name):
    run = omnidyn.simulate(on_slope(shaped(name), 1.0, 77.0), np.zeros((50, 3)), 0.1)
    assert not run.twist.any()


def test_it_gives_way_at_the_angle_where_gravity_beats_friction():
    """sin(tilt) = C/(m g), to a millionth of a degree either side."""
    edge = np.degrees(np.arcsin(AXEBOT.friction.axes.coulomb[0] / (MASS * GRAVITY)))
    for off, moves in ((-1e-6, False), (1e-6, True)):
        run = omnidyn.simulate(on_slope(AXEBOT, edge + off), np.zeros((20, 3)), 0.5)
        assert bool(run.twist.any()) is moves


def test_a_sliding_robot_drifts_as_the_exponential_says():
    """Straight down x: v = (F - C)/(a M) (1 - e^(-a t)), with the motors' brake in a."""
    tilt = 12.0
    run = omnidyn.simulate(on_slope(AXEBOT, tilt), np.zeros((100, 3)), 0.01)
    rate = -state_space(AXEBOT).A[0, 0]
    net = MASS * GRAVITY * np.sin(np.radians(tilt)) - AXEBOT.friction.axes.coulomb[0]
    expected = net / (MASS * rate) * -np.expm1(-rate * run.t)
    np.testing.assert_allclose(run.twist[:, 0], expected, atol=1e-6)
    np.testing.assert_allclose(
        run.pose[:, 0], net / (MASS * rate) * (run.t + np.expm1(-rate * run.t) / rate), atol=2e-6
    )


def test_at_any_heading_the_pull_points_downhill_in_the_room():
    """Without dry friction and with one rate along x and y, the path is the same straight line whatever the heading."""
    axes = AxesFriction(viscous=(0.94, 0.94, 0.01), coulomb=(0.0, 0.0, 0.0))
    robot = on_slope(AXEBOT.replace(friction=Friction(axes=axes)), 3.0, 50.0)
    for heading in (0.0, 1.1, -2.0):
        run = omnidyn.simulate(robot, np.zeros((40, 3)), 0.05, pose=(0.0, 0.0, heading))
        along = run.pose[-1, :2] / np.hypot(*run.pose[-1, :2])
        np.testing.assert_allclose(along, [np.cos(np.radians(50.0)), np.sin(np.radians(50.0))], atol=1e-6)


def test_energy_is_what_the_slope_and_the_motors_give_less_what_friction_and_damping_take():
    """Kinetic and potential energy against the work done, in a turning frame; the trapezoid over 1 ms rows."""
    robot = on_slope(AXEBOT, 8.0, 30.0, rotating_frame=True)
    voltage = np.repeat(np.random.default_rng(5).uniform(-5.0, 5.0, (8, 3)), 250, axis=0)
    run = omnidyn.simulate(robot, voltage, 1e-3)
    kinetic = 0.5 * np.sum([MASS, MASS, robot.body.inertia] * run.twist**2, axis=1)
    energy = kinetic - run.pose[:, :2] @ robot.floor.pull(MASS)
    axes, u = robot.friction.axes, run.voltage[:-1]

    def power(twist):
        force = drive_wrench(robot, twist, u) - axes.viscous * twist - axes.coulomb * np.sign(twist)
        return np.sum(force * twist, axis=1)

    work = 0.5e-3 * (power(run.twist[:-1]) + power(run.twist[1:]))
    assert np.abs(work).sum() > 1.0
    np.testing.assert_allclose(energy[1:] - energy[0], np.cumsum(work), atol=2e-4)


# --- every engine -----------------------------------------------------------------------------------------------------


def test_a_fixed_step_is_of_second_order():
    robot = without_dry_friction(on_slope(AXEBOT, 10.0, 30.0))
    end = omnidyn.simulate(robot, np.full((1, 3), 3.0), 1.0, tol=1e-9).twist[-1]
    errors = [
        np.abs(omnidyn.simulate(robot, np.full((n, 3), 3.0), 1.0 / n, tol=None).twist[-1] - end).max()
        for n in (100, 200)
    ]
    assert 3.5 < errors[0] / errors[1] < 4.5


@pytest.mark.parametrize(
    "kind",
    ["voltage", "speed", "windings"],
)
def test_a_live_robot_feels_it_as_well(kind):
    robot = on_slope(AXEBOT, 7.0, -60.0)
    if kind == "speed":
        robot = robot.replace(drive=robot.drive.replace(kind="speed", kp=0.3, ki=2.0, rate=100.0))
    if kind == "windings":
        robot = robot.replace(motor=robot.motor.replace(electrical="dynamic"))
    name, size = ("wheel_speed_command", 12.0) if kind == "speed" else ("voltage", 4.0)
    rows = np.repeat(size * np.random.default_rng(3).uniform(-1.0, 1.0, (6, 3)), 5, axis=0)
    run = omnidyn.simulate(robot, dt=0.04, **{name: rows})
    live = LiveRobot(robot, 0.04)
    for k, row in enumerate(rows):
        live.step(row)
        np.testing.assert_allclose(live.twist, run.twist[k + 1], atol=5e-5)
    assert (
        np.abs(
            run.twist[-1] - omnidyn.simulate(AXEBOT.replace(drive=robot.drive), dt=0.04, **{name: rows}).twist[-1]
        ).max()
        > 1e-3
    )


@pytest.mark.parametrize(
    "use",
    [
        lambda robot: breakaway_voltage(robot, [0.0, 1.0, -1.0]),
        lambda robot: omnidyn.acceleration(robot, np.zeros(3), np.zeros(3)),
        lambda robot: derivatives(robot, np.ones((5, 3)), 0.01, ["friction.axes.viscous[0]"]),
        lambda robot: omnidyn.track(robot, "circle"),
        lambda robot: (
            omnidyn.identify(omnidyn.simulate(AXEBOT, np.ones((50, 3)), 0.01), robot, omnidyn.OutputError()).estimate
        ),
    ],
    ids=["dead zone", "acceleration", "derivatives", "control", "fit"],
)
def test_what_knows_level_floors_only_says_so(use):
    with pytest.raises(UnsupportedError, match=r"no floor that is not level; got 2 degrees; expected 0"):
        use(on_slope(AXEBOT, 2.0))
