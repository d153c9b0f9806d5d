"""A comparison in a sentence."""

from typing import NamedTuple

import numpy as np
import pytest

from omnidyn.comparison.compare import compare
from omnidyn.comparison.verdict import NOISE, WELL, compared, followed, follows, is_missed, nothing_followed
from omnidyn.document import sentence
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.simulate import simulate
from tests.support.codes import codes


class Score(NamedTuple):
    rmse: float
    fit_percent: float | None
    whiteness: float | None = 0.0


def levels(verdict):
    """How each kind of measurement is followed."""
    return {signal.subject: signal.numbers["level"] for signal in verdict.numbers["signals"]}


def test_a_good_model():
    """Errors of 1 and 3 % of the spread of two wheels, 5 % of the turn rate: fit 99, 97 and 95 %."""
    scores = {"w1": Score(0.1, 99.0), "w2": Score(0.3, 97.0), "omega": Score(0.2, 95.0)}
    verdict = compared(["axebot"], [scores], {})
    assert str(verdict) == "the model follows wheel speeds within 3 % and turn rate within 5 %"
    assert (verdict.code, levels(verdict)) == ("follows", {"wheel speeds": "well", "turn rate": "well"})


def test_a_half_good_model():
    scores = {"w1": Score(0.3, 97.0), "x": Score(0.2, 70.0), "y": Score(0.2, 65.0), "heading": Score(1.2, -40.0)}
    verdict = compared(["axebot"], [scores], {})
    assert levels(verdict) == {"wheel speeds": "well", "position": "roughly", "heading": "not"}
    assert str(verdict).endswith("position roughly (35 %), but heading not at all (rms error 1.2 rad)")


def test_a_bad_model():
    scores = {"w1": Score(12.0, -60.0), "vx": Score(0.4, 30.0)}
    verdict = compared(["axebot"], [scores], {})
    assert (verdict.code, verdict.severity) == ("model_does_not_follow", "error")
    assert levels(verdict) == {"speed over the ground": "hardly", "wheel speeds": "not"}


def test_components_of_one_kind_apart_where_they_differ():
    verdict = follows("the model", followed({"vx": Score(0.01, 98.0), "vy": Score(0.3, -10.0)}))
    assert levels(verdict) == {"vx (speed over the ground)": "well", "vy (speed over the ground)": "not"}


def test_white_errors_are_noise_whatever_their_share():
    (each,) = followed({"i1": Score(0.2, 40.0, 0.3)})
    assert each.level == NOISE
    assert str(each.statement()) == "currents as far as the noise allows (60 %)"
    assert followed({"i1": Score(0.2, 90.0, 0.3)})[0].level == WELL


def test_white_errors_that_are_larger_than_what_moves_are_mere_noise():
    scores = {"x": Score(0.012, -64.0, 0.3), "w1": Score(0.2, 99.0)}
    noise = "there is mere noise in position (rms error 0.012 m)"
    assert str(follows("the model", followed(scores))) == f"the model follows wheel speeds within 1 %; {noise}"
    assert str(follows("the model", followed({"x": scores["x"]}))) == f"the model has nothing to follow; {noise}"
    hardly = {"x": scores["x"], "w1": Score(0.2, 40.0)}
    assert str(follows("the model", followed(hardly))) == f"the model follows wheel speeds hardly (60 %); {noise}"


def test_what_never_changes_cannot_be_followed():
    assert compared(["axebot"], [{"w1": Score(0.0, None)}], {}).code == "nothing_changes"


def test_two_models():
    scores = [{"vx": Score(0.01, 98.0)}, {"vx": Score(0.2, 60.0)}]
    assert str(compared(["a", "b"], scores, {"vx": "a"})) == (
        "a is surely nearer in vx; a follows speed over the ground within 2 %; b follows speed over the ground roughly "
        "(40 %)"
    )
    neither = compared(["a", "b"], scores, {"vx": None})
    assert neither.numbers["nearer"] == ()
    assert codes(neither.numbers["models"]) == ["follows", "follows"]


@pytest.fixture(scope="module")
def run():
    robot = load_robot("axebot")
    rng = np.random.default_rng(0)
    volts = np.repeat(rng.uniform(-6.0, 6.0, (20, 3)), 40, axis=0)
    run = simulate(robot, volts, 0.01)
    return run.replace(wheel_speed=run.wheel_speed + 0.05 * rng.normal(size=run.wheel_speed.shape), source="run.csv")


def test_the_sentence_stands_first_and_in_json(run):
    found = compare(load_robot("axebot"), run)
    assert found.summary().splitlines()[0].startswith("The model follows ")
    assert levels(found.verdict)["wheel speeds"] == "well"
    data = found.to_dict()
    assert (data["verdict"], data["verdict_code"]) == (sentence(str(found.verdict)), "follows")
    text = found.summary()
    assert text.count("white p:") == 1
    assert "VAF %: variance accounted for" in text
    assert "sandwich" not in text


def test_wheels_that_turn_the_other_way_are_not_followed(run):
    found = compare(
        load_robot("axebot"), run.replace(wheel_speed=-run.wheel_speed, twist=None, pose=None, current=None)
    )
    assert found.verdict.code == "model_does_not_follow"
    assert levels(found.verdict) == {"wheel speeds": "not"}
    assert found.failed
    assert found.to_dict()["ok"] is False
    assert not compare(load_robot("axebot"), run).failed


def test_a_model_fails_where_it_follows_nothing():
    """One kind that is followed, or that is noise, is enough not to fail; what never changes is no failure."""
    assert nothing_followed(followed({"w1": Score(12.0, -60.0), "vx": Score(0.4, 30.0)}))
    assert not nothing_followed(followed({"w1": Score(12.0, -60.0), "vx": Score(0.4, 60.0)}))
    assert not nothing_followed(followed({"w1": Score(12.0, -60.0), "vx": Score(0.4, 30.0, 0.3)}))
    assert not nothing_followed(followed({"w1": Score(0.0, None)}))


def test_a_signal_is_missed_where_its_errors_are_large_and_no_noise():
    assert is_missed(0.51, 3.1, 1.0)
    assert not is_missed(0.49, 3.1, 1.0)
    assert not is_missed(0.51, 2.9, 1.0)


def test_a_signal_that_hardly_moves_cannot_be_missed():
    """Fit -99 %: errors of twice a spread of 2.9 times the noise say nothing; a dead sensor has no noise."""
    assert not is_missed(1.99, 1.99 * 2.9, 1.0)
    assert is_missed(1.99, 1.99 * 3.1, 1.0)
    assert is_missed(1.99, 1.99 * 2.9, 0.0)
