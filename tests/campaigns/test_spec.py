"""Specs: what is wrong is named with the nearest key; draws follow from the seed and the index alone."""

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.stats import kstest, norm, qmc

from omnidyn.campaigns.design import numbers, points, sample_count
from omnidyn.campaigns.spec import Variable, load_spec, parse_spec, spec_tables
from omnidyn.campaigns.tasks import LoadedSpec
from omnidyn.control.closed_loop import track
from omnidyn.errors import InputError
from omnidyn.model.keys import Key
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.simulate import simulate

BASE = {"schema": 1, "robot": "axebot", "samples": 64, "vary": {"body.mass_kg": {"range": [1.0, 2.0]}}}
TRACK = {"track": {"path": "circle", "duration_s": 0.4}}


def problem(tmp_path, **changes):
    """A problem whose spec was checked."""
    made = LoadedSpec(parse_spec(BASE | TRACK | changes), tmp_path)
    made.check()
    return made


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"sampels": 3}, "unknown key; got sampels; did you mean samples"),
        ({"track": {"pth": "circle"}}, r"unknown key.*\[track\] pth.*|did you mean path"),
        ({"sampling": "sobl"}, "'sobol', 'latin', 'random' or 'grid'"),
        ({"samples": None}, "samples is missing"),
        ({"vary": {}}, "nothing varies"),
        ({"simulate": {"voltage_V": [0.0, 1.0, -1.0], "duration_s": 1.0}}, "two tasks"),
        ({"vary": {"body.mass_kg": {"range": [2.0, 1.0]}}}, "runs backwards"),
        ({"vary": {"body.mass_kg": {"range": [1.0, 2.0], "std": 0.1}}}, "range and std says how it varies"),
        ({"vary": {"body.mas_kg": {"range": [1.0, 2.0]}}}, "did you mean body.mass_kg"),
        ({"vary": {"path.radus_m": {"range": [1.0, 2.0]}}}, "did you mean radius_m"),
        ({"vary": {"controller.fastr": {"range": [1.0, 2.0]}}}, "did you mean faster"),
        ({"vary": {"track.nois_m_s": {"range": [0.0, 0.1]}}}, "did you mean noise_m_s"),
        ({"vary": {"sensors.pose_dely_s": {"range": [0.0, 0.1]}}}, "did you mean pose_delay_s"),
        ({"vary": {"controller": {"values": ["pid", "mcp"]}}}, "unknown controller"),
        ({"vary": {"simulate.scale": {"range": [0.0, 1.0]}}}, r"no \[simulate\] that could be varied"),
        ({"vary": {"friction": {"std": 0.1}}}, "not one number of the robot file"),
        ({"sampling": "grid", "samples": None}, "needs values, or a range or factor with steps"),
        ({"vary": {"body.mass_kg": {"values": [1.0, math.inf]}}}, "cannot use this value"),
        ({"correlation": {"keys": ["friction"], "matrix": [[1.0]]}}, "of what does not vary; got friction"),
        ({"correlation": {"keys": ["body.mass_kg"], "matrix": [[2.0]]}}, "less than or equal to 1"),
        ({"schema": 2}, "unknown schema; got 2"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, changes, words):
    with pytest.raises(InputError, match=words):
        problem(tmp_path, **changes)


def test_a_spec_comes_back_from_its_tables(write):
    path = write(
        'schema = 1\nrobot = "axebot"\nsamples = 8\n[vary]\n"friction" = { factor = [0.5, 1.5] }\n'
        '"track.delay" = { values = [0, 1] }\n[track]\npath = "eight:period_s=8"\ncontroller = "pid"\n',
        "spec.toml",
    )
    spec, folder = load_spec(path)
    assert folder == path.parent
    assert parse_spec(spec_tables(spec)) == spec


