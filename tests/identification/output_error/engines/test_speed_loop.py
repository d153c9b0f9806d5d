"""Logs of set speeds: friction, gains and latency through the firmware's speed loop, against simulated truth."""

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson
from scipy.optimize import least_squares

from omnidyn.errors import InputError, InsufficientDataError, UnsupportedError
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.engines.speed_loop import LoopEngine
from omnidyn.identification.output_error.fit import Fit
from omnidyn.identification.output_error.prepare import make_problem, read_records
from omnidyn.identification.output_error.problem.problem import Point
from omnidyn.identification.output_error.solve.loop import FEW_ITERATIONS, loop_start, retimed, solve_loop
from omnidyn.identification.output_error.solve.progress import FitProgress
from omnidyn.identification.output_error.solve.solver import Solver
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction, WheelFriction
from omnidyn.model.keys import EMF, TORQUE, Key, friction_keys, gain_keys
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.grouped import shared

KP, KI = "drive.kp_V_s_rad", "drive.ki_V_rad"
RESISTANCE = "motor.resistance_ohm"
NOISE, CURRENT_NOISE = np.array([0.02, 0.02, 0.1]), 0.05


@pytest.fixture(scope="module")
def looped(axebot):
    return axebot.replace(name="loop", drive=axebot.drive.replace(kind="speed", kp=0.25, ki=1.0, rate=100.0))


@pytest.fixture(scope="module")
def ellipse(looped):
    direction = DirectionFriction(coulomb=(2.2, 1.5), viscous=0.95, yaw_coulomb=0.099, yaw_viscous=0.01)
    return looped.replace(
        friction=Friction(direction=direction), drive=looped.drive.replace(ki=0.0, kp=0.4, rate=200.0)
    )


def twists(seed, rows=500, rest=20):
    """Set twists at 100 Hz: rest, then levels held 0.3 to 1.2 s."""
    rng, found, row = np.random.default_rng(seed), np.zeros((rows, 3)), rest
    while row < rows:
        end = min(rows, row + int(rng.uniform(30, 120)))
        found[row:end] = rng.uniform(-1.0, 1.0, 3) * [0.6, 0.6, 4.0] * (rng.random(3) < 0.8)
        row = end
    return found


def log(robot, seed, rows=500, late=0, channels=("twist", "current"), rest=20):
    """A run at 100 Hz with noise, seen `late` ms late."""
    command = twists(seed, rows, rest)
    fine = simulate(robot, dt=1e-3, twist_command=np.repeat(command, 10, axis=0), tol=1e-7)
    rng, seen = np.random.default_rng(1000 + seed), np.maximum(np.arange(rows) * 10 - late, 0)
    found = {}
    for name in channels:
        values = getattr(fine, name)[seen]
        found[name] = values + rng.normal(size=values.shape) * (NOISE if name == "twist" else CURRENT_NOISE)
    return Run(t=np.arange(rows) * 0.01, twist_command=command, source=f"log {seed}", **found)


def wrong(robot, **factors):
    for key, factor in {KP: 3.0, **factors}.items():
        robot = Key.parse(key).set(robot, factor * Key.parse(key).get(robot))
    return robot


def assert_near(fit, robot, most=4.5):
    for key, value in fit.value.items():
        assert abs(value - Key.parse(key).get(robot)) < most * fit.std[key], key


def test_gains_and_friction_that_are_not_known(looped):
    start = wrong(looped, **{KI: 0.3, "friction.axes.coulomb[0]": 0.5, "friction.axes.viscous[2]": 2.0})
    fit = identify(log(looped, 1), start, OutputError(nuisances=())).estimate
    assert list(fit.value) == [*friction_keys(looped), *gain_keys(looped)]
    assert {KP, KI} < set(fit.value)
    assert_near(fit, looped)
    assert fit.std[KP] < 0.02 * 0.25
    np.testing.assert_allclose(list(fit.noise.values()), [*NOISE, *[CURRENT_NOISE] * 3], rtol=0.15)


@pytest.mark.parametrize("rest", [20, 300])
def test_gains_three_times_too_small(looped, rest):
    """Of the first 0.6 s, as of a rest, friction 0 and a wrong latency are as good: no descent came back from there."""
    run = log(looped, 0, 1000, late=12, rest=rest)
    fit = identify(run, wrong(looped, **{KP: 1 / 3, KI: 1 / 3}), OutputError(nuisances=("latency",)), quick=True)
    assert_near(fit.estimate, looped)
    for name in ("latency.twist", "latency.current"):
        late = fit.estimate.nuisances[name]
        assert abs(late.value - 0.012) < 4.5 * late.std, name


