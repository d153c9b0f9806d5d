"""Arguments that are swapped: both are named, in one sentence."""

from pathlib import Path

import numpy as np
import pytest

import omnidyn
from omnidyn.arguments import check_order, seed_of
from omnidyn.control.feedforward import check_dt
from omnidyn.errors import InputError
from omnidyn.model.deadzone import axis_patterns, breakaway_voltage, dead_zone_map, moving_axes
from omnidyn.run import Run

ROBOT = omnidyn.load_robot("axebot")
RUN = Run(t=np.arange(3.0), twist=np.zeros((3, 3)))
VOLTS = np.zeros((4, 3))
TABLE = omnidyn.read_steady_table(Path(__file__).resolve().parents[1] / "examples" / "table1.csv")


@pytest.mark.parametrize(
    "call, got, expected",
    [
        (lambda: omnidyn.compare(RUN, ROBOT), "a Run before a Robot", r"compare\(robot, run\)"),
        (lambda: omnidyn.compare([RUN, RUN], ROBOT), "a list of Run before a Robot", r"compare\(robot, run\)"),
        (lambda: omnidyn.compare(RUN, ROBOT, ROBOT), "a Run before a Robot", "compare"),
        (lambda: omnidyn.identify(ROBOT, [RUN]), "a Robot before a list of Run", r"identify\(logs, robot\)"),
        (lambda: omnidyn.identify(ROBOT, TABLE), "a Robot before a SteadyTable", r"identify\(logs, robot\)"),
        (lambda: omnidyn.simulate(VOLTS, ROBOT, 0.1), "a ndarray before a Robot", r"simulate\(robot, voltage, dt\)"),
        (
            lambda: omnidyn.simulate(VOLTS.tolist(), ROBOT, 0.1),
            "a list of list before a Robot",
            r"simulate\(robot, voltage, dt\)",
        ),
        (lambda: omnidyn.simulate(ROBOT, 0.1, VOLTS), "the time before the voltage", "simulate"),
        (lambda: omnidyn.check(ROBOT, RUN), "a Robot before a Run", r"check\(log\)"),
        (lambda: omnidyn.write_run("run.csv", RUN), "the text 'run.csv' before a Run", r"write_run\(run, path\)"),
        (lambda: omnidyn.save_robot("robot.toml", ROBOT), "the text 'robot.toml' before a Robot", "save_robot"),
        (lambda: breakaway_voltage(VOLTS, ROBOT), "a ndarray before a Robot", "breakaway_voltage"),
        (lambda: moving_axes(VOLTS, ROBOT), "a ndarray before a Robot", r"moving_axes\(robot, voltage\)"),
    ],
)
def test_a_swapped_pair_is_recognised(call, got, expected):
    with pytest.raises(InputError, match=f"arguments swapped; got {got}; expected .*{expected}"):
        call()


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: omnidyn.compare("axebot", RUN), "type Robot; got the text 'axebot'; expected compare.*load_robot"),
        (lambda: omnidyn.identify("log.csv", ROBOT), "of the type Run or Log or .*; got the text 'log.csv'.*read_log"),
        (lambda: omnidyn.identify([RUN, ROBOT], ROBOT), "of the type Run or Log or .*; got a list of Run and Robot"),
        (lambda: omnidyn.check(None), "of the type Log or Run; got nothing.*recorded=True"),
        (
            lambda: omnidyn.read_log(RUN),
            r"of the type str or PathLike; got a Run; expected read_log.*ready to use",
        ),
        (lambda: omnidyn.simulate("axebot", VOLTS, 0.1), "of the type Robot; got the text 'axebot'"),
    ],
)
def test_another_kind_is_refused_with_what_makes_the_right_one(call, words):
    with pytest.raises(InputError, match=words):
        call()


def test_right_ones_pass_and_what_an_iterator_holds_is_not_asked():
    check_order("f(runs, robot)", ((RUN, RUN), Run), (ROBOT, omnidyn.Robot))
    check_order("f(runs, robot)", ([], Run), (ROBOT, omnidyn.Robot))
    check_order("f(runs, robot)", (iter([RUN]), Run), (ROBOT, omnidyn.Robot))


@pytest.mark.parametrize(
    "call",
    [
        omnidyn.dead_zone,
        axis_patterns,
        omnidyn.state_space,
        lambda name: dead_zone_map(name, [0.0]),
        lambda name: breakaway_voltage(name, VOLTS),
        lambda name: moving_axes(name, VOLTS),
        lambda name: omnidyn.confidence_band(name, VOLTS, 0.1),
        lambda name: omnidyn.acceleration(name, np.zeros(3), np.zeros(3)),
        lambda name: omnidyn.identify(TABLE, name),
    ],
)
def test_the_name_of_a_robot_is_no_robot_anywhere(call):
    """It was AttributeError: 'str' object has no attribute 'motor'."""
    with pytest.raises(InputError, match=r"of the type Robot; got the text 'axebot'.*load_robot"):
        call("axebot")


def test_random_numbers_come_from_a_seed_or_a_generator():
    """As `rng=` of NumPy: a seed gives the same numbers always, a generator gives new ones each time."""
    assert seed_of(7) == seed_of(np.int64(7)) == 7
    assert seed_of(np.random.default_rng(1)) == seed_of(np.random.default_rng(1))
    generator = np.random.default_rng(1)
    assert seed_of(generator) != seed_of(generator)
    factors = {"body.mass_kg": (0.8, 1.2)}
    first, again, other = (
        omnidyn.sample(ROBOT, 3, np.random.default_rng(k), factors=factors).values for k in (1, 1, 2)
    )
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    for wrong in (-1, 1.5, "one", True):
        with pytest.raises(InputError, match=r"rng: not a source of random numbers.*expected a whole number"):
            seed_of(wrong)


def test_numbers_of_numpy_count_and_truths_do_not():
    assert omnidyn.OutputError(bootstrap=np.int64(5), tick_rad=np.float32(0.5)).bootstrap == 5
    for options in ({"bootstrap": True}, {"tick_rad": True}):
        with pytest.raises(InputError, match="got True"):
            omnidyn.OutputError(**options)
    with pytest.raises(InputError, match="dt: step out of range; got True"):
        check_dt(True)
