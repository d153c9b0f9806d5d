"""A drive without a page, and a worker without a server."""

import asyncio
import queue

import pytest

import omnidyn
from omnidyn.studio.drive.job import Drive
from omnidyn.studio.worker import CancelledError, JobError, Worker


def drive(robot, folder, *commands, steps=40):
    """Frames, and what else is told, of a drive that got these commands at its begin."""
    frames, others = [], {}

    def tell(kind, value):
        if kind == "frame":
            frames.append(value)
        else:
            others[kind] = value

    drive = Drive(robot, folder, tell, queue.Queue())
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
    volts = float(omnidyn.breakaway_voltage(robot, omnidyn.axis_patterns(robot))[0])
    _, inside, _ = drive(robot, tmp_path, {"axes": [1, 0, 0], "level": 0.999 * volts})
    assert all(value == 0.0 for value in inside[-1][4:7])
    driven, outside, _ = drive(robot, tmp_path, {"axes": [1, 0, 0], "level": 1.01 * volts})
    assert outside[-1][4] > 0.0
    driven._take({"set": {"friction.axes.coulomb[0]": 3.3}})
    assert driven.live.twist[0] == outside[-1][4]
    assert driven.robot.friction.axes.coulomb[0] == 3.3


def test_strange_commands_are_told_and_nothing_else_happens(tmp_path):
    robot = omnidyn.load_robot("axebot")
    strange = ({"axes": "x", "level": 1}, {"set": {"__class__": 1}}, {"offset": [1]}, {"set": {"body.mass_kg": -1}})
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

    asyncio.run(asyncio.wait_for(work(), 120))
    assert len(omnidyn.read_log(tmp_path / "again.csv")) == 4001
