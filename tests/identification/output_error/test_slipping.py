"""Fits to robots whose wheels slip: the friction coefficient and the rest, from logs of the event-driven reference."""

import numpy as np
import pytest

from omnidyn import check
from omnidyn.errors import UnsupportedError
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.engines.implicit import ImplicitEngine, SlipEngine
from omnidyn.identification.output_error.linear.driven_motion import motions
from omnidyn.identification.output_error.moved_axes import motion
from omnidyn.identification.output_error.prepare import FINE_TOLERANCE, make_problem, read_records
from omnidyn.identification.output_error.problem.problem import Point
from omnidyn.identification.structure.missing import laws
from omnidyn.model.keys import Key
from omnidyn.model.robot_file import load_robot
from omnidyn.model.surroundings import GRAVITY
from omnidyn.report.figures.dead_zone_section import dead_zone_section
from omnidyn.run import Run
from omnidyn.simulation.slip.plant import wheel_loads
from tests.support.codes import codes
from tests.support.slipping import Slip

AXEBOT = load_robot("axebot")
DT, MU = 0.02, 0.35
ROBOT = AXEBOT.replace(wheels=AXEBOT.wheels.replace(traction_mu=MU, wheel_inertia=2e-5))
NOISE = {"twist": np.array([0.005, 0.005, 0.025]), "wheel_speed": 0.1}  # [m/s, m/s, rad/s], [rad/s]


def log(seed, seconds, noisy=True, robot=ROBOT):
    """Starts in every direction, hard enough to slip, and stops: by DOP853 from event to event."""
    rng, moves = np.random.default_rng(seed), []
    while sum(map(len, moves)) * DT < seconds:
        way = rng.uniform(0.0, 2.0 * np.pi)
        rim = np.array([np.cos(way), np.sin(way), rng.uniform(-0.1, 0.1)]) @ AXEBOT.wheels.wrench_matrix
        moves += [np.tile(rng.uniform(2.0, 6.0) * rim / np.abs(rim).max(), (20, 1)), np.zeros((10, 3))]
    voltage = np.concatenate(moves)
    twist, rims, contact = Slip(robot, wheel_loads(robot).newtons).run(voltage, DT)
    assert robot is not ROBOT or 0.2 < (contact != 0.0).mean() < 0.8
    seen = {"twist": twist, "wheel_speed": rims / ROBOT.wheels.radii}
    noise = {name: noisy * NOISE[name] * rng.normal(size=each.shape) for name, each in seen.items()}
    rows = min(len(each) for each in seen.values())
    return Run(
        t=np.arange(rows) * DT,
        voltage=np.concatenate([voltage, voltage[-1:]])[:rows],
        **{name: (each + noise[name])[:rows] for name, each in seen.items()},
    )


@pytest.fixture(scope="module")
def fit():
    axes = ROBOT.friction.axes.replace(coulomb=(3.0, 2.0, 0.13), viscous=(1.3, 0.7, 0.014))
    guess = ROBOT.replace(wheels=ROBOT.wheels.replace(traction_mu=0.45), friction=ROBOT.friction.replace(axes=axes))
    return identify(
        log(1, 6.0),
        guess,
        OutputError(free=("friction", "wheels.traction_mu"), outputs=("twist", "wheel_speed"), nuisances=()),
    ).estimate


def test_what_the_floor_takes_comes_back_with_the_friction(fit):
    for name, value in fit.value.items():
        assert abs(value - Key.parse(name).get(ROBOT)) < 4.0 * fit.std[name], name
    assert fit.std["wheels.traction_mu"] < 0.002


def test_a_right_model_of_wheels_that_slip_is_found_right(fit):
    assert not fit.lack_of_fit.found
    viscous = fit.rests_on["friction.axes.viscous[0]"]
    assert 0.1 < abs(viscous["motor.resistance_ohm"]) < 10.0
    assert abs(viscous["wheels.inertia_kg_m2"]) < 0.1  # [percent per percent]: light wheels


@pytest.mark.long
def test_a_wrong_mass_is_found_though_wheels_slip():
    heavy = ROBOT.replace(body=ROBOT.body.replace(mass=1.4 * ROBOT.body.mass))
    wrong = identify(
        log(1, 1.5),
        heavy,
        OutputError(free=("friction", "wheels.traction_mu"), outputs=("twist", "wheel_speed"), nuisances=()),
    ).estimate
    assert wrong.lack_of_fit.found


def test_a_wrong_mass_is_fitted_by_default_though_no_constant_force_can_be_tried():
    """Coloured errors ask for one, and the engine of wheels that slip knows none: it ended in a refusal."""
    heavy = ROBOT.replace(body=ROBOT.body.replace(mass=1.4 * ROBOT.body.mass))
    estimate = identify(log(2, 1.5), heavy, OutputError(free="friction"), quick=True).estimate
    assert not [name for name in estimate.nuisances if name.startswith(("push", "tilt"))]


def test_which_wheels_roll_is_seen_as_the_reference_has_it():
    run = log(2, 3.0, noisy=False)
    question = OutputError(
        free=("friction.axes.coulomb[0]",), outputs=("twist", "wheel_speed"), nuisances=(), start="rest"
    )
    problem = make_problem(read_records([run], ROBOT, question), ROBOT, question)
    (moved,) = motions(problem, problem.start())
    _, _, contact = Slip(ROBOT, wheel_loads(ROBOT).newtons).run(run.voltage[:-1], DT)
    assert (moved.rolls == (contact[: len(moved.rolls)] == 0.0)).mean() > 0.97


def test_its_page_leaves_out_what_nobody_knows_of_wheels_that_slip(fit):
    html = dead_zone_section({"": fit.robot}).content
    assert "not worked out" in html


