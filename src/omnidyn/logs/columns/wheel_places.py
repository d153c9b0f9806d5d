"""Places in names: which wheel front_left, fl, leftFront or rear_right_wheel_joint is.

A place is the angle [degree] at which it stands, counter-clockwise from forward: front 0, left 90, rear left 135.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

import numpy as np

from omnidyn.model.robot import Robot
from omnidyn.model.wheels import MAX_WHEELS, MIN_WHEELS, per_wheel

_FRONT, _REAR, _LEFT, _RIGHT = "front", "rear", "left", "right"
_PLACES_WORDS = {
    _FRONT: "front vorn vorne avant delantera",
    _REAR: "rear back hind hinten arriere trasera",
    _LEFT: "left links gauche izquierda",
    _RIGHT: "right rechts droite derecha",
}
_SIDES = {word: side for side, words in _PLACES_WORDS.items() for word in words.split()}
_LETTERS = {"f": _FRONT, "b": _REAR, "l": _LEFT, "r": _RIGHT}
_MIDDLE = {"mid", "middle", "center", "centre"}  # of a side: middle_left is left
ANGLES = {
    (_FRONT, ""): 0.0,
    (_FRONT, _LEFT): 45.0,
    ("", _LEFT): 90.0,
    (_REAR, _LEFT): 135.0,
    (_REAR, ""): 180.0,
    (_REAR, _RIGHT): -135.0,
    ("", _RIGHT): -90.0,
    (_FRONT, _RIGHT): -45.0,
}
FOUR = (45.0, -45.0, 135.0, -135.0)  # in the order of a file of four wheels: front left, front right, rear left, ..
WIDEST_GAP = 180.0  # [degree] between neighbours of wheels that stand around a robot
FARTHEST_ANGLE = 40.0  # [degree] from its place beyond which a wheel is another one


def place_in(words: Sequence[str], known_words: Collection[str] = ()) -> tuple[float | None, list[str]]:
    """(the place that the words of a name say, the other words); (None, all words) where they say none or two.

    words: in small letters. known_words: words that a pair of letters may stand at: "fl" in flspeed or wheelfl.
    """
    sides: list[str] = []
    words_left: list[str] = []
    for word in words:
        sides_of_word, rest = _sides_of(word, known_words)
        sides += sides_of_word
        words_left += [rest] if rest else []
    lengthwise, crosswise = set(sides) & {_FRONT, _REAR}, set(sides) & {_LEFT, _RIGHT}
    if not sides or len(lengthwise) > 1 or len(crosswise) > 1 or "emf" in words:
        return None, list(words)
    place = ANGLES["".join(lengthwise), "".join(crosswise)]
    return place, [word for word in words_left if word not in _MIDDLE]


def _sides_of(word: str, known_words: Collection[str]) -> tuple[list[str], str]:
    """(sides that a word says, what is left of it)."""
    if word in _SIDES:
        return [_SIDES[word]], ""
    pair_match = re.fullmatch(f"({'|'.join(_SIDES)})({'|'.join(_SIDES)})", word)
    if pair_match:
        return [_SIDES[pair_match[1]], _SIDES[pair_match[2]]], ""
    for pair, rest in ((word[:2], word[2:]), (word[-2:], word[:-2])) if word not in known_words else ():
        sides = _pair(pair)
        if sides and (not rest or rest in known_words):
            return sides, rest
    return [], word


def _pair(letters: str) -> list[str]:
    """Sides of two letters: fl, lf, bl, rear left as rl or lr, rear right as rr; [] for others."""
    if letters in ("rl", "lr"):
        return [_REAR, _LEFT]
    if letters == "rr":
        return [_REAR, _RIGHT]
    sides = [_LETTERS.get(letter, "") for letter in letters]
    crossing = {*sides} & {_FRONT, _REAR} and {*sides} & {_LEFT, _RIGHT}
    return sides if len(letters) == 2 and crossing and all(sides) else []


def wheels_at(places: Collection[float], robot: Robot | None = None) -> dict[float, int]:
    """Place -> number of the wheel from 1; {} where places do not decide it.

    With a robot of as many wheels: the wheel that stands there, where each has its own. Else of three wheels or more
    all around: four in the order front left, front right, rear left, rear right, others counter-clockwise from forward.
    """
    angles = sorted({*places}, key=lambda place: place % 360.0)
    gaps = [(after - before) % 360.0 for before, after in zip(angles, [*angles[1:], *angles[:1]], strict=True)]
    if not MIN_WHEELS <= len(angles) <= MAX_WHEELS or max(gaps) > WIDEST_GAP:
        return {}
    if robot is None or robot.wheels.count != len(angles):
        return {place: k for k, place in enumerate(FOUR if {*angles} == {*FOUR} else angles, 1)}
    from scipy.optimize import linear_sum_assignment  # imported lazily: 0.1 s that most logs do not need

    stand = _angles(robot)
    apart = np.abs((np.subtract.outer(angles, stand) + 180.0) % 360.0 - 180.0)
    rows, wheels = linear_sum_assignment(apart)
    if (apart[rows, wheels] > FARTHEST_ANGLE).any():
        return {}
    return {angles[row]: int(wheel) + 1 for row, wheel in zip(rows, wheels, strict=True)}


def _angles(robot: Robot) -> list[float]:
    """Where the wheels stand [degree]; mecanum wheels in an X, whose azimuth says their side, by their rollers."""
    azimuth = np.asarray(robot.wheels.azimuth_deg, dtype=float)
    roller = per_wheel(robot.wheels.roller_angle_deg, len(azimuth))
    side = (azimuth + 180.0) % 360.0 - 180.0
    corner = np.where(side * roller < 0.0, 45.0, 135.0) * np.sign(side)
    return np.where(roller == 0.0, azimuth, corner).tolist()
