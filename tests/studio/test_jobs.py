"""The process that does jobs: what it answers."""

import queue

import pytest

pytest.importorskip("nicegui", reason="the extra studio is not installed")

from omnidyn.errors import InputError
from omnidyn.studio import jobs


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
