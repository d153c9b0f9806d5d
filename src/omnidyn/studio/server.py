"""Server: routes of the studio behind the guard: pages, pictures, uploads, what was written."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import re
import secrets
import socket
import struct
import sys
import threading
import webbrowser
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import numpy as np
import uvicorn
from fastapi import FastAPI, Request, Response, WebSocket, WebSocketDisconnect
from fastapi.responses import FileResponse, JSONResponse, PlainTextResponse
from fastapi.staticfiles import StaticFiles
from nicegui import ui
from starlette.background import BackgroundTask

from omnidyn.errors import InputError
from omnidyn.studio import script, workspace
from omnidyn.studio.drive.state import Driving
from omnidyn.studio.guard import Guard
from omnidyn.studio.layout import Studio, show
from omnidyn.studio.planned.state import Planned
from omnidyn.studio.session import RefusedError

LOCAL = "127.0.0.1"
STATIC = Path(__file__).with_name("static")
TRACK_FILE, DRIFT_FILE = re.compile(r"run-\d{1,3}\.csv|drawn\.csv|motion\.json"), re.compile(r"drift\.svg")
ROBOT_FILE = re.compile(r"[^/\\]+\.toml", re.IGNORECASE)
TRIES = 20  # ports from the one asked for
FIT_FILES = {"robot.toml": "text/plain", "numbers.csv": "text/csv", "report.html": "text/html"}
NO_SCRIPT = "default-src 'none'; style-src 'unsafe-inline'; img-src data: 'self'; frame-ancestors 'none'"
RECONNECT = 30.0  # [s] that a page without a connection keeps what it shows; after that it is loaded anew
UNDER_WAY = 30  # frames of a drive that a page has not had yet: half a second
MESSAGE_BYTES = 65_536  # of what a page sends over a socket
CLOSED = (WebSocketDisconnect, RuntimeError)  # how a socket says that its page is gone
NONSENSE = (ValueError, KeyError, TypeError, AttributeError)  # what a page says that is none of ours: its socket closes


def serve(files: list[str], host: str, port: int, browse: bool) -> int:
    """Serve until interrupted. host: "" for this machine alone; another one needs the token that is printed."""
    for file in files:
        if not Path(file).exists():
            raise InputError("no such file", expected="a log or a robot file", where=file)
        if file.lower().endswith(workspace.SUFFIX):
            workspace.read(file)  # refused here, where somebody reads it
    token = secrets.token_urlsafe(24) if host else ""
    listener = _listener(host or LOCAL, port)
    shown_host = LOCAL if host in ("", "0.0.0.0", "::") else host
    address = f"http://{shown_host}:{listener.getsockname()[1]}/{f'?token={token}' if token else ''}"
    app = application(Studio(), files)
    config = uvicorn.Config(
        Guard(app, token),
        log_level="warning",
        ws_max_size=MESSAGE_BYTES,
        ws_per_message_deflate=False,  # frames are small, and each page would keep a third of a megabyte for it
        timeout_graceful_shutdown=1,
        server_header=False,
    )
    print(f"omnidyn studio: {address}", flush=True)
    if browse:
        threading.Timer(1.0, webbrowser.open, (address,)).start()
    with contextlib.suppress(KeyboardInterrupt):
        uvicorn.Server(config).run(sockets=[listener])
    return 0


def _listener(host: str, port: int) -> socket.socket:
    """A socket on the first free port from the one asked for; on any with port 0. Raises InputError."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    reason = ""
    for candidate in range(port, port + TRIES) if port else (0,):
        listener = socket.socket(family, socket.SOCK_STREAM)
        if sys.platform != "win32":
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((host, candidate))
            listener.listen()
        except OSError as error:
            listener.close()
            reason = str(error)
            continue
        listener.set_inheritable(False)
        return listener
    raise InputError("no port is free", got=reason, expected="an address of this machine", where=f"{host}:{port}")


def application(studio: Studio, files: list[str]) -> FastAPI:
    """The application without its guard."""
    session = studio.session

    @contextlib.asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        session.open(files)
        session.start(session.warm())
        gc.collect()
        gc.freeze()  # what is loaded stays: to look for what is left of a page takes milliseconds then
        try:
            yield
        finally:
            gc.unfreeze()
            await session.close()

    app = FastAPI(lifespan=lifespan, docs_url=None, redoc_url=None, openapi_url=None)
    app.mount("/static", StaticFiles(directory=STATIC))
    _add_files(app, studio)
    _add_sockets(app, studio)
    _add_key(app, studio.planned)

    @ui.page("/", title="omnidyn studio")
    def page(tab: str = "") -> None:
        show(studio, tab)

    ui.run_with(app, title="omnidyn studio", dark=None, show_welcome_message=False, reconnect_timeout=RECONNECT)
    return app


