"""Table 2 from Table 1 against EVIDENCE.md, section 1, and scipy's linregress."""

import numpy as np
import pytest
from scipy import stats

from tests.paper import printed

FITTED = {"x": (0.9382, 2.1863), "y": (0.9659, 1.5217), "yaw": (0.01073, 0.09337)}
HALF = {"x": (0.55, 0.38), "y": (0.50, 0.34), "yaw": (0.008, 0.056)}
MOVING = {"x": (1.123, 2.031), "y": (0.788, 1.672), "yaw": (0.0168, 0.0430)}
DIGITS = {"x": (4, 4), "y": (4, 4), "yaw": (5, 5)}
HALF_DIGITS = {"x": 2, "y": 2, "yaw": 3}
MOVING_DIGITS = {"x": 3, "y": 3, "yaw": 4}
KINDS = ("viscous", "coulomb")


@pytest.mark.parametrize("axis", printed.AXES)
@pytest.mark.parametrize("kind", KINDS)
def test_table_2_as_in_the_evidence(claims, axis, kind):
    numbers, k = claims[f"table-2-{kind}-{axis}"].numbers, KINDS.index(kind)
    assert round(numbers["ours"], DIGITS[axis][k]) == FITTED[axis][k]
    assert round(numbers["half_interval"], HALF_DIGITS[axis]) == HALF[axis][k]
    assert round(numbers["moving_rows"], MOVING_DIGITS[axis]) == MOVING[axis][k]


@pytest.mark.parametrize("axis", printed.AXES)
@pytest.mark.parametrize("rows, value, interval", [(0, "ours", "interval"), (1, "moving_rows", "moving_rows_interval")])
def test_table_2_by_linregress(claims, axis, rows, value, interval):
    speed, force = np.array(printed.SPEED[axis][rows:]), np.array(printed.FORCE[axis][rows:])
    fit = stats.linregress(speed, force)
    quantile = stats.t.ppf(0.975, len(speed) - 2)
    for kind, best, error in (("viscous", fit.slope, fit.stderr), ("coulomb", fit.intercept, fit.intercept_stderr)):
        numbers = claims[f"table-2-{kind}-{axis}"].numbers
        assert numbers[value] == pytest.approx(best, rel=1e-9)
        assert numbers[interval] == pytest.approx([best - quantile * error, best + quantile * error], rel=1e-9)


def test_only_c_w_is_not_reproduced(claims):
    verdicts = {key: claim.verdict for key, claim in claims.items() if key.startswith("table-2-")}
    assert verdicts.pop("table-2-coulomb-yaw") == "cannot be reproduced"
    assert len(verdicts) == 5
    assert set(verdicts.values()) == {"reproduced"}


def test_printed_c_w_is_inside_the_interval_all_the_same(claims):
    claim = claims["table-2-coulomb-yaw"]
    low, high = claim.numbers["interval"]
    assert low < 0.099 < high
    assert "inside the 95 % interval" in claim.why


def test_row_at_rest(claims):
    claim = claims["row-at-rest"]
    assert claim.verdict == "reproduced after a correction"
    assert claim.numbers["breakaway_at_least"] == [2.25, 1.47, 0.10]
    assert np.round(claim.numbers["viscous"], 4).tolist() == [1.1225, 0.7879, 0.0168]
    assert np.round(claim.numbers["coulomb"], 3).tolist() == [2.031, 1.672, 0.043]


def test_unit_of_b_w(claims):
    """A slope of 0.0107 N m s per rad; as a force at 0.1 m it would be ten times that."""
    numbers = claims["unit-of-b-w"].numbers
    assert round(numbers["as_torque"], 4) == 0.0107
    assert numbers["as_force"] == pytest.approx(10 * numbers["as_torque"])
    assert claims["unit-of-b-w"].verdict == "reproduced after a correction"


def test_steady_law_gives_friction_back(claims):
    """The points are (speed, B speed + C) of the printed B and C."""
    numbers = claims["steady-law"].numbers
    viscous, coulomb = np.repeat(printed.VISCOUS, 3), np.repeat(printed.COULOMB, 3)
    assert numbers["forces"] == pytest.approx(viscous * numbers["speeds"] + coulomb, rel=1e-12)
    assert claims["steady-law"].verdict == "reproduced"
