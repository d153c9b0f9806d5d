"""A workspace comes back as it was, and a bad one leaves nothing behind."""

import asyncio
import io
import json
import warnings
import zipfile
from pathlib import Path

import pytest

pytest.importorskip("nicegui", reason="the extra studio is not installed")

import omnidyn
from omnidyn.errors import InputError
from omnidyn.studio import workspace
from omnidyn.studio.calls import LogFile
from omnidyn.studio.layout import Studio
from omnidyn.studio.session import MAX_FILES, RefusedError
from omnidyn.studio.task import Task

LOG = {"name": "log.csv", "unsigned": True, "held_out": True, "file": "logs/1-log.csv", "map": ""}
ROWS = b"t_s,vx_m_s\n0,1\n1,2\n"


def manifest(**more):
    """A manifest of one log, or with other values."""
    return json.dumps({"schema": 1, "robot": "axebot", "logs": [LOG], "robots": [], "fits": [], **more}).encode()


def archive(files=None, kind=zipfile.ZIP_DEFLATED):
    """The bytes of a zip archive of these files, a list of pairs; of a good workspace by default."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", kind) as packed, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a name twice
        for name, content in files or [(workspace.MANIFEST, manifest()), (LOG["file"], ROWS)]:
            packed.writestr(name, content)
    return stream.getvalue()


def patched(content, place, value, signature=b"PK\x01\x02"):
    """The archive with other bytes at a place of the last entry of its list."""
    at = content.rindex(signature) + place
    return content[:at] + value + content[at + len(value) :]


@pytest.fixture
def make():
    """Makes studios that start no worker, and closes them."""
    studios = []

    def made():
        studios.append(studio := Studio())
        studio.session.start = lambda work: work.close()
        return studio

    yield made
    for studio in studios:
        asyncio.run(studio.session.close())


def test_all_comes_back(make, tmp_path):
    robot = omnidyn.load_robot("axebot")
    files = {name: tmp_path / name for name in ("log.csv", "other.csv", "columns.toml", "mine.toml", "robot.toml")}
    for name, path in files.items():
        path.write_bytes(f"# {name}\n".encode() + ROWS)
    omnidyn.save_robot(robot, tmp_path / "mine.toml", force=True)
    (tmp_path / "numbers.csv").write_text('number,key\n"a, b",c\n', "utf-8")
    (tmp_path / "warnings.csv").write_text('severity,text\nwarning,"a, b"\n', "utf-8")
    studio = make()
    session = studio.session
    session.logs["log1"] = LogFile("log1", "/somewhere/log.csv", str(files["log.csv"]))
    session.logs["log2"] = LogFile("log2", "other.csv", str(files["other.csv"]), str(files["columns.toml"]), True)
    studio.fitting.hold_out(["log2"])
    session.add_robot(str(files["mine.toml"]), "mine.toml")
    fit = Task(result={"verdict": "Good.", "failed": False}, folder=tmp_path, command="rm -r x", python="x")
    (name,) = studio.fitting.keep(fit)
    studio.fitting.name_group("log1", "wet floor")

    async def again():
        path = await studio.save()
        other = make()
        await other.open(str(path), path.name)
        return path, other

    path, other = asyncio.run(again())
    assert str(tmp_path) not in zipfile.ZipFile(path).read(workspace.MANIFEST).decode()
    logs = list(other.session.logs.values())
    assert [log.name for log in logs] == ["log.csv", "other.csv"]
    assert [log.unsigned for log in logs] == [False, True]
    assert other.fitting.held_out == [logs[1].key]
    assert other.fitting.groups == {logs[0].key: "wet floor", logs[1].key: ""}
    for log, name_before in zip(logs, ("log.csv", "other.csv"), strict=True):
        assert Path(log.path).read_bytes() == files[name_before].read_bytes()
    assert Path(logs[1].map).read_bytes() == files["columns.toml"].read_bytes()
    assert other.session.robot == "mine.toml"
    assert omnidyn.load_robot(other.session.robot_path) == robot
    assert Path(other.session.robots[name]).read_bytes() == files["robot.toml"].read_bytes()
    restored = other.fitting.last
    assert (restored.command, restored.python) == ("", "")  # a stranger's command is not shown to be copied
    assert restored.result["verdict"] == "Good."
    assert restored.result["warnings"] == [{"severity": "warning", "text": "a, b"}]
    assert restored.result["numbers"] == {"head": ["number", "key"], "rows": [["a, b", "c"]]}


STRANGE_MANIFESTS = {
    "no json": b"{",
    "a list": b"[]",
    "deep": b"[" * 100_000,
    "a large integer": b'{"schema": ' + b"1" * 5000 + b"}",
    "too long": manifest(robot="x" * workspace.MAX_MANIFEST),
    "another schema": manifest(schema=2),
    "a robot that is a number": manifest(robot=1),
    "a log that is a text": manifest(logs=["x"]),
    "a flag that is a number": manifest(logs=[{**LOG, "unsigned": 1}]),
    "another key": manifest(logs=[{**LOG, "path": "/etc/passwd"}]),
    "no file": manifest(logs=[{**LOG, "file": ""}]),
    "another file": manifest(logs=[{**LOG, "file": "/etc/passwd"}]),
    "a file twice": manifest(logs=[LOG, LOG]),
    "too many": manifest(logs=[LOG] * (MAX_FILES + 1)),
    "no logs": manifest(logs=[]),
}
GOOD, STORED = archive(), archive(kind=zipfile.ZIP_STORED)
BAD = {
    **{words: archive([(workspace.MANIFEST, text), (LOG["file"], ROWS)]) for words, text in STRANGE_MANIFESTS.items()},
    **{
        f"a file {name}": archive([(workspace.MANIFEST, manifest()), (LOG["file"], ROWS), (name, b"")])
        for name in ("../evil", "/etc/evil", "logs/../../evil", "logs/1-..\\evil", LOG["file"], workspace.MANIFEST, "x")
    },
    "no manifest": archive([(LOG["file"], ROWS)]),
    "no archive": b"t,vx\n0,1\n",
    "cut short": GOOD[:-30],
    "with more behind it": GOOD + b"x",
    "another end in front": patched(GOOD, -20, b"PK\x06\x07", b"PK\x05\x06"),
    "a bomb": archive([(workspace.MANIFEST, manifest()), (LOG["file"], b"\0" * (workspace.GROWING + 1))]),
    "many files": archive([(workspace.MANIFEST, manifest()), *((f"logs/{k}-x", b"") for k in range(4 * MAX_FILES))]),
    "encrypted": patched(GOOD, 8, b"\x01\x00"),
    "another packing": patched(GOOD, 10, b"\x0e\x00"),
    "another content": STORED.replace(ROWS, ROWS.replace(b"2", b"9")),
    "longer than it says": patched(STORED, 24, b"\x05\x00\x00\x00"),
    "larger than all": patched(GOOD, 24, b"\xff\xff\xff\xfe"),
}


@pytest.mark.parametrize("words", BAD)
def test_a_bad_one_is_refused_and_leaves_nothing(make, tmp_path, words):
    path = tmp_path / "bad.zip"
    path.write_bytes(BAD[words])
    studio = make()
    with pytest.raises(InputError, match=r"not a workspace.*expected.*save the workspace again"):
        asyncio.run(studio.open(str(path), path.name))
    with pytest.raises(InputError, match="not a workspace"):
        workspace.read(path)  # as the command line checks it
    assert not studio.session.logs
    assert not list(studio.session.folder.rglob("*"))
    assert not list(tmp_path.glob("**/evil"))


def test_the_list_of_files_is_bounded_before_it_is_read(tmp_path):
    path = tmp_path / "bad.zip"
    path.write_bytes(BAD["many files"])
    with pytest.raises(InputError, match=f"got {4 * MAX_FILES + 1} files; expected at most {4 * MAX_FILES} files"):
        workspace.read(path)


def test_a_good_one_and_one_too_many(make, tmp_path):
    path = tmp_path / "good.zip"
    path.write_bytes(GOOD)
    studio = make()
    asyncio.run(studio.open(str(path), path.name))
    (log,) = studio.session.logs.values()
    assert (log.unsigned, studio.fitting.held_out, studio.session.robot) == (True, [log.key], "axebot")
    studio.session.robots |= {f"{k}.toml": "" for k in range(MAX_FILES)}
    with pytest.raises(RefusedError):
        asyncio.run(studio.open(str(path), path.name))
    assert list(studio.session.logs.values()) == [log]


def test_a_log_that_is_a_folder_is_not_kept(make, tmp_path):
    studio = make()
    studio.session.add_log(str(tmp_path), "bag")
    with pytest.raises(InputError, match=r"only files.*got bag.*remove it"):
        asyncio.run(studio.save())


def test_a_workspace_from_before_there_were_notes_opens(make, tmp_path):
    fit = {"name": "fit-1.toml", "verdict": "Good.", "failed": False, "robot": "fits/1-robot.toml"}
    fit |= {"numbers": "fits/2-numbers.csv", "warnings": "fits/3-warnings.csv", "report": ""}
    files = [(fit["robot"], b'name = "a"\n'), (fit["numbers"], b"number\n"), (fit["warnings"], b"severity,text\n")]
    path = tmp_path / "old.zip"
    path.write_bytes(archive([(workspace.MANIFEST, manifest(fits=[fit])), (LOG["file"], ROWS), *files]))
    studio = make()
    asyncio.run(studio.open(str(path), path.name))
    assert list(studio.fitting.history) == ["fit-1.toml"]
    assert studio.fitting.fits["fit-1.toml"].note == ""
