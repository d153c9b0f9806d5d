"""A plan that is driven while a key is held: its jobs, and its state without a page."""

import asyncio
import queue
import re

import numpy as np
import pytest

pytest.importorskip("nicegui", reason="the extra studio is not installed")

import omnidyn
from omnidyn.driving.simulated import MUTE, PUSHED, STUCK, Fault, SimulatedRobot
from omnidyn.errors import InputError
from omnidyn.studio import calls
from omnidyn.studio.layout import Studio
from omnidyn.studio.planned import job
from omnidyn.studio.planned.state import AT_ADDRESS, DONE, FAST, READY, RUNNING, STOPPED
from tests.studio.test_calls import by_hand
from tests.studio.test_worker import finished

ROBOT = omnidyn.load_robot("axebot")


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    """A plan of 24 s, and its folder."""
    folder = tmp_path_factory.mktemp("plan") / "made"
    request = {"robot": "axebot", "area": [3.0, 3.0], "seconds": 24.0, "folder": str(folder)}
    return job.plan(request, lambda kind, value: None, None), folder


class Keys:
    """Commands of a page that holds the key for so many looks."""

    def __init__(self, looks):
        self.looks = looks

    def empty(self):
        self.looks -= 1
        return self.looks != 0

    def get(self):
        return {"held": False}


def drive(planned, tmp_path, looks=-1, logs=(), number=1):
    """What a drive tells, and its result."""
    made, folder = planned
    told = []
    request = {
        "robot": "axebot",
        "program": str(folder / job.PROGRAM),
        "area": made["course"]["area"],
        "logs": [*logs],
        "to": "",
        "pace": 1e9,
        "noise": made["noise"],
        "log": str(tmp_path / f"planned-{number}.csv"),
    }
    result = job.drive_plan(request, lambda kind, value: told.append((kind, value)), Keys(looks))
    return told, result, request["log"]


def test_the_plan_and_its_log_are_those_of_the_command_line(planned, tmp_path, monkeypatch):
    made, folder = planned
    monkeypatch.chdir(tmp_path)
    made_by_hand, record = by_hand(*calls.plan("axebot", [3.0, 3.0], 24.0, "", "log.csv"))
    assert str(made_by_hand.verdict).lower() == made["verdict"].lower().removesuffix(".")
    assert record.is_complete
    assert (tmp_path / "plan.csv").read_bytes() == (folder / job.PROGRAM).read_bytes()
    told, result, log = drive(planned, tmp_path)
    assert result["complete"]
    whole, written = omnidyn.read_log(log, ROBOT), omnidyn.read_log("log.csv", ROBOT)
    for name in ("t", "voltage", "wheel_speed"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(written, name))
        parts = [rows[name] for kind, rows in told if kind == "rows"]
        np.testing.assert_allclose(np.concatenate(parts), getattr(whole, name), atol=1e-6)  # as a file has them
    *_, (rows, x, y, heading) = (place for kind, place in told if kind == "frame")
    course = made["course"]
    assert rows * course["row_s"] == pytest.approx(course["seconds"])
    assert [x, y, heading] == pytest.approx(course["legs"][-1][3], abs=0.05)  # what its wheels say, beside the model


def test_a_key_that_is_let_go_stops_it_and_the_rest_is_driven_next(planned, tmp_path):
    _, stopped, first = drive(planned, tmp_path, looks=800)
    assert not stopped["complete"]
    assert "let go" in stopped["verdict"] or "released" in stopped["verdict"]
    told, rest, second = drive(planned, tmp_path, logs=[first], number=2)
    assert rest["complete"]
    (course,) = (value for kind, value in told if kind == "course")
    legs = planned[0]["course"]["legs"]
    left = len(course["legs"])
    assert 0 < left < len(legs)
    assert [leg[2] for leg in course["legs"]] == [leg[2] for leg in legs[-left:]]
    assert stopped["left"] == course
    rows = queue.Queue()
    for kind, value in told:
        rows.put(value) if kind == "rows" else None
    rows.put(job.END)
    request = {"robot": "axebot", "free": planned[0]["learnt"], "within": 0.1, "logs": [first]}
    status = job.follow(request, lambda *_: None, rows)
    assert status["seconds"] > omnidyn.read_log(first, ROBOT).t[-1] + omnidyn.read_log(second, ROBOT).t[-1]
    assert all(number["reached"] for number in status["numbers"])
    assert {number["key"] for number in status["numbers"]} == {*planned[0]["promises"]}
    assert status["said"] == []


