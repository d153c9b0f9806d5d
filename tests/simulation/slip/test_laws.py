"""Every law of friction under wheels that slip, and windings and gears: random robots by the event-driven reference."""

import re
from functools import cache

import numpy as np
import pytest

import omnidyn
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.sensitivity.directions import EPS
from omnidyn.simulation.sensitivity.late_sample import Direction, VoltageProgram
from omnidyn.simulation.sensitivity.slipping import slipping_samples
from omnidyn.simulation.slip.plant import load_shift, slip_plant, wheel_loads
from omnidyn.simulation.slip.slip_march import rolling, run_slipping
from omnidyn.simulation.speed_loop import no_loop
from tests.simulation.slip.test_random_robots import DT, drawn
from tests.support.codes import codes
from tests.support.friction_shapes import shaped
from tests.support.slipping import EDGE, Slip

AXEBOT, REJECTED = load_robot("axebot"), 8  # draws at which a decision is within rounding of its edge
LAWS = ("breakaway", "stribeck", "wheels", "wheels stribeck", "winding", "gear", "bristles")
MORE = ("ellipse", "ellipse breakaway", "ellipse stribeck", "dahl", "ductile", "elastoplastic")
ALONG = ("along dahl", "along ductile", "along lugre", "along elastoplastic", "along lugre beside wheels")
ROBOTS = [LAWS[k % len(LAWS)] for k in range(20)] + [MORE[k % len(MORE)] for k in range(30)]
ROBOTS += [ALONG[k % len(ALONG)] for k in range(20)]
FIRST = [ROBOTS.index(law) for law in (*LAWS, *MORE, *ALONG)]
SECOND = [ROBOTS.index(law, ROBOTS.index(law) + 1) for law in (*LAWS, *MORE, *ALONG)]


def pieces(robot, rng):
    """(levels of the axes, of the wheels): half of the friction of a robot each."""
    axes = robot.friction.axes
    return np.array(axes.coulomb), float(axes.coulomb[0]) / 2.0 / robot.wheels.count * rng.uniform(0.7, 1.3)


def falls(rng):
    return {
        "stribeck_shape": str(rng.choice(["exponential", "lorentzian"])),
        "stribeck_exponent": float(rng.choice([1.0, 1.5, 2.0])),
    }


def with_ellipse(robot, law, rng):
    """The robot with a law along its direction of travel, and friction of its own in every wheel."""
    way, more, speed = robot.friction.direction, rng.uniform(1.1, 1.5, 3), rng.uniform(0.02, 0.1)
    hold = {"breakaway": tuple(np.array(way.coulomb) * more[:2]), "yaw_breakaway": way.yaw_coulomb * more[2]}
    arm = float(np.mean(robot.wheels.robot_radius))
    if law != "ellipse":
        way = way.replace(**hold)
    if law == "ellipse stribeck":
        way = way.replace(stribeck_speed=speed, yaw_stribeck_speed=speed / arm, **falls(rng))
    rims = robot.friction.wheels.replace(coulomb=0.1 * way.coulomb[0] / robot.wheels.count * rng.choice([0.0, 1.0]))
    return robot.replace(friction=robot.friction.replace(direction=way, wheels=rims))


