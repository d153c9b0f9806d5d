"""Every candidate of a diagnosis, on robots of three to six wheels: each is simulated, and each that fits can hold
begins to be fitted.

Logs of benchmarks/ten_robots/world.py, which shares no code with simulation/.
"""

import numpy as np
import pytest

from benchmarks.ten_robots.world import World, currents, drive
from omnidyn.identification.lack_of_fit import Remedy
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.engines.implicit import ImplicitEngine
from omnidyn.identification.output_error.fit import Fit
from omnidyn.identification.output_error.linear.driven_motion import motions
from omnidyn.identification.output_error.linear.workbench import Workbench
from omnidyn.identification.structure.missing import refits
from omnidyn.identification.structure.missing.candidates import CHANGE
from omnidyn.identification.structure.missing.laws import candidates
from omnidyn.identification.structure.missing.rivals import unoffered
from omnidyn.identification.structure.missing.switches import switches
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.motor import Motor
from omnidyn.model.robot import Body, Robot
from omnidyn.model.wheels import Wheels
from omnidyn.run import Run

ROWS, DT = 84, 0.02
COULOMB, VISCOUS = (5.0, 4.0, 0.3), (1.2, 1.2, 0.03)
FRICTION = {
    "axes": Friction(axes=AxesFriction(coulomb=COULOMB, viscous=VISCOUS)),
    "direction": Friction(direction=DirectionFriction(coulomb=COULOMB[:2], viscous=1.2, yaw_coulomb=0.3)),
    "wheels": Friction(wheels=WheelFriction(coulomb=1.2, viscous=0.4)),
}
MECANUM = (90.0, -90.0, 90.0, -90.0), (-45.0, 45.0, 45.0, -45.0)
LAYOUTS = {
    **{f"{n} omni": (tuple(360.0 / n * (k + 0.5) for k in range(n)), (0.0,) * n) for n in (3, 4, 5, 6)},
    "4 mecanum": MECANUM,
    "6 mecanum": (MECANUM[0] + (90.0, -90.0), MECANUM[1] + (-45.0, 45.0)),
}
PLACES = {"3 omni": "axes", "4 omni": "direction", "5 omni": "wheels", "6 omni": "axes"}
PLACES |= {"4 mecanum": "direction", "6 mecanum": "wheels"}


def robot_of(layout, place):
    azimuth, roller = LAYOUTS[layout]
    return Robot(
        name="mine",
        body=Body(mass=4.0, inertia=0.05),
        wheels=Wheels(azimuth_deg=azimuth, roller_angle_deg=roller, wheel_radius=0.04, robot_radius=0.15),
        motor=Motor(resistance=2.1, torque_constant=0.016, emf_constant=0.016, gear_ratio=25.0, voltage_limit=12.0),
        friction=FRICTION[place],
        priors={},
    )


def log_of(layout, every=False):
    """Ramps from rest, of more friction than any file has. every: by all sensors that a fit knows."""
    azimuth, roller = LAYOUTS[layout]
    n = len(azimuth)
    world = World(
        azimuth, (0.04,) * n, (0.15,) * n, 4.0, 0.05, 2.1, 0.016, 25.0, 12.0, (8.0, 6.0, 0.5), VISCOUS, roller=roller
    )
    ways = np.array([[1.0, 0.4, 1.5], [-0.5, 1.0, 1.0], [0.3, 0.0, 3.0]])  # of travel, and turning
    part, row = np.divmod(np.arange(ROWS), 14)
    volts = (0.8 * np.maximum(row - 4.0, 0.0) * (-1.0) ** part)[:, None] * (ways @ world.G)[part % 3]
    moved = drive(world, volts, DT)
    held = np.concatenate([moved.voltage, moved.voltage[-1:]])
    random = np.random.default_rng(5)
    pose = moved.pose + 2e-3 * random.normal(size=moved.pose.shape)
    log = Run(t=moved.t, voltage=held, pose=pose, wheel_angle=moved.path @ world.G / 0.04, source="log")
    if not every:
        return log
    twist = moved.twist + 2e-3 * random.normal(size=moved.twist.shape)
    speed = moved.twist @ world.G / 0.04
    return log.replace(twist=twist, wheel_speed=speed, current=currents(world, moved.twist, held))


def begun(layout, every=False):
    """A fit that has hardly begun, its workbench, and all that is tried of it."""
    fit = Fit.of([log_of(layout, every)], robot_of(layout, PLACES[layout]), OutputError(nuisances=("latency",)))
    solver = fit.solver(("latency",))
    solution = solver.minimise(solver.problem.start(), limit=0)
    problem, point = solution.solver.problem, solution.state.point
    bench = Workbench(problem, point, type(solver.engine), motions(problem, point), (0.5,))
    return solution, bench, [*candidates(bench), *unoffered()]


@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_candidate_is_simulated(layout):
    """Also of a log that begins at rest, of which no start is free."""
    check_simulated(*begun(layout))


@pytest.mark.long
@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_candidate_is_simulated_beside_all_sensors(layout):
    check_simulated(*begun(layout, every=True))


def check_simulated(solution, bench, every):
    """A column for each row and sensor, all finite, and at least one that is not zero."""
    shapes = [residual.shape for residual, _, _ in solution.solver.engine.residuals(solution.state.point)]
    for one in every:
        trials = one.trials(bench)
        for own, shape in [
            (own, shape) for trial in trials for own, shape in zip(trial.columns_by_piece, shapes, strict=True)
        ]:
            assert own.shape[:2] == shape, one.key
            assert np.isfinite(own).all(), one.key
        shows = any(own.any() for trial in trials for own in trial.columns_by_piece)
        assert shows or one.key == "filter", one.key  # which speeds show, and counts do not


@pytest.mark.long
@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_candidate_that_a_fit_can_hold_begins_to_be_fitted(layout):
    """Its numbers begin where its column has them, and what it shows there is finite."""
    solution, bench, every = begun(layout)
    problem, parts = bench.problem, solution.solver.engine.residuals(solution.state.point)
    off = {ImplicitEngine: refits._by_coarse_steps(problem, parts, solution.state.point, ImplicitEngine)}
    for one in every:
        if not one.is_offered or one.key == CHANGE:
            continue
        for trial in one.trials(bench)[:1]:
            remedy = Remedy(one.key, "", 0.0, 0.0, size=(0.02,) * trial.columns_by_piece[0].shape[2], at=trial.at)
            for way in switches(remedy, problem.robot, refits._question(problem), solution):
                start = refits._begun(one, way, problem, solution, off)
                assert np.isfinite(start.state.objective), one.key
                for own in refits._trial(start, problem, parts, solution).columns_by_piece:
                    assert np.isfinite(own).all(), one.key
