"""Lets through only who may: known names of this machine, pages of the studio, holders of a cookie.

A page of another site that is open in the same browser can send requests to this machine, and by a
name of its own that it points here (DNS rebinding) even read the answers. So every request has to
name this machine, and one that says which page it comes from has to come from the studio's: pages
of other ports of this machine are of the same site for SameSite, hence `Origin`. Other programs and
users of this machine reach the port, too: a cookie is needed for everything, pages, files and
WebSockets. Who opens the printed address, which has the token, gets one: the signed name of a new
session. Workbenches belong to such sessions, so that a request without a cookie costs none.
"""

from __future__ import annotations

import hashlib
import hmac
import ipaddress
import re
import secrets
import socket
from collections.abc import Awaitable, Callable
from html import escape
from urllib.parse import quote, urlencode

from itsdangerous import Signer
from starlette.requests import HTTPConnection
from starlette.responses import HTMLResponse, PlainTextResponse
from starlette.types import ASGIApp, Receive, Scope, Send

from cdpr_drake.hosts import is_loopback

LOCAL_NAMES = ("localhost", "127.0.0.1", "::1")
EVERYWHERE = ("*", "0.0.0.0", "::")
"""Hosts that stand for all addresses of this machine."""

TOKEN, ASKED = "token", "cookie"
"""Keys of the address: the token, and that a cookie was set on the way."""

SESSION = "cdpr_studio_session"
"""Key of the scope of a request that was let through: its session."""

SHORTEST_TOKEN = 16
"""Characters of a token that somebody chooses."""

TOKEN_WORDS = f"{SHORTEST_TOKEN} to 200 of the characters A-Z a-z 0-9 . _ ~ -"
"""What is accepted as a token, which has to stand in an address as it is."""

IS_TOKEN = re.compile(rf"[A-Za-z0-9._~-]{{{SHORTEST_TOKEN},200}}")

PRINTED = "open the address that cdpr studio has printed when it started."
NO_COOKIE = "A cookie is missing: open the first page of the studio, with cookies allowed."
NO_STORE = {"cache-control": "no-store"}

_PLACE = re.compile(
    r"(?:\[([0-9a-f:.]{2,60})\]|([a-z0-9](?:[a-z0-9._-]{0,252})))(?::([0-9]{1,5}))?"
)
"""Name or address, and perhaps a port, in small letters; nothing else, no user, no backslash."""


class Door:
    """An ASGI application before another one.

    starlette's `TrustedHostMiddleware` would not do: it has no words for who is refused, takes the
    first of two hosts, and cannot accept every address where the studio listens at all of them.
    """

    def __init__(
        self,
        app: ASGIApp,
        host: str,
        token: str,
        port: int,
        prepare: Callable[[str], Awaitable[None]],
    ) -> None:
        """Of an application that listens at a host.

        Args:
            app: What is guarded.
            host: Name or address at which it listens.
            token: What is asked for; empty: nothing, but sessions are told by cookies all the same.
            port: Its port, part of the cookie's name, since cookies know no ports.
            prepare: Called with the session of a request before the application is.
        """
        self._app, self._host, self._token, self._prepare = app, host.lower(), token, prepare
        self._name = f"cdpr_studio_{port}"
        key = token or secrets.token_urlsafe(32)
        self._signer = Signer(key, salt=self._name, digest_method=hashlib.sha256)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answers in the application's place, or lets it answer."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        request = HTTPConnection(scope)
        session = self._session(request)
        refused = self._refused(request)
        if not refused and self._hands_cookie(request, session):
            await self._cookie_page(request, session)(scope, receive, send)
        elif not refused and session:
            scope[SESSION] = session
            await self._prepare(session)
            await self._app(scope, receive, send)
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
        else:
            none = f"A token is missing: {PRINTED}" if self._token else NO_COOKIE
            await PlainTextResponse(f"{refused or none}\n", 403, NO_STORE)(scope, receive, send)

    def _session(self, request: HTTPConnection) -> str:
        """The session of a request; empty: it has no cookie of this server."""
        value = request.cookies.get(self._name, "")
        session = value.partition(".")[0]
        # Signed anew: to unsign takes some texts for the same signature.
        return session if hmac.compare_digest(self._signer.sign(session), value.encode()) else ""

    def _refused(self, request: HTTPConnection) -> str:
        """Why a request is not accepted by where it goes and comes from, or by a token that is
        wrong; empty: it is."""
        hosts, origins = (request.headers.getlist(name) for name in ("host", "origin"))
        place = _place(hosts[0]) if len(hosts) == 1 else None
        if place is None or not self.knows(place[0]):
            found = ", ".join(hosts)[:80]
            return f"Host: found {found!r}; accepted: a name or address of this machine"
        if any(_origin(origin) != place for origin in origins):
            return f"Origin: found {', '.join(origins)[:80]!r}; accepted: pages of the studio"
        tokens = request.query_params.getlist(TOKEN) if self._token else []
        right = self._token.encode()
        fits = all(hmac.compare_digest(token.encode(), right) for token in tokens)
        return "" if fits else f"The token is wrong: {PRINTED}"

    def knows(self, name: str) -> bool:
        """Whether a name means this machine, and can mean no other one tomorrow."""
        if name in LOCAL_NAMES or name == self._host:
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

    def _hands_cookie(self, request: HTTPConnection, session: str) -> bool:
        """Whether a request is answered with a cookie, or with an address without the token."""
        if request.scope["type"] != "http" or request.scope["method"] != "GET":
            return False
        if self._token:
            return TOKEN in request.query_params
        return not session and request.scope["path"] == "/" and ASKED not in request.query_params

    def _cookie_page(self, request: HTTPConnection, session: str) -> HTMLResponse:
        """A page that goes on by itself to the address without the token, with a cookie.

        No redirection: a browser that comes from another site keeps SameSite=Strict cookies back.
        """
        left = [x for x in request.query_params.multi_items() if x[0] not in (TOKEN, ASKED)]
        if not self._token:
            left.append((ASKED, "set"))
        # One slash at the start, or it would be the name of another machine.
        path = quote("/" + request.scope["path"].lstrip("/\\"), errors="replace")
        shown = escape(f"{path}?{urlencode(left)}" if left else path)
        page = HTMLResponse(
            '<!doctype html><meta charset="utf-8"><title>cdpr studio</title>'
            f'<meta http-equiv="refresh" content="0;url={shown}">'
            f'<a href="{shown}">cdpr studio</a>\n',
            headers={"referrer-policy": "no-referrer", **NO_STORE},
        )
        if not session:
            value = self._signer.sign(secrets.token_urlsafe(16)).decode()
            page.set_cookie(self._name, value, httponly=True, samesite="strict")
        return page


def _place(text: str) -> tuple[str, str] | None:
    """Name and port of a header `Host`; None: it is not written as the standard has it."""
    found = _PLACE.fullmatch(text.lower())
    return None if found is None else (found[1] or found[2], found[3] or "")


def _origin(text: str) -> tuple[str, str] | None:
    """Name and port of a header `Origin`; None: it is not written as the standard has it."""
    scheme, _, place = text.lower().partition("://")
    return _place(place) if scheme in ("http", "https") else None
