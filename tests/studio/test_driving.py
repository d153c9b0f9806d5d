"""A drive without a page, and a worker without a server."""

import asyncio
import json
import queue
import socket
import subprocess
import sys
import threading

import numpy as np
import pytest

import omnidyn
from omnidyn.model.deadzone import axis_patterns, breakaway_voltage
from omnidyn.model.friction import DirectionFriction, Friction
from omnidyn.model.surroundings import Floor
from omnidyn.model.variations import Surface, Variations
from omnidyn.studio.drive.job import DrivenRobot
from omnidyn.studio.worker import CancelledError, JobError, Worker


def drive(robot, folder, *commands, steps=40):
    """Frames, and what else is told, of a drive that got these commands at its begin."""
    frames, others = [], {}

    def tell(kind, value):
        if kind == "frame":
            frames.append(value)
        else:
            others[kind] = value

    drive = DrivenRobot(robot, folder, tell, queue.Queue())
    drive._introduce()
    for command in commands:
        drive._take(command)
    for _ in range(steps):
        drive._step()
    return drive, frames, others


@pytest.mark.parametrize("name", omnidyn.preset_names())
def test_every_preset_can_be_driven(tmp_path, name):
    robot = omnidyn.load_robot(name)
    if robot.drive.kind == "duty" and robot.drive.supply is None:
        pytest.skip("needs a supply")
    _, frames, others = drive(robot, tmp_path, {"axes": [1, 0, 0], "level": 1e9})  # clipped to what there is
    assert frames[-1][4] > 0.1  # forward [m/s]
    assert abs(frames[-1][5]) < 1e-6
    assert others["robot"]["limit"] > 0.0
    assert "trouble" not in others


def test_the_robot_rests_inside_its_dead_zone_and_goes_on_under_other_numbers(tmp_path):
    robot = omnidyn.load_robot("axebot")
    volts = float(breakaway_voltage(robot, axis_patterns(robot))[0])
    _, inside, _ = drive(robot, tmp_path, {"axes": [1, 0, 0], "level": 0.999 * volts})
    assert all(value == 0.0 for value in inside[-1][4:7])
    driven, outside, _ = drive(robot, tmp_path, {"axes": [1, 0, 0], "level": 1.01 * volts})
    assert outside[-1][4] > 0.0
    driven._take({"set": {"friction.axes.coulomb[0]": 3.3}})
    assert driven.live.twist[0] == outside[-1][4]
    assert driven.robot.friction.axes.coulomb[0] == 3.3


def test_floor_load_and_battery_change_under_a_robot_that_drives(tmp_path):
    robot = omnidyn.load_robot("axebot")
    full = {"axes": [1, 0, 0], "level": 6.0}
    driven, (*_, free), before = drive(robot, tmp_path, full, steps=1)
    _, (*_, loaded), told = drive(robot, tmp_path, full, {"vary": {"payload": 1.5}}, steps=1)
    assert loaded[4] == pytest.approx(0.5 * free[4], rel=0.06)  # twice the mass of 1.5 kg, half the acceleration
    assert [n["value"] for n in told["numbers"]["numbers"] if n["key"].startswith("body")] == [3.0, 0.025]
    driven._take({"vary": {"floor": 2.0}})
    assert driven.live.twist[0] == free[4]
    assert driven.robot.friction.axes.coulomb == (4.4, 3.0, 0.198)
    assert driven._numbers()["breakaway"] == pytest.approx([2.0 * volts for volts in before["robot"]["breakaway"]])
    driven._take({"vary": {"floor": ""}})
    assert driven.robot == robot
    volts = before["robot"]["breakaway"][0]
    _, low, _ = drive(robot, tmp_path, full, {"vary": {"battery": 0.99 * volts}})
    assert low[-1][4] == 0.0
    assert low[-1][11:14] == pytest.approx([0.0, 0.99 * volts, -0.99 * volts])  # no wheel gets more


