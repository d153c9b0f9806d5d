"""Findings hold numbers and codes: with every sentence replaced by its code, `check` answers the same."""

import json

import numpy as np
import pytest

import omnidyn
from omnidyn import shown
from omnidyn.cli import main
from omnidyn.findings.finding import Finding, Verdict
from omnidyn.logs.read_log import LogOptions, recorded_log
from omnidyn.statement import ERROR, Statement
from omnidyn.telling.log_verdict import in_brief, of_several
from tests.support.codes import codes

ROBOT = omnidyn.load_robot("axebot")


@pytest.fixture(scope="module")
def faulty(tmp_path_factory):
    """A log with exchanged wheels, a gap, a spike, a column without a unit and one that nobody takes."""
    t = np.arange(0.0, 8.0, 0.02)
    volts = np.column_stack([5.0 * np.sin(1.1 * t), 4.0 * np.cos(0.7 * t), 3.0 * np.sin(0.5 * t + 1.0)])
    run = omnidyn.simulate(ROBOT, volts, 0.02)
    rng = np.random.default_rng(0)
    speed = (run.wheel_speed + 0.05 * rng.normal(size=run.wheel_speed.shape))[:-1, [1, 0, 2]]
    speed[50, 2] = 999.0
    stamps = t + 1.3 * (t > 4.0)
    table = np.column_stack([stamps, volts, run.current[:-1], speed, 40.0 * np.sin(9.0 * t), t % 3])
    path = tmp_path_factory.mktemp("logs") / "faulty.csv"
    head = "t_s,u1_V,u2_V,u3_V,i1_A,i2_A,i3_A,w1_rad_s,w2_rad_s,w3_rad_s,PWM1,mode"
    np.savetxt(path, table, delimiter=",", header=head, comments="", fmt="%.9g")
    return path


@pytest.fixture
def by_code(monkeypatch):
    """Every sentence is its code, every remedy a dash."""
    monkeypatch.setitem(shown._MAKERS, shown.SENTENCE, lambda statement: statement.code)
    monkeypatch.setitem(shown._MAKERS, shown.REMEDY, lambda statement: "-")


def without_words(value):
    """Plain values without the keys that hold sentences."""
    if isinstance(value, dict):
        return {key: without_words(item) for key, item in value.items() if key not in ("text", "remedy", "verdict")}
    return [without_words(item) for item in value] if isinstance(value, list) else value


def checked(path, capsys):
    code = main(["check", str(path), "--robot", "axebot", "--json"])
    return code, without_words(json.loads(capsys.readouterr().out))


@pytest.fixture
def before(faulty, capsys):
    return checked(faulty, capsys)


def test_no_number_of_check_depends_on_a_sentence(before, faulty, capsys, request):
    request.getfixturevalue("by_code")
    assert checked(faulty, capsys) == before
    code, document = before
    assert code == 4
    (log,) = document["logs"]
    assert [(f["code"], f["severity"], f["subject"]) for f in log["findings"]] == [
        ("swapped", "error", "w1 w2"),
        ("gap", "warning", "t"),
        ("spike", "warning", "w3"),
        ("not_taken", "note", ""),
        ("not_used", "note", ""),
    ]
    assert log["findings"][1]["rows"] == [[202, 203]]
    assert log["findings"][2]["numbers"]["farthest"] == 999.0


def test_a_doubt_says_what_settles_it(faulty):
    (finding,) = omnidyn.check(recorded_log(faulty, ROBOT), ROBOT).of("not_taken")
    doubt = finding.numbers["doubt"]
    assert (doubt.code, doubt.columns, doubt.components) == ("command_without_unit", ("PWM1",), ("d1",))
    assert doubt.declarations == (("assume", "d=%"), ("assume", "d=duty/255"))
    assert str(finding) == "PWM1 looks like d1, but no unit is given, and up to 40 may be percent: not taken"
    assert finding.remedy_text == "say `assume` d=% or `assume` d=duty/255"
    settled = recorded_log(faulty, ROBOT, LogOptions(assume={"d": "%"}))
    assert "d1" in settled.columns.columns


def test_sentences_of_a_log(faulty):
    verdict = omnidyn.check(recorded_log(faulty, ROBOT), ROBOT)
    swapped, gap, spike = verdict.findings[:3]
    assert str(swapped).startswith("wheel_speed against voltage and current of the same motor: w1 and w2 are exchanged")
    assert str(gap) == "1 gap, about 65 rows lost; the longest lasts 1.32 s, at t = 4 s"
    assert str(spike) == "1 value of w3 alone, far from the rows before and after, the farthest 999 at t = 1 s"
    assert verdict.headline().endswith("400 rows, 9.28 s at 50 Hz: 1 error, 2 warnings, 2 notes")
    assert verdict.conclusion.code == "faulty"
    assert codes(verdict.findings) == ["swapped", "gap", "spike", "not_taken", "not_used"]


def test_a_default_text_is_short_and_names_what_it_leaves_out(faulty):
    verdict = omnidyn.check(recorded_log(faulty, ROBOT), ROBOT)
    lines = in_brief(verdict, 110).to_text(110).splitlines()
    assert len(lines) <= 3 + 1 + 15  # the verdict, an empty line, the rest
    several = of_several({f"logs/{k}.csv": verdict for k in range(30)} | {"logs/x.csv": None}, 110).to_text(110)
    assert len(several.splitlines()) <= 25
    assert "and 23 logs with fewer findings" in several
    assert "swapped w1 w2 (0.csv and 29 more)" in several


def test_statements_of_findings_have_numbers_only_json_holds():
    nested = Statement("reading", numbers={"note": Statement("one_motor", numbers={"numbered": 0})})
    assert json.loads(json.dumps(nested.to_dict()))["numbers"]["note"]["code"] == "one_motor"


def verdict_with(*findings):
    return Verdict(tuple(findings), rows=10, duration=1.0)


def test_two_faults_of_one_kind_are_both_shown(by_code):
    """A dead encoder of one wheel in one log says nothing of another wheel in another log."""
    logs = {
        "a.csv": verdict_with(Finding("dead", ERROR, "w1"), Finding("dead", ERROR, "w2")),
        "b.csv": verdict_with(Finding("dead", ERROR, "w2")),
    }
    text = of_several(logs, 110).to_text(110)
    assert "error    dead w1 (a.csv): dead" in text
    assert "error    dead w2 (a.csv and 1 more): dead" in text


def test_logs_named_by_absolute_and_relative_paths_stand_in_one_table(by_code):
    text = of_several({"/logs/a.csv": verdict_with(), "b.csv": verdict_with()}, 110).to_text(110)
    assert [line.split()[0] for line in text.splitlines()[3:5]] == ["/logs/a.csv", "b.csv"]