@pytest.mark.parametrize(("fault", "words"), [(PUSHED, "slip|border"), (MUTE, "silent|nothing"), (STUCK, "wheel")])
def test_what_goes_wrong_stops_it_and_is_said(planned, tmp_path, monkeypatch, fault, words):
    def faulty(request, program):
        faults = [Fault(fault, 4.0, 60.0, 1)]
        return SimulatedRobot(
            program.robot, {"wheel_speed": 0.1, "twist": (0.02, 0.02, 0.1)}, rate=100.0, faults=faults
        )

    monkeypatch.setattr(job, "_connection", faulty)
    _, result, log = drive(planned, tmp_path)
    assert not result["complete"]
    assert re.search(words, result["verdict"]), result["verdict"]
    assert result["remedy"]
    assert result["left"]["legs"]
    assert omnidyn.read_log(log, ROBOT).t[-1] < planned[0]["course"]["seconds"]


def test_a_page_that_says_nothing_holds_no_key(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(job.time, "monotonic", lambda: now[0])
    commands = queue.Queue()
    held = job._Held(commands, job.LOST)
    for _ in range(100):
        now[0] += 0.05
        commands.put({"held": True})
        assert held()
    now[0] += 0.9 * job.LOST
    assert held()
    now[0] += 0.2 * job.LOST
    assert not held()
    commands.put({"held": True})
    assert not held()  # what came back too late begins nothing
    for word in ({"held": False}, {"held": 1}, "nonsense", None):
        queued = queue.Queue()
        queued.put(word)
        queued.put({"held": True})
        assert not job._Held(queued, job.LOST)()


@pytest.mark.parametrize(("to", "words"), [("-", "not a robot of this page"), ("udp:x", "not an address")])
def test_an_address_that_is_none_is_refused(planned, tmp_path, to, words):
    _, folder = planned
    request = {"robot": "axebot", "program": str(folder / job.PROGRAM), "area": [3.0, 3.0], "logs": [], "to": to}
    with pytest.raises(InputError, match=words):
        job.drive_plan({**request, "log": str(tmp_path / "log.csv")}, lambda *_: None, queue.Queue())


async def held_until(planned, page, reached):
    """Hold the key, and go on where a busy machine lost it, until something is reached or nothing is left."""
    async with asyncio.timeout(300):
        while not reached():
            if planned.stage == STOPPED:
                if planned.result and not planned.result["left"]:
                    return
                planned.go_on()
            planned.press(page)
            planned.hold(page, True)
            await asyncio.sleep(0.02)


@pytest.mark.long
def test_a_plan_is_driven_from_a_page_and_its_logs_can_be_fitted(tmp_path):
    async def scenario():
        studio = Studio()
        session, planned, page = studio.session, studio.planned, object()
        assert planned.why_not() == "Choose a robot first."
        session.robot = "axebot"
        planned.want(seconds=24.0, within=10.0, which=FAST)
        planned.press(page)
        assert planned.stage == READY  # nothing is planned: nothing is driven
        try:
            await asyncio.wait_for(planned.plan(), 300)
            assert planned.last.error == ""
            planned.want(which=AT_ADDRESS)
            planned.press(page)
            assert planned.stage == READY
            assert planned.why_no_drive() == "Type the address of the robot first."
            planned.want(which=FAST)
            await held_until(planned, page, lambda: planned.frame and planned.frame[0] > 300)
            planned.hold(object(), False)  # another page holds nothing
            assert planned.stage == RUNNING
            planned.hold(page, False)
            await finished(lambda: planned.stage == STOPPED)
            assert planned.result["left"]
            planned.press(page)
            assert planned.stage == STOPPED  # it stands where it stopped
            await held_until(planned, page, lambda: planned.stage == DONE)
            await finished(lambda: not session.workers["plan"].busy)
            assert planned.trouble == ""
            assert {number["key"] for number in planned.status["numbers"]} == {*planned.last.result["promises"]}
            driven = sum(omnidyn.read_log(path, ROBOT).t[-1] for path in planned.logs)
            assert planned.status["seconds"] > driven - 1.0  # all that was driven is told, with an answer each second
            logs = [log for log in session.logs.values() if log.name.startswith("planned-")]
            assert len(logs) >= 2
            await finished(lambda: all(log.result is not None for log in logs))
            studio.fitting.want_choices()
            await finished(lambda: studio.fitting.free)
            assert studio.fitting.why_not() == ("", "")
            await asyncio.wait_for(studio.fitting.run(), 300)
            fit = studio.fitting.last
            assert fit.error == ""
            head, rows = fit.result["numbers"]["head"], fit.result["numbers"]["rows"]
            cells = {row[1]: row[head.index("planned, got +- %")] for row in rows}
            for key, (half, _) in planned.last.result["promises"].items():
                assert cells[key].startswith(f"{100.0 * half:.2g}, ")
        finally:
            await session.close()

    asyncio.run(asyncio.wait_for(scenario(), 900))
