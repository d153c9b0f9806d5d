"""A process that ends is said, and the next job runs: asked of the server's side, without pages."""

import asyncio
import os
import signal

import pytest

pytest.importorskip("nicegui", reason="the extra studio is not installed")

from omnidyn.studio.fit.state import Fitting
from omnidyn.studio.session import Session
from omnidyn.studio.worker import CancelledError, EndedError, Worker
from tests.support.pages import write_log

PATIENCE = 120  # [s]


def kill(worker, by=signal.SIGKILL):
    """End the process of a worker, as a system without memory does, or stop it."""
    if worker._process.returncode is None:  # else its number may be that of another process by now
        os.kill(worker._process.pid, by)


def works(worker):
    """Whether a process is there that does a job: one that ended is not."""
    return worker.busy and worker._process is not None and worker._process.returncode is None


async def finished(condition):
    """Wait until something is so."""
    async with asyncio.timeout(PATIENCE):
        while not condition():
            await asyncio.sleep(0.005)


def run(scenario):
    """Do a scenario, which ends."""
    return asyncio.run(asyncio.wait_for(scenario(), 4 * PATIENCE))


def test_a_process_that_ends_is_an_error_and_the_next_job_gets_another(tmp_path):
    async def scenario():
        worker, path = Worker(), str(write_log(tmp_path / "log.csv", 2.0))
        request = {"path": path, "robot": "", "map": "", "unsigned": False, "folder": str(tmp_path / "series")}
        with pytest.raises(EndedError, match=r"ended before its result; got signal SIGKILL; run it again"):
            await worker.run("check", request, lambda kind, value: kill(worker))
        answer = await worker.run("check", request, lambda kind, value: None)
        assert answer["rows"] == 201
        kill(worker)  # while it waits: nothing is lost
        assert (await worker.run("free_keys", {"robot": "axebot"}, lambda kind, value: None))["default"]
        await worker.stop()

    run(scenario)


def test_a_short_job_is_done_once_more_where_its_process_ends(monkeypatch):
    answers = iter((EndedError(-signal.SIGKILL), {"default": []}))

    async def run(self, job, request, listen):
        answer = next(answers)
        if isinstance(answer, EndedError):
            raise answer
        return answer

    monkeypatch.setattr(Worker, "run", run)
    assert asyncio.run(Worker().ask("free_keys", {"robot": "axebot"})) == {"default": []}


def test_what_is_cut_short_by_the_end_of_a_process_is_no_message():
    async def scenario():
        worker = Worker()
        process = await asyncio.create_subprocess_exec(
            "sh", "-c", "printf '{\"result\": [1, 2'; exit 3", stdin=-1, stdout=asyncio.subprocess.PIPE
        )
        with pytest.raises(EndedError, match="got exit code 3"):
            await worker._result(process, "check", {}, lambda kind, value: None)

    run(scenario)


def test_a_check_and_a_fit_that_were_ended_are_said_and_run_again(tmp_path, monkeypatch):
    monkeypatch.setattr("omnidyn.studio.worker.GRACE", 0.2)

    async def scenario():
        session = Session()
        fitting, log = Fitting(session), session.add_log(str(write_log(tmp_path / "log.csv", 150.0)), "log.csv")
        session.robot = "axebot"
        await finished(lambda: works(session.workers["log"]))
        kill(session.workers["log"])
        await finished(lambda: log.ended)
        assert "run it again" in log.error
        assert not log.progress
        assert fitting.why_not()[0] == "unread"
        await session.check(log)
        assert fitting.why_not() == ("", "")
        fit = asyncio.create_task(fitting.run())
        await finished(lambda: works(session.workers["fit"]))
        kill(session.workers["fit"])
        await fit
        assert fitting.last.stopped
        assert "run it again" in fitting.last.error
        fit = asyncio.create_task(fitting.run())
        await finished(lambda: works(session.workers["fit"]))
        kill(session.workers["fit"], signal.SIGSTOP)  # else it may be done before it hears that
        await fitting.last.cancel(session, "fit", "fit")
        await fit
        assert fitting.last.stopped
        await fitting.run()
        assert fitting.last.result is not None
        assert not fitting.last.stopped
        await session.close()

    run(scenario)


def test_a_job_that_is_killed_after_it_was_cancelled_was_cancelled(monkeypatch):
    monkeypatch.setattr("omnidyn.studio.worker.GRACE", 0.2)

    async def scenario():
        worker = Worker()
        job = asyncio.create_task(worker.run("drive", {"robot": "axebot", "folder": "/nonexistent"}, lambda *_: None))
        await finished(lambda: works(worker))
        kill(worker, signal.SIGSTOP)  # it hears nothing
        await worker.cancel()
        with pytest.raises(CancelledError):
            await job

    run(scenario)
