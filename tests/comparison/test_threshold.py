"""--fail-if: what is read, what is refused with the nearest name, and what fails."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

import omnidyn
from omnidyn.comparison.threshold import exceeded, parse_threshold, refuse_absent, refuse_exceeded
from omnidyn.errors import InputError, InsufficientDataError, ThresholdError
from omnidyn.model.robot_file import load_robot
from tests.support.compared_logs import clean_log, noisy

AXEBOT = load_robot("axebot")


@pytest.fixture(scope="module")
def found():
    return omnidyn.compare(AXEBOT, noisy(clean_log(AXEBOT, 1), 1))


@pytest.mark.parametrize(
    "text, parts",
    [
        ("vx.rmse>0.05", ("vx", "rmse", ">", 0.05)),
        (" heading.max >= 1e-3 ", ("heading", "max", ">=", 1e-3)),
        ("w12.fit_percent<90", ("w12", "fit_percent", "<", 90.0)),
        ("omega.bias<=-.5", ("omega", "bias", "<=", -0.5)),
        ("i1.samples<100.", ("i1", "samples", "<", 100.0)),
    ],
)
def test_what_is_read(text, parts):
    assert tuple(parse_threshold(text)) == parts


@pytest.mark.parametrize(
    "text, words",
    [
        ("vx.rmse", "cannot read this threshold; got vx.rmse"),
        ("vx.rmse>", "cannot read"),
        ("vx.rmse>a", "cannot read"),
        ("vx.rmse=0.1", "cannot read"),
        ("vx.rmse>0.1 or 1", "cannot read"),
        ("vx.rmse>nan", "cannot read"),
        ("__import__('os').system('true')>1", "cannot read"),
        ("vx>0.1", "cannot read"),
        ("vx.rmse>0x10", "cannot read"),
        ("vx.rmse>1_000", "cannot read"),
        ("vx.rmse>1e999", "not a finite number; got 1e999"),
        ("vx.rms>0.1", "no such metric; got rms; .*did you mean rmse"),
        ("vx.vav>0.1", "did you mean vaf"),
        ("vz.rmse>0.1", "no such component; got vz"),
        ("omga.rmse>0.1", "no such component; got omga; .*did you mean omega"),
    ],
)
def test_what_is_refused(text, words):
    with pytest.raises(InputError, match=words):
        parse_threshold(text)


def test_a_component_that_is_not_in_the_logs_is_refused_with_the_nearest():
    rules = [parse_threshold("vx.rmse>1"), parse_threshold("w4.rmse>1")]
    with pytest.raises(InputError, match=r"--fail-if: the logs cannot judge this component; got w4; .*did you mean w"):
        refuse_absent(rules, ("vx", "w1", "w2"))
    refuse_absent(rules[:1], ("vx",))


def test_what_fails_is_named_with_its_numbers(found):
    rules = [parse_threshold(text) for text in ("vx.rmse>0.005", "vx.rmse>0.05", "w1.fit_percent<99.9")]
    words = exceeded(found, rules)
    assert len(words) == 2
    assert words[0] == f"vx.rmse = {found.rmse['vx']:.6g} (> 0.005)"
    with pytest.raises(ThresholdError, match=r"2 of 3 rules of --fail-if hold for axebot: vx.rmse = 0\.0\d+") as caught:
        refuse_exceeded(found, rules)
    assert caught.value.exit_code == 5
    refuse_exceeded(found, rules[1:2])


@pytest.mark.parametrize("sign, fails", [(">", False), (">=", True), ("<", False), ("<=", True)])
def test_the_four_signs_at_equality(found, sign, fails):
    rule = parse_threshold("vx.samples>401")._replace(sign=sign)
    assert bool(exceeded(found, [rule])) == fails


def test_a_number_that_the_data_do_not_tell_is_no_pass(found):
    with pytest.raises(InsufficientDataError, match=r"the data do not tell x.lag; got x.lag>1"):
        refuse_exceeded(found, [parse_threshold("x.lag>1")])


LIKE_A_RULE = st.from_regex(r"[a-z]{1,5}\d?\.[a-z_]{1,12}[<>]=?[-+.e\d]{1,8}", fullmatch=True)


@given(st.one_of(st.text(max_size=60), LIKE_A_RULE))
def test_any_text_is_read_or_refused_in_words(text):
    try:
        rule = parse_threshold(text)
    except InputError as refused:
        where = refused.where
    else:
        where = "--fail-if"
        assert parse_threshold(str(rule)) == rule._replace(number=float(f"{rule.number:g}"))
    assert where == "--fail-if"
