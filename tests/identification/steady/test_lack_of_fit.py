"""Whether a shape that nobody offers is noticed, and none is invented: on logs that share no code with omnidyn."""

import json

import pytest

from omnidyn.identification.steady.lack_of_fit import REPEATS
from tests.support.codes import codes
from tests.support.shapes_offered import NOT_OFFERED, OFFERED, study


@pytest.mark.parametrize("world", [*NOT_OFFERED])
@pytest.mark.some(2)
def test_a_shape_that_is_not_offered_is_noticed_and_named(world):
    found = study(world, 0)
    lack = found.lack_of_fit["all"]
    assert lack.found
    best = lack.remedies[0]
    assert world in (best.key, *best.same_as)
    assert best.force.after < 0.5 * best.force.before
    assert lack.channels["force"] > 0.5
    assert any(best.cause == warning.numbers["with"] for warning in found.warnings if warning.code == "no_shape_fits")


@pytest.mark.parametrize("world", [*OFFERED])
@pytest.mark.some(2)
def test_nothing_is_invented_where_a_shape_fits(world):
    found = study(world, 0)
    assert not found.lack_of_fit["all"].found
    assert found.lack_of_fit["all"].tried
    assert "no_lack_of_fit" in codes(found.statements)


def test_errors_that_repeat_tell_by_themselves():
    """Three speeds in each direction; what is wrong needs no name then."""
    lack = study("rollers", 1, speeds=(0.2, 0.3, 0.4)).lack_of_fit["all"]
    assert lack.found
    assert REPEATS in lack.tried


def test_too_few_directions_are_not_tested_and_it_says_so():
    found = study("disc", 0, step=60)
    assert found.lack_of_fit["all"].tried == ()
    assert "fit_not_tested" in codes(found.statements)


def test_an_estimate_tells_it_as_that_of_whole_logs_does():
    """One contract: found, channels, remedies with their share of the held-out error, best first."""
    one = study("rollers", 0)
    lack = one.estimate.lack_of_fit
    assert lack.found
    assert 0.0 < lack.channels["force"] <= 1.0
    assert lack.remedies[0].key == "rollers"
    assert not lack.remedies[0].offered
    force = lack.remedies[0].force
    assert lack.remedies[0].gain == pytest.approx(1.0 - (force.after / force.before) ** 2)
    assert not study("box", 0).estimate.lack_of_fit.found


def test_what_the_levels_rest_on_is_what_forces_are_made_with():
    """F = K l i / r: every level grows with the torque constant and the gear; along the floor it falls with the radius
    of the wheels, about the vertical it grows with that of the robot. The resistance says nothing beside currents.
    Within 1 % of itself: the weights of a robust fit have a scale of their own."""
    found = study("box", 0).estimate.rests_on
    for name, by in found.items():
        assert by["motor.torque_constant_Nm_A"] == pytest.approx(0.01, rel=0.01)
        assert by["motor.resistance_ohm"] == pytest.approx(0.0, abs=1e-9)
        assert by["motor.gear_ratio"] == pytest.approx(0.01, rel=0.01)
        if "coulomb" in name:
            assert by["wheels.wheel_radius_m"] == pytest.approx(1.0 / 1.01 - 1.0, rel=0.02)
            arm = by["wheels.robot_radius_m"]
            assert arm == pytest.approx(0.01 if name.endswith("[2]") else 0.0, abs=1e-4)


def test_it_is_part_of_the_answer_in_text_and_for_machines():
    found = study("rollers", 0)
    told = found.document()
    assert "no offered shape fits" in told.to_text()
    record = json.loads(json.dumps(told.data))
    assert record["lack_of_fit"] == record["groups"]["all"]["lack_of_fit"]
    assert record["lack_of_fit"]["found"] is True
    assert record["groups"]["all"]["lack_of_fit"]["remedies"][0]["key"] == "rollers"
    assert "look_beyond_shapes" in codes(found.advice)
