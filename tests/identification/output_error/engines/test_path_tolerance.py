"""The tolerance of a run whose path is fitted, by the noise of its sensors."""

import numpy as np
import pytest

from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.engines.implicit import PATH_TOLERANCES, ImplicitEngine, path_tolerance
from omnidyn.identification.output_error.prepare import make_problem, read_records
from omnidyn.model.friction import DirectionFriction, Friction
from omnidyn.run import Run

ROWS = 400


def problem_of(axebot, **outputs):
    direction = DirectionFriction(coulomb=(2.2, 1.5), viscous=0.95, yaw_coulomb=0.099, yaw_viscous=0.01)
    robot = axebot.replace(friction=Friction(direction=direction))
    voltage = np.random.default_rng(1).normal(size=(ROWS, 3))
    question = OutputError(nuisances=())
    records = read_records([Run(t=0.01 * np.arange(ROWS), voltage=voltage, **outputs)], robot, question)
    return make_problem(records, robot, question)


def paths(noise):
    """A motion of 0.3 m/s along x with this noise [m], as a pose."""
    rng = np.random.default_rng(2)
    pose = np.zeros((ROWS, 3))
    pose[:, 0] = 0.3 * np.sin(2.0 * np.pi * 0.01 * np.arange(ROWS))
    return {"pose": pose + noise * rng.normal(size=pose.shape) * [1.0, 1.0, 10.0]}


def test_it_grows_with_the_noise_and_stays_between_its_bounds(axebot):
    tols = [path_tolerance(problem_of(axebot, **paths(noise))) for noise in (1e-7, 1e-4, 2e-4, 1.0)]
    assert tols[0] == PATH_TOLERANCES[0]
    assert tols[3] == PATH_TOLERANCES[1]
    assert tols[2] == pytest.approx(2.0 * tols[1], rel=0.15)
    assert tols[0] < tols[1] < tols[2] < tols[3]


def test_speeds_keep_what_is_asked_for_and_stages_of_a_path_differ(axebot):
    speeds = problem_of(axebot, wheel_speed=np.random.default_rng(3).normal(size=(ROWS, 3)))
    assert ImplicitEngine.of(speeds, 1e-5).tol == 1e-5
    assert ImplicitEngine.of(speeds).tol is None
    path = problem_of(axebot, **paths(1e-7))
    assert ImplicitEngine.of(path, 1e-5).tol == pytest.approx(1e-6)
    assert ImplicitEngine.of(path, 3e-4).tol == pytest.approx(3e-5)
