"""The process that benchmarks ask for one log at a time: slow, failing and dying ones are three different things."""

import os
import time

import pytest

from benchmarks.wrong_worlds import worker as module
from benchmarks.wrong_worlds.worker import Worker, Workers


def test_what_comes_back_and_what_does_not(monkeypatch):
    with Worker() as worker:
        assert worker.ask(max, 3, 5) == 5
        with pytest.raises(ZeroDivisionError):
            worker.ask(divmod, 1, 0)
        with pytest.raises(RuntimeError, match="died, exit code 7"):
            worker.ask(os._exit, 7)
        monkeypatch.setattr(module, "LONGEST", 1.0)
        assert worker.ask(_busy, 60.0) is None
        assert worker.ask(_asleep, 2.0) == "rested"  # while it waits it takes no time of the processor
        monkeypatch.setattr(module, "LONGEST", 60.0)
        assert worker.ask(max, 3, 5) == 5


def test_each_comes_back_in_its_place(monkeypatch):
    with Workers() as workers:
        workers.ask_each(abs, ((k,) for k in range(8)))  # to start a process takes a while on a busy machine
        monkeypatch.setattr(module, "LONGEST", 1.5)
        assert workers.ask_each(_slow_or_own, ((k,) for k in range(5))) == [0, 1, None, 3, 4]


def _slow_or_own(number: int) -> int:
    if number == 2:
        _busy(60.0)
    time.sleep(0.05 * (5 - number))
    return number


def _asleep(seconds: float) -> str:
    time.sleep(seconds)
    return "rested"


def _busy(seconds: float) -> str:
    end = time.process_time() + seconds
    while time.process_time() < end:
        pass
    return "done"
