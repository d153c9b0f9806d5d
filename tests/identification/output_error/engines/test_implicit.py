"""Robots that only the implicit engine simulates: an ellipse of friction in a turning frame, seen late."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson
from scipy.optimize import least_squares

from omnidyn.errors import UnsupportedError
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.output_error.engines.implicit import ImplicitEngine, LastPoints
from omnidyn.identification.output_error.prepare import make_problem
from omnidyn.identification.output_error.problem.parameters import Parameter
from omnidyn.identification.output_error.problem.problem import Point
from omnidyn.identification.output_error.problem.record import record
from omnidyn.identification.output_error.solve.solver import Solver
from omnidyn.model.friction import AxesFriction, DirectionFriction, Friction
from omnidyn.model.keys import Key, find_key
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import NOISE, excitation, voltages
from tests.support.rolled_logs import TICK, captured_log, counted_log, rolled

TRUTH = {
    "friction.direction.coulomb[0]": 2.2,
    "friction.direction.coulomb[1]": 1.5,
    "friction.direction.viscous": 0.95,
    "friction.direction.yaw_coulomb": 0.099,
    "friction.direction.yaw_viscous": 0.01,
}


@pytest.fixture(scope="module")
def ellipse(axebot):
    direction = DirectionFriction(coulomb=(2.2, 1.5), viscous=0.95, yaw_coulomb=0.099, yaw_viscous=0.01)
    none = AxesFriction(viscous=(0.0, 0.0, 0.0), coulomb=(0.0, 0.0, 0.0))
    return axebot.replace(
        body=axebot.body.replace(rotating_frame=True), friction=Friction(axes=none, direction=direction)
    )


@pytest.fixture(scope="module")
def log(ellipse):
    """10 s, instruments 7 ms late: simulated on a grid ten times as fine."""
    voltage = voltages(np.random.default_rng(21), 10.0)
    fine = simulate(ellipse, np.repeat(voltage, 10, axis=0), 0.001)
    seen = np.maximum(np.arange(len(voltage)) * 10 - 7, 0)
    twist = fine.twist[seen] + np.random.default_rng(22).normal(size=(len(seen), 3)) * NOISE
    return Run(t=np.arange(len(voltage)) * 0.01, voltage=voltage, twist=twist)


def test_an_ellipse_in_a_turning_frame_seen_late(ellipse, log):
    start = ellipse
    for key, true in TRUTH.items():
        start = Key.parse(key).set(start, 1.4 * true)
    fit = identify(log, start, OutputError(free=list(TRUTH), start="rest")).estimate
    for key, true in TRUTH.items():
        assert abs(fit.value[key] - true) < 4.5 * fit.std[key]
        assert fit.std[key] < 0.3 * true
    late = fit.nuisances["latency.twist"]
    assert abs(late.value - 0.007) < 4.5 * late.std
    assert late.std < 1e-3
    np.testing.assert_allclose(list(fit.noise.values()), NOISE, rtol=0.1)


def test_what_the_second_engine_does_not_know(ellipse, log):
    slips = ellipse.replace(wheels=ellipse.wheels.replace(traction_mu=0.8, wheel_inertia=1e-5))
    with pytest.raises(UnsupportedError, match=r"breakaway is profiled .*; got wheels that may slip"):
        identify(log, slips, OutputError(free=[*TRUTH, "friction.direction.breakaway[0]"], start="rest", nuisances=()))
    problem = make_problem([record(log, ellipse)], ellipse, OutputError(free=tuple(TRUTH), start="rest", nuisances=()))
    unknown = replace(problem, parameters=(*problem.parameters, Parameter("slip", 0.0, 0.0, 1.0)))
    with pytest.raises(UnsupportedError, match=r"does not know all that is asked for; got slip.*leave it out"):
        ImplicitEngine(unknown)


def test_the_fast_fit_ends_where_an_independent_optimiser_does(ellipse, log):
    """scipy's least_squares on runs of simulate() at tol 1e-7, with a row at every t - latency."""
    fit = identify(log, ellipse, OutputError(free=list(TRUTH), start="rest", nuisances=["latency"])).estimate
    noise, t = np.array(list(fit.noise.values())), log.t

    def residual(scaled):
        robot, late = ellipse, float(scaled[-1]) * 0.007
        for key, value in zip(TRUTH, scaled, strict=False):
            robot = Key.parse(key).set(robot, float(value) * TRUTH[key])
        share = 1.0 - late / 0.01
        dt = np.tile([share * 0.01, (1.0 - share) * 0.01], len(t) - 1)
        twist = simulate(robot, np.repeat(log.voltage[:-1], 2, axis=0), dt, tol=1e-7).twist
        seen = np.concatenate([[0], 2 * np.arange(1, len(t)) - 1])
        return ((twist[seen] - log.twist) / noise).ravel()  # all rows: it begins at rest

    own = np.array(
        [*(fit.value[key] / true for key, true in TRUTH.items()), fit.nuisances["latency.twist"].value / 0.007]
    )
    std = np.array([*(fit.std[key] / true for key, true in TRUTH.items()), fit.nuisances["latency.twist"].std / 0.007])
    best = least_squares(residual, own + 0.3 * std, x_scale=std, diff_step=1e-4, xtol=1e-7, ftol=1e-10)
    print("distance from the optimum, standard errors:", np.round((own - best.x) / std, 4))
    assert (np.abs(own - best.x) < 0.02 * std).all()


