"""The process that does jobs: what it answers."""

import asyncio
import queue

import pytest

pytest.importorskip("nicegui", reason="the extra studio is not installed")

from omnidyn.errors import InputError
from omnidyn.studio import jobs
from omnidyn.studio.session import Session


@pytest.mark.parametrize(
    "raised, words",
    [
        (KeyboardInterrupt(), None),
        (SystemError("kernel"), None),  # an interrupt that arrived in compiled code
        (InputError("no such file", where="log.csv"), "log.csv"),
        (ZeroDivisionError("no"), "bug: ZeroDivisionError"),
    ],
)
def test_a_job_that_ends_without_a_result_says_why_or_that_it_was_cancelled(monkeypatch, raised, words):
    def job(request, tell, commands):
        raise raised from KeyboardInterrupt()

    monkeypatch.setitem(jobs.JOBS, "job", job)
    kind, answer = jobs._answer({"job": "job", "request": {}}, lambda kind, value: None, queue.Queue())
    assert kind == "error"
    assert answer is None if words is None else words in answer


@pytest.mark.parametrize("is_warm", [True, False])
def test_a_studio_compiles_the_rest_only_where_it_is_not_on_disk(monkeypatch, is_warm):
    """While nobody waits: what the first fit needs, and all others beside it."""

    async def scenario():
        session, asked = Session(), []

        async def run(job, request, listen):
            asked.append((job, request["all"]))
            return {"is_warm": is_warm}

        for worker in session.workers.values():
            monkeypatch.setattr(worker, "run", run)
            for name in ("start", "stop"):
                monkeypatch.setattr(worker, name, lambda: asyncio.sleep(0))
        await session.warm()
        await session.close()
        return asked

    assert asyncio.run(scenario()) == [("warm", False)] + [("warm", True)] * (not is_warm)
