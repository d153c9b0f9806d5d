"""One implicit step that turns, goes sideways and reverses, by the formula of its method: see test_one_step.py.

M x' = G K (u - K G^T x)/R - B x - friction, of the paper's robot by the numbers of its Table 3; while no sign changes
it is a linear system. An ellipse, a fall and bristles are solved by SciPy, each stage by itself.
"""

import numpy as np
import pytest
from scipy.optimize import root

from omnidyn import simulate
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from tests.simulation.implicit.test_one_step import CONSTANT, GAMMA, GEAR, RADIUS, RESISTANCE, euler, sdirk2
from tests.support.friction_shapes import AXEBOT, implicit

MASS = np.array([1.5, 1.5, 0.025])
GAIN = GEAR * CONSTANT / RADIUS  # [N/A] and [V s/m] of a wheel at its rim
SQRT = np.sqrt(3.0) / 2.0
G = np.array([[0.0, SQRT, -SQRT], [-1.0, 0.5, 0.5], [0.1, 0.1, 0.1]])  # eqs (7)-(9)
PATTERNS = np.array([[0.0, 1.0, -1.0], [-1.0, 0.5, 0.5], [1.0, 1.0, 1.0]])  # volts that push along one axis alone
NEAR = {"rel": 0.0, "abs": 1e-11}
VISCOUS = np.array([0.9, 0.9, 0.01])
BACK = (1.0 - GAMMA) / GAMMA


def of(turning=False, **friction):
    """The robot with some friction, left to the implicit engine."""
    body = AXEBOT.body.replace(rotating_frame=turning)
    return implicit(AXEBOT.replace(body=body, friction=Friction(**friction)))


def box(coulomb, **levels):
    return {"axes": AxesFriction(viscous=tuple(VISCOUS), coulomb=coulomb, **levels)}


def ellipse(coulomb, yaw=0.0, **more):
    more = {"viscous": 0.9, "yaw_viscous": 0.01, "yaw_coulomb": yaw} | more
    return {"direction": DirectionFriction(coulomb=coulomb, **more)}


def step(robot, volts, h, twist):
    """(run of one step); nothing is adapted."""
    run = simulate(robot, [list(volts)], h, twist=tuple(twist), tol=None)
    assert "implicit" in run.source
    assert not run.warnings
    return run


def linear(volts, force=(0.0, 0.0, 0.0)):
    """(A, b) of x' = A x + b under volts and a constant wrench."""
    matrix = -(G @ G.T * GAIN**2 / RESISTANCE + np.diag(VISCOUS)) / MASS[:, None]
    return matrix, (G @ volts * GAIN / RESISTANCE + force) / MASS


def push_along(axis):
    """[N or N m] that a volt times PATTERNS pushes with along an axis at rest."""
    return (G @ PATTERNS[axis])[axis] * GAIN / RESISTANCE


def two_stages(rate, start, h):
    """(x at the middle node, x at the end): SDIRK2 of x' = rate(x), each stage by SciPy's root."""
    found, start = [], np.asarray(start, dtype=float)
    for back in (0.0, BACK):
        aimed = start + back * ((found[0] if found else start) - start)
        solved = root(lambda x, aimed=aimed: x - aimed - GAMMA * h * rate(x), start, tol=1e-14)
        assert np.abs(solved.fun).max() < 1e-12
        found.append(solved.x)
    return found


# ---- what slides ------------------------------------------------------------------------------------------------

VOLTS = np.array([2.0, -3.5, 4.0])


@pytest.mark.parametrize("start", [(0.3, -0.4, 2.0), (-0.3, 0.4, -2.0)])
@pytest.mark.parametrize("gap", [{}, {"breakaway": (3.0, 2.0, 0.2)}, {"breakaway_backward": (3.0, 2.0, 0.2)}])
def test_each_axis_and_wheel_slides_with_the_level_of_its_side(start, gap):
    """Friction on the axes, and at the wheels besides, forward and backward."""
    forward, backward = np.array([2.2, 1.5, 0.1]), np.array([1.8, 1.2, 0.05])
    axes = box(tuple(forward), coulomb_backward=tuple(backward), **gap)
    on_axes = -np.where(np.array(start) > 0.0, forward, -backward)
    wheels = {"wheels": WheelFriction(coulomb=(0.4, 0.5, 0.6), coulomb_backward=0.3, breakaway=0.8)}
    at_rims = -G @ np.where(G.T @ start > 0.0, [0.4, 0.5, 0.6], -0.3)
    for friction, force in ((axes, on_axes), (axes | wheels, on_axes + at_rims)):
        expected = sdirk2(*linear(VOLTS, force), np.array(start), 0.01)
        assert step(of(**friction), VOLTS, 0.01, start).twist[1] == pytest.approx(expected, **NEAR)


