"""A studio that runs as a process of its own."""

import contextlib
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass

import pytest


@dataclass(frozen=True)
class Studio:
    """A server: its process, its address, its port."""

    process: subprocess.Popen
    address: str
    port: int


@contextlib.contextmanager
def running(*arguments: str) -> Iterator[Studio]:
    """A studio on a free port."""
    words = [sys.executable, "-m", "omnidyn", "studio", "--no-browser", "--port", "0", *arguments]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            address = process.stdout.readline().split()[-1]
            yield Studio(process, address, int(address.split("://")[1].split("/")[0].rpartition(":")[2]))
        finally:
            process.terminate()
            process.wait(20)


@pytest.fixture(scope="module")
def studio() -> Iterator[Studio]:
    """A studio without files."""
    pytest.importorskip("nicegui", reason="the extra studio is not installed")
    with running() as server:
        yield server


@pytest.fixture
def start():
    """Starts a studio with arguments."""
    pytest.importorskip("nicegui", reason="the extra studio is not installed")
    return running
