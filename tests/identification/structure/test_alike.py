"""Causes that are the same to a log by construction stand in one group, with their values and what tells them apart."""

import pytest

from benchmarks.blind.alike import ALIKE, grouped
from omnidyn.identification.advice import next_action
from omnidyn.identification.lack_of_fit import LackOfFit, Remedy
from omnidyn.statement import quoted

SOME = [ALIKE[0], ALIKE[7], ALIKE[12], ALIKE[18]]


@pytest.mark.parametrize("case", SOME, ids=[case.name for case in SOME])
@pytest.mark.some(2)
def test_equal_causes_are_one_group(case):
    good, words = grouped(case, 41)
    assert good, words


def test_the_group_is_told_with_its_values_and_what_would_decide():
    group = [
        Remedy("gain", quoted("gain 0.94"), 0.3, 0.01, ("wheels.wheel_radius_m", "body.mass_kg")),
        Remedy("wheels.wheel_radius_m", quoted("wheel radius -3 %"), 0.3, 0.01, ("gain", "body.mass_kg")),
    ]
    lack = LackOfFit(True, {"twist[0]": 0.4}, {"twist[0]": 0.1}, (), tuple(group), {})
    assert str(lack.statement()).endswith(
        "most likely gain 0.94, or what this log cannot tell from it (wheel radius -3 %, mass)"
    )
    assert next_action(group[0]) == "distinguish"
