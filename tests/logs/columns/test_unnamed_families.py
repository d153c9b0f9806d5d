"""Numbered columns whose names say no quantity are asked about, where the log lacks one; the answer shown is taken."""

import pytest

from omnidyn import load_robot
from omnidyn.logs.columns.guess import guess_columns
from tests.logs.columns.test_guess import clock, table_of
from tests.support.codes import said

SPEEDS = [f"w{k}_rad_s" for k in (1, 2, 3)]


def table_with(tmp_path, *stems, numbers=(1, 2, 3), more=()):
    names = [f"{stem}{k}" for stem in stems for k in numbers]
    return table_of(tmp_path, {"t_s": clock(0.01), **dict.fromkeys([*more, *names], 1.5)})


def taken(columns):
    return {component: column.name for component, column in columns.columns.items() if component != "t"}


def test_what_a_log_lacks_is_asked_of_numbered_columns_and_the_answer_is_taken(tmp_path):
    table = table_with(tmp_path, "input_", more=SPEEDS)
    columns = guess_columns(table)
    (text,) = said(columns.doubts)
    assert text.startswith("input_1, input_2, input_3 look like columns of wheels, but no word and no unit says")
    (doubt,) = columns.doubts
    assert doubt.declarations == (("assume", "input=V"), ("assume", "input=duty"))
    for _, answer in doubt.declarations:
        name, _, unit = answer.partition("=")
        answered = guess_columns(table, assume={name: unit if unit == "V" else "duty/2"})
        letter = "u" if unit == "V" else "d"
        assert [taken(answered)[f"{letter}{k}"] for k in (1, 2, 3)] == ["input_1", "input_2", "input_3"]
        assert not answered.doubts


@pytest.mark.parametrize("stem", ["in", "out", "y", "motor", "wheel_", "joint", "phi_"])
@pytest.mark.parametrize(("unit", "letter"), [("V", "u"), ("duty/2", "d"), ("rad/s", "w"), ("rad", "a"), ("deg", "a")])
@pytest.mark.parametrize("first", [0, 1])
def test_any_answer_is_taken_whatever_the_word(tmp_path, stem, unit, letter, first):
    numbers = [first, first + 1, first + 2]
    table = table_with(tmp_path, stem, numbers=numbers)
    (doubt,) = guess_columns(table).doubts
    assert [text for _, text in doubt.declarations] == [
        f"{doubt.stem}={choice}" for choice in ("V", "duty", "rad/s", "rad", "ticks/COUNTS_PER_TURN")
    ]
    answered = guess_columns(table, assume={doubt.stem: unit})
    assert taken(answered) == {f"{letter}{k + 1}": f"{stem}{numbers[k]}" for k in range(3)}


@pytest.mark.parametrize("form", ["motor_{}", "{} wheel", "{}_out"])
def test_places_of_wheels_are_asked_about_too(tmp_path, form):
    names = [form.format(place) for place in ("front_left", "front_right", "rear_left", "rear_right")]
    table = table_of(tmp_path, {"t_s": clock(0.01), **dict.fromkeys(names, 1.5)})
    (doubt,) = guess_columns(table).doubts
    assert doubt.columns == tuple(names)
    answered = guess_columns(table, assume={doubt.stem: "rad/s"})
    assert [taken(answered)[f"w{k}"] for k in (1, 2, 3, 4)] == names
    two = table_of(tmp_path, {"t_s": clock(0.01), **dict.fromkeys(names[:2], 1.5)}, name="two.csv")
    assert not guess_columns(two).doubts


def test_a_log_that_lacks_nothing_asks_nothing(tmp_path):
    columns = guess_columns(table_with(tmp_path, "sonar", "in", more=[*SPEEDS, "u1_V", "u2_V", "u3_V"]))
    assert not columns.doubts
    assert columns.passed_over == ("sonar1", "sonar2", "sonar3", "in1", "in2", "in3")


@pytest.mark.parametrize("stem", ["temp", "acc", "adc", "f", "x"])
def test_a_word_that_says_something_else_is_not_asked_about(tmp_path, stem):
    assert not guess_columns(table_with(tmp_path, stem, more=SPEEDS)).doubts


@pytest.mark.parametrize("numbers", [(1, 2), (2, 3, 4), (1, 2, 4)])
def test_other_numbers_are_no_wheels(tmp_path, numbers):
    assert not guess_columns(table_with(tmp_path, "in", numbers=numbers, more=SPEEDS)).doubts


def test_a_family_of_another_count_than_the_wheels_of_the_robot_is_not_asked_about(tmp_path):
    robot = load_robot("axebot")
    assert len(guess_columns(table_with(tmp_path, "in"), robot).doubts) == 1
    assert not guess_columns(table_with(tmp_path, "in", numbers=(1, 2, 3, 4)), robot).doubts


def test_what_the_user_says_of_some_is_not_asked_again(tmp_path):
    table = table_with(tmp_path, "in", more=SPEEDS)
    assert not guess_columns(table, taken={f"in{k}": f"u{k}" for k in (1, 2, 3)}).doubts


@pytest.mark.parametrize("word", ["phi_", "theta", "psi", "alpha_"])
def test_greek_angles_that_are_numbered_as_wheels_are_their_angles(tmp_path, word):
    units = ["s", *["rad/s"] * 3, *["deg"] * 3]
    angles = [f"{word}{k}" for k in (1, 2, 3)]
    table = table_of(tmp_path, {"t": clock(0.01), "w1": 1, "w2": 1, "w3": 1, **dict.fromkeys(angles, 1)}, units)
    columns = guess_columns(table)
    assert [columns.columns[f"a{k}"].name for k in (1, 2, 3)] == angles
    assert columns.columns["a1"].unit == "deg"


@pytest.mark.parametrize(
    "angles", [["theta1", "theta2"], ["theta1", "theta2", "theta3", "theta4"], ["yaw1", "yaw2", "yaw3"], ["phi_2"]]
)
def test_headings_of_several_robots_are_no_wheels(tmp_path, angles):
    units = ["s", *["rad/s"] * 3, *["deg"] * len(angles)]
    table = table_of(tmp_path, {"t": clock(0.01), "w1": 1, "w2": 1, "w3": 1, **dict.fromkeys(angles, 1)}, units)
    columns = guess_columns(table)
    assert not any(component.startswith("a") for component in columns.columns)
    assert set(angles) <= set(columns.passed_over)
