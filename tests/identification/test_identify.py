"""Identification as a whole: what the robot that comes out says of its drive, and what is advised."""

from types import SimpleNamespace

import numpy as np
import pytest

import omnidyn
from omnidyn import Run, load_robot, simulate
from omnidyn.attempts import Attempts
from omnidyn.errors import InputError
from omnidyn.identification import advice
from omnidyn.identification import identify as module
from omnidyn.identification.default_method import as_driven
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError, SteadyState
from omnidyn.logs.log import Log
from omnidyn.model.robot_file import parse_robot, robot_to_toml
from tests.support.steady_logs import clean_runs, robot_with


@pytest.fixture(scope="module")
def duties():
    """A log of duties and a supply of 6 V, and no voltage."""
    rng = np.random.default_rng(0)
    voltage = np.repeat(rng.uniform(-6.0, 6.0, (30, 3)), 20, axis=0)
    run = simulate(load_robot("axebot"), voltage, 0.02)
    noisy = run.wheel_speed + 0.05 * rng.normal(size=run.wheel_speed.shape)
    return run.replace(
        voltage=None,
        duty=run.voltage / 6.0,
        supply=np.full(len(run), 6.0),
        wheel_speed=noisy,
        current=None,
        twist=None,
        pose=None,
        source="duty.csv",
    )


def test_a_robot_fitted_to_duties_has_a_drive_of_duties(duties):
    robot = load_robot("axebot")
    fitted = identify(duties, robot).robot
    assert (fitted.drive.kind, fitted.drive.supply) == ("duty", 6.0)
    again = parse_robot(robot_to_toml(fitted))
    assert again.drive == fitted.drive
    run = simulate(again, duty=duties.duty[:-1], dt=0.02)
    np.testing.assert_allclose(run.wheel_speed, duties.wheel_speed, atol=1.0)


def test_logs_are_checked_and_runs_are_not(duties):
    """A log of which two wheels are exchanged is unfit: the result says so, not only `check`."""
    speed = duties.wheel_speed[:, [1, 0, 2]]
    swapped = duties.replace(wheel_speed=speed)
    result = identify(Log.of_run(swapped), load_robot("axebot"), quick=True)
    assert [finding.code for verdict in result.verdicts for finding in verdict.findings] == ["swapped"]
    assert "log_not_usable" in [failure.code for failure in result.failures]
    assert identify(duties, load_robot("axebot"), quick=True).verdicts == ()


def test_a_result_of_several_groups_has_no_number_of_its_own(duties):
    result = identify([duties, duties.replace(source="again.csv")], load_robot("axebot"), groups=["a", "b"], quick=True)
    with pytest.raises(AttributeError, match=r"each group has its own value: say \.groups\['a'\]\.value; groups: a, b"):
        _ = result.value
    with pytest.raises(InputError, match=r"no single estimate; got a, b"):
        _ = result.estimate
    assert result.groups["a"].value.keys() == result.groups["b"].value.keys()


def test_a_method_that_the_logs_chose_is_named_in_the_result():
    """The logs have currents and no voltage: whole logs cannot be fitted."""
    runs = [run.replace(voltage=None) for run in clean_runs(robot_with("disc"), range(0, 360, 30))]
    result = identify(runs, load_robot("axebot"), quick=True)
    assert result.method == SteadyState()
    (note,) = [warning for warning in result.warnings if warning.code == "method_chosen"]
    assert "holds set speeds only" in note.numbers["why"]


def test_a_result_says_what_it_was_made_from(duties):
    robot, method = load_robot("axebot"), OutputError(nuisances=())
    made = identify(duties, robot, method, quick=True).provenance
    assert made["omnidyn"] == omnidyn.__version__
    assert made["command"] == f"omnidyn.identify(logs, robot, {method!r}, quick=True)"
    assert [(source["role"], source["name"]) for source in made["inputs"]] == [("robot", "axebot"), ("log", "duty.csv")]
    again = identify(duties.replace(duty=duties.duty * 1.01, source="new.csv"), robot, quick=True).provenance
    assert again["inputs"][0] == made["inputs"][0]
    assert again["inputs"][1]["sha256"] != made["inputs"][1]["sha256"]


def test_a_drive_that_the_file_states_stays(duties):
    robot = load_robot("axebot")
    assert as_driven(robot, [duties.replace(duty=None, voltage=6.0 * duties.duty)]) is robot
    assert as_driven(robot, []) is robot
    coasting = robot.replace(drive=robot.drive.replace(kind="duty", off="coast", supply=7.0))
    assert as_driven(coasting, [duties]) is coasting
    told = robot.replace(drive=robot.drive.replace(supply=7.0))
    assert as_driven(told, [duties]).drive.supply == 7.0


@pytest.mark.parametrize("right", [True, False])
def test_a_longer_log_is_asked_for_against_noise_only(right):
    fit = SimpleNamespace(
        value={"body.mass_kg": 2.0},
        std={"body.mass_kg": 0.6},
        at_bound=(),
        unidentifiable=(),
        half_width=lambda _: 0.6 * 1.96 / 2.0,
        is_known=lambda _: True,
        lack_of_fit=SimpleNamespace(found=not right, is_small=False),
    )
    words = str(*advice._wide(fit))
    assert ("times as long" in words) is right
    assert ("a longer log does not help" in words) is not right


def test_a_fit_to_200_logs_without_noise_that_overlap_ends(draws):
    robot = load_robot("axebot")
    voltage = np.repeat(np.random.default_rng(0).uniform(-6.0, 6.0, (100, 3)), 25, axis=0)
    run = simulate(robot, voltage, 0.02)
    cuts = [slice(k * 10, k * 10 + 400) for k in range(draws(200))]
    runs = [
        Run(t=run.t[cut], voltage=run.voltage[cut], wheel_speed=run.wheel_speed[cut], source=f"log{k}.csv")
        for k, cut in enumerate(cuts)
    ]
    axes = robot.friction.axes.replace(coulomb=(1.5, 1.0, 0.05))
    fit = identify(runs, robot.replace(friction=robot.friction.replace(axes=axes))).estimate
    np.testing.assert_allclose(fit.robot.friction.axes.coulomb, robot.friction.axes.coulomb, rtol=1e-3)


@pytest.mark.parametrize(("fit_time", "spent", "is_said"), [(10.0, 70.0, True), (10.0, 40.0, False), (0.1, 1.5, False)])
def test_a_diagnosis_that_takes_far_longer_than_the_fit_offers_quick(monkeypatch, fit_time, spent, is_said):
    """Where it takes 5 times the fit, and more than is hardly noticed."""
    clock, said = [0.0], []
    monkeypatch.setattr(module, "process_time", lambda: clock[0])

    class Fit:
        @property
        def diagnosis(self):
            clock[0] += spent
            return "something"

    asked = module._Request(None, None, (), False, said.append, print, Attempts(), fit_time)
    module._diagnosed({"all": Fit()}, asked)
    urgent = [report.phase for report in said if report.urgent]
    assert urgent == ["the diagnosis took 70 s, 7 times the fit; `quick` leaves it out"] * is_said
