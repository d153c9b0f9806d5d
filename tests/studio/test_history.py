"""The history of fits, removals and undo, what a user may bring, and that no path of the server shows."""

import asyncio
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import pytest

pytest.importorskip("nicegui", reason="the extra studio is not installed")

import omnidyn
from omnidyn.studio import calls
from omnidyn.studio.calls import MAX_NAME
from omnidyn.studio.compare.state import Comparing
from omnidyn.studio.fit.job import PARTS, _fitted
from omnidyn.studio.fit.state import Fitting
from omnidyn.studio.job import part_of
from omnidyn.studio.script import script
from omnidyn.studio.session import MAX_FILES, RefusedError, Session
from omnidyn.studio.task import Task
from omnidyn.studio.track.state import DRAWN, Tracks
from omnidyn.studio.words import each_text, in_page_names
from tests.studio.test_calls import Here
from tests.support.pages import write_log

FOLDER = "a folder of the server"


@pytest.fixture
def session(tmp_path):
    """A session whose jobs are done in this process."""
    made = Session()
    made.workers = dict.fromkeys(made.workers, Here())
    made.start = lambda work: work.close()
    made.robot = "axebot"
    yield made
    made._folder.cleanup()


def kept(session, fitting, count=1):
    """So many fits of the axebot."""
    for _ in range(count):
        folder = session.new_folder()
        omnidyn.save_robot(omnidyn.load_robot("axebot"), folder / "robot.toml")
        fitting.last = Task(result={"verdict": "Good.", "failed": False}, folder=folder)
        fitting.keep(fitting.last)


def test_fits_are_kept_named_noted_and_shown_again(session):
    fitting = Fitting(session)
    kept(session, fitting, 2)
    first, second = (kept.fit for kept in fitting.history.values())
    assert [omnidyn.load_robot(session.robots[name]).name for name in fitting.history] == [
        "axebot, fit-1",
        "axebot, fit-2",
    ]  # told apart where both are compared
    fitting.show("fit-1.toml")
    assert fitting.last is first
    fitting.note("fit-1.toml", "the old floor")
    session.choose("fit-1.toml")
    assert fitting.rename("fit-1.toml", "carpet") == ""
    assert list(fitting.history) == ["fit-2.toml", "carpet.toml"]
    assert (session.robot, Path(session.robot_path).name) == ("carpet.toml", "carpet.toml")
    assert fitting.history["carpet.toml"].note == "the old floor"
    assert omnidyn.load_robot(session.robot_path).name == "axebot, carpet"  # also in the file that is downloaded
    assert "there is a robot of this name" in fitting.rename("carpet.toml", "fit-2")
    assert asyncio.run(session.keep_robot("", "carpet", "carpet.toml")) != ""  # a fit is not written over
    fitting.remove("carpet.toml")
    assert list(fitting.history) == ["fit-2.toml"]
    assert session.robot == ""
    session.undo()
    assert fitting.history["carpet.toml"].fit is first
    assert session.robot == "carpet.toml"
    assert fitting.history["fit-2.toml"].fit is second


def test_a_log_that_was_removed_comes_back_and_its_file_goes_with_the_next_removal(session, tmp_path):
    paths = [session.new_folder() / name for name in ("a.csv", "b.csv")]
    logs = [session.add_log(str(write_log(path, 1.0)), path.name) for path in paths]
    session.remove(logs[0])
    assert list(session.logs.values()) == [logs[1]]
    session.undo()
    assert session.removed is None
    assert {log.name for log in session.logs.values()} == {"a.csv", "b.csv"}
    session.remove(logs[0])
    assert paths[0].exists()
    session.remove(logs[1])
    assert not paths[0].exists()
    assert paths[1].exists()


def test_only_what_a_user_brought_counts_and_that_is_said(session, tmp_path):
    fitting = Fitting(session)
    kept(session, fitting, 3)
    asyncio.run(session.example())
    assert session.room == f"0 of at most {MAX_FILES} files, 1 GiB each."

    async def body():
        yield b"t_s,vx_m_s\n0,1\n"

    for k in range(MAX_FILES):
        asyncio.run(session.upload(f"{k}.csv", body()))
    assert session.room == f"{MAX_FILES} of at most {MAX_FILES} files, 1 GiB each. Remove one first."
    with pytest.raises(RefusedError, match="Remove one first"):
        asyncio.run(session.upload("one-more.csv", body()))