@pytest.mark.parametrize("sampling", ["random", "latin", "sobol"])
def test_draws_do_not_depend_on_where_they_are_cut(sampling):
    vary = {
        "body.mass_kg": {"range": [1.0, 2.0]},
        "body.inertia_kg_m2": {"std": 0.001},
        "friction": {"factor": [0.5, 2]},
    }
    spec = parse_spec(BASE | TRACK | {"sampling": sampling, "samples": 1000, "vary": vary, "seed": 7})
    whole = points(spec, 0, 1000)
    cuts = [0, 1, 7, 300, 999, 1000]
    assert np.array_equal(np.concatenate([points(spec, a, b) for a, b in pairwise(cuts)]), whole)
    assert not np.array_equal(points(spec.replace(seed=8), 0, 1000), whole)
    for column in whole.T:
        assert kstest(column, "uniform").pvalue > 0.01
    if sampling == "latin":
        assert np.array_equal(np.sort(np.floor(whole * 1000).astype(int), axis=0)[:, 0], np.arange(1000))
    if sampling == "sobol":
        assert qmc.discrepancy(whole) < 0.1 * qmc.discrepancy(np.random.default_rng(0).random((1000, 3)))


def test_a_grid_counts_every_combination(tmp_path):
    vary = {"body.mass_kg": {"range": [1.0, 2.0], "steps": 3}, "controller": {"values": ["pid", "feedforward"]}}
    made = problem(tmp_path, sampling="grid", samples=None, vary=vary)
    assert sample_count(made.spec) == 6
    columns = made.columns(0, 6)
    assert columns["body.mass_kg"].tolist() == [1.0, 1.0, 1.5, 1.5, 2.0, 2.0]
    assert columns["controller"] == ["pid", "feedforward"] * 3
    assert made.columns(2, 4)["body.mass_kg"].tolist() == [1.5, 1.5]


@pytest.mark.parametrize("sampling", ["random", "latin", "sobol"])
def test_correlated_numbers_have_their_law_and_their_correlation(tmp_path, sampling):
    vary = {
        "body.mass_kg": {"std": 0.1},
        "body.inertia_kg_m2": {"std": 0.002},
        "friction": {"factor": [0.5, 1.5]},
        "wheels.wheel_radius_m": {"factor": [0.98, 1.02]},
    }
    matrix = [[1.0, 0.8, -0.3], [0.8, 1.0, 0.0], [-0.3, 0.0, 1.0]]
    keys = ["body.mass_kg", "body.inertia_kg_m2", "friction"]
    changes = {"samples": 2**14, "sampling": sampling, "vary": vary}
    made = problem(tmp_path, **changes, correlation={"keys": keys, "matrix": matrix})
    columns = made.columns(0, 2**14)
    normals = np.array([columns[keys[0]], columns[keys[1]], norm.ppf(columns["friction"] - 0.5)])
    np.testing.assert_allclose(np.corrcoef(normals), matrix, atol=0.03)
    assert columns[keys[0]].std() == pytest.approx(0.1, rel=0.02)
    assert kstest(columns["friction"], "uniform", (0.5, 1.0)).pvalue > 0.01
    free = problem(tmp_path, **changes).columns(0, 2**14)["wheels.wheel_radius_m"]
    np.testing.assert_array_equal(columns["wheels.wheel_radius_m"], free)
    for name, whole in columns.items():
        np.testing.assert_array_equal(made.columns(700, 777)[name], whole[700:777])


def test_numbers_follow_their_law():
    u = (np.arange(2000) + 0.5) / 2000
    log = Variable(range=(0.1, 10.0), scale="log")
    assert kstest(np.log10(numbers(log, u)), "uniform", (-1.0, 2.0)).pvalue > 0.99
    assert kstest(numbers(Variable(std=0.2), u, 3.0), norm(3.0, 0.2).cdf).pvalue > 0.99
    assert numbers(Variable(values=("a", "b")), np.array([0.0, 0.49, 0.5, 1.0])) == ["a", "a", "b", "b"]


