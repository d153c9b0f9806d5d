"""Who may talk to the studio: asked by a raw client, which can say what no browser would."""

import asyncio
import base64
import json
import os
import socket
import tempfile
from pathlib import Path

import pytest

from omnidyn.studio.guard import is_loopback
from tests.support.raw_sockets import forwarded, open_web_socket, text_frame

SOCKETS = ("/plot", "/drive", "/_nicegui_ws/socket.io/?EIO=4&transport=websocket")
FILE = "/static/studio.js"  # a page is made anew for each that asks, and takes 0.2 s
POLLING = "/_nicegui_ws/socket.io/?EIO=4&transport=polling"


def ask(port, path="/", method="GET", body=b"", **headers):
    """Status and text of an answer to a request with these headers alone."""
    given = {"Host": f"127.0.0.1:{port}", "Connection": "close", "Content-Length": str(len(body))}
    given |= {name.replace("_", "-"): value for name, value in headers.items()}
    lines = [f"{method} {path} HTTP/1.1", *(f"{name}: {value}" for name, value in given.items() if value is not None)]
    with socket.create_connection(("127.0.0.1", port), 120) as client:
        client.sendall("\r\n".join(lines).encode() + b"\r\n\r\n" + body)
        answer = b""
        try:
            while block := client.recv(65536):
                answer += block
                if b"101 Switching" in answer:
                    break
        except (TimeoutError, ConnectionResetError):
            pass
    return int(answer.split()[1]), answer.decode("utf-8", "replace")


def open_socket(port, path, **headers):
    """Status of a WebSocket handshake: 101 where it opens."""
    key = base64.b64encode(os.urandom(16)).decode()
    upgrade = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec_WebSocket_Key": key, "Sec_WebSocket_Version": "13"}
    return ask(port, path, **{**upgrade, **headers, "Content_Length": None})[0]


def test_every_name_of_this_machine_is_fine_and_no_other(studio):
    for host in ("127.0.0.1", "LOCALHOST", "[::1]", "127.0.0.1:9", "localhost:65000", "127.8.8.8"):
        assert ask(studio.port, FILE, Host=host)[0] == 200, host
    for host in (
        "evil.example",
        f"evil.example:{studio.port}",
        "127.0.0.1.evil.example",
        "localhost.evil",
        "192.168.1.9",
        "",
    ):
        assert ask(studio.port, Host=host)[0] == 403, host
    assert is_loopback("127.0.0.1:8642")
    assert not is_loopback("127.0.0.1@evil.example")


def test_pages_of_other_sites_get_nothing(studio):
    mine = f"http://127.0.0.1:{studio.port}"
    assert ask(studio.port, POLLING, Origin=mine)[0] == 200
    for origin in ("http://evil.example", "null", f"http://127.0.0.1:{studio.port + 1}", f"{mine}.evil.example"):
        assert ask(studio.port, Origin=origin)[0] == 403, origin
        assert ask(studio.port, POLLING, Origin=origin)[0] == 403, origin
        assert ask(studio.port, "/upload?name=a.csv", "POST", b"x", Origin=origin)[0] == 403, origin
    assert ask(studio.port, "/upload?name=a.csv", "POST", b"x")[0] == 403  # a browser says its origin here


def test_a_picture_of_another_site_costs_nothing_and_a_link_is_followed(studio):
    for site in ("cross-site", "same-site"):  # <img src="http://127.0.0.1:8642/"> says no origin
        for path in ("/", "/workspace", "/static/studio.js"):
            image = {"Sec_Fetch_Site": site, "Sec_Fetch_Mode": "no-cors", "Sec_Fetch_Dest": "image"}
            assert ask(studio.port, path, **image)[0] == 403, (site, path)
        link = {"Sec_Fetch_Site": site, "Sec_Fetch_Mode": "navigate", "Sec_Fetch_Dest": "document"}
        assert ask(studio.port, **link)[0] == 200
        assert ask(studio.port, "/workspace", **link)[0] == 403
        assert ask(studio.port, **{**link, "Sec_Fetch_Dest": "iframe"})[0] == 403
    for site in ("same-origin", "none"):
        assert ask(studio.port, "/static/studio.js", Sec_Fetch_Site=site)[0] == 200


