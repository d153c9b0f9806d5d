"""A finished fit is written and shown, whatever becomes of its diagnosis, its comparison with the logs and its page."""

import json
import signal

import numpy as np
import pytest

import omnidyn
from omnidyn.cli import main
from omnidyn.errors import InputError, Terminated
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.identification.structure import diagnosis
from omnidyn.identification.structure.ladder import climb
from omnidyn.logs.read_log import read_log
from omnidyn.logs.run_file import write_run
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from tests.cli.test_process import ended, posix, waiting
from tests.support.steady_logs import clean_runs, robot_with

FIT = ("identify", "log0.csv", "--robot", "axebot", "--free", "friction", "--nuisance", "none")
GROUPS = ("identify", "log0.csv", "log1.csv", *FIT[2:], "--per", "a=log0*", "--per", "b=log1*")
STEADY = ("identify", "steady", "--robot", "axebot", "--method", "steady-state")
MOTORS = ("identify", "log0.csv", "--what", "motors", "--robot", "axebot")
PLACES = {
    "diagnosis": "omnidyn.identification.structure.diagnosis.diagnose",
    "comparison with the logs": "omnidyn.identification.identify.validate",
    "page": "omnidyn.report.fit_page.render_fit",
}
ENDS = {"bug": 0, "memory": 0, "interrupt": 130, "termination": 143}
ERRORS = {"bug": IndexError("index 3 is out of bounds"), "memory": MemoryError()}
ERRORS |= {"interrupt": KeyboardInterrupt(), "termination": Terminated()}
FAILURES = [
    ("diagnosis", "bug"),
    ("comparison with the logs", "interrupt"),
    ("page", "termination"),
    pytest.param("diagnosis", "termination", marks=pytest.mark.long),
    pytest.param("comparison with the logs", "memory", marks=pytest.mark.long),
    ("page", "bug"),
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two logs of 3 s, and a folder of steady ones."""
    there = tmp_path_factory.mktemp("logs")
    (there / "steady").mkdir()
    k = np.arange(300)
    volts = np.column_stack([4.0 * (k // 50 % 2), 3.0 - 6.0 * (k // 70 % 2), -4.0 * (k // 90 % 2)])
    for number in (0, 1):
        run = omnidyn.simulate(load_robot("axebot"), volts * (-1.0) ** number, 0.01)
        assert run.twist is not None
        twist = run.twist + np.random.default_rng(number).normal(size=run.twist.shape) * 0.01
        log = Run(t=run.t, voltage=run.voltage, twist=twist, wheel_speed=run.wheel_speed)
        write_run(log, there / f"log{number}.csv")
    for number, run in enumerate(clean_runs(robot_with("disc"), range(0, 360, 45), seconds=1.0)):
        write_run(run, there / "steady" / f"log{number}.csv")
    return there


@pytest.fixture
def call(folder, monkeypatch, capsys):
    """Run a command in that folder: (exit code, stdout, stderr)."""
    monkeypatch.chdir(folder)

    def run(*arguments):
        code = main(list(arguments))
        return code, *capsys.readouterr()

    return run


@pytest.fixture(scope="module")
def undisturbed(folder):
    """The robot file of the fit when nothing fails."""
    found = identify(
        [read_log(folder / "log0.csv")], load_robot("axebot"), OutputError(free="friction", nuisances="none")
    )
    return found.estimate.robot


def fails(error):
    def make(*_, **__):
        raise error

    return make


@pytest.mark.parametrize("part, end", FAILURES)
@pytest.mark.some(2)
def test_a_part_that_fails_costs_nothing_but_itself(call, tmp_path, monkeypatch, undisturbed, part, end):
    monkeypatch.setattr(PLACES[part], fails(ERRORS[end]))
    out, page = tmp_path / "fit.toml", tmp_path / "fit.html"
    code, text, err = call(*FIT, "-o", str(out), "--report", str(page))
    assert code == ENDS[end]
    assert f"not made: the {part}: " in err
    first = " ".join(text.partition("\n\n")[0].split())
    assert f"Not made: the {part}" in first
    assert "friction.axes.coulomb[0]" in text
    assert load_robot(out).friction == undisturbed.friction
    assert page.is_file() == (code == 0 and part != "page")


def test_machines_learn_what_is_missing(call, monkeypatch):
    monkeypatch.setattr(PLACES["diagnosis"], fails(IndexError("index 3 is out of bounds")))
    code, text, _ = call(*FIT, "--json")
    told = json.loads(text)
    assert code == 0
    assert told["missing"] == [{"part": "diagnosis", "reason": "bug: IndexError: index 3 is out of bounds"}]
    assert told["lack_of_fit"] is None
    assert told["parameters"]["friction.axes.coulomb[0]"]["std"] > 0.0


def test_every_group_is_written_before_the_first_is_diagnosed(call, tmp_path, monkeypatch):
    def look(_):
        assert {path.name for path in tmp_path.iterdir()} == {"fit-a.toml", "fit-b.toml"}
        raise KeyboardInterrupt

    monkeypatch.setattr(diagnosis, "diagnose", look)
    code, text, _ = call(*GROUPS, "-o", str(tmp_path / "fit.toml"))
    assert code == 130
    first = " ".join(text.split())
    assert "the diagnosis of a, the diagnosis of b, the comparison with the logs of a and" in first


def test_the_file_of_a_group_that_is_there_is_refused_before_the_fit(call, tmp_path, monkeypatch):
    (tmp_path / "fit-b.toml").write_text("mine")
    monkeypatch.setattr("omnidyn.identification.output_error.fit.Fit.of", fails(AssertionError("a fit has begun")))
    code, _, err = call(*GROUPS, "-o", str(tmp_path / "fit.toml"))
    assert code == 3
    assert "fit-b.toml" in err


def test_a_ladder_that_fails_leaves_the_fit_from_which_it_began(call, tmp_path, monkeypatch, undisturbed):
    monkeypatch.setattr(climb, "climb", fails(ZeroDivisionError("division by zero")))
    out = tmp_path / "fit.toml"
    code, text, _ = call(*FIT, "--ladder", "-o", str(out))
    assert code == 0
    assert "Not made: the ladder (bug: ZeroDivisionError: division by zero)" in " ".join(text.split())
    assert load_robot(out).friction == undisturbed.friction


def test_a_robot_file_that_cannot_be_written_costs_no_result(call, tmp_path, monkeypatch):
    monkeypatch.setattr("omnidyn.save_robot", fails(InputError("the disk is full", where="fit.toml")))
    code, text, err = call(*FIT, "--quick", "-o", str(tmp_path / "fit.toml"))
    assert code == 3
    assert "friction.axes.coulomb[0]" in text
    assert "fit.toml: the disk is full" in err


@pytest.mark.parametrize(
    "command, part, place",
    [
        (STEADY, "diagnosis", "omnidyn.identification.steady.study.moments"),
        (STEADY, "page", "omnidyn.report.steady_page.render_study"),
        (MOTORS, "page", "omnidyn.report.motors_page.render_motors"),
    ],
)
@pytest.mark.parametrize("end, shown", [("bug", ()), ("bug", ("--full",)), ("interrupt", ("--json",))])
@pytest.mark.some(3)
def test_so_it_is_of_steady_states_and_motors(call, tmp_path, monkeypatch, command, part, place, end, shown):
    monkeypatch.setattr(place, fails(ERRORS[end]))
    out = tmp_path / "fit.toml"
    code, text, err = call(*command, *shown, "-o", str(out), "--report", str(tmp_path / "fit.html"))
    assert code == ENDS[end], err
    assert f"Not made: the {part}" in " ".join(text.split())
    assert load_robot(out) != load_robot("axebot")


def test_the_phases_have_their_names(folder):
    """The fit is handed over before the diagnosis, and the diagnosis is called by its name while it is made."""
    said, robot, own = [], load_robot("axebot"), diagnosis.diagnose

    def diagnosing(solution):
        said.append(f"({said[-1]})")
        return own(solution)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(diagnosis, "diagnose", diagnosing)
        found = identify(
            [read_log(folder / "log0.csv")],
            robot,
            OutputError(free=("friction",), nuisances=()),
            progress=lambda report: said.append(str(report)),
            save=lambda fits: said.append(f"saved {', '.join(fits)}"),
        )
        assert found.verdict  # makes what follows the fit
    phases = [words.partition(":")[0].partition(",")[0].partition(" /")[0] for words in said]
    assert [*dict.fromkeys(phases)] == ["fitting", "saved all", "diagnosing", "(diagnosing)", "replaying"]


def test_quick_leaves_out_the_diagnosis_and_says_so(call, tmp_path, monkeypatch, undisturbed):
    monkeypatch.setattr(diagnosis, "diagnose", fails(AssertionError("a diagnosis has begun")))
    out, page = tmp_path / "fit.toml", tmp_path / "fit.html"
    code, text, _ = call(*FIT, "--quick", "-o", str(out), "--report", str(page))
    assert code == 0
    assert "Not made: the diagnosis (left out by --quick)" in " ".join(text.split())
    assert "left out by --quick" in page.read_text("utf-8")
    assert load_robot(out).friction == undisturbed.friction
    fit = omnidyn.identify(
        [read_log("log0.csv")], load_robot("axebot"), omnidyn.OutputError(free="friction", nuisances="none"), quick=True
    ).estimate
    assert fit.diagnosis is None
    assert fit.lack_of_fit is None
    assert fit.robot.friction == undisturbed.friction
    steady = json.loads(call(*STEADY, "--quick", "--json")[1])
    assert steady["missing"] == [{"part": "diagnosis", "reason": "left out by --quick"}]
    assert steady["lack_of_fit"] is None


def test_a_ladder_needs_the_diagnosis(call):
    code, _, err = call(*FIT, "--quick", "--ladder")
    assert code == 3
    assert "the ladder climbs by the diagnosis, which --quick leaves out" in err


@posix
@pytest.mark.long
@pytest.mark.parametrize(
    "number, code, words", [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "terminated")]
)
def test_a_signal_during_the_diagnosis_leaves_the_result(folder, tmp_path, number, code, words):
    out, shown = tmp_path / "fit.toml", tmp_path / "shown.txt"
    with shown.open("w") as stdout:
        place = ("omnidyn.identification.structure.diagnosis", "diagnose")
        process = waiting(*place, *FIT, "-o", str(out), cwd=folder, stdout=stdout)
        robot = load_robot(out)  # it is there while the diagnosis is made
        assert ended(process, number)[0] == code
    assert f"Not made: the diagnosis and the comparison with the logs ({words})" in " ".join(shown.read_text().split())
    assert robot.friction != load_robot("axebot").friction
