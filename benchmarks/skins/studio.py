"""The studio: a drive of minutes in Chromium, a client that does not read, a hundred pages, an installation.

Needs Chromium and playwright, as tests/studio do (OMNIDYN_PLAYWRIGHT), and the network for the installation.
OMNIDYN_BENCH_SECONDS=60 shortens the drive of ten minutes.
"""

from __future__ import annotations

import asyncio
import html
import os
import re
import subprocess
import sys
import tempfile
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import psutil
import socketio

from benchmarks.table import Table, machine
from omnidyn.studio.server import RECONNECT
from tests.studio.conftest import Studio, launched, running
from tests.support.raw_sockets import frames_of, open_web_socket, text_frame

SECONDS = float(os.environ.get("OMNIDYN_BENCH_SECONDS", "600"))
RATE, LEAST_RATE = 60.0, 59.0  # frames a second
MOST_MB, SILENT, PAGES = 5.0, 30.0, 50
AGE = 0.5  # [s] of the newest frame that a slow client gets when it reads again
FORGOTTEN = RECONNECT + 3.0  # [s] after which a page that is gone is forgotten
COLUMNS = ["what", "result", "unit"]
ROOT = Path(__file__).resolve().parents[2]


def measure() -> Table:
    """The table."""
    table = Table(f"studio: a drive of {SECONDS:g} s, slow clients, many pages, an installation", COLUMNS)
    table.notes.append(machine())
    with running() as studio, _driven(studio) as page:
        _drive(table, studio, page)
        _slow_client(table, studio, page)
    with running() as studio:
        time.sleep(5.0)
        asyncio.run(_many_pages(table, studio))
    _installed(table)
    table.notes.append("MB of the server: resident, of its process alone; a change is the last number less the first")
    table.notes.append("the worker of the drive is a process of its own and is not in the MB of the server")
    return table


def _memory(studio: Studio) -> float:
    """MB of the server."""
    return psutil.Process(studio.process.pid).memory_info().rss / 2**20


@contextmanager
def _driven(studio: Studio) -> Iterator[Any]:
    """A page of Chromium in which a robot drives forward and back."""
    with launched() as browser:
        page = browser.new_page(viewport={"width": 1400, "height": 900})
        page.goto(studio.address)
        page.get_by_role("tab", name="Drive").click()
        page.click("#drive")
        page.wait_for_function("document.querySelector('omni-drive')?.painted > 60", timeout=120_000)
        yield page


def _drive(table: Table, studio: Studio, page: Any) -> None:
    """Frames a second that the page paints, and what the server takes."""
    counts, memory, begun = [_counts(page)], [_memory(studio)], time.monotonic()
    for k in range(max(1, round(SECONDS / 10.0))):
        page.keyboard.up("ws"[k % 2 - 1])
        page.keyboard.down("ws"[k % 2])
        page.wait_for_timeout(1000.0 * (begun + 10.0 * (k + 1) - time.monotonic()))
        counts.append(_counts(page))
        memory.append(_memory(studio))
    page.keyboard.up("w")
    page.keyboard.up("s")
    at, received, painted = np.array(counts).T
    for name, count in (("received", received), ("painted", painted)):
        rates = np.diff(count) / np.diff(at)
        rate = float((count[-1] - count[0]) / (at[-1] - at[0]))
        table.add(f"{LEAST_RATE:g}", rate >= LEAST_RATE, what=f"frames {name}", result=rate, unit="1/s")
        table.add(what=f"frames {name}, the worst 10 s", result=float(rates.min()), unit="1/s")
    change = memory[-1] - memory[0]
    table.add(f"{MOST_MB:g}", abs(change) <= MOST_MB, what="memory of the server, change", result=change, unit="MB")
    table.add(what="memory of the server", result=memory[-1], unit="MB")


def _counts(page: Any) -> tuple[float, float, float]:
    """Seconds, frames received and painted."""
    return page.evaluate(
        "(d => [performance.now() / 1000, d.received, d.painted])(document.querySelector('omni-drive'))"
    )