@pytest.mark.parametrize("path", SOCKETS)
def test_sockets_open_for_pages_of_this_server_only(studio, path):
    assert open_socket(studio.port, path, Origin=f"http://127.0.0.1:{studio.port}") == 101
    for origin in ("http://evil.example", "null", None):
        assert open_socket(studio.port, path, Origin=origin) == 403, origin
    host = f"evil.example:{studio.port}"
    assert open_socket(studio.port, path, Origin=f"http://{host}", Host=host) == 403


def test_a_forwarded_port_works_and_guards_as_well(studio):
    """As `ssh -L` does: bytes go from another port of this machine, whose number the browser names."""
    with forwarded(studio.port) as port:
        for host in (f"127.0.0.1:{port}", f"localhost:{port}", f"[::1]:{port}"):
            mine = {"Host": host, "Origin": f"http://{host}"}
            assert ask(port, FILE, Host=host)[0] == 200
            assert ask(port, POLLING, **mine)[0] == 200
            for path in SOCKETS:
                assert open_socket(port, path, **mine) == 101, (host, path)
        assert ask(port, Host=host)[0] == 200
        evil = f"evil.example:{port}"
        for strange in (
            {"Host": evil, "Origin": f"http://{evil}"},
            {"Origin": "http://evil.example"},
            {"Origin": f"http://127.0.0.1:{studio.port}"},  # the page of another port is another page
        ):
            assert ask(port, **strange)[0] == 403
            assert ask(port, POLLING, **strange)[0] == 403
            assert [open_socket(port, path, **strange) for path in SOCKETS] == [403] * len(SOCKETS)


def test_only_this_machine_can_connect(studio):
    with pytest.raises(OSError, match=r"refused|unreachable|timed out"):
        socket.create_connection(("127.0.0.2", studio.port), 5)


def test_only_what_belongs_to_the_page_is_served(studio):
    for path in (
        "/docs",
        "/openapi.json",
        "/static/../server.py",
        "/fit/..%2f..%2fetc%2fpasswd",
        "/log/x/log",
        "/series/x",
        "/track/run-1.csv",
        "/track/..%2frobot.toml",
        "/drift/drift.svg",
        "/robot/axebot",
        "/robot/..%2f..%2fetc%2fpasswd",
        "/robot//etc/passwd",
    ):
        status, text = ask(studio.port, path)
        assert status in (404, 307, 204), path  # 204: a picture that is no more
        assert "root:" not in text
    status, text = ask(studio.port)
    assert "content-security-policy: default-src 'self'" in text.lower()
    assert "https://" not in text.partition("<body")[0]


def test_a_page_that_answers_late_on_a_busy_machine_is_not_loaded_anew(studio):
    """It would lose what is typed and open: the default of the server gives a page 2 s to answer, and 3 s more."""
    status, text = ask(studio.port, POLLING, Origin=f"http://127.0.0.1:{studio.port}")
    assert status == 200
    assert int(text.partition('"pingTimeout":')[2].partition(",")[0].strip("} ")) >= 10_000  # [ms]


def test_a_large_request_is_refused(studio):
    mine = f"http://127.0.0.1:{studio.port}"
    status, _ = ask(studio.port, f"{POLLING}&sid=x", "POST", b"x" * 1_100_000, Origin=mine)
    assert status in (400, 413)