def test_floors_and_loads_of_the_robot_file_go_by_name(tmp_path):
    robot = omnidyn.load_robot("axebot")
    direction = DirectionFriction(coulomb=(3.0, 3.0), yaw_coulomb=0.1)
    variations = Variations(
        floor={"carpet": Surface(friction=Friction(direction=direction))}, tilt={"ramp": Floor(tilt=30.0)}
    )
    robot = robot.replace(variations=variations)
    driven, _, told = drive(robot, tmp_path, {"vary": {"floor": "carpet"}})
    assert told["robot"]["names"] == {"floor": ("carpet",), "tilt": ("ramp",)}
    assert next(n["key"] for n in told["numbers"]["numbers"]) == "friction.direction.coulomb[0]"
    assert driven.robot.friction.direction == direction
    driven._take({"vary": {"tilt": "ramp"}})
    assert driven._numbers()["breakaway"] == [None] * 3
    driven._step()
    braked = (19.0 * 0.0059 / 0.035) ** 2 / 1.69 * 1.5 / 1.5 / 60  # (l K_t / r)^2 / R of 1.5 wheels, over M, one step
    speed = (9.81 * 0.5 - 3.0 / 1.5) / 60 * (1.0 - np.exp(-braked)) / braked  # g sin 30 - 3.0 N / 1.5 kg
    assert driven.live.twist[0] == pytest.approx(speed, rel=1e-4)


def test_friction_holds_at_rest_and_resists_in_motion(tmp_path):
    robot = omnidyn.load_robot("axebot")
    _, held, _ = drive(robot, tmp_path, {"axes": [1, 0, 0], "level": 0.5})
    _, moving, _ = drive(robot, tmp_path, {"axes": [1, 0, 0], "level": 5.0})
    push = 2 * 0.5 * np.sin(np.pi / 3) * 19.0 * 0.0059 / (1.69 * 0.035)  # two wheels, eqs (4), (10), (11) at rest
    assert held[-1][8:11] == pytest.approx([-push, 0.0, 0.0], abs=1e-12)
    assert moving[-1][8] == pytest.approx(-(2.2 + 0.94 * moving[-1][4]), rel=1e-9)  # Table 3


def test_a_duty_is_recorded_with_its_battery(tmp_path):
    robot = omnidyn.load_robot("axebot")
    robot = robot.replace(drive=robot.drive.replace(kind="duty", supply=6.0))
    driven, _, _ = drive(robot, tmp_path, {"record": True}, {"axes": [1, 0, 0], "level": 0.5}, steps=30)
    driven._take({"vary": {"battery": 3.0}})
    for _ in range(30):
        driven._step()
    driven._take({"record": False})
    log = omnidyn.read_log(tmp_path / "drive-1.csv")
    np.testing.assert_array_equal(log.supply, [6.0] * 30 + [3.0] * 30)
    np.testing.assert_allclose(log.duty[-1], [0.0, 0.5, -0.5])


def test_strange_commands_are_told_and_nothing_else_happens(tmp_path):
    robot = omnidyn.load_robot("axebot")
    strange = (
        {"axes": "x", "level": 1},
        {"set": {"__class__": 1}},
        {"offset": [1]},
        {"set": {"body.mass_kg": -1}},
        {"vary": {"floor": "carpet"}},
        {"vary": {"payload": -1}},
        {"vary": {"body": 1}},
        {"vary": [1]},
        {"set": [1]},
        {"axes": [float("nan"), 0, 0], "level": 1},
        {"axes": [1, 0, 0], "level": float("inf"), "offset": [0, 0, 0]},
    )
    for command in strange:
        driven, frames, others = drive(robot, tmp_path, command, steps=2)
        assert "trouble" in others, command
        assert driven.robot == robot
        assert all(value == 0.0 for value in frames[-1][4:7])


