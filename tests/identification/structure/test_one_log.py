"""What differs in one of several logs is found with the name of that log: a load, a floor, a battery.

The worlds are those of the benchmark, whose simulator shares no code with ours.
"""

import pytest

from benchmarks.wrong_worlds.log import SPEEDS, logged, right_case, robot_of
from benchmarks.wrong_worlds.remedies import FRICTION
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError

INERTIA = "body.inertia_kg_m2"


def lack_of(second, seed, count=3):
    """What a fit to logs of a right robot leaves out, of which the second is of another world."""
    case = right_case(seed).setup_but(sensor=SPEEDS, memory=0.0, rate=50.0, seconds=12.0).both_but(frame=False)
    cases = [case] * count
    cases[1] = second(case)
    logs = [logged(one, seed + k).replace(source=f"{k}.csv") for k, one in enumerate(cases)]
    return identify(logs, robot_of(case.told), OutputError(free=(*FRICTION, INERTIA))).estimate.lack_of_fit


@pytest.mark.parametrize(
    ("key", "second", "share"),
    [
        ("mass of one log", lambda case: case.world_but(change=0.0, after_mass=1.3), 0.3),
        ("friction of one log", lambda case: case.world_but(change=0.0, after_friction=1.4), 0.0),
        ("supply of one log", lambda case: case.world_but(change=0.0, after_gain=0.9), -0.1),
    ],
)
def test_what_differs_in_one_log_is_the_first_cause(key, second, share):
    lack = lack_of(second, 7301)
    best = lack.causes[0]
    assert lack.found
    assert (best.key, best.confident) == (key, True)
    assert best.cause.numbers["log"] == "1.csv"
    assert "in 1.csv than in the other logs" in str(best.cause)
    assert best.cause.numbers["share"] == pytest.approx(share, abs=0.4 * abs(share))


def test_nothing_differs_in_logs_of_one_robot():
    assert not lack_of(lambda case: case, 7301).found
