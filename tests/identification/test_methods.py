"""Methods: options validated once, what does not go together, and the words from which others take theirs."""

import re
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

import omnidyn
from omnidyn.cli.terminal.flags import of_place, with_flags
from omnidyn.cli.terminal.identify_options import default_of, options
from omnidyn.cli.terminal.identify_options import identify_request as asked_of
from omnidyn.errors import InputError
from omnidyn.identification.default_method import default_motor_method
from omnidyn.identification.grouping import names_of_groups
from omnidyn.identification.methods import METHODS, MotorFit, MotorLine, OutputError, SteadyState, choices

SOURCE = Path(omnidyn.__file__).parent


def asked(**given):
    """What the command line makes of these options, all others as by default."""
    return asked_of({name: given.get(name, default_of(spec)) for name, spec in options().items()})


def test_one_name_is_a_tuple_of_it_and_none_is_none():
    assert OutputError(free="friction").free == ("friction",)
    assert OutputError(nuisances="none").nuisances == OutputError(nuisances=[]).nuisances == ()
    assert OutputError(nuisances="auto").nuisances is None
    assert SteadyState(window=[0.4, 0.95]).window == (0.4, 0.95)
    assert OutputError(free=["body.mass_kg"]) == OutputError(free=("body.mass_kg",))


@pytest.mark.parametrize(
    "method, wrong, words",
    [
        (OutputError, {"loss": "huber"}, "loss: unknown loss; got huber; expected gaussian or student-t"),
        (OutputError, {"start": "moving"}, "start: unknown start; got moving; expected auto, rest or free"),
        (OutputError, {"covariance": "blue"}, "covariance: unknown covariance; got blue"),
        (SteadyState, {"speed": "fast"}, "speed: no such speed; got fast"),
        (SteadyState, {"rest": "sleep"}, "rest: unknown use of rows at rest; got sleep"),
        (MotorFit, {"nuisances": ("none", "gain")}, "nuisances: none and auto stand alone; got none, gain"),
        (MotorLine, {"window": (0.9, 0.4)}, "window: not two shares; got 0.9,0.4; expected such as 0.4,0.95"),
        (SteadyState, {"window": 0.4}, "window: not two shares; got 0.4; expected such as 0.4,0.95"),
        (OutputError, {"free": 3}, "free: not a name or several; got 3; expected text, or a list of texts"),
        (MotorFit, {"nuisances": [1.0]}, "nuisances: not a name or several"),
        (OutputError, {"bootstrap": -1}, "bootstrap: not a number of draws; got -1"),
        (OutputError, {"tick_rad": float("nan")}, "tick_rad: not the step of an encoder; got nan"),
    ],
)
def test_words_that_mean_nothing_are_refused_at_once(method, wrong, words):
    with pytest.raises(InputError, match=re.escape(words)):
        method(**wrong)


@pytest.mark.parametrize("method", ["output-error", OutputError, 3])
def test_a_method_that_is_none_is_refused_with_the_four(method):
    with pytest.raises(InputError, match=r"OutputError\(\), omnidyn.SteadyState\(\), .*MotorLine\(\), .*MotorFit\(\)"):
        omnidyn.identify([], omnidyn.load_robot("axebot"), method)


@pytest.mark.parametrize(
    "method, given",
    [
        (SteadyState(), {"hold_out": "a*"}),
        (MotorLine(), {"hold_out": "a*"}),
        (MotorLine(), {"quick": True}),
        (MotorFit(), {"groups": "a=*"}),
    ],
)
def test_what_a_method_has_no_use_for_is_refused(method, given):
    words = f"{type(method).__name__} does not take it; got `{next(iter(given))}`"
    with pytest.raises(InputError, match=words):
        omnidyn.identify([], omnidyn.load_robot("axebot"), method, **given)


def test_groups_in_a_table_are_refused():
    """Its names would be taken for those of the logs, in that order."""
    with pytest.raises(InputError, match=r"groups: groups are not a table; got .*; expected .*NAME=GLOB"):
        names_of_groups({"gray": "a*", "green": "b*"}, ["b.csv", "a.csv"])


def test_friction_needs_a_robot_and_a_ladder_the_diagnosis():
    with pytest.raises(InputError, match="friction is identified of a robot; got none"):
        omnidyn.identify([])
    with pytest.raises(InputError, match="the ladder climbs by the diagnosis"):
        omnidyn.identify([], omnidyn.load_robot("axebot"), OutputError(ladder=True), quick=True)


