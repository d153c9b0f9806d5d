"""Guard: one place through which pages, files and sockets go. Foreign pages and foreign names get nothing.

A page of another site may send requests to this machine, and a name of another site may point to it (DNS rebinding).
The first is told by `Origin` and `Sec-Fetch-Site`, which a page cannot set, the second by `Host`, which has to be a
name of this machine.
Any port is fine, so that a forwarded one (`ssh -L`) works.
"""

from __future__ import annotations

import hmac
import ipaddress
import re
from collections.abc import Awaitable, Callable, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

UPLOAD = "/upload"  # its route counts bytes itself
MAX_BODY = 1_000_000  # bytes of any other request
COOKIE = "omnidyn_studio"
REFUSED, TOO_LARGE, POLICY_VIOLATION = 403, 413, 1008
HEADERS = (
    (b"x-frame-options", b"DENY"),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (
        b"content-security-policy",
        b"default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; frame-ancestors 'none'",
    ),
)
OWN = ("same-origin", "none")  # `Sec-Fetch-Site` of a page of this server, and of an address that somebody typed
_HOST = re.compile(r"(?P<name>[a-z0-9.-]+|\[[0-9a-f:.]+\])(?::\d{1,5})?", re.ASCII)


class TooLargeError(Exception):
    """A request brought more bytes than it may."""


class Guard:
    """An ASGI application behind the checks. token: that a page must know; "" where only this machine can connect."""

    def __init__(self, app: App, token: str = "") -> None:
        self.app, self.token = app, token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
        elif not self._is_welcome(scope):
            await _refuse(scope, receive, send, REFUSED)
        else:
            await self._passed_on(scope, receive, send)

    def _is_welcome(self, scope: Scope) -> bool:
        """Whether a request comes from a page of this server."""
        hosts, origins = _values(scope, b"host"), _values(scope, b"origin")
        if len(hosts) != 1 or not (self.token or is_loopback(hosts[0])):
            return False
        asks_only = scope["type"] == "http" and scope["method"] in ("GET", "HEAD")
        if len(origins) != 1 and not (asks_only and not origins):  # a browser always says it of the others
            return False
        pages = (f"http://{hosts[0]}".lower(), f"https://{hosts[0]}".lower())
        if any(origin.lower() not in pages for origin in origins) or _is_foreign(scope):
            return False
        return not self.token or self._knows_token(scope)

    def _knows_token(self, scope: Scope) -> bool:
        """Whether the address or a cookie has the token."""
        given = parse_qs(scope["query_string"].decode("latin-1")).get("token", [])
        cookie = SimpleCookie()
        for text in _values(scope, b"cookie"):
            try:
                cookie.load(text)
            except CookieError:
                return False
        given += [cookie[COOKIE].value] if COOKIE in cookie else []
        return any(hmac.compare_digest(text.encode(), self.token.encode()) for text in given)

    async def _passed_on(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Give a request to the application; count what it brings, add headers to what it gets."""
        size, begun, gone = 0, False, False

        async def counted() -> MutableMapping[str, Any]:
            nonlocal size, gone
            message = await receive()
            gone = gone or message["type"] == "http.disconnect"
            size += len(message.get("body", b""))
            if size > MAX_BODY and scope["path"] != UPLOAD:
                raise TooLargeError
            return message

        async def with_headers(message: MutableMapping[str, Any]) -> None:
            nonlocal begun
            if message["type"] == "http.response.start":
                begun = True
                names = {name.lower() for name, _ in message.get("headers", [])}
                headers = [*message.get("headers", []), *(pair for pair in HEADERS if pair[0] not in names)]
                if self.token:
                    cookie = f"{COOKIE}={self.token}; HttpOnly; SameSite=Strict; Path=/"
                    headers.append((b"set-cookie", cookie.encode()))
                message = {**message, "headers": headers}
            await send(message)

        if scope["type"] == "websocket":
            await self.app(scope, receive, send)
            return
        try:
            await self.app(scope, counted, with_headers)
        except TooLargeError:
            if not begun:
                await _refuse(scope, receive, send, TOO_LARGE)
        except RuntimeError:  # of the toolkit, where nobody waits for the answer any more
            if not gone:
                raise


def _is_foreign(scope: Scope) -> bool:
    """Whether a page of another site asks, as its browser says; one that links to the first page may."""
    sites = _values(scope, b"sec-fetch-site")
    kind = (*_values(scope, b"sec-fetch-mode"), *_values(scope, b"sec-fetch-dest"))
    followed = kind == ("navigate", "document") and scope["path"] == "/" and scope.get("method") == "GET"
    return any(site not in OWN for site in sites) and not followed


def is_loopback(host: str) -> bool:
    """Whether the value of a `Host` header is a name of this machine that no name server can give to another."""
    match = _HOST.fullmatch(host.lower())
    if match is None:
        return False
    name = match["name"].strip("[]")
    try:
        return ipaddress.ip_address(name).is_loopback
    except ValueError:
        return name == "localhost"


def _values(scope: Scope, name: bytes) -> list[str]:
    """The values of a header."""
    return [value.decode("latin-1") for key, value in scope["headers"] if key.lower() == name]


async def _refuse(scope: Scope, receive: Receive, send: Send, status: int) -> None:
    """Close a socket before it opens; answer a request with a status and no more."""
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": POLICY_VIOLATION})
        return
    await send({"type": "http.response.start", "status": status, "headers": [(b"content-type", b"text/plain")]})
    await send({"type": "http.response.body", "body": b"refused"})
