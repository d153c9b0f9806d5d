"""All claims together: nothing of the paper is left out, nothing is typed, the verdicts are these."""

import json
import re

import pytest

from omnidyn.paper.claim import Claim, ClaimVerdict, judge, listed, plain, same, tiny
from omnidyn.paper.claims import SUBJECTS, all_claims, headlines

NOT = [
    "inertia",
    "table-2-coulomb-yaw",
    "steady-speed-x",
    "steady-speed-y",
    "steady-speed-yaw",
    "at-rest-x",
    "at-rest-y",
    "at-rest-yaw",
    "force-x",
    "force-y",
    "force-yaw",
    "no-load",
    "fig-4",
    "dead-zone-x",
    "dead-zone-y",
    "dead-zone-yaw",
    "one-robot",
    "axes-disagree",
]
ABSENT, ELSEWHERE = {"current-limit", "figs-1-3"}, {"mpc"}
CORRECTED = [
    "wheel-1-sign",
    "noise",
    "turning-frame",
    "sign-at-rest",
    "inertia-symbol",
    "back-emf",
    "current-sign",
    "row-at-rest",
    "unit-of-b-w",
]


def numbers_after(word, places):
    """Every number in the places that begin with `word`, ranges filled in."""
    found = set()
    for place in places:
        for text in re.findall(rf"{word}s? ([-\d(), ]+)", place):
            for first, last in re.findall(r"(\d+)\)?(?:-\(?(\d+))?", text):
                found |= set(range(int(first), int(last or first) + 1))
    return found


@pytest.fixture(scope="module")
def places(claims):
    return [claim.place for claim in claims.values()]


def test_every_equation_table_and_figure_has_a_claim(places):
    assert numbers_after("eq", places) == set(range(1, 18))
    assert numbers_after("Table", places) == {1, 2, 3, 4}
    assert numbers_after("Fig.", places) | numbers_after("Figs.", places) == {1, 2, 3, 4, 5}
    assert any("section 4" in place for place in places)
    assert "conclusion" in places


def test_verdicts(claims):
    verdicts = {key: claim.verdict for key, claim in claims.items()}
    assert {key for key, verdict in verdicts.items() if verdict is ClaimVerdict.NOT_REPRODUCED} == set(NOT)
    assert {key for key, verdict in verdicts.items() if verdict is ClaimVerdict.CORRECTED} == set(CORRECTED)
    assert [str(verdict) for verdict in ClaimVerdict] == [
        "reproduced",
        "reproduced after a correction",
        "cannot be reproduced",
        "not in the text we have",
        "about another paper",
    ]
    assert {key for key, verdict in verdicts.items() if verdict is ClaimVerdict.NOT_IN_TEXT} == ABSENT
    assert {key for key, verdict in verdicts.items() if verdict is ClaimVerdict.OTHER_PAPER} == ELSEWHERE


def test_one_rule_for_every_number():
    """5 %, or the same in the printed digits: 0.0107 is the printed 0.01 of one digit, 0.0934 is no 0.099."""
    assert same(1.0499, 1.0)
    assert not same(1.051, 1.0)
    assert same(0.0107, 0.01, digit=0.01)
    assert not same(0.0107, 0.01)
    assert not same(0.0934, 0.099, digit=0.001)
    assert same([0.37, 1.2], [0.36, 1.0]).tolist() == [True, False]


def test_the_rule_gives_every_verdict_on_a_number_of_table_2(claims):
    digits = {"viscous": 0.01, "coulomb": 0.1}
    rows = {key: claim for key, claim in claims.items() if key.startswith("table-2-")}
    assert len(rows) == 6
    for key, claim in rows.items():
        digit = 0.001 if key == "table-2-coulomb-yaw" else digits[key.split("-")[2]]
        by_rule = bool(same(claim.numbers["ours"], claim.numbers["printed"], digit))
        assert (claim.verdict is ClaimVerdict.REPRODUCED) == by_rule, key
        assert f"{100 * claim.numbers['off'] / claim.numbers['printed']:+.1f} %" in claim.why


def test_five_lines_say_what_came_out(claims):
    lines = headlines(tuple(claims.values()))
    assert len(lines) == 5
    judged = len(claims) - len(ABSENT) - len(ELSEWHERE)
    assert f"of {judged} claims" in lines[0]
    assert f"{len(CORRECTED)} after a correction, {len(NOT)} cannot be" in lines[0]
    assert "C_w: 0.09337" in lines[2]
    assert "2 of 12" in lines[3]


def test_every_claim_has_a_subject(claims):
    assert {claim.subject for claim in claims.values()} == set(SUBJECTS)


def test_claims_are_deterministic_and_keys_unique(claims):
    again = all_claims()
    assert again == tuple(claims.values())
    assert len({claim.key for claim in again}) == len(again)


def test_numbers_survive_json(claims):
    for claim in claims.values():
        assert json.loads(json.dumps(claim.numbers, allow_nan=False)) == claim.numbers


def test_every_claim_says_why(claims):
    for claim in claims.values():
        assert claim.why.endswith(".")
        assert all((claim.place, claim.statement, claim.printed, claim.ours))
        assert claim.numbers or claim.key == "figs-1-3"


def test_mpc(claims):
    """EVIDENCE.md: the torque row divided by M instead of I_n, 60 times too small; |A| > 1 as a discrete matrix."""
    numbers = claims["mpc"].numbers
    assert numbers["ratio"] == pytest.approx(1.5 / 0.025)
    assert round(numbers["b_torque_row"], 4) == 7.5807
    assert round(numbers["spectral_radius_of_a"], 3) == 7.684


def test_judge():
    assert judge(True, False) is ClaimVerdict.REPRODUCED
    assert judge(False, True) is ClaimVerdict.CORRECTED
    assert judge(False) is ClaimVerdict.NOT_REPRODUCED


def test_text():
    assert listed([0.37, 1.0, 10.02]) == "0.37, 1, 10"
    assert (tiny(1e-16, "W"), tiny(0.002)) == ("1e-12 W", "2.0e-03")
    assert plain(a=1, b=(1, 2)) == {"a": 1.0, "b": [1.0, 2.0]}
    assert Claim("k", "p", "s", "a", "b", ClaimVerdict.REPRODUCED, "w.").numbers == {}
