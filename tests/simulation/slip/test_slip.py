"""Wheels that slip: against an event-driven reference, closed forms, energy, and the engine of wheels that roll."""

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import InputError, UnsupportedError
from omnidyn.model.deadzone import breakaway_voltage
from omnidyn.model.friction import DirectionFriction, Friction
from omnidyn.model.robot_file import load_robot, parse_robot, robot_to_toml
from omnidyn.model.surroundings import GRAVITY, Floor
from omnidyn.simulation.live import LiveRobot
from omnidyn.simulation.sensitivity.derivatives import derivatives
from omnidyn.simulation.slip.plant import load_shift, wheel_loads
from tests.support.codes import codes
from tests.support.friction_shapes import shaped
from tests.support.slipping import EDGE, Slip

AXEBOT, FOUR = load_robot("axebot"), load_robot("four-wheel")


def slippery(robot, mu, inertia=2e-5, **body):
    wheels = robot.wheels.replace(traction_mu=mu, wheel_inertia=inertia)
    return robot.replace(wheels=wheels, body=robot.body.replace(**body))


def levels(robot, seed, rows=8, most=6.0):
    found = np.random.default_rng(seed).uniform(-most, most, (rows, robot.wheels.count))
    found[rows // 2] = 0.0
    return found


# --- the reference ----------------------------------------------------------------------------------------------------


LONG = [pytest.param(seed, marks=pytest.mark.long) for seed in range(4, 8)]


@pytest.mark.parametrize("seed", [*range(4), *LONG])
@pytest.mark.some(2)
def test_against_the_events(seed):
    """Random grip, wheels, frame and levels: within tol [m/s], 10 tol [rad/s], the rims too, of DOP853 by events."""
    rng = np.random.default_rng(seed)
    robot = slippery(
        (AXEBOT, FOUR)[seed % 2], rng.uniform(0.1, 0.8), rng.uniform(1e-5, 5e-5), rotating_frame=bool(seed // 2 % 2)
    )
    u, reference = levels(robot, seed), Slip(robot, wheel_loads(robot).newtons)
    twist, rims, contact = reference.run(u, 0.25)
    if reference.least < EDGE:
        pytest.skip("what holds and what drives differ by no more than rounding")
    run = omnidyn.simulate(robot, u, 0.25, tol=1e-6)
    assert "wheels that slip" in run.source
    assert (np.abs(run.twist - twist) / [1.0, 1.0, 10.0]).max() < 1e-6
    assert np.abs(run.wheel_speed * robot.wheels.radii - rims).max() < 1e-5
    assert contact.any()
    assert "wheels_slip" in codes(run.warnings)


def meet_slip(robot, body, seed):
    """(the run of a robot, which meets the events of the reference; that of the same robot with another body)."""
    u, reference = levels(robot, seed), Slip(robot, wheel_loads(robot).newtons, load_shift(robot))
    twist, rims, contact = reference.run(u, 0.25)
    if reference.least < EDGE:
        pytest.skip("what holds and what drives differ by no more than rounding")
    run, other = (omnidyn.simulate(each, u, 0.25, tol=1e-6) for each in (robot, robot.replace(body=body)))
    assert (np.abs(run.twist - twist) / [1.0, 1.0, 10.0]).max() < 1e-6
    assert np.abs(run.wheel_speed * robot.wheels.radii - rims).max() < 1e-5
    assert contact.any()
    return run, other


@pytest.mark.parametrize("seed", [*range(3), *LONG])
@pytest.mark.some(1)
def test_loads_that_shift_against_the_events(seed):
    """The same with a centre of mass at a height of up to 0.4 of where the wheels stand."""
    rng = np.random.default_rng(100 + seed)
    robot = slippery(
        (AXEBOT, FOUR)[seed % 2],
        rng.uniform(0.2, 0.8),
        rng.uniform(1e-5, 5e-5),
        rotating_frame=bool(seed // 2 % 2),
        centre_height=rng.uniform(0.01, 0.04),
    )
    run, other = meet_slip(robot, robot.body.replace(centre_height=0.0), 100 + seed)
    assert np.abs(run.twist - other.twist).max() > 1e-4


# --- wheels that roll -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("robot", [AXEBOT, FOUR, shaped("ellipse"), shaped("wheels"), load_robot("mecanum")])
def test_with_more_grip_than_is_asked_for_it_is_the_engine_of_wheels_that_roll(robot):
    grips = slippery(robot, 100.0)
    rolls = grips.replace(wheels=grips.wheels.replace(traction_mu=None))
    u = levels(robot, 3)
    run, plain = (omnidyn.simulate(each, u, 0.25, tol=1e-6) for each in (grips, rolls))
    assert not run.warnings
    assert (np.abs(run.twist - plain.twist) / [1.0, 1.0, 10.0]).max() < 2e-6
    assert np.abs(run.wheel_speed - plain.wheel_speed).max() * 0.035 < 2e-5
    np.testing.assert_allclose(run.current, plain.current, atol=2e-5)
    np.testing.assert_allclose(run.pose, plain.pose, atol=1e-5)


@pytest.mark.parametrize("name", ["axebot", "four-wheel", "mecanum"])
@pytest.mark.parametrize("tol", [1e-3, 1e-5])
def test_heavy_wheels_on_a_body_that_turns_easily_leave_rest_as_wheels_that_roll_do(name, tol):
    """Forces of such wheels creep from round to round: a body that still rests then was taken to rest for good."""
    robot = load_robot(name)
    spin = 2.0 * robot.body.mass * float(np.mean(robot.wheels.radii)) ** 2
    robot = robot.replace(
        body=robot.body.replace(inertia=1e-2 * robot.body.inertia),
        wheels=robot.wheels.replace(wheel_inertia=spin),
        friction=Friction(
            direction=DirectionFriction(coulomb=(2.0, 2.0), viscous=0.5, yaw_coulomb=0.1, yaw_viscous=0.01)
        ),
    )
    u = levels(robot, 3, 12)
    rolls = omnidyn.simulate(robot, u, 0.1, tol=1e-7)
    grips = omnidyn.simulate(robot.replace(wheels=robot.wheels.replace(traction_mu=100.0)), u, 0.1, tol=tol)
    assert np.abs(rolls.twist[-1]).max() > 0.1
    assert (np.abs(grips.twist - rolls.twist) / [1.0, 1.0, 10.0]).max() < 2.0 * tol
    assert np.array_equal(grips.twist == 0.0, rolls.twist == 0.0)


def test_within_the_dead_zone_it_rests_exactly():
    run = omnidyn.simulate(slippery(AXEBOT, 0.4), np.tile([0.0, 0.2, -0.2], (50, 1)), 0.1)
    assert not run.twist.any()
    assert not run.wheel_speed.any()


@pytest.mark.parametrize("name", ["wheels", "ellipse"])
def test_friction_of_wheels_and_of_the_direction_rests_exactly_too(name):
    run = omnidyn.simulate(slippery(shaped(name), 0.4), np.full((20, 3), 0.01), 0.1)
    assert not run.twist.any()
    assert not run.wheel_speed.any()


# --- closed forms -----------------------------------------------------------------------------------------------------


def test_wheels_that_spin_push_with_mu_times_the_load():
    """Forward at full volts on ice: M v' = 2 mu N cos 30 - C - B v, N = M g/3; rims run to the motors' speed."""
    mu = 0.4
    robot = slippery(
        AXEBOT.replace(friction=AXEBOT.friction.replace(axes=AXEBOT.friction.axes.replace(coulomb=(0.5, 0.5, 0.05)))),
        mu,
        1e-6,
    )
    mass, axes = robot.body.mass, robot.friction.axes
    load = mass * GRAVITY / 3.0
    np.testing.assert_allclose(wheel_loads(robot).newtons, load)
    push = 2.0 * mu * load * np.cos(np.radians(30.0)) - axes.coulomb[0]
    run = omnidyn.simulate(robot, np.tile([0.0, 6.0, -6.0], (30, 1)), 0.01)
    expected = push / axes.viscous[0] * -np.expm1(-axes.viscous[0] * run.t / mass)
    slips = np.abs(run.wheel_speed[:, 1] * 0.035) > np.abs(run.twist[:, 0]) * np.cos(np.radians(30.0)) + 1e-6
    slips[0] = True
    assert slips[:10].all()
    np.testing.assert_allclose(run.twist[slips, 0], expected[slips], atol=1e-5)
    motor = robot.motor
    stall = motor.gear_ratio * motor.torque_constant / 0.035
    rim = 0.035 / (motor.gear_ratio * motor.emf_constant) * (6.0 - motor.resistance * mu * load / stall)
    assert abs(run.wheel_speed[5, 1]) * 0.035 == pytest.approx(rim, rel=1e-3)


def test_a_robot_whose_wheels_are_locked_slides_to_a_stop_at_mu_g():
    """Four wheels shorted by motors far too strong: each brakes along its own direction with mu N."""
    motor = FOUR.motor.replace(resistance=1e-3)
    robot = slippery(FOUR.replace(motor=motor), 0.1, 1e-3)
    run = omnidyn.simulate(robot, np.zeros((20, 4)), 0.01, twist=(0.8, 0.0, 0.0))
    load, axes = robot.body.mass * GRAVITY / 4.0, robot.friction.axes
    force = 4.0 * 0.1 * load * np.cos(np.radians(45.0)) + axes.coulomb[0]
    rate = axes.viscous[0] / robot.body.mass
    expected = (0.8 + force / axes.viscous[0]) * np.exp(-rate * run.t) - force / axes.viscous[0]
    moving = expected > 0.05
    np.testing.assert_allclose(run.twist[moving, 0][3:], expected[moving][3:], atol=4e-3)


def test_slip_takes_energy_and_gives_none():
    """Kinetic energy, of the wheels too, never grows beyond what the motors put in."""
    robot = slippery(AXEBOT, 0.3, rotating_frame=True)
    u = np.repeat(levels(robot, 8, 10), 100, axis=0)
    run = omnidyn.simulate(robot, u, 1e-3)
    rims, spin = run.wheel_speed * 0.035, 2e-5 / 0.035**2
    mass = [robot.body.mass, robot.body.mass, robot.body.inertia]
    kinetic = 0.5 * np.sum(mass * run.twist**2, axis=1) + 0.5 * spin * np.sum(rims**2, axis=1)
    thrust, emf = 19.0 * 0.0059 / 0.035, 19.0 * 0.0059 / 0.035

    def power(rim):
        return np.sum(thrust * (u - emf * rim) / 1.69 * rim, axis=1)

    work = np.cumsum(0.5e-3 * (power(rims[:-1]) + power(rims[1:])))
    lost = work - (kinetic[1:] - kinetic[0])
    assert (np.diff(lost) > -1e-4).all()
    assert lost[-1] > 1.0


@pytest.mark.parametrize("seed", [*range(4), *LONG])
@pytest.mark.some(2)
def test_a_centre_of_mass_beside_the_wheels_against_the_events(seed):
    """The same with its centre of mass off by up to 0.4 of where the wheels stand: unequal loads, coupled masses.

    Not so far that a wheel lifts off: the reference knows none that does.
    """
    rng = np.random.default_rng(200 + seed)
    far, way = rng.uniform(0.01, 0.04), rng.uniform(0.0, 6.28)
    robot = slippery(
        (AXEBOT, FOUR)[seed % 2],
        rng.uniform(0.2, 0.8),
        rng.uniform(1e-5, 5e-5),
        rotating_frame=bool(seed // 2 % 2),
        centre=(far * np.cos(way), far * np.sin(way)),
        centre_height=rng.choice([0.0, 0.015]),
    )
    run, other = meet_slip(robot, robot.body.replace(centre=(0.0, 0.0)), 200 + seed)
    assert np.abs(run.twist - other.twist).max() > 1e-3
    assert "not_converged" not in codes(run.warnings)


def test_wheels_that_grip_carry_a_centre_beside_them_as_wheels_that_roll():
    """On a slope too, with an ellipse: the engine of wheels that roll knows its torque."""
    robot = slippery(shaped("ellipse"), 50.0, centre=(0.04, -0.03), rotating_frame=True)
    robot = robot.replace(floor=Floor(tilt=3.0, downhill=50.0))
    rolls, u = robot.replace(wheels=robot.wheels.replace(traction_mu=None)), levels(robot, 5)
    one, other = omnidyn.simulate(robot, u, 0.1, tol=1e-7), omnidyn.simulate(rolls, u, 0.1, tol=1e-7)
    assert (np.abs(one.twist - other.twist) / [1.0, 1.0, 10.0]).max() < 1e-6


# --- loads ------------------------------------------------------------------------------------------------------------


def test_loads_are_those_of_statics():
    robot = AXEBOT.replace(
        wheels=AXEBOT.wheels.replace(azimuth_deg=(170.0, -50.0, 70.0), robot_radius=(0.1, 0.12, 0.09))
    )
    loads = wheel_loads(robot).newtons
    angle, arm = np.radians(robot.wheels.azimuth_deg), np.array(robot.wheels.robot_radius)
    assert loads.sum() == pytest.approx(robot.body.mass * GRAVITY)
    assert np.abs([loads @ (arm * np.cos(angle)), loads @ (arm * np.sin(angle))]).max() < 1e-12
    slope = wheel_loads(robot.replace(floor=Floor(tilt=20.0))).newtons
    np.testing.assert_allclose(slope, loads * np.cos(np.radians(20.0)))


def test_four_wheels_on_equal_springs():
    """N = a + b x + c y, by the sums of force and moments."""
    robot = FOUR.replace(wheels=FOUR.wheels.replace(azimuth_deg=(30.0, 150.0, -120.0, -60.0)))
    loads = wheel_loads(robot).newtons
    angle = np.radians(robot.wheels.azimuth_deg)
    places = np.stack([np.ones(4), np.cos(angle), np.sin(angle)])
    np.testing.assert_allclose(places @ loads, [robot.body.mass * GRAVITY, 0.0, 0.0], atol=1e-12)
    assert np.linalg.matrix_rank(np.vstack([places, loads]), tol=1e-9) == 3


def test_a_load_in_front_is_carried_in_front():
    """Three wheels: by the moments about the centre of mass. All of it over one wheel is carried by that one."""
    robot = AXEBOT.replace(body=AXEBOT.body.replace(centre=(0.03, -0.01)))
    loads, angle = wheel_loads(robot).newtons, np.radians(AXEBOT.wheels.azimuth_deg)
    places = 0.1 * np.stack([np.cos(angle), np.sin(angle)], axis=1) - robot.body.centre
    np.testing.assert_allclose(loads @ places, [0.0, 0.0], atol=1e-12)
    assert loads.sum() == pytest.approx(robot.body.mass * GRAVITY)
    over = AXEBOT.replace(body=AXEBOT.body.replace(centre=(-0.1, 0.0)))
    np.testing.assert_allclose(wheel_loads(over).newtons, [1.5 * GRAVITY, 0.0, 0.0], atol=1e-9)


def test_mecanum_wheels_that_slip_under_a_centre_beside_them_are_refused():
    robot = slippery(load_robot("mecanum"), 0.5, centre=(0.02, 0.0))
    with pytest.raises(
        UnsupportedError,
        match=r"\[body\] centre_m: what mecanum wheels carry .* got centre_m = \[0.02.*wheelbase_m",
    ):
        omnidyn.simulate(robot, np.ones((5, 4)), 0.01)


# --- mecanum wheels, whose places a wheelbase tells -------------------------------------------------------------------

MECANUM = load_robot("mecanum")


def standing(robot, wheelbase=0.2):
    return robot.replace(wheels=robot.wheels.replace(wheelbase=wheelbase))


def test_a_wheelbase_says_where_mecanum_wheels_stand():
    """Front left, front right, rear left, rear right; the arm of each push is that of the wrench matrix."""
    assert MECANUM.wheels.places is None
    for wheelbase, x, y in ((0.2, 0.1, 0.1), (0.26, 0.13, 0.07)):
        wheels = standing(MECANUM, wheelbase).wheels
        np.testing.assert_allclose(wheels.places, [[x, x, -x, -x], [y, -y, y, -y]], atol=1e-15)
        along, across, arm = wheels.wrench_matrix
        np.testing.assert_allclose(wheels.places[0] * across - wheels.places[1] * along, arm, atol=1e-15)
    omni = AXEBOT.wheels
    np.testing.assert_allclose(np.hypot(*omni.places), 0.1, rtol=1e-15)
    text = robot_to_toml(standing(MECANUM))
    assert parse_robot(text).wheels == standing(MECANUM).wheels


@pytest.mark.parametrize(
    "robot, wheelbase, words",
    [(AXEBOT, 0.1, "wheelbase_m 0.1 is of mecanum wheels"), (MECANUM, 0.4, "leaves no track.*expected less than 0.4")],
)
def test_a_wheelbase_that_cannot_be_is_refused(robot, wheelbase, words):
    with pytest.raises(InputError, match=words):
        standing(robot, wheelbase)


def test_what_mecanum_wheels_carry_is_statics():
    """Braking, F_x < 0, loads the wheels in front; all moments balance: h F = - sum N (x, y)."""
    robot = slippery(standing(MECANUM, 0.26), 0.5, centre=(0.02, -0.01), centre_height=0.08)
    x, y = robot.wheels.places
    loads, shift, weight = wheel_loads(robot).newtons, load_shift(robot), 1.5 * GRAVITY
    np.testing.assert_allclose([loads.sum(), loads @ x, loads @ y], [weight, 0.02 * weight, -0.01 * weight], rtol=1e-12)
    np.testing.assert_allclose([shift.sum(axis=0), x @ shift, y @ shift], [[0, 0], [-0.08, 0], [0, -0.08]], atol=1e-15)
    assert (shift[:2, 0] < 0.0).all()


@pytest.mark.parametrize("centre", [(0.0, 0.0), (0.015, -0.01)])
@pytest.mark.some(1)
def test_mecanum_wheels_under_a_high_centre_meet_the_events(centre):
    """Their grip is that along the axle of a roller, cos 45 degrees of it along their own way."""
    robot = slippery(standing(MECANUM, 0.26), 0.25, centre=centre, centre_height=0.06)
    u = np.random.default_rng(12).uniform(-6.0, 6.0, (6, 4))
    least = np.sqrt(0.5)
    found = Slip(robot, least * wheel_loads(robot).newtons, least * load_shift(robot))
    twist, rims, contact = found.run(u, 0.25)
    assert found.least >= EDGE
    assert contact.any()
    run = omnidyn.simulate(robot, u, 0.25, tol=1e-6)
    assert (np.abs(run.twist - twist) / [1.0, 1.0, 10.0]).max() < 1e-6
    assert (np.abs(run.pose - found.pose) / [1.0, 1.0, 10.0]).max() < 1e-6
    assert np.abs(run.wheel_speed * 0.035 - rims).max() < 1e-5
    flat = omnidyn.simulate(robot.replace(body=robot.body.replace(centre_height=0.0)), u, 0.25, tol=1e-6)
    assert np.abs(flat.twist - run.twist).max() > 1e-3  # the height is seen, a thousand times tol


def test_a_wheel_in_the_air_carries_nothing_and_is_named():
    robot = slippery(AXEBOT.replace(wheels=AXEBOT.wheels.replace(azimuth_deg=(0.0, 40.0, 170.0))), 0.5)
    loads = wheel_loads(robot)
    assert loads.lifted == (1,)
    assert loads.newtons[1] == 0.0
    run = omnidyn.simulate(robot, np.ones((5, 3)), 0.01)
    assert [each.numbers["wheel"] for each in run.warnings if each.code == "wheel_in_air"] == [2]


def test_loads_shift_by_the_height_times_what_the_floor_pushes_with():
    """Sums of force and moments again: braking loads the wheels in front."""
    robot = FOUR.replace(body=FOUR.body.replace(centre_height=0.03))
    shift, angle = load_shift(robot), np.radians(FOUR.wheels.azimuth_deg)
    force = np.array([-3.0, 1.0])  # braking, and pushed to the left
    more = shift @ force
    assert abs(more.sum()) < 1e-12
    assert more @ (0.1 * np.cos(angle)) == pytest.approx(-0.03 * force[0])
    assert more @ (0.1 * np.sin(angle)) == pytest.approx(-0.03 * force[1])
    assert more[0] > 0.0  # in front, on the left
    assert more[2] < 0.0


def test_a_wheel_that_lifts_off_is_said():
    robot = slippery(FOUR, 1.5, centre_height=0.2)
    run = omnidyn.simulate(robot, np.tile([-6.0, -6.0, 6.0, 6.0], (10, 1)), 0.01)
    assert "wheel_lifts" in codes(run.warnings)
    low = omnidyn.simulate(slippery(FOUR, 1.5, centre_height=0.01), np.tile([-6.0, -6.0, 6.0, 6.0], (10, 1)), 0.01)
    assert "wheel_lifts" not in codes(low.warnings)


def test_a_robot_at_rest_on_a_slope_leans_downhill():
    """The floor holds it with m g sin(tilt): the loads below are larger, and its friction is what holds it."""
    robot = slippery(FOUR, 0.5, centre_height=0.04).replace(floor=Floor(tilt=5.0))
    run = omnidyn.simulate(robot, np.zeros((5, 4)), 0.1)
    assert not run.twist.any()
    assert not run.warnings


def test_the_height_of_a_mecanum_robot_is_refused():
    with pytest.raises(
        UnsupportedError, match="the height of the centre of mass on mecanum wheels without wheelbase_m"
    ):
        omnidyn.simulate(slippery(load_robot("mecanum"), 0.3, centre_height=0.1), np.ones((2, 4)), 0.01)


# --- in every engine, and where it is refused -------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["voltage", "speed"])
def test_a_live_robot_slips_as_well(kind):
    robot = slippery(AXEBOT, 0.3)
    name, rows = "voltage", np.repeat(levels(robot, 5, 6), 4, axis=0)
    if kind == "speed":
        robot = robot.replace(drive=robot.drive.replace(kind="speed", kp=0.3, ki=2.0, rate=100.0))
        name, rows = "wheel_speed_command", 4.0 * rows
    run = omnidyn.simulate(robot, dt=0.04, **{name: rows})
    live = LiveRobot(robot, 0.04)
    for k, row in enumerate(rows):
        live.step(row)
        np.testing.assert_allclose(live.twist, run.twist[k + 1], atol=5e-5)
        np.testing.assert_allclose(live.wheel_speed, run.wheel_speed[k + 1], atol=1e-2)


def test_a_slope_pulls_at_it_too():
    """Steeper than what friction and wheels that are shorted take: it slides down, wheels or no wheels."""
    robot = slippery(AXEBOT, 0.05).replace(floor=Floor(tilt=15.0, downhill=90.0))
    run = omnidyn.simulate(robot, np.zeros((20, 3)), 0.05)
    assert run.pose[-1, 1] > 0.05
    assert abs(run.pose[-1, 0]) < 1e-6


def test_a_floor_of_the_file_can_be_slippery():
    text = robot_to_toml(slippery(AXEBOT, None)) + (
        "\n[variations.floor.ice]\ntraction_mu = 0.1\n[variations.floor.ice.friction.axes]\n"
        "viscous = [0.9, 0.9, 0.01]\ncoulomb = [0.3, 0.3, 0.02]\n"
    )
    robot = parse_robot(text)
    assert parse_robot(robot_to_toml(robot)) == robot
    ice = omnidyn.vary_robot(robot, floor="ice")
    assert ice.wheels.traction_mu == 0.1
    tracked = omnidyn.track(robot, "circle", "pid", plant=ice, duration=1.0)
    rim = np.abs(tracked.run.wheel_speed * 0.035 - tracked.run.twist @ robot.wheels.wrench_matrix)
    assert rim.max() > 1e-3


@pytest.mark.parametrize(
    "change, named",
    [
        (lambda r: r.replace(wheels=r.wheels.replace(wheel_inertia=0.0)), "wheels that weigh nothing"),
        (
            lambda r: r.replace(friction=r.friction.replace(axes=r.friction.axes.replace(law="karnopp"))),
            r'law = "karnopp" of \[friction.axes\].*take law = "coulomb", which sticks with the same levels',
        ),
    ],
    ids=["weightless", "karnopp"],
)
def test_what_has_no_law_here_is_named(change, named):
    with pytest.raises(UnsupportedError, match=rf"\[wheels\] traction_mu: .*got .*{named}"):
        omnidyn.simulate(change(slippery(AXEBOT, 0.3)), np.ones((2, 3)), 0.01)


@pytest.mark.parametrize(
    "use",
    [
        lambda robot: breakaway_voltage(robot, [0.0, 1.0, -1.0]),
        lambda robot: omnidyn.acceleration(robot, np.zeros(3), np.zeros(3)),
        lambda robot: derivatives(robot, np.ones((5, 3)), 0.01, ["friction.axes.viscous[0]"]),
    ],
    ids=["dead zone", "acceleration", "derivatives"],
)
def test_what_knows_rolling_wheels_only_says_so(use):
    with pytest.raises(UnsupportedError, match=r"no wheels that slip; got traction_mu = 0.5"):
        use(slippery(AXEBOT, 0.5))
