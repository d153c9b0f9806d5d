"""All claims together: nothing of the paper is left out, nothing is typed, the verdicts are these."""

import json
import re

import pytest

from omnidyn.paper.claim import Claim, ClaimVerdict, judge, listed, plain, tiny
from omnidyn.paper.claims import all_claims

NOT = [
    "inertia",
    "current-limit",
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
    "figs-1-3",
    "one-robot",
    "axes-disagree",
    "mpc",
]
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
    ]


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
