"""Of logs with one fault nothing else is said: drawn logs in which something untrue was."""

import pytest

from benchmarks.logs.check import CODES
from benchmarks.logs.check_faults import FAULTS, draw
from omnidyn.findings.check import check
from omnidyn.statement import NOTE


@pytest.mark.parametrize(
    ("fault", "seed"),
    [
        ("dead channel", 29),  # "a mean over 6 rows": of the speed that stands in for the dead wheel
        ("dead channel", 41),
        ("dead channel", 119),  # "the marker is mounted at 33 deg", while the path was as alike as logged
        ("inverted sign", 89),  # "one was logged in the place of the other": wheels that turn against each other
    ],
)
def test_a_fault_is_named_alone(fault, seed):
    log, robot, broken, _ = draw(fault, seed)
    verdict = check(log, robot)
    assert FAULTS[fault].found(verdict, broken)
    said = {finding.code for finding in verdict.findings if finding.severity != NOTE}
    assert said <= {*CODES[fault], *FAULTS[fault].also}