def _slow_client(table: Table, studio: Studio, page: Any) -> None:
    """A client that does not read for half a minute, then does."""
    client, times = open_web_socket(studio.port, "/drive"), []
    with client:
        before, begun = _memory(studio), time.monotonic()
        page.wait_for_timeout(1000.0 * SILENT)
        change, text = _memory(studio) - before, b""
        sent = (time.monotonic() - begun) * RATE
        for _ in range(20):  # what had piled up, then what is new, and each time it says what it has
            newest = page.evaluate("document.querySelector('omni-drive').newest[0]")
            frames, text = frames_of(text + client.recv(2**20))
            times += [float(np.frombuffer(frame, "<f4", 1, 4)[0]) for frame in frames if len(frame) > 8]
            client.sendall(text_frame(b'{"seen": %d}' % len(times)))
            page.wait_for_timeout(50)
    name = f"client silent for {SILENT:g} s"
    table.add(f"{MOST_MB:g}", change <= MOST_MB, what=f"{name}: memory of the server", result=change, unit="MB")
    table.add(what=f"{name}: frames it missed", result=int(sent - len(times)), unit=f"of {sent:.0f}")
    age = newest - times[-1]
    table.add(f"{AGE:g}", age <= AGE, what=f"{name}: age of its newest frame", result=age, unit="s")


async def _many_pages(table: Table, studio: Studio) -> None:
    """Pages that open and close, as a browser does it, after as many that warm up."""
    memory = []
    async with httpx.AsyncClient(base_url=f"http://127.0.0.1:{studio.port}") as client:
        for _ in range(2):
            for _ in range(PAGES):
                await _one_page(client, studio.port)
            await asyncio.sleep(FORGOTTEN)
            memory.append(_memory(studio))
    change = memory[1] - memory[0]
    what = f"{PAGES} pages after {PAGES}: memory of the server, change"
    table.add(f"{MOST_MB:g}", change <= MOST_MB, what=what, result=change, unit="MB")


async def _one_page(client: httpx.AsyncClient, port: int) -> None:
    """Load a page, connect its socket, close it."""
    text = html.unescape((await client.get("/")).text)
    found = {name: re.search(rf"{name}['\"]?:\s*['\"]?([0-9a-f-]+)", text) for name in ("client_id", "next_message_id")}
    query = "&".join(f"{name}={match[1]}" for name, match in found.items() if match)
    query += f"&implicit_handshake=true&document_id={uuid.uuid4()}&tab_id={uuid.uuid4()}&old_tab_id="
    page, address = socketio.AsyncClient(), f"http://127.0.0.1:{port}"
    headers, path = {"Origin": address}, "/_nicegui_ws/socket.io"
    await page.connect(f"{address}?{query}", headers=headers, transports=["websocket"], socketio_path=path)
    await asyncio.sleep(0.05)
    await page.disconnect()


def _installed(table: Table) -> None:
    """`pip install omnidyn[studio]` of our wheel into a bare environment, and a studio that serves from it."""
    with tempfile.TemporaryDirectory() as folder:
        place, bare = Path(folder), {"PATH": "/usr/bin:/bin", "HOME": folder, "LANG": "C.UTF-8"}
        build = ("-m", "pip", "wheel", "-q", "--no-deps", "-w", folder, str(ROOT))
        subprocess.run([sys.executable, "-m", "venv", place / "env"], check=True)
        python = place / "env" / "bin" / "python"
        subprocess.run([python, *build], check=True, env=bare)
        wheel = next(place.glob("omnidyn-*.whl"))
        begun = time.monotonic()
        subprocess.run([python, "-m", "pip", "install", "-q", f"{wheel}[studio]"], check=True, env=bare)
        table.add(what="pip install omnidyn[studio]", result=time.monotonic() - begun, unit="s")
        size = sum(file.stat().st_size for file in (place / "env" / "lib").rglob("*") if file.is_file())
        table.add(what="its environment", result=size / 2**20, unit="MB")
        table.add(what="its wheel", result=wheel.stat().st_size / 2**20, unit="MB")
        begun = time.monotonic()
        words = (python, "-m", "omnidyn", "studio", "--no-browser", "--port", "0")
        with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env=bare, cwd=folder) as process:
            assert process.stdout is not None
            address = process.stdout.readline().split()[-1]
            texts = [httpx.get(f"{address}{name}").text for name in ("", "static/studio.js", "static/studio.css")]
            seconds = time.monotonic() - begun
            process.terminate()
        served = "omnidyn studio" in texts[0] and "drive.js" in texts[1] and "omni-drive" in texts[2]
        table.add("served", served, what="its first page, from the start", result=seconds, unit="s")
