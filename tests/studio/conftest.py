"""A studio that runs as a process of its own, and a browser that looks at it.

Needs Chromium (CHROMIUM names it where it is not on the path) and playwright, which no lock has: OMNIDYN_PLAYWRIGHT may
name a folder that holds it. `.ci/run` sees to both; without them tests that need a browser are skipped.
"""

import contextlib
import os
import shutil
import subprocess
import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import pytest

if folder := os.environ.get("OMNIDYN_PLAYWRIGHT"):
    sys.path.append(folder)

PATIENCE = 200  # [s] that a server has to begin, and to end
# As `python -m omnidyn`, but for the kernels that a studio compiles while nobody waits: each server of the tests would
# begin that anew, and be ended before it is done.
WITHOUT_WARMING = """
import asyncio, sys
from omnidyn.cli import main
from omnidyn.studio.session import Session
Session.warm = lambda self: asyncio.sleep(0)
sys.exit(main())
"""


@dataclass(frozen=True)
class Studio:
    """A server: its process, its address, its port."""

    process: subprocess.Popen
    address: str
    port: int


@contextlib.contextmanager
def running(*arguments: str) -> Iterator[Studio]:
    """A studio on a free port."""
    words = [sys.executable, "-c", WITHOUT_WARMING, "studio", "--no-browser", "--port", "0", *arguments]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        late = threading.Timer(PATIENCE, process.kill)  # it never says its address
        late.start()
        try:
            assert process.stdout is not None
            said = process.stdout.readline()
            late.cancel()
            assert said, "the server ended before it said its address"
            address = said.split()[-1]
            yield Studio(process, address, int(address.split("://")[1].split("/")[0].rpartition(":")[2]))
        finally:
            late.cancel()
            process.terminate()
            try:
                process.wait(PATIENCE)
            finally:
                process.kill()  # else the end of `with` waits for it for ever


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


@dataclass
class Browser:
    """A browser, the studios it looks at, and what its pages complained about or asked others for."""

    chromium: Any
    studios: contextlib.ExitStack
    complaints: list[str] = field(default_factory=list)

    def start(self, *files, width=1400, **options):
        """A studio with these files, and a page of it."""
        studio = self.studios.enter_context(running(*map(str, files)))
        return studio, self.open(studio, width, **options)

    def open(self, studio, width=1400, **options):
        """A page of a studio."""
        page = self.chromium.new_page(viewport={"width": width, "height": 900}, **options)
        page.on("console", lambda m: self.complaints.append(m.text) if m.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("request", lambda request: self._note(request.url, studio.port))
        page.set_default_timeout(float(os.environ.get("OMNIDYN_PATIENCE_MS", 120_000)))
        page.goto(studio.address)
        page.wait_for_selector("#example")
        return page

    def _note(self, url, port):
        if not url.startswith((f"http://127.0.0.1:{port}/", f"ws://127.0.0.1:{port}/", "data:", "blob:")):
            self.complaints.append(f"asks {url}")


@contextlib.contextmanager
def launched():
    """Chromium, without a window. Raises ImportError, or FileNotFoundError, where it is not there."""
    from playwright import sync_api

    names = ("chromium", "chromium-browser", "google-chrome")
    path = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, names)), None)
    if path is None:
        raise FileNotFoundError("Chromium is not installed")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def chromium():
    """Chromium, without a window."""
    pytest.importorskip("nicegui", reason="the extra studio is not installed")
    pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    try:
        with launched() as browser:
            yield browser
    except FileNotFoundError as error:
        pytest.skip(str(error))


@pytest.fixture
def browser(chromium) -> Iterator[Browser]:
    """A browser none of whose pages may complain, or ask anybody else."""
    with contextlib.ExitStack() as studios:
        browser = Browser(chromium, studios)
        yield browser
        for context in chromium.contexts:
            context.close()
        assert not browser.complaints