def test_no_row_comes_or_goes_where_a_latency_passes_0(ellipse, log):
    """The likelihood would jump by the density of these rows, and a descent from 0 would end there."""
    lacks = replace(log, voltage=np.vstack([log.voltage[:-1], np.full((1, 3), np.nan)]))  # the last row needs none
    for run in (log, lacks):
        problem = make_problem([record(run, ellipse)], ellipse, OutputError(free=tuple(TRUTH), start="rest"))
        solver, late = Solver(problem, ImplicitEngine(problem, 1e-6)), problem.names.index("latency.twist")
        objectives, used = [], []
        for value in (-1e-6, 0.0, 1e-6):
            point = problem.start()
            point.values[late] = value
            state = solver.state(point)
            objectives.append(state.objective)
            used.append(np.isfinite(solver.engine.residuals(point)[0][0]).sum())
        assert used[0] == used[1] == used[2]
        assert np.ptp(objectives) < 0.5


NUISANCES = {
    "gain": 1.04,
    "dead_band": 0.1,
    "fade": 0.03,
    "latency.twist": 0.004,
    "latency.current": 0.0025,
    "latency.heading": 0.006,
    "latency.position": 0.0035,
    "latency.wheel_angle": 0.0045,
}
START = (0.4, -0.3, 1.0)


def applied(voltage, values):
    """What the driver makes of the voltages, written anew."""
    share = np.arange(len(voltage)) / len(voltage)
    left = values["gain"] * (1.0 - values["fade"] * share)
    return left[:, None] * np.sign(voltage) * np.maximum(np.abs(voltage) - values["dead_band"], 0.0)


CHANNELS = {"twist": 3, "wheel_speed": 3, "current": 3, "heading": 1, "position": 2, "wheel_angle": 3}
FINE = 20  # rows of a run in one of the log
PLACE = np.array([0.7, -1.1, 0.8])  # where the robot stands and faces at the start


def shown(robot, voltage, values, start=START, tol=1e-9, place=PLACE, channels=CHANNELS):
    """What a log has, each channel late, by runs with FINE rows for one of the log; angles by Simpson's rule."""
    for key, value in values.items():
        if find_key(key):
            robot = Key.parse(key).set(robot, value)
    u = np.repeat(applied(voltage, values), FINE, axis=0)
    run = simulate(robot, u, 0.01 / FINE, twist=start, pose=place, tol=tol)
    every = {
        "heading": run.pose[:, 2:],
        "position": run.pose[:, :2],
        "wheel_angle": cumulative_simpson(run.wheel_speed, dx=0.01 / FINE, axis=0, initial=0.0),
        **{name: getattr(run, name) for name in ("twist", "wheel_speed", "current")},
    }
    found = []
    for channel in channels:
        late = round(values.get(f"latency.{channel}", 0.0) * 100.0 * FINE)
        rows = FINE * np.arange(len(voltage) + 1) - late
        found.append(np.where((rows >= 0)[:, None], every[channel][np.maximum(rows, 0)], np.nan))
    return np.hstack(found)


GEOMETRY = ("wheels.wheel_radius_m", "wheels.robot_radius_m", "wheels.azimuth_deg[2]")