def test_an_ellipse_robot_seen_late(ellipse):
    run = log(ellipse, 2, late=7, channels=("twist", "current"))
    fit = identify(run, wrong(ellipse, **{"friction.direction.coulomb[1]": 0.6}), OutputError()).estimate
    assert_near(fit, ellipse)
    for name in ("latency.twist", "latency.current"):
        late = fit.nuisances[name]
        assert abs(late.value - 0.007) < max(4.5 * late.std, 5e-4), name
    late = ellipse.replace(drive=fit.robot.drive.replace(kp=ellipse.drive.kp, ki=ellipse.drive.ki))
    free = simulate(late, dt=np.diff(run.t), twist_command=run.twist_command[:-1], log=fit.robot.log)
    error = np.sqrt(np.mean((free.twist - run.twist) ** 2, axis=0))
    np.testing.assert_allclose(error, NOISE, rtol=0.15)


def test_an_independent_optimiser_ends_at_the_same_point(ellipse):
    """scipy's least squares on `simulate`, by its own differences, weighted with the true noise."""
    run, keys = log(ellipse, 3, 250), ["friction.direction.coulomb[0]", "friction.direction.viscous", KP]
    true = np.array([Key.parse(key).get(ellipse) for key in keys])

    def residual(scaled):
        robot = ellipse
        for key, value in zip(keys, scaled * true, strict=True):
            robot = Key.parse(key).set(robot, float(value))
        model = simulate(robot, dt=0.01, twist_command=run.twist_command[:-1], tol=1e-8)
        parts = (model.twist - run.twist) / NOISE, (model.current - run.current) / CURRENT_NOISE
        return np.hstack(parts).ravel()

    found = least_squares(residual, np.ones(3), diff_step=1e-4, x_scale=0.1)
    fit = identify(run, ellipse, OutputError(free=keys, nuisances=())).estimate
    for key, value in zip(keys, found.x * true, strict=True):
        assert abs(fit.value[key] - value) < 0.15 * fit.std[key], key  # its noise is estimated, not given


@pytest.mark.parametrize("late", [0.0, 0.0123])
def test_outputs_and_slopes(ellipse, late):
    """Outputs against `simulate` on a fine grid; slopes against differences of the outputs. Latency of a twist too."""
    run = log(ellipse, 4, 200)
    run = run.replace(wheel_speed=np.zeros((200, 3)), pose=np.zeros((200, 3)), wheel_angle=np.zeros((200, 3)))
    free = (*friction_keys(ellipse), KP, "body.mass_kg", "wheels.robot_radius_m")
    records = read_records([run], ellipse, OutputError(free=free, nuisances=()))
    problem = make_problem(records, ellipse, OutputError(free=free, nuisances=("latency",)))
    engine, piece, start = LoopEngine(problem, 1e-8), problem.pieces[0], problem.start()
    values = start.values.copy()
    values[problem.robot_count :] = late
    facing = 3 + piece.record.columns.index(("heading", 0))
    assert piece.free[[facing, facing + 1, -1]].all()

    def at(values, heading=0.3):
        """(outputs (rows, C), slopes (rows, C, U), what each slope is by)."""
        state = start.states[0].copy()
        state[facing] = heading
        residual, slopes, by = engine.residuals(Point(values, (state,)))[0]
        return (piece.record.outputs.T - residual).T, np.swapaxes(slopes, 0, 1), by

    outputs, slopes, by = at(values)
    fine = simulate(
        ellipse, dt=1e-4, twist_command=np.repeat(run.twist_command, 100, axis=0), tol=1e-8, pose=(0.0, 0.0, 0.3)
    )
    angle = cumulative_simpson(fine.wheel_speed, dx=1e-4, axis=0, initial=0.0)
    seen = np.maximum(np.arange(200) * 100 - round(late * 1e4), 0)
    late_enough = np.arange(200) * 100 >= round(late * 1e4)
    for c, (name, i) in enumerate(piece.record.columns):
        pose = {"heading": fine.pose[:, 2:], "position": fine.pose, "wheel_angle": angle}
        model = (pose[name] if name in pose else getattr(fine, name))[:, i]
        # To the last row: the loop answers its set point too.
        np.testing.assert_allclose(outputs[late_enough, c], model[seen][late_enough], atol=2e-6)
    for j, p in enumerate(problem.parameters):
        if p.name.startswith("latency") and not late:
            continue  # rows stand on ticks, where a twist has a kink
        width = 1e-4 if p.name.startswith("latency") else 1e-4 * values[j]
        up, down = values.copy(), values.copy()
        up[j], down[j] = values[j] + width, values[j] - width
        change = (at(up)[0] - at(down)[0]) / (2.0 * width)
        error = np.abs(slopes[:, :, list(by).index(j)] - change)
        size = np.nanmax(np.abs(change), axis=0)
        current = np.array([name == "current" for name, _ in piece.record.columns])
        if p.name.startswith("latency"):  # of a current: the slope is a mean over a tick, by intent
            error = error[:, ~current]
            size = size[~current]
        good = ~(error > 1e-3 * size + 3e-4)  # the tolerance over the width is 1e-4
        assert good.mean() > 0.97, p.name  # a row beside an event or a tick is not differentiable
    turned = (at(values, 0.3 + 1e-5)[0] - at(values, 0.3 - 1e-5)[0]) / 2e-5
    own = slopes[:, :, list(by).index(len(values) + facing)]
    current = [name == "current" for name, _ in piece.record.columns]
    np.testing.assert_allclose(own[:, ~np.array(current)], turned[:, ~np.array(current)], atol=1e-8)


