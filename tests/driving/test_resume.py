"""A drive that was stopped at any moment is resumed to the intervals of the whole drive."""

import json

import numpy as np
import pytest

import omnidyn
from omnidyn.driving.program_file import read_program
from omnidyn.driving.resume import rest_of
from omnidyn.driving.simulated import SimulatedRobot
from omnidyn.errors import InputError, InsufficientDataError

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


@pytest.fixture(scope="module")
def whole(plan):
    """Half the interval of each number, fitted to a drive of the whole program."""
    program = read_program(plan)
    return widths([omnidyn.drive(program, SimulatedRobot(program.robot, NOISE, rate=100.0)).run])


def widths(logs):
    fit = omnidyn.identify(logs, omnidyn.load_robot("axebot"), quick=True).estimate
    assert len(fit.value) == 6
    return {name: 0.5 * (high - low) for name, (low, high) in fit.ci95.items()}


def check(plan, whole, moments):
    """Every interval of both logs together beside that of the whole drive; as fitted, not as predicted."""
    program = read_program(plan)
    for moment in moments:
        record = stopped_at(program, moment)
        assert record.stopped is not None
        rest = rest_of(program, [record.run])
        rest_run = omnidyn.drive(rest, SimulatedRobot(program.robot, NOISE, rate=100.0, seed=1)).run
        wider = {name: half / whole[name] for name, half in widths([record.run, rest_run]).items()}
        assert max(wider.values()) < 1.1, (moment, wider)


def test_the_same_intervals_after_a_stop(plan, whole):
    check(plan, whole, (14.0,))


@pytest.mark.long
def test_the_same_intervals_after_a_stop_at_twenty_moments(plan, whole):
    check(plan, whole, np.random.default_rng(7).uniform(1.0, 44.0, 20))


def test_the_legs_that_are_left_are_driven(plan):
    program = read_program(plan)
    leg = program.legs[len(program.legs) // 2]  # in its middle: at the end of one the last row decides
    record = stopped_at(program, 0.5 * (leg.first + leg.end) * program.dt)
    rest = rest_of(program, [record.run])
    first = len(program.legs) - len(rest.legs)
    assert record.legs - 4 <= first <= record.legs
    assert rest.legs[-1].words == program.legs[-1].words
    again = stopped_at(rest, rest.seconds - 8.0)  # and a second stop, of the rest
    last = rest_of(program, [record.run, again.run])
    assert last.legs[-1].words == program.legs[-1].words
    assert 8.0 < last.seconds < 12.0
    assert last.source == f"the rest of {program.source}"


def test_the_rest_begins_where_the_robot_is_put_back_to(plan):
    """A way back that is driven alone ends as far on the other side, and what follows leaves the room from there."""
    program = read_program(plan)
    begins = [(0.0, 0.0), *(leg.pose[:2] for leg in program.legs)]
    backs = [k for k in range(len(program.legs)) if np.hypot(*begins[k]) > 0.3]
    assert len(backs) > 4
    for k in backs[:4]:
        record = stopped_at(program, 0.5 * (program.legs[k].first + program.legs[k].end) * program.dt)
        rest = rest_of(program, [record.run])
        first = len(program.legs) - len(rest.legs)
        assert first < k
        assert np.hypot(*begins[first]) < 0.1
        assert np.abs(np.asarray(rest.predicted.pose)[:, :2]).max() < 1.2


def test_a_log_of_another_program_with_the_same_wheels_is_refused(plan):
    program = read_program(plan)
    other = omnidyn.drive(
        read_program(plan.with_name("plan-check.csv")), SimulatedRobot(program.robot, NOISE, rate=100.0)
    )
    with pytest.raises(InputError, match=r"not a log of this program; got .* of its rows are those of the program"):
        rest_of(program, [other.run])
    record = stopped_at(program, 20.0)
    rest = stopped_at(rest_of(program, [record.run]), 5.0)
    with pytest.raises(InputError, match="in the order in which they were driven"):
        rest_of(program, [rest.run, record.run])


def test_nothing_is_left(plan):
    program = read_program(plan)
    with pytest.raises(InsufficientDataError, match=r"nothing is left to drive.*fit what is recorded"):
        rest_of(program, [program.predicted])


def test_a_log_of_something_else_is_refused(plan):
    program = read_program(plan)
    other = omnidyn.Run(t=[0.0, 1.0], twist=np.zeros((2, 3)))
    with pytest.raises(InputError, match="not a log of this program"):
        rest_of(program, [other])


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


def test_a_drive_whose_loop_was_held_up_again_and_again_is_known_again(plan):
    program, draws = read_program(plan), np.random.default_rng(3)
    rows = len(program.inputs) // 2
    held_up = np.where(draws.random(rows) < 0.02, draws.uniform(0.0, 0.2, rows), 0.0)  # a busy machine: 0.2 s at most
    t = program.dt * np.arange(rows) + np.cumsum(held_up)
    log = omnidyn.Run(t=t, voltage=program.inputs[:rows])
    assert t[-1] > 1.05 * program.dt * rows
    leg = next(leg for leg in program.legs if leg.end > rows)
    rest = rest_of(program, [log])
    np.testing.assert_array_equal(rest.inputs[-len(program.inputs) + leg.first :], program.inputs[leg.first :])
    assert leg.words in [begun.words for begun in rest.legs[:4]]  # its move begins in the middle
    other = omnidyn.Run(t=t, voltage=draws.permutation(program.inputs[:rows]))
    with pytest.raises(InputError, match="not a log of this program"):
        rest_of(program, [other])
