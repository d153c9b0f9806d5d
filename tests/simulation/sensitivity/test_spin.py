"""Derivatives by rotor and wheel inertia, and by what else now moves the mass: gear ratio, radii.

Against differences of whole runs of the exact engine and of the reference, as in test_derivatives.py.
"""

import numpy as np
import pytest

from omnidyn.model.friction import DirectionFriction, Friction, WheelFriction
from omnidyn.model.keys import ROTOR, WHEEL, Key
from omnidyn.simulation.sensitivity.derivatives import derivatives
from omnidyn.simulation.simulate import simulate
from tests.reference.modes import reference
from tests.support.run_differences import AGREES, BODY, differences, held, worst

KEYS = [ROTOR, WHEEL, "motor.gear_ratio", *BODY]
TURNING = held((20, [1, 5, -3]), (25, [2, -4, 5]), (15, [0, 0, 0]), (15, [-3, 1, 4]))


@pytest.fixture
def heavy(axebot):
    """The paper's robot with rotors of 13 % and wheels of 4 % of its mass: its axes do not couple."""
    motor, wheels = axebot.motor.replace(rotor_inertia=4.4e-7), axebot.wheels.replace(wheel_inertia=5e-5)
    return axebot.replace(name="heavy", motor=motor, wheels=wheels)


@pytest.fixture
def unequal(heavy):
    """Each wheel its own inertia, and all else that the implicit engine knows."""
    return heavy.replace(
        name="unequal",
        body=heavy.body.replace(rotating_frame=True),
        motor=heavy.motor.replace(rotor_inertia=(4.4e-7, 9e-7, 2e-7), current_limit=1.3),
        wheels=heavy.wheels.replace(wheel_radius=(0.035, 0.036, 0.034)),
        friction=Friction(
            direction=DirectionFriction(coulomb=(1.2, 0.8), viscous=0.5, yaw_coulomb=0.04, yaw_viscous=0.005),
            wheels=WheelFriction(coulomb=(0.3, 0.2, 0.25), viscous=0.1),
        ),
    )


def check(run, robot, keys, width, program=TURNING, **start):
    """Largest error of twist and pose, relative to the largest value of each derivative."""
    found = derivatives(robot, program, 0.01, keys, tol=1e-8, **start)
    for j, key in enumerate(keys):
        twist, pose, _ = differences(run, robot, key, width)
        errors = worst(found.twist[..., j], twist), worst(found.pose[..., j], pose)
        print(f"{robot.name:10} {key:32} twist {errors[0]:.1e} pose {errors[1]:.1e}")
        assert max(errors) <= AGREES, key
    return found


def test_against_the_exact_engine(heavy):
    """Stops, rests and reversals."""
    run = lambda r: simulate(r, TURNING, 0.01, twist=(0.3, -0.2, 2.0))  # noqa: E731
    assert "exact" in run(heavy).source
    found = check(run, heavy, KEYS, 3e-4, twist=(0.3, -0.2, 2.0))
    assert (found.twist[found.run.twist == 0.0] == 0.0).all()
    assert (found.run.twist[45:60] == 0.0).any()


@pytest.mark.long
def test_against_the_modes(unequal):
    """A mass that couples the axes, wheels that stop and reverse, a current limit, a turning frame."""
    keys = [f"{ROTOR}[1]", f"{WHEEL}[2]", "motor.gear_ratio", "motor.gear_ratio[0]", "wheels.wheel_radius_m[1]"]
    keys += ["wheels.robot_radius_m", "body.mass_kg", "body.inertia_kg_m2", "friction.wheels.coulomb[2]"]
    check(lambda r: reference(r, TURNING, 0.01), unequal, keys, 1e-4)


def test_a_centre_of_mass_beside_the_wheels(unequal):
    """By where it is, and by what else moves then: the reference knows the equations of the centre of mass alone."""
    wheels = Friction(wheels=WheelFriction(coulomb=(0.3, 0.2, 0.25), viscous=0.1))
    robot = unequal.replace(
        name="beside",
        friction=wheels,
        body=unequal.body.replace(centre=(0.03, -0.05)),
    )
    keys = ["body.centre_m[0]", "body.centre_m[1]", "body.mass_kg", "body.inertia_kg_m2", f"{ROTOR}[1]"]
    check(lambda r: reference(r, TURNING, 0.01), robot, keys, 1e-4)