def pose_of(middle, end, h):
    """SDIRK2 of the pose, which follows the twist: p' = R(theta) v."""
    first, turned = GAMMA * h * middle[2], h * ((1.0 - GAMMA) * middle[2] + GAMMA * end[2])
    along = [
        [np.cos(a) * v[0] - np.sin(a) * v[1], np.sin(a) * v[0] + np.cos(a) * v[1]]
        for a, v in ((first, middle), (turned, end))
    ]
    return np.append(h * ((1.0 - GAMMA) * np.array(along[0]) + GAMMA * np.array(along[1])), turned)


@pytest.mark.parametrize("kind", ["dissipation", "plain", "falls", "firm"])
@pytest.mark.parametrize("turning", [False, True])
def test_an_ellipse_in_a_frame_that_turns(kind, turning):
    """F = -(Cx^2 vx, Cy^2 vy)/D, or (Cx vx, Cy vy)/|v|; its levels may fall over metres per second."""
    levels, hold, v_s = np.array([2.2, 1.4]), np.array([2.9, 2.4]), 2.0
    more = {"ellipse": "plain"} if kind == "plain" else {}
    more |= {"breakaway": tuple(hold)} if kind in ("falls", "firm") else {}
    more |= {"stribeck_speed": v_s} if kind == "falls" else {}
    robot, (matrix, forced) = of(turning, **ellipse((2.2, 1.4), 0.1, **more)), linear(VOLTS)

    def rate(x):
        v, size = x[:2], np.hypot(*x[:2])
        level = levels + (hold - levels) * np.exp(-((size / v_s) ** 2)) * (kind == "falls")
        force = level * v / size if kind == "plain" else level**2 * v / np.hypot(*(level * v))
        turns = x[2] * np.array([x[1], -x[0], 0.0]) * turning
        return matrix @ x + forced - np.append(force, 0.1 * np.sign(x[2])) / MASS + turns

    for start in ((0.3, -0.4, 2.0), (-0.1, 0.5, -3.0), (0.02, 0.03, 1.0)):
        run, (middle, end) = step(robot, VOLTS, 0.01, start), two_stages(rate, start, 0.01)
        assert run.twist[1] == pytest.approx(end, rel=0.0, abs=1e-10)
        assert run.pose[1] == pytest.approx(pose_of(middle, end, 0.01), rel=0.0, abs=1e-12)


@pytest.mark.parametrize("place", ["axes", "direction", "wheels"])
def test_weak_bristles_bend_on_from_step_to_step(place):
    """LuGre's z' = s - sigma0 |s| z/C, of less than a newton in all; in the plane sigma0 D(v) z_a/C_a^2."""
    stiffness, damping, h = 300.0, 5.0, 0.004
    numbers = {"law": "lugre", "stiffness": stiffness, "damping": damping}
    matrix, forced = linear(VOLTS)
    level = np.array({"axes": (0.3, 0.2, 0.03), "direction": (0.3, 0.2), "wheels": (0.2, 0.3, 0.25)}[place])
    if place == "axes":
        stiffness, damping = np.array([300.0, 300.0, 3.0]), np.array([5.0, 5.0, 0.05])
        numbers |= {"stiffness": tuple(stiffness), "damping": tuple(damping)}
        robot, directions = of(**box(tuple(level), **numbers)), np.eye(3)
    elif place == "direction":
        robot, directions = of(**ellipse(tuple(level), **numbers)), np.eye(3)[:, :2]
    else:
        law = WheelFriction(coulomb=tuple(level), **numbers)
        robot, directions = of(**box((0.0, 0.0, 0.0)), wheels=law), G

    def rate(state):
        x, z = state[:3], state[3:]
        speed = directions.T @ x
        size = np.hypot(*(level * speed)) / level if place == "direction" else np.abs(speed)
        bends = speed - stiffness * size * z / level
        force = directions @ (stiffness * z + damping * bends)
        return np.concatenate([matrix @ x + forced - force / MASS, bends])

    run = simulate(robot, [VOLTS.tolist()] * 3, h, twist=(0.1, -0.15, 1.0), tol=None)
    assert "implicit" in run.source
    state = np.concatenate([[0.1, -0.15, 1.0], np.zeros(len(level))])
    for k in range(1, 4):
        state = two_stages(rate, state, h)[1]
        assert run.twist[k] == pytest.approx(state[:3], rel=0.0, abs=1e-9)


