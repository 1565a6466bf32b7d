"""Lets through only who may: known names of this machine, pages of the studio, holders of a cookie.

A page of another site that is open in the same browser can send requests to this machine, and by a
name of its own that it points here (DNS rebinding) even read the answers. So every request has to
name this machine, and one that says which page it comes from has to come from the studio's. Other
programs and users of this machine reach the port, too: a cookie is needed for everything, pages,
files and WebSockets, and whoever has the token gets one (`Entrance`).
"""

from __future__ import annotations

import ipaddress
import re
import socket
from collections.abc import Awaitable, Callable, MutableMapping
from html import escape
from typing import Any
from urllib.parse import parse_qsl, urlencode

from cdpr_drake.hosts import is_loopback
from cdpr_drake.studio.entrance import Entrance

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Any]]
Send = Callable[[Any], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

LOCAL_NAMES = ("localhost", "127.0.0.1", "::1")
EVERYWHERE = ("*", "0.0.0.0", "::")
"""Hosts that stand for all addresses of this machine."""

TOKEN, ASKED = "token", "cookie"
"""Keys of the address: the token, and that a cookie was set on the way."""

SESSION = "cdpr_studio_session"
"""Key of the scope of a request that was let through: its session."""

_PLACE = re.compile(
    r"(?:\[([0-9a-f:.]{2,60})\]|([a-z0-9](?:[a-z0-9._-]{0,252})))(?::([0-9]{1,5}))?"
)
"""Name or address, and perhaps a port, in small letters; nothing else, no user, no backslash."""


class Guard:
    """An ASGI application before another one."""

    def __init__(self, app: App, host: str, entrance: Entrance) -> None:
        """Of an application that listens at a host.

        Args:
            app: What is guarded.
            host: Name or address at which it listens.
            entrance: Knows tokens and cookies.
        """
        self._app, self._host, self._entrance = app, host, entrance

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answers in the application's place, or lets it answer."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers: dict[str, list[str]] = {}
        for name, value in scope["headers"]:
            headers.setdefault(name.decode("latin-1").lower(), []).append(value.decode("latin-1"))
        query = parse_qsl(scope["query_string"].decode("latin-1"), keep_blank_values=True)
        session = self._entrance.session("; ".join(headers.get("cookie", [])))
        refused = self._refused(headers) or self._wrong_token(query)
        if not refused and self._hands_cookie(scope, query, session):
            cookie = "" if session else self._entrance.new_cookie()
            await self._hand_cookie(scope, query, send, cookie)
        elif refused or not session:
            await _refuse(scope, send, refused or self._why_none())
        else:
            scope[SESSION] = session
            await self._app(scope, receive, send)

    def _refused(self, headers: dict[str, list[str]]) -> str:
        """Why a request is not accepted by where it goes and comes from; empty: it is."""
        hosts, origins = headers.get("host", []), headers.get("origin", [])
        place = _place(hosts[0]) if len(hosts) == 1 else None
        if place is None or not self.knows(place[0]):
            found = ", ".join(hosts)[:80]
            return f"Host: found {found!r}; accepted: a name or address of this machine"
        if any(_origin(origin) != place for origin in origins):
            return f"Origin: found {', '.join(origins)[:80]!r}; accepted: pages of the studio"
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

    def _wrong_token(self, query: list[tuple[str, str]]) -> str:
        given = [value for key, value in query if key == TOKEN]
        if all(self._entrance.accepts(each) for each in given) or not self._entrance.needs_token:
            return ""
        return "The token is wrong: open the address that cdpr studio has printed when it started."

    def _hands_cookie(self, scope: Scope, query: list[tuple[str, str]], session: str) -> bool:
        """Whether a request is answered with a cookie, or with an address without the token."""
        if scope["type"] != "http" or scope["method"] != "GET":
            return False
        keys = {key for key, _ in query}
        if self._entrance.needs_token:
            return TOKEN in keys
        return not session and scope["path"] == "/" and ASKED not in keys

    def _why_none(self) -> str:
        if self._entrance.needs_token:
            return (
                "A token is missing: open the address that cdpr studio has printed when it started."
            )
        return "A cookie is missing: open the first page of the studio, with cookies allowed."

    async def _hand_cookie(
        self, scope: Scope, query: list[tuple[str, str]], send: Send, cookie: str
    ) -> None:
        """Sends the browser to the same address without the token, with a cookie."""
        left = [pair for pair in query if pair[0] not in (TOKEN, ASKED)]
        if not self._entrance.needs_token:
            left.append((ASKED, "set"))
        # One slash at the start, or it would be the name of another machine.
        where = "/" + scope["path"].lstrip("/\\") + (f"?{urlencode(left)}" if left else "")
        shown = escape(where, quote=True)
        body = (
            '<!doctype html><meta charset="utf-8"><title>cdpr studio</title>'
            f'<meta http-equiv="refresh" content="0;url={shown}">'
            f'<a href="{shown}">cdpr studio</a>\n'
        )
        headers = [
            (b"content-type", b"text/html; charset=utf-8"),
            (b"referrer-policy", b"no-referrer"),
            (b"cache-control", b"no-store"),
        ]
        if cookie:
            headers.append((b"set-cookie", cookie.encode()))
        await send({"type": "http.response.start", "status": 200, "headers": headers})
        await send({"type": "http.response.body", "body": body.encode("utf-8", "replace")})


def _place(text: str) -> tuple[str, str] | None:
    """Name and port of a header `Host`; None: it is not written as the standard has it."""
    found = _PLACE.fullmatch(text.lower())
    return None if found is None else (found[1] or found[2], found[3] or "")


def _origin(text: str) -> tuple[str, str] | None:
    """Name and port of a header `Origin`; None: it is not written as the standard has it."""
    scheme, _, place = text.lower().partition("://")
    return _place(place) if scheme in ("http", "https") else None


async def _refuse(scope: Scope, send: Send, words: str) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": 1008})
        return
    headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"cache-control", b"no-store")]
    await send({"type": "http.response.start", "status": 403, "headers": headers})
    await send({"type": "http.response.body", "body": f"{words}\n".encode()})