def test_two_floors_share_the_gains(looped):
    rough = looped
    for axis in range(3):
        key = f"friction.axes.coulomb[{axis}]"
        rough = Key.parse(key).set(rough, 1.3 * Key.parse(key).get(looped))
    runs = [log(looped, 5, 300), log(rough, 6, 300), log(looped, 7, 300), log(rough, 8, 300)]
    found = identify(runs, wrong(looped), OutputError(nuisances=()), groups=["smooth", "rough"] * 2)
    assert shared(found) == {KP, KI}
    assert_near(found.groups["smooth"], looped)
    assert_near(found.groups["rough"], rough)
    change = {d.key: d for d in found.differences}["friction.axes.coulomb[0]"]
    assert abs(change.difference - 0.66) < 4.5 * change.std


@pytest.mark.parametrize("own", [(), pytest.param(("friction", "latency.current"), marks=pytest.mark.long)], ids=str)
def test_groups_find_the_latency_of_currents_behind_a_slow_loop(looped, own):
    """No descent crosses a tick of 20 ms: each group alone tries one after the other, and so must all together."""
    slow = looped.replace(drive=looped.drive.replace(rate=50.0))
    runs = [log(slow, seed, 300, late=23) for seed in (1, 2)]
    found = identify(runs, slow, OutputError(per_free=own, nuisances=("latency",)), groups=["a", "b"])
    for estimate in found.groups.values():
        late = estimate.nuisances["latency.current"]
        assert abs(late.value - 0.023) < max(4.5 * late.std, 5e-4)
        assert late.std < 1e-3


def test_a_voltage_beside_the_set_speeds_is_the_input_unless_a_gain_is_asked_for(looped):
    command = twists(9, 300)
    clean = simulate(looped, dt=0.01, twist_command=command[:-1])
    noise = np.random.default_rng(9).normal(size=clean.twist.shape) * NOISE
    run = Run(t=clean.t, twist_command=clean.twist_command, voltage=clean.voltage, twist=clean.twist + noise)
    plain = identify(run, looped, OutputError(nuisances=())).estimate
    assert KP not in plain.value
    both = identify(run, wrong(looped), OutputError(free=[*plain.value, KP], nuisances=())).estimate
    assert_near(both, looped)


def test_a_robot_without_a_loop_is_told_what_to_write(axebot, looped):
    run = log(looped, 10, 100)
    with pytest.raises(UnsupportedError, match=r"no speed loop.*\[drive\] kind = \"speed\", kp_V_s_rad, ki_V_rad"):
        identify(run, axebot, OutputError())
    still = log(looped, 1, 300, channels=("twist", "current"))
    assert "output error" in identify(still, looped).estimate.method


def test_what_cannot_be_used(looped):
    run = log(looped, 11, 200)
    with pytest.raises(UnsupportedError, match="no voltage that could be changed on its way; got gain"):
        identify(run, looped, OutputError(nuisances=["gain"]))
    with pytest.raises(UnsupportedError, match="integral of the loop is not known elsewhere"):
        identify(run, looped, OutputError(start="free"))
    moving = Run(t=run.t[60:], twist_command=run.twist_command[60:], twist=run.twist[60:] + 0.5, source="moving")
    with pytest.raises(InsufficientDataError, match="no log begins at rest"):
        identify(moving, looped, OutputError())
    silent = Run(t=run.t, twist_command=0.0 * run.twist_command, twist=0.0 * run.twist)
    with pytest.raises(InsufficientDataError, match="never visibly moved"):
        identify(silent, looped, OutputError())
    powered = run.replace(voltage=np.zeros_like(run.twist))
    with pytest.raises(InputError, match="some logs have voltages, others set speeds only"):
        identify([run, powered], looped, OutputError())


