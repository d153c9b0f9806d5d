"""A WebSocket as bytes, and a port that is forwarded to another: what no browser and no library would do."""

import base64
import contextlib
import os
import socket
import struct
import threading


def open_web_socket(port, path):
    """A WebSocket of a studio that is open."""
    client, host = socket.create_connection(("127.0.0.1", port), 10), f"127.0.0.1:{port}"
    head = {"Host": host, "Origin": f"http://{host}", "Upgrade": "websocket", "Connection": "Upgrade"}
    head |= {"Sec-WebSocket-Key": base64.b64encode(os.urandom(16)).decode(), "Sec-WebSocket-Version": "13"}
    lines = [f"GET {path} HTTP/1.1", *(f"{name}: {value}" for name, value in head.items())]
    client.sendall("\r\n".join(lines).encode() + b"\r\n\r\n")
    answer = b""
    while not answer.endswith(b"\r\n\r\n"):
        answer += client.recv(1)
    assert b" 101 " in answer, answer
    return client


def text_frame(words):
    """A text frame of a client, with a mask of zeros."""
    size = bytes([0x80 | len(words)]) if len(words) < 126 else b"\xff" + struct.pack(">Q", len(words))
    return b"\x81" + size + b"\0" * 4 + words


def frames_of(text):
    """Contents of the whole frames of a server in some bytes, and the bytes that are left."""
    frames = []
    while len(text) >= 4:
        length, start = text[1] & 127, 2
        if length == 126:
            length, start = struct.unpack_from(">H", text, 2)[0], 4
        if len(text) < start + length:
            break
        frames.append(text[start : start + length])
        text = text[start + length :]
    return frames, text


@contextlib.contextmanager
def forwarded(port):
    """The number of another port of this machine whose bytes go to a port, and back, as `ssh -L` does."""
    listener = socket.create_server(("127.0.0.1", 0))

    def accept():
        with contextlib.suppress(OSError):
            while True:
                client, _ = listener.accept()
                threading.Thread(target=_forward, args=(client, port), daemon=True).start()

    thread = threading.Thread(target=accept, daemon=True)
    thread.start()
    with listener:
        yield listener.getsockname()[1]
        listener.shutdown(socket.SHUT_RDWR)
        thread.join(10)


def _forward(client, port):
    with client, socket.create_connection(("127.0.0.1", port)) as server:
        back = threading.Thread(target=_pump, args=(server, client), daemon=True)
        back.start()
        _pump(client, server)
        back.join(10)


def _pump(source, target):
    with contextlib.suppress(OSError):
        while block := source.recv(65536):
            target.sendall(block)
    for end in (source, target):
        with contextlib.suppress(OSError):
            end.shutdown(socket.SHUT_RDWR)
