"""One recording given twice counts once."""

import numpy as np
import pytest

from omnidyn.identification.fingerprints import count_once
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError, SteadyState
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.codes import codes
from tests.support.plain_world import World, fan, spoiled, steady_logs

AXEBOT = load_robot("axebot")


def fan_runs():
    random, world = np.random.default_rng(0), World(cone=(2.0, 2.0), elements=[((0.0, 0.0, 1.0), 0.1, 0.1)])
    logs = [spoiled(log, random) for _, log in steady_logs(world, fan())]
    return [Run(t=t, current=i, wheel_speed=w, source=f"run{k}.csv") for k, (t, i, w) in enumerate(logs)]


def driven(seed):
    random = np.random.default_rng(seed)
    voltage = np.repeat(random.uniform(-6.0, 6.0, (10, 3)), 30, axis=0)
    run = simulate(AXEBOT, voltage, 0.01)
    noisy = run.twist + 0.01 * random.standard_normal(run.twist.shape)
    return Run(t=run.t, voltage=run.voltage, twist=noisy, source=f"{seed}.csv")


def test_another_name_and_another_start_of_time_do_not_make_another_recording():
    run = fan_runs()[0]
    copy = run.replace(source="copy.csv", t=run.t + 100.0)
    other = run.replace(current=run.current + 1e-9)
    kept, words = count_once([run, copy, other], ["all"] * 3)
    assert kept == [0, 2]
    assert (*map(str, words),) == ("copy.csv is the same recording as run0.csv: it counts once",)


def test_steady_state_counts_once_and_says_so():
    runs = fan_runs()
    once = identify(runs, AXEBOT, SteadyState(shape="disc")).study
    twice = identify([*runs, *(run.replace(source="again") for run in runs)], AXEBOT, SteadyState(shape="disc")).study
    assert twice.estimate.std == once.estimate.std
    assert len(twice.points) == len(once.points)
    assert codes(twice.warnings).count("counted_once") == len(runs)


def test_a_recording_in_two_groups_is_no_evidence_of_their_difference():
    runs = fan_runs()
    study = identify(runs + runs, AXEBOT, SteadyState(shape="disc"), groups=["a"] * 24 + ["b"] * 24).study
    assert [*study.estimates] == ["a", "b"]
    assert any("the groups are not independent" in str(words) for words in study.warnings)


def test_output_error_counts_once_and_says_so():
    run = driven(1)
    once = identify(run, AXEBOT, OutputError(nuisances=())).estimate
    twice = identify([run, run.replace(source="copy.csv")], AXEBOT, OutputError(nuisances=())).estimate
    assert twice.std == pytest.approx(once.std)
    assert ("counted_once", "copy.csv") in {(each.code, each.subject) for each in twice.warnings}


def test_a_held_out_copy_of_a_fitted_log_proves_nothing():
    run = driven(1)
    found = identify([run, run.replace(source="copy.csv")], AXEBOT, OutputError(nuisances=()), hold_out=("copy.csv",))
    assert ("held_out_is_fitted", "copy.csv") in {(each.code, each.subject) for each in found.advice}