def test_friction_keys_name_what_is_there(looped, ellipse):
    wheels = looped.replace(friction=Friction(wheels=WheelFriction(coulomb=(0.3, 0.2, 0.25), viscous=0.1)))
    assert friction_keys(wheels) == (*(f"friction.wheels.coulomb[{w}]" for w in range(3)), "friction.wheels.viscous")
    assert friction_keys(ellipse)[0] == "friction.direction.coulomb[0]"
    none = looped.replace(friction=Friction(axes=AxesFriction(viscous=(0.0,) * 3, coulomb=(0.0,) * 3)))
    assert friction_keys(none) == ()


def test_a_latency_of_currents_that_went_astray_is_tried_where_the_others_are(looped):
    """A loop of 500 Hz in rows at 100 Hz: after a few steps with wrong gains a latency may stand anywhere."""
    fast = looped.replace(drive=looped.drive.replace(rate=500.0))
    given = OutputError(nuisances=("latency",), free=(KP,))
    problem = make_problem(read_records([log(fast, 3, 300)], fast, given), fast, given)
    point = problem.start()
    values = point.values.copy()
    astray = problem.where("latency.current")
    values[astray] = 0.15
    found = retimed(Solver(problem, LoopEngine(problem)), Point(values, point.states), FitProgress())
    assert abs(found.values[astray]) <= 0.01


@pytest.mark.long
def test_motors_that_are_wrong_guesses_come_before_latencies(looped):
    """Torque twice too large, a resistance that is a guess: with all at once the latencies end in another valley."""
    start = wrong(looped, **{KP: 1.0, RESISTANCE: 0.3, TORQUE: 2.0, EMF: 2.0})
    asked = OutputError(nuisances=("latency",), free=(RESISTANCE, *friction_keys(looped)))
    problem = make_problem(read_records([log(looped, 3, 300)], start, asked), start, asked)
    solver, progress = Solver(problem, LoopEngine(problem)), FitProgress()
    all_at_once = solver.minimise(loop_start(problem, 0.0, progress), FEW_ITERATIONS)
    all_at_once = solver.minimise(retimed(solver, all_at_once.state.point, progress))
    assert solve_loop(problem, 0.0, progress).state.objective < all_at_once.state.objective - 10.0


@pytest.mark.parametrize("channel", ["twist", "current"])
def test_a_channel_that_is_early_shows_as_many_rows(ellipse, channel):
    """Else the likelihood of those that are left would jump at a latency of 0, and no descent would cross it."""
    given = OutputError(nuisances=("latency",))
    problem = make_problem(read_records([log(ellipse, 5, 150)], ellipse, given), ellipse, given)
    solver, point = Solver(problem, LoopEngine(problem, 1e-6)), problem.start()
    found = []
    for late in (0.0, -1e-6, -0.012):
        values = point.values.copy()
        values[problem.where(f"latency.{channel}")] = late
        found.append(solver.state(Point(values, point.states)))
    for state in found:
        assert state.sums[0].number.tolist() == found[0].sums[0].number.tolist() == [150.0] * 6
    assert abs(found[1].objective - found[0].objective) < 0.1  # 9 of a row of wheel speeds, before


@pytest.mark.parametrize("seed", [2, 3])
def test_a_fit_is_at_least_as_good_as_one_from_the_truth(ellipse, seed):
    """Where rows stand on ticks, F has a valley with a sharp floor at a latency of 0, and for currents a jump."""
    robot = ellipse.replace(drive=ellipse.drive.replace(ki=4.0))
    start = wrong(robot, **{KP: 1.0, "friction.direction.coulomb[1]": 0.7, "friction.direction.viscous": 1.5})
    fit = Fit.of(log(robot, seed, 400), start, OutputError(fixed=(KP, KI)))
    found = fit.solve()
    solver = found.solver
    values = found.state.point.values.copy()
    for j, p in enumerate(solver.problem.parameters):
        values[j] = 0.0 if p.part == "latency" else Key.parse(p.name).get(robot)
    best = solver.minimise(Point(values, found.state.point.states))
    assert found.state.objective < best.state.objective + 0.5
