"""Question: options validated once, what does not go together, and the words from which others take theirs."""

import re
from pathlib import Path

import pytest

import omnidyn
from omnidyn.cli.terminal.flags import of_place, with_flags
from omnidyn.errors import InputError
from omnidyn.identification.question import AUTO, OUTPUT_ERROR, STEADY_STATE, Question, options

SOURCE = Path(omnidyn.__file__).parent


def test_one_name_is_a_tuple_of_it_and_none_is_none():
    assert Question(free="friction").free == ("friction",)
    assert Question(nuisances="none").nuisances == Question(nuisances=[]).nuisances == ()
    assert Question(nuisances="auto").nuisances is None
    assert Question(window=[0.4, 0.95]).window == (0.4, 0.95)
    assert Question(free=["body.mass_kg"]) == Question(free=("body.mass_kg",))


@pytest.mark.parametrize(
    "wrong, words",
    [
        ({"method": "magic"}, "method: no such method; got magic; expected output-error or steady-state"),
        ({"loss": "huber"}, "loss: unknown loss; got huber; expected gaussian or student-t"),
        ({"start": "moving"}, "start: unknown start; got moving; expected auto, rest or free"),
        ({"covariance": "blue"}, "covariance: unknown covariance; got blue"),
        ({"what": "magic"}, "what: nothing of that name; got magic; expected friction or motors"),
        ({"speed": "fast"}, "speed: no such speed; got fast"),
        ({"rest": "sleep"}, "rest: unknown use of rows at rest; got sleep"),
        ({"nuisances": ("none", "gain")}, "nuisances: none and auto stand alone; got none, gain"),
        ({"window": (0.9, 0.4)}, "window: not two shares; got 0.9,0.4; expected such as 0.4,0.95"),
    ],
)
def test_words_that_mean_nothing_are_refused_at_once(wrong, words):
    with pytest.raises(InputError, match=re.escape(words)):
        Question(**wrong)


@pytest.mark.parametrize(
    "asked, method",
    [({}, AUTO), ({"free": "friction"}, OUTPUT_ERROR), ({"shape": "disc"}, STEADY_STATE), ({"loss": "gaussian"}, AUTO),
     ({"what": "motors", "input": "duty"}, AUTO), ({"what": "motors", "between": "mean"}, OUTPUT_ERROR)],
)  # fmt: skip
def test_options_of_one_method_choose_it(asked, method):
    assert Question(**asked).method_asked() == method


@pytest.mark.parametrize(
    "asked, words",
    [
        ({"method": OUTPUT_ERROR, "shape": "disc"}, "output-error has no such option; got `shape`"),
        ({"method": OUTPUT_ERROR, "group": "a=*"}, "for groups use `per`"),
        ({"method": STEADY_STATE, "free": "friction"}, "got `free`; expected with output-error; leave it out, or leave "
         "out `method`"),
        ({"shape": "disc", "loss": "student-t"}, "steady-state has no such option; got `loss`"),
        ({"between": "mean"}, "`between`: an option of the motors"),
        ({"input": "duty"}, "`input`: an option of the motors"),
        ({"what": "motors", "free": "friction"}, "`what` motors: not an option of the motors; got `free`"),
        ({"what": "motors", "method": OUTPUT_ERROR, "speed": "set"}, "output-error has no such option; got `speed`"),
    ],
)  # fmt: skip
def test_what_does_not_go_together_is_refused(asked, words):
    with pytest.raises(InputError, match=re.escape(words)):
        Question(**asked).method_asked()


def test_what_chooses_among_runs_needs_all_of_them():
    with pytest.raises(InputError, match=r"chooses among runs; got `hold_out`"):
        omnidyn.fit_output_error([], omnidyn.load_robot("axebot"), hold_out="b*")
    with pytest.raises(InputError, match="no such option; got fre"):
        omnidyn.identify([], omnidyn.load_robot("axebot"), fre="friction")


def test_every_option_is_told_in_help():
    for each in options():
        assert re.search(rf"^    {each.name}[ :]", Question.__doc__, re.MULTILINE)


def test_the_command_line_writes_options_as_flags():
    words = "fix it (`fixed`), or `hold_out` one; `current_unsigned`, `nuisances` latency; `omnidyn check` stays"
    told = "fix it (--fix), or --hold-out one; --current-unsigned, --nuisance latency; `omnidyn check` stays"
    assert with_flags(words) == told
    assert (of_place("per_free"), of_place("log.csv")) == ("--per-free", "log.csv")


def test_no_message_of_the_library_names_a_flag():
    """It names the option in backticks: Python has no flags. The skins may."""
    found = []
    for path in sorted(SOURCE.rglob("*.py")):
        if path.relative_to(SOURCE).parts[0] in ("cli", "report"):
            continue
        for number, line in enumerate(path.read_text("utf-8").splitlines(), 1):
            plain = line.split("#")[0]
            if re.search(r"(?<![\w-])--[a-z]", plain) and '"""' not in plain and "exit 5" not in plain:
                found.append(f"{path.relative_to(SOURCE)}:{number}: {line.strip()}")
    assert not found, "\n".join(found)
