"""The table [correlation] of a robot file: read, written, checked; and what changes of the robot do to it."""

import numpy as np
import pytest

from omnidyn.errors import InputError
from omnidyn.model.correlation import KeyCorrelation
from omnidyn.model.friction import DirectionFriction, Friction
from omnidyn.model.known.told import correlation_of, uncertainty_of, with_correlation
from omnidyn.model.known.uncertainty import plausible
from omnidyn.model.robot import Prior
from omnidyn.model.robot_file import PRESETS, load_robot, parse_robot, robot_to_toml

AXEBOT = load_robot("axebot")
TEXT = (PRESETS / "axebot.toml").read_text("utf-8")
KEYS = ("friction.axes.coulomb[0]", "friction.axes.viscous[0]", "motor.resistance_ohm")
MATRIX = np.array([[1.0, -0.8, -0.5], [-0.8, 1.0, 0.1], [-0.5, 0.1, 1.0]])
TABLE = """
[correlation]
keys = ["body.mass_kg", "motor.resistance_ohm"]
matrix = [[1, 0.25], [0.25, 1.0]]
"""


def test_a_file_without_it_is_as_it_was():
    assert AXEBOT.correlation is None
    assert "[correlation]" not in robot_to_toml(AXEBOT)
    assert parse_robot(TEXT).correlation is None


def test_a_file_with_it_says_which_numbers_are_off_together():
    robot = parse_robot(TEXT + TABLE)
    assert robot.correlation.keys == ("body.mass_kg", "motor.resistance_ohm")
    np.testing.assert_array_equal(robot.correlation.of(robot.correlation.keys), [[1.0, 0.25], [0.25, 1.0]])
    np.testing.assert_array_equal(robot.correlation.of(("motor.resistance_ohm", "body.inertia_kg_m2")), np.eye(2))


def test_it_comes_back_from_its_file_to_the_last_bit():
    robot = with_correlation(AXEBOT, KEYS, MATRIX)
    assert parse_robot(robot_to_toml(robot)) == robot
    with_std = robot.replace(correlation=robot.correlation.replace(std=(0.1, 0.2, 0.3)))
    assert parse_robot(robot_to_toml(with_std)) == with_std


def test_digits_left_out_are_forgiven():
    """A matrix of rank one, rounded."""
    way = np.array([1.0, -1.0, 1.0])
    rounded = np.round(np.outer(way, way) * 0.9999996, 6)
    np.fill_diagonal(rounded, 1.0)
    assert KeyCorrelation(keys=KEYS, matrix=rounded.tolist()).keys == KEYS


