"""What a page shows as "the same by hand" runs as it stands: each command line, and each Python call."""

import asyncio
import queue
import shlex
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("nicegui", reason="the extra studio is not installed")

import omnidyn
from omnidyn.cli import main
from omnidyn.model.keys import Key, find_key
from omnidyn.studio import calls
from omnidyn.studio.calls import LogFile
from omnidyn.studio.compare.state import Comparing
from omnidyn.studio.fit.state import Fitting
from omnidyn.studio.job import shown
from omnidyn.studio.jobs import JOBS
from omnidyn.studio.script import script
from omnidyn.studio.session import Session
from omnidyn.studio.task import Task
from omnidyn.studio.track.state import Tracks
from tests.support.pages import command, write_log

NAMES = ("monday.csv", "tuesday.csv")


@pytest.fixture
def session(tmp_path, monkeypatch):
    """A session with two logs of one drive, the axebot and two fits."""
    monkeypatch.chdir(tmp_path)
    for name in NAMES:
        write_log(name, 8.0, robot=omnidyn.load_robot("axebot"))
    made = Session()
    made.robot = "axebot"
    made.logs = {name: LogFile(name, name, name) for name in NAMES}
    for name in ("fit-1.toml", "fit-2.toml"):
        assert main(["identify", NAMES[0], "--robot", "axebot", "--quick", "-o", name]) == 0
        made.robots[name] = name
    yield made
    made._folder.cleanup()


def by_hand(command, python):
    """Run both, line by line; returns what the expressions of Python give. voltages: those of a user."""
    for line in command.splitlines():
        assert main(shlex.split(line)[1:]) == 0
    names, given = {"omnidyn": omnidyn, "voltages": np.zeros((10, 3))}, []
    for line in python.splitlines():
        if line.startswith("robot = "):
            exec(line, names)
        else:
            given.append(eval(line, names))
    return given


def test_what_stands_under_the_same_by_hand_runs(session):
    first, second = session.logs.values()
    (verdict,) = by_hand(*calls.check(first, "axebot"))
    assert verdict.rows > 700
    (offset,) = by_hand(*calls.align(first, second, "axebot"))
    assert abs(offset) < 0.01
    comparing = Comparing(session)
    comparing.choose(1, "fit-1.toml")
    (comparison,) = by_hand(*comparing.calls())
    assert len(comparison.robots) == 2
    assert len(comparison.measured) == 2
    (fit,) = by_hand(*calls.fit([first, second], [second], "axebot", ("friction.axes.coulomb",)))
    assert "friction.axes.coulomb[0]" in fit.estimate.value
    tracks = Tracks(session)
    tracks.options[tracks.path]["rounds"] = "0.25"
    (trackings,) = by_hand(*tracks.calls())
    assert [tracking.controller for tracking in trackings] == ["pid", "mpc"]
    comparing.choose_fits(["fit-1.toml", "fit-2.toml"])
    (drift,) = by_hand(*comparing.drift_calls())
    assert drift.numbers
    assert drift.changed == ()
    Path("voltages.csv").write_text("t_s,u1_V,u2_V,u3_V\n0,0,3,-3\n1,0,0,0\n", "utf-8")
    zone, run = by_hand(*calls.drive("axebot"))
    assert zone
    assert len(run) == 11


class Here:
    """A worker that does its jobs in this process."""

    async def run(self, job, request, listen):
        return JOBS[job](request, listen, queue.Queue())

    async def ask(self, job, request):
        return JOBS[job](request, lambda kind, value: None, queue.Queue())

    def command(self, value):
        pass


def written(name, columns):
    """A log of the axebot with other columns. columns: of its run -> of the file."""
    run = omnidyn.read_log(write_log("all.csv", 8.0, seed=len(name)))
    motion = omnidyn.simulate(omnidyn.load_robot("axebot"), run.voltage[:-1], 0.01)
    names, values = zip(*columns(run, motion).items(), strict=True)
    head = ",".join(("t_s", "u1_V", "u2_V", "u3_V", *names))
    np.savetxt(name, np.column_stack([run.t, run.voltage, *values]), delimiter=",", header=head, comments="")
    Path("all.csv").unlink()
    return name