def test_check_takes_the_wheels_to_grip_at_rest():
    """A robot that is driven hard and stands is blocked, whatever its wheels might do on the move."""
    run = log(2, 6.0, noisy=False)
    held = run.t > 4.0
    still = {name: np.where(held[:, None], 0.0, getattr(run, name)) for name in ("twist", "wheel_speed")}
    assert "blocked" in {finding.code for finding in check(run.replace(**still), ROBOT).findings}


def test_derivatives_are_those_of_the_runs_themselves():
    """Its run is that of the reference; a number moved by a hundredth of a percent leads to as exact a run."""
    run = log(2, 1.5, noisy=False)
    keys = ("friction.axes.coulomb[0]", "friction.axes.viscous[1]", "wheels.traction_mu")
    question = OutputError(free=keys, outputs=("twist", "wheel_speed"), nuisances=(), start="rest")
    problem = make_problem(read_records([run], ROBOT, question), ROBOT, question)
    engine, point = ImplicitEngine.of(problem, FINE_TOLERANCE), problem.start()
    assert isinstance(engine, SlipEngine)
    ((residual, slopes, at),) = engine.residuals(point)
    assert np.nanmax(np.abs(residual[:3])) < 2e-5
    for k in np.flatnonzero(at < len(problem.parameters)):
        step = np.zeros_like(point.values)
        step[at[k]] = 1e-4 * point.values[at[k]]
        (up, _, _), (down, _, _) = (engine.residuals(Point(point.values + s * step, point.states))[0] for s in (1, -1))
        expected = -(up - down) / (2.0 * step[at[k]])
        off = np.abs(slopes[:, :, k] - expected)
        assert np.nanmedian(off) < 1e-3 * np.nanmax(np.abs(expected))


def test_a_speed_loop_with_wheels_that_slip_is_refused():
    run = log(2, 1.5)
    looped = ROBOT.replace(drive=ROBOT.drive.replace(kind="speed", kp=0.1, ki=1.0, rate=100.0))
    with pytest.raises(UnsupportedError, match="slip"):
        identify(run.replace(voltage=None, wheel_speed_command=run.wheel_speed), looped, OutputError())


def test_what_an_axis_has_held_is_no_more_than_the_floor_takes():
    """Driven along x far beyond the grip of a robot that something holds; without slip, the drive itself."""
    volts = np.array([6.0, 0.0, -6.0]) * np.sign(AXEBOT.wheels.wrench_matrix[0])
    turning = np.random.default_rng(3).normal(size=(300, 3)) * [1e-4, 1e-4, 1e-3]
    turning[100:200, 2] += 1.0
    run = Run(t=DT * np.arange(300), voltage=np.tile(volts, (300, 1)), twist=turning)
    (free,) = read_records([run], AXEBOT, OutputError(outputs=("twist",)))
    drive = motion([free], AXEBOT).held_forces
    assert np.isfinite(drive).all()
    (slips,) = read_records([run], ROBOT, OutputError(outputs=("twist",)))
    held = motion([slips], ROBOT).held_forces
    assert held[0] <= MU * ROBOT.body.mass * GRAVITY
    assert held[0] < drive[0]


def test_the_ladder_takes_the_grip_that_the_file_lacks():
    """Of a file without traction_mu, nor any inertia of wheels; a floor that lets them slip at the hardest starts."""
    grippy = ROBOT.replace(wheels=ROBOT.wheels.replace(traction_mu=1.6))
    rolling = AXEBOT.replace(wheels=AXEBOT.wheels.replace(wheel_inertia=0.0))
    run = log(1, 5.0, robot=grippy)
    best = identify(
        run, rolling, OutputError(free=("friction",), outputs=("twist", "wheel_speed"), ladder=True)
    ).estimate
    (step,) = best.ladder.taken
    assert step.key == "wheels.traction_mu"
    assert abs(best.value["wheels.traction_mu"] / 1.6 - 1.0) < 0.02
    assert not best.lack_of_fit.found
    for name in [name for name in best.value if name.startswith("friction")]:
        assert abs(best.value[name] - Key.parse(name).get(ROBOT)) < 4.0 * best.std[name], name


def test_a_fit_that_wheels_that_slip_led_astray_is_diagnosed_in_bounded_time(monkeypatch):
    """Its friction about yaw went to 1e6 N m: bristles as stiff as that took minutes."""
    grippy = ROBOT.replace(wheels=ROBOT.wheels.replace(traction_mu=0.8))
    run = log(1, 6.0, robot=grippy)
    astray = identify(run, AXEBOT, OutputError(free=("friction",), outputs=("twist", "wheel_speed"))).estimate
    assert "search_end" in codes(astray.warnings)
    tried = []
    raw, words = laws.BRISTLES[laws.DAMPING]

    def law(robot, table, bend):
        tried.append(robot)
        return raw(robot, table, bend)

    monkeypatch.setitem(laws.BRISTLES, laws.DAMPING, (law, words))
    assert astray.lack_of_fit.found
    assert max(robot.friction.axes.coulomb[2] for robot in tried) < 10.0


def test_a_right_fit_asks_nothing_of_the_engine_of_wheels_that_slip(monkeypatch):
    """It would have to be compiled, for half a minute, by everybody."""
    asked = []
    monkeypatch.setattr(laws, "slippery", lambda robot, mu: asked.append(mu))
    rolls = ROBOT.replace(wheels=ROBOT.wheels.replace(traction_mu=50.0))
    known = ROBOT.replace(wheels=ROBOT.wheels.replace(traction_mu=None))
    fit = identify(log(1, 5.0, robot=rolls), known, OutputError(free=("friction",), outputs=("twist",))).estimate
    assert not fit.lack_of_fit.found
    assert not asked
