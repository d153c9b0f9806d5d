"""drift: against formulas of textbooks, against fits drawn from a known covariance, and on logs of two floors."""

import json

import numpy as np
import pytest
from scipy.stats import chi2 as chi_squared
from scipy.stats import norm

import omnidyn
from benchmarks.wrong_worlds.log import SPEEDS, logged, right_case, robot_of
from benchmarks.wrong_worlds.remedies import FRICTION
from omnidyn.comparison.drift import LEVEL, drift
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.model.keys import Key
from omnidyn.model.known.told import with_correlation
from omnidyn.model.robot import Prior
from omnidyn.model.robot_file import load_robot
from tests.support.codes import codes

KEYS = tuple(f"friction.axes.{name}[{k}]" for name in ("viscous", "coulomb") for k in range(3))
AXEBOT = load_robot("axebot")
TRUTH = np.array([Key.parse(key).get(AXEBOT) for key in KEYS])
STD = 0.03 * TRUTH
CORRELATION = np.eye(6) - 0.8 * (np.eye(6, k=3) + np.eye(6, k=-3))  # viscous against Coulomb friction


def fitted(values, name="fit", source="log", keys=KEYS, std=STD):
    """A robot as `identify` writes it."""
    robot = AXEBOT.replace(name=name)
    for key, value in zip(keys, values, strict=True):
        robot = Key.parse(key).set(robot, float(value))
    priors = {
        key: Prior(std=float(s), source=f"output error, {source}", origin="identified")
        for key, s in zip(keys, std, strict=True)
    }
    robot = robot.replace(priors=priors)
    return with_correlation(robot, keys, CORRELATION, std.tolist()) if len(keys) == 6 else robot


def drawn(rng, shift=0.0):
    covariance = CORRELATION * np.outer(STD, STD)
    return rng.multivariate_normal(TRUTH * (1.0 + shift), covariance)


def test_two_fits_are_told_apart_as_their_difference_over_its_error():
    moved = TRUTH + np.array([0.0, 0.0, 0.0, 5.0, 0.0, 0.0]) * STD
    found = drift([fitted(TRUTH, "a", "one"), fitted(moved, "b", "two")])
    one = next(each for each in found.numbers if each.key == KEYS[3])
    z = np.log(moved[3] / TRUTH[3]) / np.hypot(STD[3] / TRUTH[3], STD[3] / moved[3])
    assert one.p == pytest.approx(6.0 * 2.0 * norm.sf(abs(z)), rel=1e-9)
    assert found.changed == (KEYS[3],)
    off = moved - TRUTH
    both = 2.0 * CORRELATION * np.outer(STD, STD)
    chi2, degrees, p = found.together
    assert (chi2, degrees) == (pytest.approx(off @ np.linalg.solve(both, off)), 6)
    assert p == pytest.approx(chi_squared.sf(chi2, 6))
    assert str(found.verdict).startswith("1 of 6 numbers changed by more than errors allow: Coulomb friction forward")


def test_numbers_that_trade_can_change_together_where_none_does_alone():
    moved = TRUTH + np.array([1.6, 0.0, 0.0, 1.6, 0.0, 0.0]) * STD  # both up, where errors go one up, one down
    found = drift([fitted(TRUTH, "a", "one"), fitted(moved, "b", "two")])
    assert not found.changed
    assert found.together[2] < LEVEL
    assert found.verdict.code == "fits_differ_together"


def test_right_fits_change_as_rarely_as_said():
    rng = np.random.default_rng(4)
    said = together = 0
    for _ in range(300):
        found = drift([fitted(drawn(rng), name, name) for name in ("a", "b", "c")])
        said, together = said + bool(found.changed), together + (found.together[2] <= LEVEL)
    assert 0.01 < together / 300 < 0.10
    assert said / 300 <= 0.09


def test_two_floors_of_another_simulator(tmp_path, monkeypatch, capsys):
    """Files that `identify` writes; Coulomb friction is 15 % more on the second floor, and nothing else is."""
    monkeypatch.chdir(tmp_path)
    case = right_case(8101).setup_but(sensor=SPEEDS, memory=0.0)
    rough = case.world_but(coulomb=tuple(1.15 * c for c in case.world.coulomb))
    for seed, (name, world) in enumerate((("first", case), ("second", case), ("rough", rough)), 8101):
        run = logged(world, seed).replace(source=name)
        omnidyn.save_robot(
            omnidyn.identify(run, robot_of(case.told), omnidyn.OutputError(free=FRICTION)).robot, f"{name}.toml"
        )
    assert not drift(["first.toml", "second.toml"]).changed
    found = drift(["first.toml", "second.toml", "rough.toml"])
    assert {KEYS[3], KEYS[4]} <= set(found.changed)
    assert not set(found.changed) & {KEYS[0], KEYS[1], KEYS[2]}
    forward = next(each for each in found.numbers if each.key == KEYS[3])
    low, high = forward.ci95[2]
    assert low < rough.world.coulomb[0] < high

    from omnidyn.cli import main

    assert main(["drift", "first.toml", "rough.toml", "--picture", "drift.svg", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert KEYS[3] in data["changed"]
    assert data["numbers"][KEYS[3]]["fits"]["rough.toml"]["value"] == pytest.approx(forward.value[2])
    assert "Coulomb friction forward" in data["verdict"]
    assert (tmp_path / "drift.svg").stat().st_size > 1000
    assert main(["drift", "first.toml", "second.toml"]) == 0
    assert capsys.readouterr().out.startswith("No number of 6 changed by more than its errors allow.")


def test_what_is_taken_as_it_stands_and_one_log_twice_are_warned_of():
    heavy = fitted(TRUTH, "b", "log")
    heavy = heavy.replace(body=heavy.body.replace(mass=3.0))
    warnings = drift([fitted(TRUTH, "a", "log"), heavy]).warnings
    assert codes(warnings) == ["fits_of_one_log", "taken_differently"]
    assert warnings[1].numbers == {"values": ((1.5,), (3.0,)), "fits": ("a", "b")}


def test_a_number_that_only_one_fit_has_is_left_out():
    found = drift([fitted(TRUTH, "a", "x"), fitted(TRUTH[:2], "b", "y", KEYS[:2], STD[:2])])
    assert tuple(each.key for each in found.numbers) == KEYS[:2]
    with pytest.raises(InsufficientDataError, match="no number is in two of the fits"):
        drift([fitted(TRUTH[:2], "a", "x", KEYS[:2], STD[:2]), fitted(TRUTH[2:4], "b", "y", KEYS[2:4], STD[2:4])])


def test_what_is_no_fit_is_refused():
    with pytest.raises(InputError, match=r"no number of this file was fitted.*identify wrote"):
        drift([fitted(TRUTH), AXEBOT])
    with pytest.raises(InputError, match="two robots or more"):
        drift([fitted(TRUTH)])
    with pytest.raises(InputError, match="a name of its own"):
        drift([fitted(TRUTH), fitted(TRUTH)], names=["a", "a"])


def test_a_picture_of_it():
    found = drift([fitted(TRUTH, name, name) for name in ("a", "b")])
    figure = found.plot()
    assert len(figure.axes) == 6