def with_plane(robot, law, rng):
    """The robot with bristles along its direction of travel; "beside wheels": and dry friction of its wheels."""
    way, more, speed = robot.friction.direction, rng.uniform(1.1, 1.5, 3), rng.uniform(0.02, 0.1)
    arm, beside, kind = float(np.mean(robot.wheels.robot_radius)), law.endswith("wheels"), law.split()[1]
    own = {"law": "dahl", "dahl_exponent": rng.uniform(1.3, 2.0)} if kind == "ductile" else {"law": kind}
    if kind in ("lugre", "elastoplastic"):
        own |= {
            "breakaway": tuple(np.array(way.coulomb) * more[:2]),
            "yaw_breakaway": way.yaw_coulomb * more[2],
            "stribeck_speed": speed,
            "yaw_stribeck_speed": speed / arm,
            "damping": rng.uniform(2.0, 10.0),
            "yaw_damping": 10.0 * arm**2,
            **falls(rng),
        }
    if kind == "lugre" and not beside:
        own |= {"damping_speed": rng.uniform(0.5, 2.0), "yaw_damping_speed": rng.uniform(0.5, 2.0) / arm}
    if kind == "elastoplastic":
        own["elastic_share"] = rng.uniform(0.3, 0.9)
    way = way.replace(
        stiffness=way.coulomb[0] / rng.uniform(0.5e-3, 2e-3),
        yaw_stiffness=max(way.yaw_coulomb, 1e-3) / (1e-3 / arm),
        **own,
    )
    rim = 0.1 * way.coulomb[0] / robot.wheels.count if beside else 0.0
    rims = robot.friction.wheels.replace(coulomb=rim, breakaway=1.3 * rim if beside else None)
    grip = robot.wheels.replace(traction_mu=0.6 * robot.wheels.traction_mu)
    return robot.replace(friction=robot.friction.replace(direction=way, wheels=rims), wheels=grip)


def with_law(robot, law, rng):
    """The robot with a law, its levels and its numbers drawn."""
    if law.startswith("along"):
        return with_plane(robot, law, rng)
    if law.startswith("ellipse"):
        return with_ellipse(robot, law, rng)
    coulomb, rim = pieces(robot, rng)
    arm, more = float(np.mean(robot.wheels.robot_radius)), rng.uniform(1.1, 1.5, 3)
    speed, friction, motor = rng.uniform(0.02, 0.1), robot.friction, robot.motor
    axes, wheels, half = friction.axes, friction.wheels, friction.axes.replace(coulomb=tuple(0.5 * coulomb))
    rims = {
        "coulomb": rim,
        "coulomb_backward": 0.9 * rim,
        "breakaway": 1.3 * rim,
        "breakaway_backward": 1.2 * rim,
        "viscous": 0.2 * rim,
    }
    if law == "breakaway":
        axes = axes.replace(
            breakaway=tuple(coulomb * more), coulomb_backward=tuple(0.9 * coulomb), breakaway_backward=tuple(coulomb)
        )
    elif law == "stribeck":
        axes = axes.replace(breakaway=tuple(coulomb * more), stribeck_speed=(speed, speed, speed / arm), **falls(rng))
    elif law == "wheels":
        axes, wheels = half.replace(breakaway=tuple(0.5 * coulomb * more)), wheels.replace(**rims)
    elif law == "wheels stribeck":
        axes, wheels = half, wheels.replace(**rims, stribeck_speed=speed, **falls(rng))
    elif law == "winding":
        settles = rng.uniform(0.3, 3.0) * 1e-3
        axes = axes.replace(breakaway=tuple(coulomb * more))
        motor = motor.replace(electrical="dynamic", inductance=settles * motor.resistance)
    elif law == "gear":  # with friction of its own a wheel at rest is not at the edge
        axes, wheels = half.replace(breakaway=tuple(0.5 * coulomb * more)), wheels.replace(**rims)
        motor = motor.replace(gear_efficiency=tuple(rng.uniform(0.75, 0.95, robot.wheels.count)))
    elif law in MORE:
        stiff, spring = 0.5 * coulomb / 1e-3, rim / 2e-3
        own = {"law": "elastoplastic", "elastic_share": rng.uniform(0.3, 0.9)}
        if law != "elastoplastic":
            own = {"law": "dahl", "dahl_exponent": 1.0 if law == "dahl" else rng.uniform(1.3, 2.0)}
        axes = half.replace(**own, stiffness=(stiff[0], stiff[1], stiff[2] * arm))
        wheels = wheels.replace(**own, coulomb=rim, viscous=0.2 * rim, stiffness=spring)
        if law == "elastoplastic":
            spin = robot.wheels.wheel_inertia / robot.wheels.radii[0] ** 2
            axes = axes.replace(
                breakaway=tuple(0.5 * coulomb * more),
                stribeck_speed=(speed, speed, speed / arm),
                damping=(10.0, 10.0, 10.0 * arm**2),
                **falls(rng),
            )
            wheels = wheels.replace(damping=2.0 * float(np.sqrt(spring * spin)))
    else:
        stiff = coulomb / 1e-3
        axes = axes.replace(
            law="lugre",
            breakaway=tuple(coulomb * more),
            stribeck_speed=(speed, speed, speed / arm),
            stiffness=(stiff[0], stiff[1], stiff[2] * arm),
            damping=(10.0, 10.0, 10.0 * arm**2),
            coulomb=tuple(coulomb),
        )
        spring, spin = rim / 2e-3, robot.wheels.wheel_inertia / robot.wheels.radii[0] ** 2
        wheels = wheels.replace(law="lugre", coulomb=rim, stiffness=spring, damping=2.0 * float(np.sqrt(spring * spin)))
    grip = robot.wheels.replace(traction_mu=0.6 * robot.wheels.traction_mu)  # friction of its own holds a wheel back
    return robot.replace(friction=friction.replace(axes=axes, wheels=wheels), motor=motor, wheels=grip)


