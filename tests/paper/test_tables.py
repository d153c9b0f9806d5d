"""Tables 1-4, typed a second time in printed.py: a slip of the pen in one of the two shows."""

import numpy as np
import pytest

from omnidyn.paper import tables
from omnidyn.paper.steady import measured_speed, pattern_of, printed_force, printed_speed, printed_voltage
from tests.paper import printed


@pytest.mark.parametrize("axis", printed.AXES)
def test_table_1(axis):
    assert printed_speed(axis).tolist() == printed.SPEED[axis]
    assert printed_force(axis).tolist() == printed.FORCE[axis]
    assert printed_voltage(axis).tolist() == np.outer(printed.LEVEL[axis], printed.PATTERN[axis]).tolist()
    assert [row.at_rest for row in tables.TABLE_1[axis]] == [True, False, False, False]


def test_table_2():
    assert tables.TABLE_2_VISCOUS == (0.94, 0.96, 0.01)
    assert tables.TABLE_2_COULOMB == (2.2, 1.5, 0.099)


@pytest.mark.parametrize("axis", printed.AXES)
def test_table_4_is_2_3_and_4_volts_along_each_axis(axis):
    assert np.array(tables.TABLE_4[axis]).tolist() == np.outer([2, 3, 4], printed.PATTERN[axis]).tolist()
    assert list(pattern_of(axis)) == printed.PATTERN[axis]


def test_six_steps_of_table_4_have_a_row_in_table_1():
    found = {axis: [measured_speed(axis, row) for row in tables.TABLE_4[axis]] for axis in printed.AXES}
    assert found == {"x": [0.37, 0.74, 1.08], "y": [None, 0.42, 0.75], "yaw": [8.04, None, None]}


def test_preset_is_table_3(claims):
    """Against the second typing, not against the first."""
    claim = claims["table-3"]
    wanted = [printed.M, printed.I_N, printed.B, printed.R_WHEEL, printed.R_A, printed.L_A, printed.K_T, printed.K_T]
    wanted += [printed.GEAR, 6.0, *printed.VISCOUS, *printed.COULOMB]
    assert list(claim.numbers.values()) == wanted
    assert claim.verdict == "reproduced"


def test_a_preset_with_another_number_is_found(axebot):
    from omnidyn.paper.speeds import speed_claims

    other = axebot.replace(motor=axebot.motor.replace(resistance=1.7))
    claim = next(claim for claim in speed_claims(other) if claim.key == "table-3")
    assert claim.verdict == "cannot be reproduced"
    assert "1 differ: motor.resistance" in claim.why
