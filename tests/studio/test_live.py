"""A log that is watched while it grows: what the page gets is what `omnidyn watch` and `omnidyn.Live` say."""

import asyncio
import json
import shlex
from contextlib import redirect_stdout
from io import StringIO

import pytest

pytest.importorskip("nicegui", reason="the extra studio is not installed")

from omnidyn.cli import main
from omnidyn.errors import InputError
from omnidyn.model.keys import in_words
from omnidyn.studio.layout import Studio
from omnidyn.studio.live import job
from tests.studio.test_calls import by_hand
from tests.studio.test_worker import finished, works
from tests.support.pages import write_log


class Until:
    """Commands of a page that come after so many looks at the file."""

    def __init__(self, looks):
        self.looks = looks

    def empty(self):
        self.looks -= 1
        return self.looks >= 0


def watched(path, looks, **request):
    """What a job tells, and its result."""
    told = []
    of_log = {"path": str(path), "name": path.name, "map": "", "unsigned": False, "robot": "axebot", "within": 0.1}
    result = job.watch({**of_log, **request}, lambda kind, value: told.append((kind, value)), Until(looks))
    assert {kind for kind, _ in told} == {"live"}
    return [value for _, value in told], result


def test_a_file_that_grows_in_pieces_says_what_watch_and_live_say(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = write_log(tmp_path / "log.csv", 20.0)
    text = path.read_bytes()
    pieces = [text[: len(text) // 3], b"", text[len(text) // 3 : -40], text[-40:], b""]
    monkeypatch.setattr(job, "growth_of", lambda path: iter(pieces))
    monkeypatch.setattr(job, "INTERVAL", 0.0)
    told, last = watched(path, 9)
    assert told[0]["numbers"] == []
    assert told[0]["verdict"].startswith("No numbers yet")
    assert last == told[-1]
    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)
    with redirect_stdout(StringIO()) as out:
        main(["watch", "log.csv", "--robot", "axebot", "--idle", "0.3", "--json"])
    lines = [json.loads(line) for line in out.getvalue().splitlines()]
    said = lines[-2]  # the last one is of the whole fit, which ends a drive
    assert last["verdict"] == said["verdict"]
    assert last["enough"] == said["enough"]
    wanted = {in_words(key): number for key, number in said["numbers"].items() if number["within"]}
    assert len(wanted) >= 6
    assert [number["name"] for number in last["numbers"]] == [*wanted]
    for number in last["numbers"]:
        same = wanted[number["name"]]
        assert (number["value"], number["reached"]) == (same["value"], same["reached"])
        assert number["half"] == pytest.approx(0.5 * (same["high"] - same["low"]) / abs(same["value"]))
    seconds = [answer["seconds"] for answer in told if answer["numbers"]]
    assert len({*seconds}) >= 15  # an answer each second, whatever comes at once
    assert seconds == sorted(seconds)


def test_a_file_that_is_written_anew_is_read_from_its_start(tmp_path, monkeypatch):
    path = write_log(tmp_path / "log.csv", 8.0)
    text = path.read_bytes()
    monkeypatch.setattr(job, "growth_of", lambda path: iter([text, None, text]))
    told, last = watched(path, 9)
    assert last["said"]
    assert last["seconds"] > told[1]["seconds"]


def test_what_is_no_text_is_said_and_stop_ends_it_with_the_log_checked_anew(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = write_log(tmp_path / "whole.csv", 12.0).read_text("utf-8").splitlines(keepends=True)
    path, packed = tmp_path / "log.csv", tmp_path / "log.parquet"
    path.write_text("".join(text[:300]), "utf-8")
    packed.write_bytes(b"PAR1" + bytes(50) + b"PAR1")
    with pytest.raises(InputError, match="only text can be read while it grows"):
        watched(packed, 9)

    async def scenario():
        studio = Studio()
        session, watching = studio.session, studio.watching
        log = session.add_log("log.csv", "log.csv")
        assert watching.why_not() == "Choose a robot first."
        session.robot = "axebot"
        watching.want(15)
        try:
            await finished(lambda: log.result is not None)
            assert log.result["rows"] == 299
            task = asyncio.ensure_future(watching.run(log))
            await finished(lambda: session.workers["watch"].busy)
            watching.stop()  # before its process can hear it
            await asyncio.wait_for(task, 120)
            assert watching.trouble == ""
            task = asyncio.ensure_future(watching.run(log))
            await finished(lambda: works(session.workers["watch"]) and watching.status is not None)
            with path.open("a", encoding="utf-8") as file:
                file.write("".join(text[300:]))
            await finished(lambda: bool(watching.status["numbers"]))
            watching.stop()
            await asyncio.wait_for(task, 120)
            assert watching.trouble == ""
            assert log.result["rows"] == 1201  # all that came since
            assert watching.command == "omnidyn watch log.csv --robot axebot --within 15"
            assert {number["within"] for number in watching.status["numbers"]} == {0.15}
            return watching.status, watching.python
        finally:
            await session.close()

    status, python = asyncio.run(asyncio.wait_for(scenario(), 600))
    assert shlex.split(python.splitlines()[-1])
    (verdict,) = by_hand("", python)
    assert status["verdict"].lower() == f"{verdict}.".lower()
