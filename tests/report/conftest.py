"""The pictures of the paper, drawn once for all tests."""

import pytest

from omnidyn.model.robot_file import load_robot
from omnidyn.report.figures.paper_pictures import paper_pictures


@pytest.fixture(scope="session")
def robot():
    return load_robot("axebot")


@pytest.fixture(scope="session")
def pictures(robot):
    return list(paper_pictures(robot))