@cache
def reference(number):
    """(robot, levels, twist, rims, place, contacts, how many draws were rejected) of a draw that counts."""
    for rejected in range(REJECTED):
        seed, law = 100 + number + 100 * rejected, ROBOTS[number]
        robot, levels = drawn(seed, "direction" if law.startswith(("ellipse", "along")) else "axes")
        robot = with_law(robot, law, np.random.default_rng([seed, 10]))
        found = Slip(robot, wheel_loads(robot).newtons, load_shift(robot))
        twist, rims, contact = found.run(levels, DT)
        if found.least >= EDGE:
            return robot, levels, twist, rims, found.pose, contact, rejected
    raise AssertionError(f"draw {number}: nothing but edges")


def meets_the_events(number, tol):
    robot, levels, twist, rims, pose, _, _ = reference(number)
    run = omnidyn.simulate(robot, levels, DT, tol=tol)
    assert (np.abs(run.twist - twist) / [1.0, 1.0, 10.0]).max() < tol
    assert (np.abs(run.pose - pose) / [1.0, 1.0, 10.0]).max() < tol
    assert np.abs(run.wheel_speed * robot.wheels.radii - rims).max() < 10.0 * tol
    assert "not_converged" not in codes(run.warnings)


@pytest.mark.parametrize("number", FIRST, ids=[*LAWS, *MORE, *ALONG])
@pytest.mark.some(4)
def test_each_law_against_the_events(number):
    """Within tol [m/s] and [m], 10 tol [rad/s] and [rad]; rims within 10 tol [m/s]."""
    meets_the_events(number, 1e-6)


@pytest.mark.long
@pytest.mark.parametrize("number, tol", [*((k, 1e-5) for k in SECOND), *((k, 1e-7) for k in FIRST[::3])])
def test_other_robots_and_tolerances_against_the_events(number, tol):
    meets_the_events(number, tol)


@pytest.mark.long
def test_few_draws_are_rejected_and_most_slip():
    found = [reference(number) for number in (*FIRST, *SECOND)]
    assert sum(each[-1] for each in found) <= 2
    assert sum(bool(each[-2].any()) for each in found) >= 0.9 * len(found)


# --- wheels that roll -------------------------------------------------------------------------------------------------


def slippery(robot, mu, inertia=2e-5):
    return robot.replace(wheels=robot.wheels.replace(traction_mu=mu, wheel_inertia=inertia))


def changed(name, place=None, **keys):
    """A robot of tests/support/friction_shapes, or the preset, with other keys of a friction table, or of its motor."""
    robot = AXEBOT if name == "axes" else shaped(name)
    if place is None:
        return robot.replace(motor=robot.motor.replace(**keys))
    table = getattr(robot.friction, place).replace(**keys)
    return robot.replace(friction=robot.friction.replace(**{place: table}))


