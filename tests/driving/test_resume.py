"""A drive that was stopped at any moment is resumed to the intervals that its plan promised."""

import json

import numpy as np
import pytest

import omnidyn
from omnidyn.driving.program_file import plan_beside, read_program
from omnidyn.driving.resume import driven_rows, rest_of
from omnidyn.driving.simulated import SimulatedRobot
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.identification.planning.plan import plan_rest

NOISE = {"twist": (0.02, 0.02, 0.1)}


@pytest.fixture(scope="module")
def plan(tmp_path_factory):
    """A plan of the paper's robot, as the command writes it."""
    from omnidyn.cli import main

    path = tmp_path_factory.mktemp("resume") / "plan.csv"
    assert main(["plan", "axebot", "--time", "60", "--noise", "twist=0.02,0.02,0.1", "-o", str(path)]) == 0
    return path


def stopped_at(program, seconds):
    """The log of a drive whose key was released then."""
    robot = SimulatedRobot(program.robot, NOISE, rate=100.0)
    return omnidyn.drive(program, robot, held=lambda: robot.clock.now() < seconds + 0.31)


def check(plan, moments):
    """Every interval of both logs together beside that of the whole plan."""
    program, beside = read_program(plan), plan_beside(plan)
    wider = []
    for moment in moments:
        record = stopped_at(program, moment)
        assert record.stopped is not None
        driven = driven_rows(program, record.run)
        assert abs(len(driven) * program.dt - moment) < 0.05
        np.testing.assert_array_equal(driven, program.inputs[: len(driven)])
        made = plan_rest(
            beside.robot,
            driven / beside.limit,
            program.seconds - moment,
            program.area,
            promised=beside.promised,
            noise=beside.noise,
        )
        assert len(made.share) + len(driven) <= len(program.inputs) + 1
        wider.append(max(made.predicted[name].half / half for name, half in beside.promised.items()))
    assert max(wider) < 1.16, wider  # a move in its middle is lost: at 2 of 20 moments 14 and 15 % were seen
    assert sorted(wider)[int(0.9 * (len(wider) - 1))] < 1.1, wider


def test_the_same_intervals_after_a_stop(plan):
    check(plan, (14.0, 35.0))


@pytest.mark.long
def test_the_same_intervals_after_a_stop_at_twenty_moments(plan):
    check(plan, np.random.default_rng(7).uniform(1.0, 44.0, 20))


def test_the_rest_is_a_program_that_is_driven(plan):
    program = read_program(plan)
    record = stopped_at(program, 30.0)
    rest = rest_of(program, [record.run], plan_beside(plan))
    assert rest.seconds + record.rows * program.dt <= program.seconds + 0.1
    assert omnidyn.drive(rest, SimulatedRobot(program.robot, NOISE, rate=100.0)).is_complete


def test_without_a_plan_the_legs_that_are_left_are_driven(plan):
    program = read_program(plan)
    leg = program.legs[len(program.legs) // 2]  # in its middle: at the end of one the last row decides
    record = stopped_at(program, 0.5 * (leg.first + leg.end) * program.dt)
    rest = rest_of(program, [record.run])
    assert len(rest.legs) == len(program.legs) - record.legs
    assert rest.legs[-1].words == program.legs[-1].words


def test_nothing_is_left(plan):
    program = read_program(plan)
    with pytest.raises(InsufficientDataError, match=r"nothing is left to drive.*fit what is recorded"):
        rest_of(program, [program.predicted], plan_beside(plan))


def test_a_log_of_something_else_is_refused(plan):
    program = read_program(plan)
    other = omnidyn.Run(t=[0.0, 1.0], twist=np.zeros((2, 3)))
    with pytest.raises(InputError, match="not a log of this program"):
        rest_of(program, [other], plan_beside(plan))


def test_a_program_beside_the_json_of_another_is_refused(plan, tmp_path):
    (tmp_path / "plan.csv").write_text(plan.read_text().replace("\n0.01,", "\n0.010,", 1))
    (tmp_path / "plan.json").write_text(plan.with_suffix(".json").read_text())
    with pytest.raises(InputError, match="not the program that belongs to the JSON file beside it"):
        read_program(tmp_path / "plan.csv")


def test_a_json_that_is_no_plan_is_refused(plan, tmp_path):
    (tmp_path / "plan.csv").write_text(plan.read_text())
    for broken in (
        {},
        {"robot_file": "name = 3"},
        {**json.loads(plan.with_suffix(".json").read_text()), "area_m": [1]},
    ):
        (tmp_path / "plan.json").write_text(json.dumps(broken))
        with pytest.raises(InputError, match=r"no plan in this file|plan\.json"):
            read_program(tmp_path / "plan.csv")