def another_sign(run, motion):
    return {"vx_m_s": -run.twist[:, 0], "vy_m_s": run.twist[:, 1], "omega_rad_s": run.twist[:, 2]}


def another_column(run, motion):
    vx, vy, omega = run.twist.T
    return {"vx_m_s": 0.5 * vx, "slip_vx": vx, "vy_m_s": vy, "omega_rad_s": omega}


def another_unit(run, motion):
    rpm = motion.wheel_speed * 19.0 * 30.0 / np.pi  # of the motor, before a gear of 19
    noise = np.random.default_rng(3).standard_normal(rpm.shape) * 20.0
    return dict(zip(("m1", "m2", "m3"), (rpm + noise).T, strict=True))


BY_COLUMN = {  # column -> what it is, its unit, whether it is of the motor, and of the other sign
    "another_sign.csv": {"vx_m_s": ("vx", "m/s", False, True)},
    "another_column.csv": {"vx_m_s": ("-", "m/s", False, False), "slip_vx": ("vx", "m/s", False, False)},
    "another_unit.csv": {f"m{k}": (f"w{k}", "rpm", True, False) for k in (1, 2, 3)},
}


async def mapped(session, log, of_columns):
    """Correct the columns of a log on the page."""
    await session.check(log)
    result = log.result or {"columns": [], "unused": []}
    rows = {row["column"]: dict(row) for row in result["columns"]}
    for column, (component, unit, motor, invert) in of_columns.items():
        rows[column] = {"component": component, "column": column, "unit": unit, "motor": motor, "invert": invert}
    assert await session.map_columns(log, [row for row in rows.values() if row["component"] != "-"]) == ""
    Path(log.map_name).write_bytes(Path(log.map).read_bytes())  # "Save this map"


@pytest.fixture
def three_maps(tmp_path, monkeypatch):
    """A session with a log of another sign, one of another column, one of another unit, and the robot of all."""
    monkeypatch.chdir(tmp_path)
    made = Session()
    made.workers = dict.fromkeys(made.workers, Here())
    made.start = lambda work: work.close()
    made.robot = "axebot"
    for make in (another_sign, another_column, another_unit):
        log = made.add_log(written(f"{make.__name__}.csv", make), f"{make.__name__}.csv")
        asyncio.run(mapped(made, log, BY_COLUMN[log.name]))
    yield made
    made._folder.cleanup()


FREE = ("friction.axes.coulomb[0]", "friction.axes.viscous[2]")  # the other numbers are fixed
NOTE = "'" * 3 + chr(10) + " import os"  # of a user: no code


GROUPS = {"another_sign.csv": "dry floor", "another_column.csv": "wet", "another_unit.csv": "dry floor"}


