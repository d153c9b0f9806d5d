"""Forces from outside on robots that only the implicit engine fits: a tilted floor, a constant push."""

import numpy as np
import pytest

from benchmarks.wrong_worlds.log import SPEEDS, logged, right_case, robot_of, truths
from omnidyn.errors import UnsupportedError
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.engines.implicit import ImplicitEngine, SlipEngine
from omnidyn.identification.output_error.prepare import make_problem
from omnidyn.identification.output_error.problem.problem import Point
from omnidyn.identification.output_error.problem.record import record
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction
from omnidyn.model.log_effects import LogEffects
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import voltages

PUSH, TILT = (0.31, -0.22, 0.013), (0.41, -0.32)
CENTRE = ("body.centre_m[0]", "body.centre_m[1]")
KEYS = ("friction.direction.coulomb[0]", "friction.direction.viscous", "body.mass_kg", "body.inertia_kg_m2", *CENTRE)


@pytest.fixture(scope="module")
def robot(axebot):
    """An ellipse and a current limit in a turning frame, the centre of mass beside that of the wheels."""
    direction = DirectionFriction(coulomb=(2.2, 1.5), viscous=0.95, yaw_coulomb=0.099, yaw_viscous=0.01)
    return axebot.replace(
        body=axebot.body.replace(rotating_frame=True, centre=(0.01, -0.02)),
        friction=Friction(direction=direction),
        motor=axebot.motor.replace(current_limit=2.0),
    )


def test_at_its_current_limit_a_push_adds_to_the_force_of_the_motors(axebot):
    """Closed form: at |i| = i_max and without viscous friction M v' = F_max + push - C. Volts could not push so."""
    robot = axebot.replace(
        motor=axebot.motor.replace(current_limit=1.0),
        friction=Friction(axes=AxesFriction(viscous=(0.0,) * 3, coulomb=(1.0,) * 3)),
    )
    run = simulate(robot, np.tile([0.0, 6.0, -6.0], (20, 1)), 0.01, log=LogEffects(push=(0.7, 0.0, 0.0)), tol=1e-8)
    motors = 2.0 * np.cos(np.radians(30.0)) * 1.0 * robot.motor.torque_constant * robot.motor.gear_ratio
    force = motors / robot.wheels.wheel_radius + 0.7 - 1.0
    assert np.abs(run.current[:-1, 1]) == pytest.approx(1.0)
    np.testing.assert_allclose(run.twist[:, 0], force / robot.body.mass * run.t, atol=1e-7)


def a_log(robot, push=(0.0, 0.0, 0.0), tilt=(0.0, 0.0), seed=3, duration=6.0):
    """What simulate says, which turns the force as the robot turns."""
    voltage = voltages(np.random.default_rng(seed), duration)
    return simulate(robot, voltage[:-1], 0.01, log=LogEffects(push=push, tilt=tilt), tol=1e-8)


def problem_of(robot, run):
    asked = OutputError(free=KEYS, start="rest", nuisances=("push", "tilt"), outputs=("twist", "pose"))
    return make_problem([record(run, robot, ("twist", "heading"))], robot, asked)


def test_residuals_and_slopes(robot):
    """Residuals beside simulate, which shares the step but neither derivatives nor how a log turns the force; slopes by
    differences."""
    run = a_log(robot, PUSH, TILT, duration=3.0)
    problem = problem_of(robot, run)
    values = dict(zip([f"push.{axis}" for axis in ("x", "y", "yaw")], PUSH, strict=True))
    values |= dict(zip(["tilt.x", "tilt.y"], TILT, strict=True))
    truth = np.array([values.get(p.name, p.value) for p in problem.parameters])
    point = Point(truth, tuple(np.zeros_like(s) for s in problem.start().states))
    engine = ImplicitEngine(problem, 1e-8)
    ((residual, slopes, at),) = engine.residuals(point)
    assert np.nanmax(np.abs(residual)) < 1e-3  # the force is turned once a row
    off = []
    for k in range(len(truth)):
        size = 2e-4 * max(abs(truth[k]), 0.1)
        up, down = (
            engine._simulated(Point(truth + side * size * np.eye(len(truth))[k], point.states))[0][0]
            for side in (1.0, -1.0)
        )
        by, expected = -slopes[:, :, list(at).index(k)], (up - down) / (2.0 * size)
        off.append(float(np.nanquantile(np.abs(by - expected), 0.99) / np.nanmax(np.abs(expected))))
    print(dict(zip(problem.names, np.array(off).round(7), strict=True)))
    assert max(off) < 2e-4


@pytest.mark.parametrize("seed", [2, 8])
def test_logs_of_another_simulator_on_a_slope(seed):
    """A turning frame, so that no exact engine serves; the robot turns, and the other simulator turns the force."""
    case = right_case(3 * seed + 2).setup_but(sensor=SPEEDS, memory=0.0, rate=50.0)
    assert case.told.frame
    pull = (1.1, -0.7)
    run, robot = logged(case.world_but(pull=pull), 500 + seed), robot_of(case.told)
    fit = identify(run, robot, OutputError(nuisances=("tilt",))).estimate
    truth = truths(case.told, case.told.shape)
    z = [abs(fit.value[key] - true) / fit.std[key] for key, true in truth.items()]
    z += [
        abs(fit.nuisances[f"tilt.{axis}"].value - own) / fit.nuisances[f"tilt.{axis}"].std
        for axis, own in zip("xy", pull, strict=True)
    ]
    print(np.round(z, 2))
    assert max(z) < 4.0
    assert all(abs(own.value) > 10.0 * own.std for own in fit.nuisances.values())
    assert fit.robot.log.tilt == pytest.approx(pull, abs=0.1)


def test_wheels_that_slip_know_no_such_force(robot):
    slips = robot.replace(
        wheels=robot.wheels.replace(traction_mu=0.4, wheel_inertia=2e-5), motor=robot.motor.replace(current_limit=None)
    )
    run = a_log(robot)
    with pytest.raises(UnsupportedError, match=r"does not know all that is asked for; got push\.x, push\.y, push\.yaw"):
        SlipEngine(problem_of(slips, run))
