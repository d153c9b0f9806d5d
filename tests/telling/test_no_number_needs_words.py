"""Sentences replaced by their codes: a comparison, a steady study, a fit of motors and a track stay what they are."""

import json

import pytest

import omnidyn
from omnidyn import shown
from omnidyn.cli import main
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import MotorLine, SteadyState
from tests.support.steady_logs import clean_runs, robot_with

AXEBOT = omnidyn.load_robot("axebot")
WORDS = ("text", "remedy", "verdict", "method", "data", "robot", "source")  # keys of a record that hold sentences


def gapped_run() -> omnidyn.Run:
    run = omnidyn.simulate(AXEBOT, [[5.0, -2.0, -3.0]] * 80 + [[-4.0, 3.0, 1.0]] * 80, 0.01)
    kept = [*range(70), *range(100, 161)]
    return omnidyn.Run(t=run.t[kept], voltage=run.voltage[kept], wheel_speed=run.wheel_speed[kept], source="run.csv")


def comparison() -> dict:
    return omnidyn.compare(AXEBOT, gapped_run()).to_dict()


def steady_study() -> dict:
    return identify(clean_runs(robot_with("disc"), range(0, 360, 15)), AXEBOT, SteadyState()).study.document().data


def motor_fit() -> dict:
    return identify([gapped_run()], None, MotorLine()).study.to_dict()


def without_words(value):
    """A record without the sentences in it."""
    if isinstance(value, dict):
        return {key: without_words(item) for key, item in value.items() if key not in WORDS}
    return [without_words(item) for item in value] if isinstance(value, list | tuple) else value


@pytest.fixture
def only_codes(monkeypatch):
    """Replaces every sentence by its code, when called."""

    def replace_sentences():
        for what in (shown.SENTENCE, shown.REMEDY):
            monkeypatch.setitem(shown._MAKERS, what, lambda statement: statement.code)

    return replace_sentences


@pytest.mark.parametrize("result", [comparison, steady_study, motor_fit])
def test_no_number_of_a_result_needs_a_sentence(result, only_codes):
    before = result()
    only_codes()
    after = result()
    assert json.dumps(without_words(before), default=repr) == json.dumps(without_words(after), default=repr)


def test_no_number_and_no_exit_code_of_a_track_needs_a_sentence(only_codes, capsys):
    command = ["track", "axebot", "--path", "eight:period_s=4", "--duration", "1", "--controller", "pid"]

    def outcome():
        code = main([*command, "--json"])
        data = json.loads(capsys.readouterr().out)
        for controller in data["controllers"]:
            del controller["step_us"]
        return code, without_words({key: data[key] for key in ("controllers", "notes", "warnings", "verdict_code")})

    before = outcome()
    only_codes()
    assert outcome() == before