HOLD, SPEEDS = (2.9, 2.0, 0.13), (0.05, 0.05, 0.4)
ROBOTS_OF = {
    "breakaway": changed("axes", "axes", breakaway=HOLD),
    "backward": changed("axes", "axes", coulomb_backward=(1.9, 1.2, 0.08), breakaway_backward=(2.5, 1.9, 0.1)),
    "stribeck": changed("axes", "axes", breakaway=HOLD, stribeck_speed=SPEEDS),
    "lorentzian": changed(
        "axes", "axes", breakaway=HOLD, stribeck_speed=SPEEDS, stribeck_shape="lorentzian", stribeck_exponent=1.0
    ),
    "wheels": changed("wheels", "wheels", breakaway=1.2),
    "wheels stribeck": changed("wheels", "wheels", breakaway=1.2, stribeck_speed=0.05),
    "direction": changed("ellipse", "direction", breakaway=(2.9, 1.7), yaw_breakaway=0.12),
    "direction stribeck": changed("ellipse", "direction", breakaway=(2.9, 1.7), stribeck_speed=0.05),
    "gear": changed("axes", gear_efficiency=0.8),
    "gear and wheels": changed("wheels", gear_efficiency=0.8),
    "winding": changed("axes", electrical="dynamic", inductance=3e-3),
    "winding, drop and limit": changed(
        "axes", electrical="dynamic", inductance=3e-3, voltage_drop=0.3, current_limit=1.5
    ),
    "lugre": changed("axes", "axes", law="lugre", stiffness=(1e4, 1e4, 300.0), breakaway=HOLD, stribeck_speed=SPEEDS),
    "dahl": changed("axes", "axes", law="dahl", stiffness=(1e4, 1e4, 300.0)),
    "dahl, exponent": changed("axes", "axes", law="dahl", stiffness=(1e4, 1e4, 300.0), dahl_exponent=1.5),
    "lugre at the wheels": changed("wheels", "wheels", law="lugre", stiffness=1e4),
    "dahl along": changed("ellipse", "direction", law="dahl", stiffness=1e4, yaw_stiffness=300.0),
    "dahl along, exponent": changed(
        "ellipse", "direction", law="dahl", stiffness=1e4, yaw_stiffness=300.0, dahl_exponent=1.5
    ),
    "lugre along": changed(
        "ellipse",
        "direction",
        law="lugre",
        stiffness=1e4,
        yaw_stiffness=300.0,
        breakaway=(2.9, 1.7),
        stribeck_speed=0.05,
        yaw_breakaway=0.12,
        yaw_stribeck_speed=0.4,
    ),
    "elastoplastic along": changed(
        "ellipse",
        "direction",
        law="elastoplastic",
        stiffness=1e4,
        yaw_stiffness=300.0,
        breakaway=(2.9, 1.7),
        stribeck_speed=0.05,
    ),
}


BENT = re.compile("dahl|lugre|elastoplastic")


@pytest.mark.parametrize("name", ROBOTS_OF)
@pytest.mark.some(7)
def test_with_more_grip_than_is_asked_for_it_is_the_engine_of_wheels_that_roll(name):
    grips = slippery(ROBOTS_OF[name], 100.0)
    rolls, u = grips.replace(wheels=grips.wheels.replace(traction_mu=None)), volts(3)
    run, plain = (omnidyn.simulate(each, u, 0.25, tol=1e-6) for each in (grips, rolls))
    assert not run.warnings
    assert (np.abs(run.twist - plain.twist) / [1.0, 1.0, 10.0]).max() < 2e-6
    assert np.abs(run.wheel_speed - plain.wheel_speed).max() * 0.035 < 2e-5
    np.testing.assert_allclose(run.current, plain.current, atol=2e-5)
    np.testing.assert_allclose(run.pose, plain.pose, atol=1e-5)


