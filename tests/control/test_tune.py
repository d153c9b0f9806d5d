"""tune: it finds what a grid finds, holds it against robots it has not seen, and says what it gave up."""

import numpy as np
import pytest

import omnidyn
from omnidyn.control.controllers import load_controller, save_controller
from omnidyn.control.tune import Range
from omnidyn.errors import InputError
from omnidyn.model.robot import Prior
from omnidyn.model.robot_file import load_robot

AXEBOT = load_robot("axebot")
KNOWN = AXEBOT.replace(
    priors={f"friction.axes.coulomb[{k}]": Prior(std=0.2 * c) for k, c in enumerate(AXEBOT.friction.axes.coulomb)}
)
QUICK = {"duration": 2.0, "draws": 3, "evaluations": 15, "noise": 0.02}


def test_a_search_finds_what_a_grid_finds():
    """One gain, one robot: the best of a fine grid is no better than 3 % of it."""
    found = omnidyn.tune(AXEBOT, "eight", "speed", duration=2.0, evaluations=25, noise=0.02)
    assert found.better
    runs = {}
    from omnidyn.control.speed_loop import SpeedController

    for faster in np.geomspace(0.3, 20.0, 25):
        control = SpeedController(AXEBOT, faster=float(faster))
        runs[faster] = omnidyn.track(AXEBOT, "eight", control, duration=2.0, noise=0.02, seed=0).rmse_position
    mine = SpeedController(AXEBOT, faster=found.gains["faster"])
    own = omnidyn.track(AXEBOT, "eight", mine, duration=2.0, noise=0.02, seed=0).rmse_position
    assert own < 1.03 * min(runs.values())


def test_over_the_robots_that_may_be_meant(tmp_path):
    said = []
    found = omnidyn.tune(KNOWN, ["eight", "square"], "pid", progress=said.append, **QUICK)
    assert found.draws == 3
    assert found.after.cost <= found.before.cost
    assert found.evaluations == len(said) <= 17
    words = str(found)
    assert "over 3 robots drawn from the std" in " ".join(words.split())
    assert "which the search has not seen" in " ".join(words.split())
    assert "given up: " in words
    save_controller(found.controller, tmp_path / "pid.toml")
    assert load_controller(tmp_path / "pid.toml") == found.controller
    again = omnidyn.tune(KNOWN, ["eight", "square"], "pid", **QUICK)
    assert again.gains == found.gains


def test_a_robot_without_std_is_tuned_alone_and_that_is_said():
    found = omnidyn.tune(AXEBOT, "eight", "pid", **QUICK)
    assert found.draws == 0
    assert found.statements()[0].numbers["draws"] == 0


def test_it_begins_where_a_file_says(tmp_path):
    (tmp_path / "own.toml").write_text(
        'schema = 1\ncontroller = "pid"\n[options]\nfaster = 1.25\nfriction = false\n', encoding="utf-8"
    )
    found = omnidyn.tune(AXEBOT, "eight", str(tmp_path / "own.toml"), **QUICK)
    assert found.start == {"faster": 1.25, "integral": 0.25}
    assert found.controller.options["friction"] is False


def test_a_range_there_and_back():
    for each in (Range(0.3, 20.0), Range(0.0, 1.0, log=False)):
        for place in (0.0, 0.3, 1.0):
            assert each.of(each.at(place)) == pytest.approx(place, abs=1e-3)
        assert each.at(-1.0) == each.low
        assert each.at(7.0) == each.high


@pytest.mark.parametrize(
    "options, words",
    [
        ({"controller": "feedforward"}, "has no gains; got feedforward; expected pid or speed"),
        ({"draws": 0}, "draws: out of range; got 0"),
        ({"evaluations": 1.5}, "evaluations: out of range"),
        ({"path": []}, "nothing to follow"),
        ({"path": ["eigt"]}, "did you mean eight"),
    ],
)
def test_what_cannot_be_tuned_is_refused(options, words):
    with pytest.raises(InputError, match=words):
        omnidyn.tune(AXEBOT, **{"path": "eight", **options})