def test_every_kind_of_key_reaches_its_place(tmp_path):
    vary = {
        "wheels.wheel_radius_m": {"factor": [1.02, 1.02]},
        "friction": {"factor": [0.5, 0.5]},
        "sensors.pose_delay_s": {"values": [0.02]},
        "path.radius_m": {"values": [0.7]},
        "controller.faster": {"values": [2.0]},
        "track.delay": {"values": [1]},
        "track.noise_m_s": {"values": [0.01]},
        "track.seed": {"values": [5]},
    }
    (sample,) = problem(tmp_path, vary=vary, samples=1).samples(0, 1)
    axebot = load_robot("axebot")
    assert Key.parse("wheels.wheel_radius_m").get(sample.robot) == pytest.approx(0.035 * 1.02)
    assert sample.robot.friction.axes.coulomb == pytest.approx([1.1, 0.75, 0.0495])
    assert sample.robot.sensor_model.pose_delay == 0.02
    from omnidyn.control.controllers import ControllerFile

    measured = problem(tmp_path, vary=vary, samples=1).measure(sample)
    tracking = track(
        axebot,
        "circle:radius_m=0.7",
        ControllerFile("pid", {"faster": 2.0}),
        plant=sample.robot,
        duration=0.4,
        delay=1,
        noise=0.01,
        rng=5,
    )
    assert measured["rmse_position_m"] == tracking.rmse_position
    assert measured["worst_position_m"] == tracking.worst_position


def test_noise_is_of_the_sample(tmp_path):
    vary = {"body.mass_kg": {"values": [1.5]}}
    noisy = TRACK["track"] | {"noise_m_s": 0.01}
    made = problem(tmp_path, vary=vary, track=noisy)
    first, second = (made.measure(sample)["rmse_position_m"] for sample in made.samples(0, 2))
    assert first != second
    alike = problem(tmp_path, vary=vary, track=noisy | {"seed": 3})
    first, second = (alike.measure(sample)["rmse_position_m"] for sample in alike.samples(0, 2))
    assert first == second


def test_a_simulation_is_measured_by_closed_forms(tmp_path):
    """Without friction, v' = -a v + g: where it settles, when, and what that takes; within the dead zone, nothing."""
    task = {"voltage_V": [0.0, 3.0, -3.0], "duration_s": 3.0}
    vary = {"simulate.scale": {"values": [1.0, 0.1]}}
    made = problem(tmp_path, track=None, simulate=task, vary=vary, sampling="grid", samples=None)
    moving, stuck = (made.measure(sample) for sample in made.samples(0, 2))
    assert stuck["drift_m"] == 0.0
    assert stuck["energy_J"] == pytest.approx(2 * 0.3**2 / 1.69 * 3.0)  # two motors that stand: u^2/R
    run = simulate(load_robot("axebot"), [[0.0, 3.0, -3.0]] * 3000, 1e-3)
    assert moving["final_vx_m_s"] == run.twist[-1, 0]
    rate = -math.log(1.0 - run.twist[100, 0] / run.twist[-1, 0]) / 0.1
    assert moving["settling_s"] == pytest.approx(math.log(1.0 / 0.02) / rate, abs=0.002)
    heat = 1.69 * np.sum(run.current**2, axis=1)
    force = 2.2 + 0.94 * run.twist[:, 0]  # of friction, Table 3
    power = heat + force * run.twist[:, 0]
    kinetic = 0.5 * 1.5 * run.twist[-1, 0] ** 2
    assert moving["energy_J"] == pytest.approx(np.trapezoid(power, run.t) + kinetic, rel=1e-3)


def test_draws_of_the_robot_file_are_those_of_plausible(tmp_path, write):
    from omnidyn.model.known.uncertainty import plausible
    from omnidyn.model.robot_file import load_robot, robot_to_toml

    text = robot_to_toml(load_robot("axebot")).replace("mass_kg = 1.5", "mass_kg = { value = 1.5, std = 0.1 }")
    path = write(text, "robot.toml")
    made = problem(tmp_path, robot=str(path), robot_draws=True, vary={}, samples=40, seed=3)
    masses = [sample.robot.body.mass for sample in made.samples(10, 20)]
    assert masses == [robot.body.mass for robot in plausible(load_robot(path), 40, 3)][10:20]


def test_a_command_file_is_applied(tmp_path, write):
    path = write("t_s,u1_V,u2_V,u3_V\n0,0,3,-3\n0.01,0,3,-3\n", "volts.csv")
    task = {"voltages": str(path), "duration_s": 0.5}
    made = problem(tmp_path, track=None, simulate=task, vary={"simulate.scale": {"values": [0.5]}}, samples=1)
    (sample,) = made.samples(0, 1)
    run = simulate(load_robot("axebot"), [[0.0, 1.5, -1.5]] * 50, 0.01)
    assert made.measure(sample)["drift_m"] == pytest.approx(np.hypot(*run.pose[-1, :2]), rel=1e-9)
