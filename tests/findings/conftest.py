"""The log that the tests break, and ways to break it."""

from dataclasses import replace

import pytest

from omnidyn.model.robot_file import load_robot
from tests.support.pushed_logs import clean_log


@pytest.fixture(scope="session")
def robot():
    return load_robot("axebot")


@pytest.fixture(scope="session")
def log(robot):
    return clean_log(robot)


@pytest.fixture(scope="session")
def with_channels(log):
    """The log with some channels changed, or left out where None."""

    def change(base=log, /, **channels):
        kept = {name: values for name, values in {**base.channels, **channels}.items() if values is not None}
        return replace(base, channels=kept)

    return change


@pytest.fixture(scope="session")
def grave():
    """The kinds of findings above a note."""

    def kinds(verdict):
        return {finding.code for finding in verdict.findings if finding.severity != "note"}

    return kinds