@pytest.mark.parametrize("volts, omega", [((0.6, 0.7, -1.4), 1.0), ((0.5, 2.0, -2.8), 2.3)])
@pytest.mark.some(1)
def test_a_stop_that_lets_another_axis_go(axebot, volts, omega):
    """While it slows down, yaw holds y against what drives it, and lets it go as it stops: one instant for both."""
    robot = axebot.replace(body=axebot.body.replace(centre=(0.06, 0.0)))
    rows, start = np.tile(volts, (60, 1)), (0.3, 0.0, omega)
    run = simulate(robot, rows, 0.005, twist=start)
    stops = int(np.flatnonzero((run.twist[:-1, 2] != 0.0) & (run.twist[1:, 2] == 0.0))[0])
    assert (run.twist[:stops, 1] == 0.0).all()
    assert (run.twist[stops + 1 :, 1] != 0.0).all()
    keys = ["friction.axes.coulomb[1]", "friction.axes.coulomb[2]", "body.centre_m[0]", "body.inertia_kg_m2"]
    found = derivatives(robot, rows, 0.005, keys, twist=start, tol=1e-8)
    for j, key in enumerate(keys):
        twist, pose, _ = differences(lambda r: reference(r, rows, 0.005, twist=start), robot, key, 1e-5)
        assert max(worst(found.twist[..., j], twist), worst(found.pose[..., j], pose)) <= 1e-4, key


def test_a_first_step_of_the_centre_from_the_middle(unequal):
    """From 0, where the number has no size of its own: central differences of whole runs."""
    found = derivatives(unequal, TURNING[:20], 0.01, ["body.centre_m[0]", "body.centre_m[1]"], tol=1e-9)
    for k in range(2):
        up, down = (
            simulate(
                unequal.replace(body=unequal.body.replace(centre=tuple(np.eye(2)[k] * each))),
                TURNING[:20],
                0.01,
                tol=1e-9,
            ).twist
            for each in (1e-4, -1e-4)
        )
        assert worst(found.twist[..., k], (up - down) / 2e-4) <= 1e-4


@pytest.mark.long
def test_dynamic_electrics(unequal):
    motor = unequal.motor.replace(electrical="dynamic", inductance=0.004)
    keys = [f"{ROTOR}[0]", "motor.gear_ratio", "motor.inductance_H"]
    robot, program = unequal.replace(name="dynamic", motor=motor), TURNING[:40]
    check(lambda r: reference(r, program, 0.01), robot, keys, 1e-4, program)


def test_the_fixed_step_is_the_derivative_of_its_map(unequal):
    run = lambda r: simulate(r, TURNING, 0.01, tol=None)  # noqa: E731
    found = derivatives(unequal, TURNING, 0.01, [f"{ROTOR}[1]", "motor.gear_ratio"], tol=None)
    for j, key in enumerate(found.keys):
        assert worst(found.twist[..., j], differences(run, unequal, key, 1e-5)[0]) <= 1e-6


@pytest.mark.parametrize("key", [ROTOR, WHEEL, f"{ROTOR}[1]"])
def test_of_what_is_absent(axebot, key):
    """A robot without rotors: how a first one would move it, from one side (Richardson)."""
    program = held((20, [1, 5, -3]))
    found = derivatives(axebot, program, 0.01, [key], tol=1e-9)
    step = 1e-3 * 1.5 * 0.035**2 / (1.0 if key == WHEEL else 19.0**2)
    run = lambda value: simulate(Key.parse(key).set(axebot, value), program, 0.01, tol=1e-9).twist  # noqa: E731
    values = [run(k * step) for k in range(4)]
    expected = (-11.0 * values[0] + 18.0 * values[1] - 9.0 * values[2] + 2.0 * values[3]) / (6.0 * step)
    assert worst(found.twist[..., 0], expected) <= AGREES


def test_one_wheel_after_the_other_is_all(heavy):
    found = derivatives(heavy, TURNING[:20], 0.01, [ROTOR, *(f"{ROTOR}[{w}]" for w in range(3))])
    np.testing.assert_allclose(found.twist[..., 1:].sum(axis=-1), found.twist[..., 0], rtol=1e-6)