def volts(seed, rows=8):
    found = np.random.default_rng(seed).uniform(-6.0, 6.0, (rows, 3))
    found[rows // 2] = 0.0
    return found


# --- rest, energy, derivatives ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [each for each in ROBOTS_OF if not BENT.search(each)])
@pytest.mark.parametrize("tol", [1e-6, None])
def test_below_breakaway_it_rests_exactly(name, tol):
    run = omnidyn.simulate(slippery(ROBOTS_OF[name], 0.4), np.tile([0.0, 0.25, -0.25], (20, 1)), 0.05, tol=tol)
    assert not run.twist.any()
    assert not run.wheel_speed.any()


def test_between_coulomb_and_breakaway_what_rests_stays_and_what_moves_goes_on():
    """3.2 N at the rims, F = K u/R sqrt(3), lie between the levels of 2.2 and 3.6 N."""
    robot = slippery(changed("axes", "axes", breakaway=(3.6, 2.0, 0.13)), 0.6)
    rim = 19.0 * 0.0059 / 0.035 / 1.69 * np.sqrt(3.0)
    pushed = np.tile([0.0, 3.2 / rim, -3.2 / rim], (10, 1))
    assert not omnidyn.simulate(robot, pushed, 0.1).twist.any()
    moving = omnidyn.simulate(robot, pushed, 0.1, twist=(0.05, 0.0, 0.0))
    assert moving.twist[-1, 0] > 0.03


@pytest.mark.parametrize("name", ["breakaway", "stribeck", "wheels", "wheels stribeck", "direction", "gear"])
def test_it_takes_energy_and_gives_none(name):
    """Kinetic energy, of the wheels too, never grows beyond what the motors put in."""
    robot = slippery(ROBOTS_OF[name], 0.3)
    u = np.repeat(volts(8, 6), 250, axis=0)
    run = omnidyn.simulate(robot, u, 1e-3, tol=1e-6)
    rims, spin, body = run.wheel_speed * 0.035, 2e-5 / 0.035**2, robot.body
    kinetic = 0.5 * np.sum([body.mass, body.mass, body.inertia] * run.twist**2, axis=1)
    kinetic += 0.5 * spin * np.sum(rims**2, axis=1)
    thrust = 19.0 * 0.0059 / 0.035

    def power(rim):
        return np.sum(thrust * (u - thrust * rim) / 1.69 * rim, axis=1)

    work = np.cumsum(0.5e-3 * (power(rims[:-1]) + power(rims[1:])))
    lost = work - (kinetic[1:] - kinetic[0])
    assert (np.diff(lost) > -1e-4).all()
    assert lost[-1] > 1.0


@pytest.mark.parametrize(
    "name, key", [("breakaway", "coulomb"), ("stribeck", "breakaway"), ("lugre", "coulomb"), ("winding", "viscous")]
)
@pytest.mark.some(2)
def test_derivatives_follow(name, key):
    """Those of slipping_samples, by runs in fixed steps, are near differences of far more accurate runs."""
    robot, along = slippery(ROBOTS_OF[name], 0.6), np.outer([5.0, 0.0, -5.5, -3.0], [0.1, 1.0, -1.0])
    u = np.repeat(along, 40, axis=0)
    dt, step = 0.005, 1e-3

    def moved(side):
        levels = getattr(robot.friction.axes, key)
        axes = robot.friction.axes.replace(**{key: (levels[0] + side, *levels[1:])})
        return robot.replace(friction=robot.friction.replace(axes=axes))

    t = np.arange(len(u) + 1) * dt
    one = Direction(key, moved(EPS), moved(-EPS))
    found = slipping_samples(robot, VoltageProgram(t, u, np.zeros(3)), [one], [0.0], 4, 1e-6)[0].dtwist[:, 0, 0]
    far, near = (omnidyn.simulate(moved(side), u, dt, tol=1e-9).twist[:, 0] for side in (step, -step))
    expected = (far - near) / (2.0 * step)
    assert np.abs(expected).max() > 1e-3
    assert np.median(np.abs(found - expected)) < 0.05 * np.abs(expected).max()


# --- what bends along the direction of travel -------------------------------------------------------------------------

PLANE = ("dahl along", "dahl along, exponent", "lugre along", "elastoplastic along")
ONE_LEVEL = {"breakaway": None, "stribeck_speed": None, "yaw_breakaway": None, "yaw_stribeck_speed": None}
STEPWISE = np.repeat(volts(8, 6), 50, axis=0)


@pytest.mark.parametrize("name", PLANE)
@pytest.mark.some(2)
def test_stiff_bristles_along_the_way_are_coulomb_friction(name):
    """The difference, of how it stops, falls as the root of the stiffness; and steps of 5 ms are near."""
    coulomb, own = shaped("ellipse"), ROBOTS_OF[name].friction.direction.replace(**ONE_LEVEL)
    exact, far = omnidyn.simulate(slippery(coulomb, 0.3), STEPWISE, 5e-3, tol=1e-6), []
    assert exact.warnings[0].code == "wheels_slip"
    for stiffness in (1e4, 1e6):
        bent = own.replace(stiffness=stiffness, yaw_stiffness=0.03 * stiffness)
        robot = slippery(coulomb.replace(friction=coulomb.friction.replace(direction=bent)), 0.3)
        run, fixed = (omnidyn.simulate(robot, STEPWISE, 5e-3, tol=tol) for tol in (1e-6, None))
        far.append((np.abs(run.twist - exact.twist) / [1.0, 1.0, 10.0]).max())
        assert "not_converged" not in codes([*run.warnings, *fixed.warnings])
        assert (np.abs(fixed.twist - run.twist) / [1.0, 1.0, 10.0]).max() < 0.01
    assert far[1] < 2e-3
    assert far[1] == pytest.approx(0.1 * far[0], rel=0.3)


@pytest.mark.parametrize("name", PLANE)
@pytest.mark.some(2)
def test_what_bends_along_the_way_gives_no_energy(name):
    """Without voltage, bristles bent before: kinetic energy, that of the wheels too, and sigma0 |z|^2/2 fall."""
    way = ROBOTS_OF[name].friction.direction.replace(**ONE_LEVEL)
    way = way if way.law == "dahl" else way.replace(damping=0.0, yaw_damping=0.0)  # LuGre's known exception
    robot = slippery(ROBOTS_OF[name], 0.15)
    plant = slip_plant(robot.replace(friction=robot.friction.replace(direction=way)))
    rows, stiffness, random = 400, np.array([300.0, 1e4, 1e4]), np.random.default_rng(3)
    for start in random.normal(size=(4, 3)) * [0.5, 0.5, 3.0]:
        state, slips = rolling(plant, start), np.full(rows, 1e-3)
        state[-2:] = random.uniform(-0.5, 0.5, 2) * np.array(way.coulomb) / 1e4
        off, bound = np.zeros((rows, 3)), np.full((rows, 3), np.inf)
        out = run_slipping(plant, off, bound, slips, state, np.zeros(3), no_loop(3), 1e-8)
        assert out.contact.any()
        bends = out.state[:, [3 + 2 * 3 + 2, -2, -1]]
        energy = 0.5 * (plant.mass * out.twist**2).sum(axis=1) + 0.5 * (plant.spin * out.rims**2).sum(axis=1)
        energy += 0.5 * (stiffness * bends**2).sum(axis=1)
        assert (np.diff(energy) <= 1e-9).all()
        assert energy[-1] < 0.5 * energy[0]


@pytest.mark.parametrize("number", [ROBOTS.index(law) for law in ALONG], ids=ALONG)
@pytest.mark.some(2)
def test_derivatives_by_the_grip_beside_what_bends_are_those_of_the_events(number):
    """d twist/d traction_mu, by runs in fixed steps of 1 ms, against differences of the event-driven reference."""
    robot, levels = reference(number)[:2]
    mu, rows = robot.wheels.traction_mu, 4

    def moved(side):
        return robot.replace(wheels=robot.wheels.replace(traction_mu=mu + side))

    one = Direction("wheels.traction_mu", moved(EPS), moved(-EPS))
    t = np.arange(rows + 1) * DT
    found = slipping_samples(robot, VoltageProgram(t, levels[:rows], np.zeros(3)), [one], [0.0], 250, 1e-6)[0].dtwist[
        :, 0
    ]
    ends = []
    for side in (1e-3 * mu, -1e-3 * mu):
        each = moved(side)
        ends.append(Slip(each, wheel_loads(each).newtons, load_shift(each)).run(levels[:rows], DT)[0])
    expected = (ends[0] - ends[1]) / (2e-3 * mu)
    assert np.abs(expected[:, :2]).max() > 0.01
    assert (np.abs(found - expected) / np.abs(expected).max(axis=0)).max() < 0.03