@pytest.mark.parametrize("geometry", [(), GEOMETRY])
def test_every_slope_against_differences_of_simulated_logs(ellipse, geometry):
    """Robot, driver, latencies and start, in all outputs; the model of the log is written anew above."""
    t = np.arange(41) * 0.01
    voltage = np.stack([4.0 + np.sin(9.0 * t), 1.0 + np.cos(5.0 * t), -3.0 + np.sin(7.0 * t)], axis=1)[:-1]
    values = {**TRUTH, "body.mass_kg": 1.5, "motor.resistance_ohm": 1.69, **NUISANCES, "latency.wheel_speed": 0.0}
    values |= {key: float(Key.parse(key).get(ellipse)) for key in geometry}
    clean = shown(ellipse, voltage, values)
    run = Run(
        t=t,
        voltage=np.vstack([voltage, voltage[-1:]]),
        twist=clean[:, :3],
        wheel_speed=clean[:, 3:6],
        current=clean[:, 6:9],
        pose=clean[:, [10, 11, 9]],
        wheel_angle=clean[:, 12:],
    )
    keys = [*TRUTH, "body.mass_kg", "motor.resistance_ohm", *geometry]
    given = OutputError(
        free=tuple(keys), nuisances=("gain", "dead_band", "fade", "latency"), start="free", tick_rad=0.0
    )
    problem = make_problem([record(run, ellipse, tick_rad=0.0)], ellipse, given)
    columns = [name for name, width in CHANNELS.items() for _ in range(width)]
    assert [name for name, _ in problem.columns] == columns
    piece = replace(problem.pieces[0], margin=np.zeros(15))
    engine = ImplicitEngine(replace(problem, pieces=(piece,)), 1e-8)
    offset = np.zeros(15)
    offset[9:12] = PLACE[[2, 0, 1]]
    point = Point(np.array([values[name] for name in problem.names]), (np.concatenate([START, offset]),))
    residual, slopes, at = engine.residuals(point)[0]
    share = np.arange(40) / 40
    np.testing.assert_allclose((run.t[:-1] - run.t[0]) / problem.pieces[0].record.span, share)
    assert np.nanmax(np.abs(residual)) < 3e-6
    inner = slice(1, 40)  # the first row of a late channel has nothing to show, the last current another voltage
    names = [*problem.names, "vx", "vy", "omega", *columns]
    for column, index in zip(slopes.transpose(2, 1, 0), at, strict=True):
        name = names[index]
        if name == "latency.wheel_speed":
            continue  # it is 0: at a row the rate jumps
        ends = []
        for side in (1.0, -1.0):
            moved, start, place = dict(values), list(START), PLACE.copy()
            width = 1e-4 * (abs(values.get(name, 1.0)) or 0.01)
            if name.startswith("latency"):
                width = 0.01 / FINE  # a row of the run: to second order
            if name in values:
                moved[name] += side * width
            elif index < len(problem.names) + 3:
                start[index - len(problem.names)] += side * width
            elif name in ("heading", "position"):
                place[(index - len(problem.names) - 3 - 9 + 2) % 3] += side * width
            ends.append(shown(ellipse, voltage, moved, start, place=place))
        expected = (ends[0] - ends[1])[inner] / (2.0 * width)
        if name == "wheel_angle":
            expected[:, index - len(problem.names) - 3] = 1.0
        error = np.nanmax(np.abs(column[inner] - expected), axis=0)
        size = np.nanmax(np.abs(expected), axis=0)
        print(f"{name:34}", np.round(error / np.maximum(size, 1e-9), 7))
        assert (error <= 1e-3 * size + 1e-9 / width + 1e-7).all(), name  # what the runs' tolerance leaves of 0