@pytest.mark.parametrize(
    "free, held_out, groups",
    [
        (FREE, "another_unit.csv", GROUPS),
        ((), "another_column.csv", {}),
        (FREE, "another_column.csv", {}),  # both others have a part of it
    ],
)
@pytest.mark.some(1)
def test_logs_of_different_maps_give_by_hand_what_the_page_gives(three_maps, free, held_out, groups):
    session, fitting = three_maps, Fitting(three_maps)
    fitting.hold_out([log.key for log in session.logs.values() if log.name == held_out])
    for log in session.logs.values():
        fitting.name_group(log.key, groups.get(log.name, ""))
    fitting._choices_of = session.robot_path
    asyncio.run(fitting._choose(session.robot_path))
    fitting.set_free(list(free) or fitting.free)
    asyncio.run(fitting.run())
    assert fitting.last.result, fitting.last.error
    (fit,) = by_hand(fitting.last.command, fitting.last.python)
    folder, result = fitting.last.folder, fitting.last.result
    assert [*result["values"]] == ([*dict.fromkeys(groups.values())] if groups else [""])
    for group, on_page in result["values"].items():
        estimate = fit.groups[group] if group else fit.estimate
        assert {name: float(value) for name, value in estimate.value.items()} == on_page
        assert set(on_page) >= set(free)
        of_command = omnidyn.load_robot(f"fitted-{group.replace(' ', '-')}.toml" if group else "fitted.toml")
        of_page = omnidyn.load_robot(folder / result["robots"][group])
        for name in filter(find_key, on_page):
            assert Key.parse(name).get(of_command) == Key.parse(name).get(of_page)
    assert fit.headline == fitting.last.result["verdict"]
    assert not fitting.last.result["failed"]
    kept = fitting.history
    assert [*kept] == ([f"fit-1-{group}.toml" for group in ("dry_floor", "wet")] if groups else ["fit-1.toml"])
    assert len(result["differences"]["rows"]) == (len(free) if groups else 0)
    fitting.note(next(iter(kept)), NOTE)
    work = script(fitting, {"compare": Task(), "track": Task()})
    assert "eval" not in work
    assert str(session.folder) not in work
    for path in Path().glob("*-columns.toml"):
        path.unlink()  # the script has them
    with redirect_stdout(StringIO()) as out:
        exec(compile(work, "work.py", "exec"), {})
    assert fitting.last.result["verdict"] in out.getvalue()
    assert work.count("omnidyn.identify(") == 1
    for name, one in kept.items():
        assert Path(name).read_text("utf-8") == (folder / one.file).read_text("utf-8")


def test_groups_that_a_fit_cannot_have_are_said_before(three_maps):
    fitting, (first, second, third) = Fitting(three_maps), three_maps.logs
    for key, group, code in ((first, "=a,b;", "no_group"), (second, "ab", "no_group"), (third, "ab", "one_group")):
        fitting.name_group(key, group)
        assert fitting.why_not()[0] == code
    assert fitting.group_of(first) == "ab"  # a name that commands and files can have
    fitting.name_group(third, "c")
    assert fitting.why_not()[0] == ""
    fitting.hold_out([third])
    assert fitting.why_not()[0] == "one_group"
    fitting.name_group(second, "d")
    assert fitting.why_not()[0] == "group_held_out"
    fitting.use(third, "leave out")
    assert fitting.why_not()[0] == ""


def by_hand_as_json(words, python):
    """What the last command says for machines, after those before it; and what Python gives."""
    for path in Path().glob("*-si.csv"):
        path.unlink()
    *before, last = words.splitlines()
    (given,) = by_hand("\n".join(before), python)
    return command(*shlex.split(last)[1:], "--json")[0], given


def test_comparisons_and_clocks_of_logs_of_different_maps_by_hand(three_maps):
    session = three_maps
    first, second, _ = session.logs.values()
    first.other = second.key
    asyncio.run(session.align(first))
    said, offset = by_hand_as_json(*calls.align(first, second, "axebot"))  # of two motions: the best of them
    assert said["offset"] == offset == first.offset != 0.0
    comparing = Comparing(session)
    asyncio.run(comparing.run())
    said, comparison = by_hand_as_json(comparing.last.command, comparing.last.python)
    assert shown(comparison.document())["parts"] == comparing.last.result["all"]
    overall = {name: score.rmse for name, score in comparison.overall["axebot"].items()}
    assert {name: score["rmse"] for name, score in said["robots"]["axebot"]["overall"].items()} == overall


def test_one_map_for_all_is_one_flag(three_maps):
    for log in three_maps.logs.values():
        log.map = next(iter(three_maps.logs.values())).map
    line, _ = calls.fit([*three_maps.logs.values()], (), "axebot", ())
    assert "convert" not in line
    assert line.count("--map another_sign-columns.toml") == 1


def test_files_of_logs_of_one_name_have_several(three_maps):
    again = three_maps.add_log("elsewhere/another_sign.csv", "elsewhere/another_sign.csv")
    assert len({log.map_name for log in three_maps.logs.values()} | {again.si_name}) == 5