def _add_files(app: FastAPI, studio: Studio) -> None:
    """Uploads, and what can be downloaded."""
    session = studio.session

    @app.post("/upload")
    async def upload(request: Request, name: str, kind: str = "") -> Response:
        try:
            return JSONResponse({"name": await session.upload(name, request.stream(), kind)})
        except RefusedError as error:
            return JSONResponse({"error": str(error)}, 413)
        except InputError as error:
            return JSONResponse({"error": session.shown(str(error))}, 400)

    @app.get("/workspace")
    async def save_workspace() -> Response:
        try:
            path = await studio.save()
        except InputError as error:
            return PlainTextResponse(session.shown(str(error)), 400)
        return FileResponse(path, filename=path.name, background=BackgroundTask(path.unlink))

    @app.get("/script")
    async def save_script() -> Response:
        comparing = studio.comparing
        others = {"compare": comparing.last, "drift": comparing.last_drift, "track": studio.tracks.last}
        named = {"content-disposition": f'attachment; filename="{script.FILE_NAME}"'}
        return PlainTextResponse(script.script(studio.fitting, others), headers=named)

    @app.get("/series/{key}")
    async def series(key: str) -> Response:
        shown = session.series.get(key)
        return Response(status_code=204) if shown is None else JSONResponse(shown.meta)  # a page that is late

    @app.get("/fit/{name}")
    async def fit_file(name: str) -> Response:
        folder = studio.fitting.last.folder
        if name not in FIT_FILES or folder is None or not (folder / name).exists():
            return Response(status_code=404)
        headers = {"content-security-policy": NO_SCRIPT}
        shown_here = name.endswith(".html")
        return FileResponse(
            folder / name,
            media_type=FIT_FILES[name],
            headers=headers,
            filename=name,
            content_disposition_type="inline" if shown_here else "attachment",
        )

    @app.get("/track/{name}")
    async def track_file(name: str) -> Response:
        return _file_of(studio.tracks.last.folder, name, TRACK_FILE)

    @app.get("/drift/{name}")
    async def drift_file(name: str) -> Response:
        return _file_of(studio.comparing.last_drift.folder, name, DRIFT_FILE, "image/svg+xml")

    @app.get("/robot/{name:path}")
    async def robot_file(name: str) -> Response:
        path = Path(session.robots.get(name, ""))
        return _file_of(path.parent, path.name, ROBOT_FILE)

    @app.get("/log/{key}/{what}")
    async def log_file(key: str, what: str) -> Response:
        log = session.logs.get(key)
        path = {"map": log.map, "log": log.path}.get(what) if log else ""
        if not log or not path or not Path(path).is_file():
            return Response(status_code=404)
        name = log.map_name if what == "map" else Path(path).name
        return FileResponse(path, media_type="text/plain", filename=name)


def _file_of(folder: Path | None, name: str, form: re.Pattern[str], kind: str = "text/plain") -> Response:
    """A file that was written for a page, to be saved; nothing where its name has another form."""
    if folder is None or not form.fullmatch(name) or not (folder / name).is_file():
        return Response(status_code=404)
    return FileResponse(folder / name, media_type=kind, filename=name, headers={"content-security-policy": NO_SCRIPT})


def _add_sockets(app: FastAPI, studio: Studio) -> None:
    """Fast channels: pictures of signals, and the drive."""
    session, driving = studio.session, studio.driving

    @app.websocket("/plot")
    async def plot(socket: WebSocket) -> None:
        await socket.accept()
        with contextlib.suppress(*CLOSED, *NONSENSE):
            while True:
                request = await socket.receive_json()
                shown = session.series.get(str(request.get("series")))
                if shown is None:
                    await socket.send_bytes(b"")
                    continue
                view = (float(request["begin"]), float(request["end"]), int(request["width"]))
                await socket.send_bytes(await asyncio.to_thread(shown.frame, *view))

    @app.websocket("/drive")
    async def drive(socket: WebSocket) -> None:
        """Frames out, commands in. A slow page loses frames: it says how many it has, and few are under way to it."""
        await socket.accept()
        fresh, seen = asyncio.Event(), 0
        driving.fresh.add(fresh)

        async def send() -> None:
            sent = 0
            with contextlib.suppress(*CLOSED):
                while True:
                    await fresh.wait()
                    fresh.clear()
                    if sent - seen >= UNDER_WAY:
                        continue
                    sent += 1
                    frame = np.asarray(driving.frame, dtype="<f4")
                    await socket.send_bytes(struct.pack("<I", len(frame)) + frame.tobytes())

        sender = asyncio.create_task(send())
        try:
            with contextlib.suppress(*CLOSED, *NONSENSE):
                while True:
                    command = await socket.receive_json()
                    if isinstance(command, dict) and isinstance(command.get("seen"), int):
                        seen = command["seen"]
                    _take(driving, command)
        finally:
            sender.cancel()
            driving.fresh.discard(fresh)
            if not driving.fresh:
                driving.send({"axes": [0.0, 0.0, 0.0], "level": 0.0})  # nobody holds a key any more


def _add_key(app: FastAPI, planned: Planned) -> None:
    """The key of a plan that is driven: a page that is gone holds it no more."""

    @app.websocket("/planned")
    async def key(socket: WebSocket) -> None:
        """Where the robot is out, the newest; whether the key is held in."""
        await socket.accept()
        fresh = asyncio.Event()
        planned.fresh.add(fresh)

        async def send() -> None:
            with contextlib.suppress(*CLOSED):
                while True:
                    await fresh.wait()
                    fresh.clear()
                    await socket.send_json(planned.frame)

        sender = asyncio.create_task(send())
        try:
            with contextlib.suppress(*CLOSED, *NONSENSE):
                while True:
                    said = await socket.receive_json()
                    if said.get("pressed") is True:
                        planned.press(socket)
                    planned.hold(socket, said.get("held") is True)
        finally:
            sender.cancel()
            planned.fresh.discard(fresh)
            planned.hold(socket, held=False)


def _take(driving: Driving, command: Any) -> None:
    """A command of a page, as far as it is one."""
    if isinstance(command, dict):
        fields = {name: command[name] for name in ("axes", "level", "offset", "set", "vary") if name in command}
        if fields:
            driving.send(fields)