@pytest.mark.parametrize(
    "given, method",
    [
        ({}, None),
        ({"free": ["friction"]}, OutputError(free="friction")),
        ({"shape": "disc"}, SteadyState(shape="disc")),
        ({"loss": "gaussian"}, None),
        ({"hold_out": ["a"]}, OutputError()),
        ({"group": ["a=*"]}, SteadyState()),
        ({"quick": True}, None),
        ({"method": "steady-state"}, SteadyState()),
        ({"what": "motors"}, None),
        ({"what": "motors", "input": "duty"}, None),
        ({"what": "motors", "window": "0.4,0.9"}, MotorLine(window=(0.4, 0.9))),
        ({"what": "motors", "method": "output-error", "input": "duty"}, MotorFit(input="duty")),
        ({"what": "motors", "between": "mean"}, MotorFit(between="mean")),
    ],
)
def test_options_of_one_method_choose_it(given, method):
    assert asked(**given).method == method


@pytest.mark.parametrize(
    "channel, step, input, method",
    [
        ("voltage", 0.01, "", MotorFit()),
        ("duty", 0.01, "duty", MotorFit(input="duty")),
        ("voltage", 1.0, "", MotorLine()),
        ("current", 0.01, "", MotorLine()),
        ("voltage", 0.01, "current", MotorLine(input="current")),
        ("voltage", 0.01, "wind", MotorLine(input="wind")),
    ],
)
def test_logs_of_motors_say_whether_whole_logs_are_fitted(channel, step, input, method):
    run = omnidyn.Run(t=step * np.arange(50), wheel_speed=np.zeros((50, 1)), **{channel: np.zeros((50, 1))})
    reports = []
    assert default_motor_method([run], input, reports.append) == method
    assert bool(reports) == isinstance(method, MotorLine)


@pytest.mark.parametrize(
    "given, words",
    [
        ({"method": "magic"}, "method: no such method; got magic; expected output-error or steady-state"),
        ({"what": "magic"}, "what: nothing of that name; got magic; expected friction or motors"),
        ({"method": "output-error", "shape": "disc"}, "output-error has no such option; got `shape`"),
        ({"method": "output-error", "group": ["a=*"]}, "for groups use `per`"),
        (
            {"method": "steady-state", "free": ["friction"]},
            "got `free`; expected with output-error; leave it out, or leave out `method`",
        ),
        ({"shape": "disc", "loss": "student-t"}, "steady-state has no such option; got `loss`"),
        ({"between": "mean"}, "`between`: an option of the motors"),
        ({"input": "duty"}, "`input`: an option of the motors"),
        ({"what": "motors", "shape": "disc"}, "not an option of the motors; got `shape`"),
        (
            {"what": "motors", "method": "steady-state", "between": "hold"},
            "steady-state has no such option; got `between`",
        ),
        ({"what": "motors", "free": ["friction"]}, "`what` motors: not an option of the motors; got `free`"),
        ({"what": "motors", "method": "output-error", "speed": "set"}, "output-error has no such option; got `speed`"),
    ],
)
def test_what_does_not_go_together_is_refused(given, words):
    with pytest.raises(InputError, match=re.escape(words)):
        asked(**given)


@pytest.mark.parametrize("method", METHODS)
def test_every_option_is_told_in_help(method):
    for spec in fields(method):
        assert re.search(rf"^    {spec.name}[ :]", method.__doc__, re.MULTILINE)
        assert spec.metadata["words"]


def test_options_with_choices_name_them_in_their_type():
    assert choices(OutputError)["loss"] == ("gaussian", "student-t")
    assert choices(SteadyState).keys() == {"speed", "force_from", "rest"}


def test_the_command_line_writes_options_as_flags():
    words = "fix it (`fixed`), or `hold_out` one; `current_unsigned`, `nuisances` latency; `omnidyn check` stays"
    told = "fix it (--fix), or --hold-out one; --current-unsigned, --nuisance latency; `omnidyn check` stays"
    assert with_flags(words) == told
    assert (of_place("per_free"), of_place("log.csv")) == ("--per-free", "log.csv")


OF_ROS = "--(from-paths|ignore-src|packages-select|param-file|controller-ros-args)"  # flags of tools of ROS 2


def test_no_message_of_the_library_names_a_flag():
    """It names the option in backticks: Python has no flags. The skins may."""
    found = []
    for path in sorted(SOURCE.rglob("*.py")):
        if path.relative_to(SOURCE).parts[0] in ("cli", "report", "studio"):
            continue
        for number, line in enumerate(path.read_text("utf-8").splitlines(), 1):
            plain = re.sub(OF_ROS, "", line.split("#")[0])
            if re.search(r"(?<![\w-])--[a-z]", plain) and '"""' not in plain and "exit 5" not in plain:
                found.append(f"{path.relative_to(SOURCE)}:{number}: {line.strip()}")
    assert not found, "\n".join(found)