# ---- what stops and holds -----------------------------------------------------------------------------------------

AXES = (0, 1)  # along x, and sideways


@pytest.mark.parametrize("share", [0.9, -0.9])
@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("levels", [(2.2, 1.4), (1.4, 2.2)])
def test_each_axis_of_an_ellipse_holds_as_much_as_its_level(axis, levels, share):
    """From rest, and where what slows down is stopped by Coulomb friction: (m v/tau + drive)/C is then `share`."""
    robot, h = of(**ellipse(levels)), 0.03
    force = share * levels[axis]
    assert (step(robot, force / push_along(axis) * PATTERNS[axis], h, np.zeros(3)).twist == 0.0).all()
    speed = 0.5 * force * GAMMA * h / MASS[axis]
    run = step(robot, 0.5 * force / push_along(axis) * PATTERNS[axis], h, speed * np.eye(3)[axis])
    assert (run.twist[1] == 0.0).all()
    more = step(robot, 1.2 * force / push_along(axis) * PATTERNS[axis], h, np.zeros(3)).twist[1]
    expected = sdirk2(
        *linear(1.2 * force / push_along(axis) * PATTERNS[axis], -np.sign(share) * levels[axis] * np.eye(3)[axis]),
        np.zeros(3),
        h,
    )
    assert more == pytest.approx(expected, **NEAR)


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("gap", ["x", "y", "both"])
def test_what_an_ellipse_stops_breakaway_holds(axis, gap):
    """Where one of its levels alone is larger at rest, too: a drive back below S, of 1.9 N where S is C, tears nothing
    loose; one above S does, and then it slides with C."""
    levels = np.array([2.0, 2.0])
    hold = levels + 1.0 * np.array([gap != "y", gap != "x"])
    robot = of(**ellipse(tuple(levels), breakaway=tuple(hold)))
    for h, speed in ((0.5, 0.05), (0.5, -0.05)):
        force = -np.sign(speed) * 0.95 * hold[axis]
        run = step(robot, force / push_along(axis) * PATTERNS[axis], h, speed * np.eye(3)[axis])
        assert (run.twist[1] == 0.0).all()
        assert (step(robot, force / push_along(axis) * PATTERNS[axis], h, np.zeros(3)).twist[1] == 0.0).all()
        volts = 1.1 * np.sign(force) * hold[axis] / push_along(axis) * PATTERNS[axis]
        run = step(robot, volts, h, np.zeros(3))
        expected = sdirk2(*linear(volts, -np.sign(force) * levels[axis] * np.eye(3)[axis]), np.zeros(3), h)
        assert run.twist[1] == pytest.approx(expected, **NEAR)


def test_an_ellipse_at_rest_holds_what_lies_in_it():
    """(Fx/Sx)^2 + (Fy/Sy)^2 <= 1, around its edge."""
    hold = np.array([3.0, 2.0])
    robot = of(**ellipse((2.5, 1.5), breakaway=tuple(hold)))
    for angle in np.linspace(0.1, 6.2, 7):
        force = hold * [np.cos(angle), np.sin(angle)]
        volts = sum(force[axis] / push_along(axis) * PATTERNS[axis] for axis in AXES)
        assert (step(robot, 0.999 * volts, 0.02, np.zeros(3)).twist[1] == 0.0).all()
        moved = step(robot, 1.001 * volts, 0.02, np.zeros(3)).twist[1]
        assert moved[:2] @ force > 0.0