def test_no_path_of_the_server_stands_in_what_is_said_or_written(session, tmp_path):
    folder = tmp_path / FOLDER
    folder.mkdir()
    robot_file, paths = folder / "mine.toml", [folder / "one.csv", folder / "two.csv"]
    omnidyn.save_robot(omnidyn.load_robot("axebot"), robot_file)

    def turn(twist):
        twist[:, 1] *= -1.0

    write_log(paths[0], 8.0)
    write_log(paths[1], 8.0, 2, change=turn)
    session.open([str(robot_file), *map(str, paths)])
    assert session.robot == "mine.toml"
    said = []
    for log in session.logs.values():
        asyncio.run(session.check(log))
        said += [log.result, log.error]
    fitting, comparing = Fitting(session), Comparing(session)
    (finding,) = (f for f in list(session.logs.values())[1].result["findings"] if f["severity"] == "error")
    assert finding["reading"]
    assert fitting.why_not()[0] == "unfit"
    asyncio.run(session.remedy(list(session.logs.values())[1], finding["reading"]))
    fitting.hold_out([list(session.logs)[1]])
    assert fitting.why_not() == ("", "")
    asyncio.run(fitting.run())
    assert not fitting.last.result["failed"]
    asyncio.run(comparing.run())
    said += [fitting.last.result, comparing.last.result]
    first, second = session.logs.values()
    first.other = second.key
    asyncio.run(session.align(first))
    said.append(first.aligned)
    assert FOLDER not in str(said)
    assert str(session.folder) not in str(said)
    for file in fitting.last.folder.rglob("*"):
        if file.suffix in (".toml", ".csv", ".json", ".html") and file.name != "report.html":
            text = file.read_text("utf-8")
            assert FOLDER not in text, file
            assert str(session.folder) not in text, file
    assert str(session.folder) not in (fitting.last.folder / "report.html").read_text("utf-8")
    kept_robot = omnidyn.load_robot(fitting.last.folder / "robot.toml")
    assert "one.csv" in str({key: prior.source for key, prior in kept_robot.priors.items()})
    rows = {row[0]: row[1:] for row in fitting.last.result["logs"]["rows"]}
    assert {name: row[0] for name, row in rows.items()} == {"two.csv": "hold out", "one.csv": "fit"}
    of_one = omnidyn.compare(kept_robot, omnidyn.read_log(paths[0], kept_robot)).rmse
    assert [float(cell) for cell in rows["one.csv"][1:]] == pytest.approx([*of_one.values()], rel=0.01)
    assert list(fitting.last.result["runs"]) == ["two.csv (hold out)", "one.csv (fit)"]


def test_the_words_of_the_library_have_the_names_of_the_page():
    said = "hold out a log with `hold_out`, see `check`; raise `max_bytes`"
    assert in_page_names(said) == "hold out a log with hold out (tab Fit), see check; raise --max-bytes"
    assert in_page_names("hold it out (`hold_out`): then") == "hold it out (hold out, tab Fit): then"
    told = each_text({"text": said, "columns": [{"column": "`hold_out`"}]}, in_page_names, str)
    assert told["columns"] == [{"column": "`hold_out`"}]
    assert "`" not in told["text"]
    remedy = {"key": "motor.resistance_ohm", "text": "motor.resistance_ohm would explain it"}
    told = each_text({"remedies": [remedy]}, in_page_names, str)["remedies"]
    assert told == [{"key": "motor.resistance_ohm", "text": "resistance would explain it"}]  # the button fits the key
    for name in ("latency.csv", "latency.twist.csv", "twist[1].csv"):  # a file of a user stays as it is
        assert in_page_names(f"{name}: 3 rows") == f"{name}: 3 rows"
    assert in_page_names("latency.twist is 0; twist[1] is not followed; so is latency.heading.") == (
        "latency of the speed over the ground is 0; vy is not followed; so is latency of the heading."
    )


@pytest.mark.parametrize(
    "said, shown",
    [
        (
            "which may be voltages or speeds (say `column` u1=V1:V and so on): not taken",
            "which may be voltages or speeds (say that V1 is u1 in V and so on: Columns and units, tab Log): not taken",
        ),
        (
            'the motion says `column` "w1=m 1:rpm@motor" w2=-m2:rad/s',
            "the motion says that m 1 is w1 in rpm at the motor and m2 is w2 in rad/s, other sign: "
            "Columns and units (tab Log)",
        ),
        ("no unit is given (say `assume` d=V, duty or %)", "no unit is given (say the unit: V, duty or %)"),
        (
            "motor.resistance_ohm is a guess: fit it (`free` friction `free` motor.resistance_ohm).",
            "resistance is a guess: fit it (choose resistance under Free, tab Fit).",
        ),
        ("fit it (`nuisances` latency)", "fit it (--nuisances latency)"),
        ("resistance (motor.resistance_ohm) is off", "resistance is off"),
        (
            "friction.axes.coulomb.toml and a/motor.resistance_ohm",
            "friction.axes.coulomb.toml and a/motor.resistance_ohm",
        ),
    ],
)
def test_no_key_and_no_argument_of_the_command_line_stands_in_prose(said, shown):
    told = each_text({"verdict": said, "rows": [[said]]}, in_page_names, str)
    assert told == {"verdict": shown, "rows": [[said]]}


@pytest.mark.parametrize("name", ['ends in "', "x'", "a\\b", "ü", "n" * 400])
def test_a_fit_is_told_apart_whatever_its_robot_is_called(session, name):
    fitting, folder = Fitting(session), session.new_folder()
    omnidyn.save_robot(omnidyn.load_robot("axebot").replace(name=name), folder / "robot.toml")
    (key,) = fitting.keep(Task(result={"verdict": "Good.", "failed": False}, folder=folder))
    assert omnidyn.load_robot(session.robots[key]).name == f"{name[:MAX_NAME]}, fit-1"


