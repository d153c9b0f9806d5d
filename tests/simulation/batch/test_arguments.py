"""What is given to batches and samples: a wrong argument is named; whole numbers of NumPy are whole numbers."""

import pickle

import numpy as np
import pytest

from omnidyn.errors import InputError
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.batch.batch import simulate_batch
from omnidyn.simulation.batch.sample import sample
from omnidyn.simulation.simulate import simulate

VOLTS = [[0.0, 3.0, -3.0]] * 5
FACTORS = {"body.mass_kg": (0.8, 1.2)}


@pytest.fixture(scope="module")
def robot():
    return load_robot("axebot")


@pytest.mark.parametrize(
    "change, words",
    [
        ({"robots": None}, "robots: not robots; got NoneType"),
        ({"robots": 5}, "robots: not robots; got int"),
        ({"robots": "axebot"}, "robots: not robots; got str"),
        ({"supply": np.array([5.0, 6.0])}, "supply: not a supply"),
        ({"threads": 1.5}, "threads: cannot work with so many threads"),
        ({"threads": True}, "threads: cannot work with so many threads"),
        ({"every": 2.5}, "every: cannot keep every so many samples"),
        ({"dtype": "flot"}, "dtype: no such dtype; got flot"),
        ({"pose": np.array([1, 2])}, "pose: no such pose"),
        ({"tol": "a"}, "tol: tolerance out of range"),
        ({"dt": "a"}, "dt: step out of range"),
        ({"voltage": np.array(VOLTS) * 1j}, "voltage: not numbers"),
        ({"voltage": np.array(VOLTS) > 0.0}, "voltage: not numbers"),
        ({"start_twist": (1j, 0.0, 0.0)}, "twist: not numbers"),
        ({"start_twist": (True, False, False)}, "twist: not numbers"),
        ({"start_twist": (1e30, 0.0, 0.0)}, "twist: no robot starts there"),
        ({"start_twist": (np.nan, 0.0, 0.0)}, "twist: cannot start there"),
        ({"start_pose": (1e30, 0.0, 0.0)}, "pose: no robot starts there"),
        ({"substeps": 0}, "substeps: cannot cut a row into so many steps"),
        ({"substeps": 1.5}, "substeps: cannot cut a row into so many steps"),
    ],
    ids=lambda case: "-".join(case) if isinstance(case, dict) else "",
)
def test_a_wrong_argument_is_named(robot, change, words):
    given = {"robots": [robot], "voltage": VOLTS, "dt": 0.02} | change
    with pytest.raises(InputError) as caught:
        simulate_batch(**given)
    assert words in str(caught.value)


def test_volts_that_are_no_numbers_are_refused_of_one_robot_too(robot):
    for volts in (np.array(VOLTS) * 1j, np.array(VOLTS) > 0.0):
        with pytest.raises(InputError, match="voltage: not numbers"):
            simulate(robot, volts, 0.02)


def test_whole_numbers_of_numpy_are_numbers(robot):
    one, two = np.int64(1), np.int32(2)
    run = simulate_batch((each for each in [robot] * 3), VOLTS, 0.02, threads=one, every=two)
    assert run.end.twist.shape == (3, 3)
    assert len(sample(robot, np.int64(4), np.int64(7), factors=FACTORS)) == 4


@pytest.mark.parametrize("count, seed", [(3.5, 0), (True, 0), (0, 0), (3, "a"), (3, -1)])
def test_a_count_or_a_seed_that_is_none_is_refused(robot, count, seed):
    with pytest.raises(InputError):
        sample(robot, count, seed, factors=FACTORS)


def test_a_sample_is_its_robots(robot):
    drawn = sample(robot, 5, factors=FACTORS)
    robots = list(drawn)
    assert [drawn[k] for k in range(5)] == robots
    assert drawn[-1] == robots[4]
    assert drawn[1:3] == robots[1:3]
    assert [*reversed(drawn)] == robots[::-1]
    assert list(pickle.loads(pickle.dumps(drawn))) == robots
    with pytest.raises(IndexError):
        drawn[5]