def test_names_of_uploads_are_not_trusted_and_files_go_away(start, tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    with start() as server:
        mine = f"http://127.0.0.1:{server.port}"
        for name in ("../../evil.csv", "%2e%2e%2f%2e%2e%2fevil.csv", "..%5Cevil.csv", "evil.csv%00", ".evil.csv"):
            status, text = ask(server.port, f"/upload?name={name}", "POST", b"t,vx\n0,1\n1,2\n", Origin=mine)
            assert status == 200, text
            assert json.loads(text.rpartition("\r\n\r\n")[2])["name"].strip("_") == "evil.csv"
        folders = list(tmp_path.glob("omnidyn-studio-*"))
        assert len(folders) == 1
        written = list(tmp_path.rglob("evil.csv*"))
        assert len(written) == 5
        assert all(folders[0] in path.parents for path in written)
    assert not folders[0].exists()
    assert not list(Path(tempfile.gettempdir()).glob("evil*"))


def test_a_bad_workspace_is_told_and_refused(start, tmp_path):
    from omnidyn.cli import main

    bad = tmp_path / "bad.zip"
    bad.write_bytes(b"PK")
    assert main(["studio", str(bad), "--no-browser", "--port", "0"]) == 3
    with start() as server:
        mine = f"http://127.0.0.1:{server.port}"
        status, text = ask(server.port, "/upload?name=bad.zip", "POST", bad.read_bytes(), Origin=mine)
        assert status == 400
        assert "bad.zip: not a workspace" in text
        assert ask(server.port, "/upload?name=bad.zip", "POST", b"PK", Origin="http://evil.example")[0] == 403
        assert ask(server.port, "/workspace", Origin="http://evil.example")[0] == 403


@pytest.mark.parametrize("kind", ["", "track"])
@pytest.mark.some(1)
def test_uploads_are_bounded_in_number(start, kind):
    from omnidyn.studio.session import MAX_FILES

    with start() as server:
        mine, statuses = f"http://127.0.0.1:{server.port}", []
        for _ in range(MAX_FILES + 1):
            statuses.append(ask(server.port, f"/upload?name=a.toml2&kind={kind}", "POST", b"", Origin=mine)[0])
        assert statuses[0] == 200
        assert statuses[-2:] == [200, 413]  # what comes along does not count


def test_uploads_are_bounded_in_size_one_by_one_and_all_together(monkeypatch):
    from omnidyn.studio import session
    from omnidyn.studio.session import RefusedError, Session

    async def body(size):
        for _ in range(size // 100):
            yield b"x" * 100

    async def work():
        studio = Session()
        monkeypatch.setattr(studio, "check", lambda log: asyncio.sleep(0))
        for size, taken in ((900, True), (1100, False), (800, True), (400, False), (300, True)):
            if taken:
                await studio.upload("log.csv", body(size))
            else:
                with pytest.raises(RefusedError):
                    await studio.upload("log.csv", body(size))
        sizes = [path.stat().st_size for path in sorted(studio.folder.rglob("log.csv"))]
        assert sorted(sizes) == [300, 800, 900]  # nothing is left of what was refused
        studio.remove(next(iter(studio.logs.values())))  # its 900 bytes are free again
        await studio.upload("log.csv", body(800))
        await studio.close()
        assert not studio.folder.exists()

    monkeypatch.setattr(session, "MAX_FILE_BYTES", 1000)
    monkeypatch.setattr(session, "MAX_BYTES", 2000)
    asyncio.run(work())


def test_another_host_needs_the_token(start):
    with start("--host", "0.0.0.0") as server:
        token = server.address.partition("?token=")[2]
        assert len(token) >= 30
        assert ask(server.port)[0] == 403
        assert ask(server.port, "/?token=wrong")[0] == 403
        status, text = ask(server.port, f"/?token={token}", Host="robot.local:8642")
        assert status == 200
        assert f"set-cookie: omnidyn_studio={token}; HttpOnly; SameSite=Strict" in text
        cookie = {"Cookie": f"omnidyn_studio={token}", "Origin": f"http://127.0.0.1:{server.port}"}
        assert open_socket(server.port, "/drive", **cookie) == 101
        assert open_socket(server.port, "/drive", Origin=cookie["Origin"]) == 403
        assert ask(server.port, Cookie=cookie["Cookie"], Origin="http://evil.example")[0] == 403
        server.process.terminate()
        assert token not in server.process.communicate(timeout=200)[0]  # it was printed once


def test_what_a_socket_does_not_know_closes_it_and_nothing_else(studio):
    for path in ("/plot", "/drive"):
        for words in (
            b"no json",
            b"[1]",
            b'{"series": "x", "begin": "y"}',
            b'{"seen": "x", "axes": 1}',
            b"x" * 100_000,
        ):
            with open_web_socket(studio.port, path) as client:
                client.sendall(text_frame(words))
    assert ask(studio.port)[0] == 200
    with open_web_socket(studio.port, "/plot") as client:
        client.sendall(text_frame(b'{"series": "x", "begin": 0, "end": 1, "width": 9}'))
        assert client.recv(2) == b"\x82\x00"  # a picture that is no more: an empty frame