# ---- what reverses ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("gap", ["breakaway", "breakaway_backward"])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_an_axis_that_holds_more_on_one_side_reverses_in_an_euler_step(axis, gap, side):
    """Along x, sideways and about yaw, from forward to backward and back: one Euler step, at whose end it holds up to
    the S of the side to which it is driven, or slides with C."""
    levels = np.array([2.0, 1.5, 0.1])
    hold = {"breakaway": tuple(levels), "breakaway_backward": tuple(levels)} | {gap: tuple(1.5 * levels)}
    robot, h = of(**box(tuple(levels), **hold)), 0.05
    is_held = gap == ("breakaway_backward" if side > 0.0 else "breakaway")  # a force of 1.25 C lies below its S
    start = side * np.array([0.03, 0.03, 0.1])[axis] * np.eye(3)[axis]
    for force in (1.25, 1.75):
        drive = -side * force * levels[axis] - MASS[axis] * start[axis] / h
        volts = drive / push_along(axis) * PATTERNS[axis]
        expected = euler(*linear(volts, side * levels[axis] * np.eye(3)[axis]), start, h)
        assert side * expected[axis] < 0.0
        expected *= 0.0 if is_held and force < 1.5 else 1.0
        assert step(robot, volts, h, start).twist[1] == pytest.approx(expected, **NEAR)


def test_the_other_axes_take_the_same_euler_step():
    """What slides on does so by Euler, too, where one axis reverses or stops."""
    levels, hold, h = np.array([2.0, 1.5, 0.1]), (3.0, 2.5, 0.15), 0.05
    robot = of(**box(tuple(levels), breakaway=hold))
    for push, x, signs in ((-4.4, 0.03, [-1, 1, 1]), (-2.9, 0.03, [0, 1, 1])):
        volts, start = push / push_along(0) * PATTERNS[0] + 2.0 * PATTERNS[1], np.array([x, 0.3, 2.0])
        matrix, forced = linear(volts, -levels * signs)
        free = np.flatnonzero(signs)
        expected = np.zeros(3)
        expected[free] = euler(matrix[np.ix_(free, free)], forced[free], start[free], h)
        assert (np.sign(expected) == signs).all()
        assert step(robot, volts, h, start).twist[1] == pytest.approx(expected, **NEAR)


@pytest.mark.parametrize("holds_more", [False, True])
def test_wheels_that_reverse(holds_more):
    """Driven back along x, both wheels that roll: Euler where they hold more than they slide with; else each stage of
    SDIRK2 by the signs that it ends with."""
    level, h = 0.8, 0.05
    law = WheelFriction(coulomb=level, **({"breakaway": 1.2} if holds_more else {}))
    robot = of(**box((0.0, 0.0, 0.0)), wheels=law)
    volts, start = -4.0 * PATTERNS[0], np.array([0.05, 0.0, 0.0])
    matrix, forced = linear(volts, -G @ (level * np.array([0.0, -1.0, 1.0])))
    if holds_more:
        expected = euler(matrix, forced, start, h)
    else:
        first = euler(matrix, forced, start, GAMMA * h)
        assert first[0] < 0.0
        expected = euler(matrix, forced, start + BACK * (first - start), GAMMA * h)
    assert expected[0] < 0.0
    assert step(robot, volts, h, start).twist[1] == pytest.approx(expected, **NEAR)


@pytest.mark.parametrize("place", ["axes", "direction"])
def test_what_falls_reverses_without_a_gap(place):
    """A level that falls with the speed leaves no gap: SDIRK2, each stage under the level of its end."""
    slide, hold, v_s, h = 2.0, 3.0, 0.4, 0.05
    if place == "axes":
        friction = box((slide, slide, 0.1), breakaway=(hold, hold, 0.1), stribeck_speed=(v_s,) * 3)
    else:
        friction = ellipse((slide,) * 2, breakaway=(hold,) * 2, stribeck_speed=v_s)
    volts = -5.0 * PATTERNS[0]
    matrix, forced = linear(volts)

    def rate(x):
        level = slide + (hold - slide) * np.exp(-((x[0] / v_s) ** 2))
        return matrix @ x + forced + level * np.eye(3)[0] / MASS

    middle, end = two_stages(rate, (0.03, 0.0, 0.0), h)
    assert middle[0] < 0.0
    assert end[0] < 0.0
    assert step(of(**friction), volts, h, (0.03, 0.0, 0.0)).twist[1] == pytest.approx(end, rel=0.0, abs=1e-10)