def test_gain_dead_band_and_latency_from_a_log_that_starts_in_motion(ellipse):
    """12 s with currents; the first 2 s are cut off, so that it starts somewhere."""
    rng, true = np.random.default_rng(31), {**TRUTH, "gain": 0.97, "dead_band": 0.15, "fade": 0.0}
    true |= {"latency.twist": 0.006, "latency.current": 0.002}
    voltage = voltages(rng, 14.0)
    full = shown(ellipse, voltage, true, (0.0, 0.0, 0.0), 1e-6, channels=("twist", "current"))[:-1]
    full += np.random.default_rng(32).normal(size=full.shape) * np.array([*NOISE, *(3 * [0.05])])
    log = Run(t=np.arange(1200) * 0.01, voltage=voltage[200:], twist=full[200:, :3], current=full[200:, 3:])
    assert np.abs(full[200, :3]).max() > 0.2
    wanted = ["gain", "dead_band", "latency"]
    for start in ("free", "auto"):
        fit = identify(log, ellipse, OutputError(free=list(TRUTH), nuisances=wanted, start=start)).estimate
        found = {**{k: (v, fit.std[k]) for k, v in fit.value.items()}}
        found |= {k: (n.value, n.std) for k, n in fit.nuisances.items()}
        assert set(found) == set(true) - {"fade"}
        for name, (value, std) in found.items():
            print(start, name, round((value - true[name]) / std, 2), std)
            assert abs(value - true[name]) < 4.5 * std, name
        assert fit.nuisances["gain"].std < 0.01
    assert fit.covariance == "white"


@pytest.fixture(scope="module")
def turning(axebot):
    """As `omnidyn init` makes it: friction along the axes, the frame turns."""
    return axebot.replace(body=axebot.body.replace(rotating_frame=True))


@pytest.mark.long
def test_counts_and_positions_of_an_independent_run(turning):
    """Encoders of 2048 counts, and motion capture, of a run by DOP853: z-scores of all draws are those of a normal."""
    run, angle = rolled(turning, excitation(5.0, seed=1), 0.01)
    for kind in ("pose", "counts"):
        z = []
        for seed in (0, 2, 3, 1):
            log = counted_log(run, angle, seed) if kind == "counts" else captured_log(run, seed)
            fit = identify(log, turning, OutputError(start="rest")).estimate
            assert not fit.unused
            assert not fit.unidentifiable
            z.append([(v - float(Key.parse(key).get(turning))) / fit.std[key] for key, v in fit.value.items()])
        print(kind, np.round(z, 1).tolist())
        assert len(z[0]) == 6
        assert np.abs(z).max() < 4.5
        assert 0.7 < np.sqrt(np.mean(np.square(z))) < 1.35
    plain = identify(counted_log(run, angle, 1), turning, OutputError(start="rest", tick_rad=0.0)).estimate
    for name in ("wheel_angle[0]", "wheel_angle[1]"):  # of a tick: what is rounded off, and next to no other noise
        assert 0.5 < plain.noise[name] / (TICK / np.sqrt(12.0)) < 1.1  # rows at rest repeat
        assert fit.noise[name] < 0.15 * TICK


def test_many_logs_take_as_many_runs_as_one(turning, monkeypatch):
    """24 logs of 8 s that begin under voltage: 34 runs of each, until starts that nothing tells of were held back."""
    logs = []
    for seed in range(1, 25):
        run = simulate(turning, voltages(np.random.default_rng(seed), 8.0), 0.01)
        noise = np.random.default_rng(99 + seed).normal(size=run.twist.shape) * NOISE
        logs.append(Run(t=run.t, voltage=run.voltage, twist=run.twist + noise))
    start, rows = turning, 0
    for axis in range(3):
        for kind, factor in (("coulomb", 0.6), ("viscous", 1.5)):
            key = Key.parse(f"friction.axes.{kind}[{axis}]")
            start = key.set(start, factor * key.get(start))
    plain = ImplicitEngine._piece

    def counting(self, robot, moved, scales, piece, *rest):
        nonlocal rows
        rows += piece.last - piece.first
        return plain(self, robot, moved, scales, piece, *rest)

    monkeypatch.setattr(ImplicitEngine, "_piece", counting)
    fit = identify(logs, start, OutputError(nuisances=("latency",))).estimate
    assert rows < 15 * sum(len(log) for log in logs)
    for key, value in fit.value.items():
        assert abs(value - float(Key.parse(key).get(turning))) < 4.5 * fit.std[key]


def test_last_points_may_be_asked_by_several_threads():
    """Every thread gets what belongs to its point, and two points are kept."""
    points = [Point(np.array([float(k)]), ()) for k in range(6)]
    last = LastPoints()

    def asked(k):
        return last.at(points[k % 6], lambda point: [(point.values, point.values, np.zeros(0, int))])[0][0][0]

    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(asked, range(3000))) == [float(k % 6) for k in range(3000)]
    assert len(last._found) == LastPoints.KEPT
