"""Lets through only who may: known names of this machine, pages of the studio, holders of a token.

A page of another site that is open in the same browser can send requests to this machine, and by a
name of its own that it points here (DNS rebinding) even read the answers. So every request has to
name this machine, and one that says which page it comes from has to come from the studio's. Where
other machines reach the studio, a token is needed as well: once in the address, then as a cookie.
"""

from __future__ import annotations

import hmac
import ipaddress
import socket
from collections.abc import Awaitable, Callable, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qsl, urlencode, urlsplit

from cdpr_drake.bridge import is_loopback

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Any]]
Send = Callable[[Any], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

LOCAL_NAMES = ("localhost", "127.0.0.1", "::1")
EVERYWHERE = ("*", "0.0.0.0", "::")
"""Hosts that stand for all addresses of this machine."""

TOKEN = "token"


class Guard:
    """An ASGI application before another one."""

    def __init__(self, app: App, host: str, port: int, token: str = "") -> None:
        """Of an application that listens at a host.

        Args:
            app: What is guarded.
            host: Name or address at which it listens.
            port: Its port, part of the cookie's name, since cookies know no ports.
            token: What is asked for; empty: nothing.
        """
        self._app, self._host, self._token = app, host, token
        self._cookie = f"cdpr_studio_token_{port}"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answers 403 in the application's place, or lets it answer."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = {
            name.decode().lower(): value.decode("latin-1") for name, value in scope["headers"]
        }
        refused = self._refused(headers)
        if refused:
            await _answer(scope, send, 403, refused)
        elif not self._token or self._has_cookie(headers):
            await self._app(scope, receive, send)
        elif scope["type"] == "http" and self._has_token(scope):
            await self._hand_cookie(scope, send)
        else:
            await _answer(
                scope, send, 403,
                "A token is missing: open the address that cdpr studio has printed, ?token=...",
            )  # fmt: skip

    def _refused(self, headers: dict[str, str]) -> str:
        """Why a request is not accepted by where it goes and comes from; empty: it is."""
        host = headers.get("host", "")
        if not self.knows(_name(host)):
            return f"Host: found {host[:80]!r}; accepted: a name or address of this machine"
        origin = headers.get("origin")
        if origin is not None and urlsplit(origin).netloc.lower() != host.lower():
            return f"Origin: found {origin[:80]!r}; accepted: pages of the studio"
        return ""

    def knows(self, name: str) -> bool:
        """Whether a name means this machine, and can mean no other one tomorrow."""
        if name in LOCAL_NAMES or name == self._host.lower():
            return True
        if is_loopback(self._host):
            return False
        if name in (socket.gethostname().lower(), socket.getfqdn().lower()):
            return True
        try:
            ipaddress.ip_address(name)
        except ValueError:
            return False
        return True  # an address needs no DNS, so nobody can rebind it

    def _has_cookie(self, headers: dict[str, str]) -> bool:
        try:
            morsel = SimpleCookie(headers.get("cookie", "")).get(self._cookie)
        except CookieError:
            return False
        return morsel is not None and hmac.compare_digest(
            morsel.value.encode(), self._token.encode()
        )

    def _has_token(self, scope: Scope) -> bool:
        given = dict(parse_qsl(scope["query_string"].decode("latin-1"))).get(TOKEN, "")
        return hmac.compare_digest(given.encode(), self._token.encode())

    async def _hand_cookie(self, scope: Scope, send: Send) -> None:
        """Sends the browser to the same address without the token, with a cookie."""
        query = [
            pair for pair in parse_qsl(scope["query_string"].decode("latin-1")) if pair[0] != TOKEN
        ]
        # One slash at the start, or it would be the name of another machine.
        where = "/" + scope["path"].lstrip("/\\") + (f"?{urlencode(query)}" if query else "")
        cookie = f"{self._cookie}={self._token}; Path=/; HttpOnly; SameSite=Strict"
        headers = [
            (b"location", where.encode("ascii", "ignore").translate(None, b"\r\n")),
            (b"set-cookie", cookie.encode()),
            (b"referrer-policy", b"no-referrer"),
        ]
        await send({"type": "http.response.start", "status": 303, "headers": headers})
        await send({"type": "http.response.body", "body": b""})


def _name(host: str) -> str:
    """The name in a header `Host`, without its port."""
    try:
        return (urlsplit(f"//{host}").hostname or "").lower()
    except ValueError:
        return ""


async def _answer(scope: Scope, send: Send, status: int, words: str) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": 1008})
        return
    headers = [(b"content-type", b"text/plain; charset=utf-8")]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": words.encode()})