@pytest.mark.parametrize("place", ["axes", "direction", "wheels"])
def test_what_gives_way_sideways_in_a_step_too_long_for_its_currents(place):
    """h R/L > 1 + sqrt 2: an Euler step of speeds and currents; just below it SDIRK2."""
    inductance, level = 1e-2, 1.5
    friction = {
        "axes": box((level, level, 0.1)),
        "direction": ellipse((level, level), 0.1),
        "wheels": box((0.0, 0.0, 0.0)) | {"wheels": WheelFriction(coulomb=0.5)},
    }[place]
    robot = of(**friction)
    robot = robot.replace(motor=robot.motor.replace(electrical="dynamic", inductance=inductance))
    volts, resists = (
        5.0 * PATTERNS[1],
        -G @ (0.5 * np.sign(PATTERNS[1])) if place == "wheels" else -level * np.eye(3)[1],
    )
    matrix = np.block(
        [
            [-np.diag(VISCOUS / MASS), G * GAIN / MASS[:, None]],
            [-GAIN * G.T / inductance, -np.eye(3) * RESISTANCE / inductance],
        ]
    )
    forced = np.concatenate([resists / MASS, volts / inductance])
    limit = (1.0 + np.sqrt(2.0)) * inductance / RESISTANCE
    for h, method in ((1.02 * limit, euler), (0.98 * limit, sdirk2)):
        run, expected = step(robot, volts, h, np.zeros(3)), method(matrix, forced, np.zeros(6), h)
        assert run.twist[1] == pytest.approx(expected[:3], rel=0.0, abs=1e-10)
        assert run.current[1] == pytest.approx(expected[3:], rel=0.0, abs=1e-10)


# ---- Karnopp's band ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("place", ["axes", "direction"])
@pytest.mark.parametrize("axis", AXES)
def test_momentum_gathers_in_the_band_until_it_is_left(axis, place):
    """M w' = drive - S while nothing moves; at w = Dv it moves, and slides with C from there."""
    slide, hold, band, h, drive = 2.0, 2.5, 0.0301, 2e-3, 4.0
    if place == "axes":
        friction = box((slide,) * 3, breakaway=(hold,) * 3, law="karnopp", karnopp_speed=(band, band, 10.0))
    else:
        friction = ellipse((slide,) * 2, breakaway=(hold,) * 2, law="karnopp", karnopp_speed=band)
    volts = drive / push_along(axis) * PATTERNS[axis]
    run = simulate(of(**friction), [volts.tolist()] * 20, h, tol=None)
    gathered = (drive - hold) / MASS[axis] * h
    rows = int(np.ceil(band / gathered))
    assert 5 < rows < 19
    assert (run.twist[:rows] == 0.0).all()
    assert run.twist[rows] == pytest.approx(rows * gathered * np.eye(3)[axis], **NEAR)
    expected = sdirk2(*linear(volts, -slide * np.eye(3)[axis]), run.twist[rows], h)
    assert run.twist[rows + 1] == pytest.approx(expected, **NEAR)


def test_a_band_beside_what_sticks():
    """Wheels that stick by themselves hold a body in its band, too, until both together give way."""
    band = AxesFriction(viscous=tuple(VISCOUS), coulomb=(1.0, 1.0, 0.0), law="karnopp", karnopp_speed=(0.01,) * 3)
    robot = of(axes=band, wheels=WheelFriction(coulomb=0.5))
    holds = 1.0 + 0.5 * 2.0 * SQRT
    for share, rests in ((0.98, True), (1.3, False)):
        volts = share * holds / push_along(0) * PATTERNS[0]
        run = simulate(robot, [volts.tolist()] * 9, 4e-3, tol=None)
        assert (run.twist[1:] == 0.0).all() == rests
        if not rests:
            first = int(np.flatnonzero(run.twist[:, 0])[0])
            assert run.twist[first, 0] == pytest.approx(first * 4e-3 * (share - 1.0) * holds / 1.5, rel=1e-9)