BAD = {
    "not square": (
        "matrix = [[1, 0.25], [0.25, 1.0]]",
        "matrix = [[1, 0.25]]",
        "correlation: the matrix is not square; expect",
    ),
    "no row": ("matrix = [[1, 0.25], [0.25, 1.0]]", "matrix = []", "not square; expected 2 rows of 2 numbers"),
    "not symmetric": ("[0.25, 1.0]]", "[0.5, 1.0]]", "not symmetric; got 0.25 and 0.5 between body.mass_kg and motor"),
    "diagonal": ("[[1, 0.25]", "[[0.5, 0.25]", r"matrix\[0\]\[0\] is not 1; got 0.5; expected 1, with itself"),
    "above 1": ("[[1, 0.25], [0.25, 1.0]]", "[[1, 1.5], [1.5, 1.0]]", r"matrix\[0\]\[1\].*got 1.5; expected .*equal"),
    "text": ("[[1, 0.25]", '[[1, "0.25"]', r'matrix\[0\]\[1\]: cannot use this value; got the text "0.25"'),
    "NaN": ("[[1, 0.25]", "[[1, nan]", r"matrix\[0\]\[1\]: cannot use this value; got nan; expected a finite number"),
    "unknown number": (
        "body.mass_kg",
        "body.mas_kg",
        r"\[correlation\] keys\[0\]: unknown key; got body.mas_kg; did you",
    ),
    "not of this robot": (
        "body.mass_kg",
        "drive.supply_V",
        r"keys\[0\]: not a number of this robot; got drive.supply_V",
    ),
    "needs an index": ("body.mass_kg", "friction.axes.coulomb", r"keys\[0\]: needs an index; got friction.axes.coul"),
    "twice": ("body.mass_kg", "motor.resistance_ohm", "a key stands twice; got motor.resistance_ohm; expected every"),
    "unknown key": (
        "matrix =",
        "matrx = 1\nmatrix =",
        r"\[correlation\] matrx: unknown key; got matrx; did you mean matrix",
    ),
    "known of one": ("[[1, 0.25]", "[[{ value = 1.0, std = 0.1 }, 0.25]", r"matrix\[0\]\[0\]: cannot use this value"),
    "std of one": ("keys =", "std = [0.1]\nkeys =", "too few or too many std; got 1; expected 2"),
    "negative std": (
        "keys =",
        "std = [0.1, -1.0]\nkeys =",
        r"std\[1\]: cannot use this value; got -1.0; expected great",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_no_correlation_is_refused(case):
    old, new, words = BAD[case]
    with pytest.raises(InputError, match=words):
        parse_robot(TEXT + TABLE.replace(old, new))


def test_what_cannot_be_is_refused():
    """Three numbers cannot each be the opposite of both others."""
    with pytest.raises(InputError, match=r"no numbers can be correlated like this; got an eigenvalue of -0\.8"):
        with_correlation(AXEBOT, KEYS, [[1.0, -0.9, -0.9], [-0.9, 1.0, -0.9], [-0.9, -0.9, 1.0]])
    with pytest.raises(InputError, match=r"\[correlation\] keys\[0\]: unknown key; got motor.resistance; did you mean"):
        with_correlation(AXEBOT, ["motor.resistance", KEYS[0]], np.eye(2))


def test_a_changed_value_keeps_it():
    robot = with_correlation(AXEBOT, KEYS, MATRIX)
    changed = robot.replace(motor=robot.motor.replace(resistance=2.0))
    assert correlation_of(changed) == robot.correlation


def test_another_shape_of_friction_drops_its_entries():
    """With one number left nothing is left to be correlated; with two, their entry is."""
    shape = Friction(direction=DirectionFriction(coulomb=(1.8, 1.8)))
    assert correlation_of(with_correlation(AXEBOT, KEYS, MATRIX).replace(friction=shape)) is None
    keys = (*KEYS, "body.mass_kg")
    matrix = np.eye(4)
    matrix[2, 3] = matrix[3, 2] = 0.3
    disc = with_correlation(AXEBOT, keys, matrix).replace(friction=shape)
    assert correlation_of(disc).keys == ("motor.resistance_ohm", "body.mass_kg")
    again = parse_robot(robot_to_toml(disc))
    assert again.correlation.matrix == ((1.0, 0.3), (0.3, 1.0))


def test_friction_that_is_off_has_no_std_either():
    robot = AXEBOT.replace(priors={"friction.axes.coulomb[0]": Prior(std=0.1), "body.mass_kg": Prior(std=0.1)})
    assert uncertainty_of(robot).keys == ("friction.axes.coulomb[0]", "body.mass_kg")
    disc = robot.replace(friction=Friction(direction=DirectionFriction(coulomb=(1.8, 1.8))))
    assert uncertainty_of(disc).keys == ("body.mass_kg",)


def test_what_is_known_anew_takes_the_place_of_what_was():
    """What the new fit has not keeps what it has among itself, and loses what it had with the numbers of the fit."""
    robot = with_correlation(AXEBOT, KEYS, MATRIX)
    robot = with_correlation(robot, [KEYS[1], "body.mass_kg"], [[1.0, 0.6], [0.6, 1.0]])
    assert robot.correlation.keys == (KEYS[0], KEYS[2], KEYS[1], "body.mass_kg")
    wanted = np.eye(4)
    wanted[0, 1] = wanted[1, 0] = -0.5
    wanted[2, 3] = wanted[3, 2] = 0.6
    np.testing.assert_array_equal(robot.correlation.of(robot.correlation.keys), wanted)


def test_the_std_of_the_fit_is_kept_where_it_is_not_that_of_the_number():
    """A guess keeps its own std, as a prior of the next fit; what it is known to together is narrower."""
    priors = {KEYS[0]: Prior(std=0.1, origin="identified"), KEYS[2]: Prior(std=0.5, origin="guess")}
    robot = AXEBOT.replace(priors=priors)
    pair, matrix = (KEYS[0], KEYS[2]), [[1.0, 0.9], [0.9, 1.0]]
    assert with_correlation(robot, pair, matrix, [0.1, 0.5]).correlation.std is None
    both = with_correlation(robot, pair, matrix, [0.1, 0.4])
    assert both.correlation.std == (0.1, 0.4)
    np.testing.assert_array_equal(uncertainty_of(both).std, [0.1, 0.4])
    np.testing.assert_array_equal(uncertainty_of(robot).std, [0.1, 0.5])


def test_a_list_that_is_one_number_is_drawn_as_one():
    """A disc: its coulomb is a number for both directions."""
    disc = AXEBOT.replace(friction=Friction(direction=DirectionFriction(coulomb=(1.8, 1.8), viscous=0.5)))
    disc = disc.replace(priors={f"friction.direction.{k}": Prior(std=0.1) for k in ("coulomb", "viscous")})
    both = with_correlation(disc, ["friction.direction.coulomb", "friction.direction.viscous"], [[1, -0.7], [-0.7, 1]])
    x, y = (f"friction.direction.coulomb[{k}]" for k in range(2))
    assert both.correlation.of((x, y))[0, 1] == 1.0
    assert both.correlation.of((y, "friction.direction.viscous"))[0, 1] == -0.7
    for draw in plausible(both, 20):
        assert draw.friction.direction.coulomb[0] == pytest.approx(draw.friction.direction.coulomb[1], rel=1e-9)
    assert parse_robot(robot_to_toml(both)) == both


def test_what_is_measured_anew_by_itself_leaves_it():
    robot = with_correlation(AXEBOT, KEYS, MATRIX)
    assert with_correlation(robot, [KEYS[2]], [[1.0]]).correlation.keys == KEYS[:2]
    assert with_correlation(robot, KEYS, np.eye(3)).correlation is None