def test_a_worker_tells_errors_in_words_and_can_be_cancelled(tmp_path):
    async def work():
        worker, heard = Worker(), []
        absent = {"path": str(tmp_path / "none.csv"), "folder": str(tmp_path / "series")}
        with pytest.raises(JobError, match=r"none\.csv"):
            await worker.run("check", absent, lambda *_: None)
        request = {"robot": "axebot", "folder": str(tmp_path)}
        job = asyncio.ensure_future(worker.run("drive", request, lambda kind, value: heard.append(kind)))
        while heard.count("frame") < 20:
            await asyncio.sleep(0.02)
        await worker.cancel()
        with pytest.raises(CancelledError):
            await job
        path = str(tmp_path / "again.csv")
        assert await worker.run("example", {"path": path}, lambda *_: None) == {}  # the same process goes on
        await worker.stop()

    asyncio.run(asyncio.wait_for(work(), 600))
    assert len(omnidyn.read_log(tmp_path / "again.csv")) == 4001


def test_stop_is_heard_whenever_it_is_pressed():
    from omnidyn.studio.drive.state import Driving
    from omnidyn.studio.session import Session

    async def work():
        session = Session()
        session.robot, driving, worker = "axebot", Driving(session), session.workers["drive"]
        moments = (  # before its process is there, before it can hear, at its first word
            lambda: driving.running,
            lambda: worker.busy,
            lambda: driving.running and driving.robot is not None,
        )
        try:
            for moment in moments:
                task = asyncio.ensure_future(driving.run())
                while not moment():
                    await asyncio.sleep(0)
                driving.send({"stop": True})
                await asyncio.wait_for(task, 120)
                assert not driving.running
                assert driving.trouble == ""
        finally:
            await session.close()

    asyncio.run(asyncio.wait_for(work(), 600))


def test_a_command_that_comes_with_its_job_is_its_own_and_one_before_it_is_not(tmp_path):
    request = {"robot": "axebot", "folder": str(tmp_path)}
    job, stop = {"job": "drive", "request": request}, {"command": {"stop": True}}
    lines = "".join(json.dumps(message) + "\n" for message in ({"command": {"record": 1, "x": 0}}, job, stop))
    words = [sys.executable, "-m", "omnidyn.studio.jobs"]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        late = threading.Timer(200, process.kill)
        late.start()
        try:
            process.stdin.write(lines.encode())
            process.stdin.flush()
            kinds = []
            while "result" not in kinds and (line := process.stdout.readline()):
                kinds += json.loads(line)
        finally:
            late.cancel()
            process.kill()
    assert kinds[-1] == "result"
    assert "recorded" not in kinds


def test_a_page_that_says_nothing_gets_few_frames_and_the_newest_when_it_is_back():
    import uvicorn
    import websockets

    from omnidyn.studio.layout import Studio
    from omnidyn.studio.server import UNDER_WAY, application

    async def work():
        studio, listener = Studio(), socket.create_server(("127.0.0.1", 0))
        server = uvicorn.Server(uvicorn.Config(application(studio, []), log_level="warning"))
        serving = asyncio.ensure_future(server.serve(sockets=[listener]))
        while not server.started:
            await asyncio.sleep(0.01)

        async def send(*numbers):
            for number in numbers:
                studio.driving.frame = [float(number)]
                for fresh in studio.driving.fresh:
                    fresh.set()
                await asyncio.sleep(0.001)

        async with websockets.connect(f"ws://127.0.0.1:{listener.getsockname()[1]}/drive", max_queue=None) as page:
            await send(*range(1000))
            got = [float(np.frombuffer(await page.recv(), "<f4", offset=4)[0]) for _ in range(UNDER_WAY)]
            assert got == [float(k) for k in range(UNDER_WAY)]
            await page.send(f'{{"seen": {UNDER_WAY}}}')
            await asyncio.sleep(0.1)
            await send(1000)
            assert np.frombuffer(await asyncio.wait_for(page.recv(), 120), "<f4", offset=4)[0] == 1000.0
        server.should_exit = True
        await serving
        listener.close()

    asyncio.run(asyncio.wait_for(work(), 600))