def test_a_second_click_on_remove_removes_nothing(session):
    """Two clicks, or two pages: the file stays, for Undo brings it back."""
    path = session.new_folder() / "a.csv"
    log = session.add_log(str(write_log(path, 1.0)), path.name)
    session.remove(log)
    session.remove(log)
    session.undo()
    assert path.exists()
    fitting = Fitting(session)
    kept(session, fitting)
    fitting.remove("fit-1.toml")
    fitting.remove("fit-1.toml")
    assert "removed" in fitting.rename("fit-1.toml", "other")
    session.undo()
    assert list(fitting.history) == ["fit-1.toml"]


def test_a_robot_file_with_the_name_of_a_fit_that_was_removed_is_not_that_fit(session, tmp_path):
    fitting = Fitting(session)
    kept(session, fitting)
    fitting.remove("fit-1.toml")
    omnidyn.save_robot(omnidyn.load_robot("axebot"), tmp_path / "fit-1.toml")
    session.add_robot(str(tmp_path / "fit-1.toml"), "fit-1.toml")
    assert session.robot == "fit-1-2.toml"
    assert session.is_editable("fit-1-2.toml")
    assert not fitting.history
    session.undo()
    assert list(fitting.history) == ["fit-1.toml"]


def test_two_logs_of_one_name_have_two_names_in_what_is_done_by_hand(session):
    """Else a call would read one of them twice."""
    logs = [session.add_log(str(write_log(session.new_folder() / "log.csv", 1.0, k)), "log.csv") for k in (1, 2)]
    command, python = calls.fit(logs, logs[1:], "axebot", ())
    assert [log.name for log in logs] == ["log.csv", "log-4.csv"]
    assert "log.csv log-4.csv" in command
    assert "'log-4.csv'" in python
    assert logs[1].request["name"] == "log-4.csv"


def test_the_script_runs_after_a_fit_was_renamed_and_with_a_drawn_path(session, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    fitting, comparing, tracks = Fitting(session), Comparing(session), Tracks(session)
    session.add_log(str(write_log(tmp_path / "log.csv", 4.0)), "log.csv")
    kept(session, fitting, 2)
    comparing.choose(0, "fit-1.toml")
    comparing.choose_fits(["fit-1.toml", "fit-2.toml"])
    asyncio.run(comparing.run())
    tracks.choose(DRAWN)
    tracks.draw([[0.0, 0.0], [0.5, 0.0]])
    tracks.control(["pid"])
    asyncio.run(tracks.run())
    assert comparing.last.result
    assert tracks.last.result
    fitting.rename("fit-1.toml", "carpet")
    fitting.remove("fit-2.toml")
    work = script(fitting, {"compare": comparing.last, "track": tracks.last})
    assert str(session.folder) not in work
    with redirect_stdout(StringIO()) as out:
        exec(compile(work, "work.py", "exec"), {})
    for name, rmse in omnidyn.compare(omnidyn.load_robot("fit-1.toml"), omnidyn.read_log("log.csv")).rmse.items():
        assert name in out.getvalue()
        assert f"{rmse:.4g}" in out.getvalue()
    assert "pid" in out.getvalue()


def test_a_fit_says_which_part_of_how_many_it_is_at_and_what_the_last_one_took(session, tmp_path):
    phases, path = [], str(write_log(tmp_path / "log.csv", 4.0))
    log = {"path": path, "name": "log.csv", "map": "", "unsigned": False}
    request = {"robot": "axebot", "logs": [log], "hold_out": [], "folder": str(tmp_path / "fit"), "command": ""}
    _fitted(request, lambda report: phases.append(report.phase))
    parts = [part for phase in phases if (part := part_of(phase, PARTS))]
    assert parts == sorted(parts)
    assert {*parts} == {*range(1, len(PARTS) + 1)}  # each phase of the library has its part
    session.add_log(path, "log.csv")
    asyncio.run(session.check(next(iter(session.logs.values()))))
    fitting = Fitting(session)
    asyncio.run(fitting.run())
    assert fitting.last.before is None  # nothing is known yet, and nothing is said
    fitting.last.spent = 14.0
    asyncio.run(fitting.run())
    assert fitting.last.before == 14.0


def test_a_fit_warns_of_an_interval_much_wider_than_planned(tmp_path):
    log = {"path": str(write_log(tmp_path / "log.csv", 4.0)), "name": "log.csv", "map": "", "unsigned": False}
    request = {"robot": "axebot", "logs": [log], "hold_out": [], "command": ""}
    request["promises"] = {"friction.axes.coulomb[0]": (1e-9, 1e-9), "friction.axes.coulomb[1]": (None, None)}
    told = _fitted({**request, "folder": str(tmp_path / "fit")}, lambda report: None)
    assert told["warnings"][0]["severity"] == "warning"
    assert "coulomb friction forward is known within" in told["warnings"][0]["text"].lower()
    assert "times as wide as planned" in (tmp_path / "fit" / "warnings.csv").read_text("utf-8")
