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

import asyncio
import hashlib
import hmac
import ipaddress
import re
import secrets
import socket
from collections.abc import Awaitable, Callable
from weakref import WeakValueDictionary

from itsdangerous import Signer
from starlette.requests import HTTPConnection
from starlette.responses import HTMLResponse, PlainTextResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send

from cdpr_drake.errors import CdprError
from cdpr_drake.hosts import is_loopback
from cdpr_drake.studio.session import Workbench

TOKEN, ASKED = "token", "cookie"
"""Keys of the address: the token, and that a cookie was set on the way."""

BENCH = "cdpr_studio_bench"
"""Key of the scope of a request that was let through: the workbench of its session."""

MOST_SESSIONS = 8
"""Workbenches that are kept, those used last, beside all that a page shows; 10 MB each."""

PRINTED = "open the address that cdpr studio has printed when it started, with cookies allowed"
NO_STORE = {"cache-control": "no-store"}

_PLACE = re.compile(r"(?:\[([0-9a-f:.]{2,60})\]|([a-z0-9](?:[a-z0-9._-]{0,252})))(?::[0-9]{1,5})?")
"""Name or address, and perhaps a port, in small letters; nothing else, no user, no backslash."""


class Door:
    """An ASGI application before another one.

    starlette's `TrustedHostMiddleware` has no words for who is refused, takes the first of two
    hosts, and cannot accept every address where the studio listens at all of them.
    """

    def __init__(
        self, app: ASGIApp, host: str, token: str, port: int,
        bench: Callable[[str], Awaitable[Workbench]],
    ) -> None:  # fmt: skip
        """Of an application that listens at a host.

        Args:
            app: What is guarded.
            host: Name or address at which it listens.
            token: What is asked for; empty: nothing, but sessions are told by cookies all the same.
            port: Part of the cookie's name, since cookies know no ports.
            bench: The workbench of a session, which the application gets with the request.
        """
        self._app, self._host, self._token, self._bench = app, host.lower(), token, bench
        self._name = f"cdpr_studio_{port}"
        key = token or secrets.token_urlsafe(32)
        self._signer = Signer(key, salt=self._name, digest_method=hashlib.sha256)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answers in the application's place, or lets it answer."""
        is_request = scope["type"] in ("http", "websocket")
        answer = await self._answer(HTTPConnection(scope)) if is_request else None
        if answer is None:
            await self._app(scope, receive, send)
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
        else:
            await answer(scope, receive, send)

    async def _answer(self, request: HTTPConnection) -> Response | None:
        """What is answered in the application's place; None: it may answer."""
        session, words, status = self._session(request), self._refusal(request), 403
        if not words and self._hands_cookie(request, session):
            return self._cookie_page(session)
        if not words and session:
            try:
                request.scope[BENCH] = await self._bench(session)
                return None
            except (CdprError, OSError) as problem:
                words, status = str(problem), 500
        return PlainTextResponse(
            f"{words or f'A cookie is missing: {PRINTED}'}\n", status, NO_STORE
        )

    def _session(self, request: HTTPConnection) -> str:
        """The session of a request; empty: it has no cookie of this server."""
        value = request.cookies.get(self._name, "")
        session = value.partition(".")[0]
        # Signed anew: to unsign takes some texts for the same signature.
        return session if hmac.compare_digest(self._signer.sign(session), value.encode()) else ""

    def _refusal(self, request: HTTPConnection) -> str:
        """Why a request is refused for where it goes or comes from, or a wrong token, or empty."""
        hosts, origins = (request.headers.getlist(name) for name in ("host", "origin"))
        host = hosts[0].lower() if len(hosts) == 1 else ""
        place = _PLACE.fullmatch(host)
        if place is None or not self.knows(place[1] or place[2]):
            found = ", ".join(hosts)[:80]
            return f"Host: found {found!r}; accepted: a name or address of this machine"
        if any(origin.lower() not in (f"http://{host}", f"https://{host}") for origin in origins):
            return f"Origin: found {', '.join(origins)[:80]!r}; accepted: pages of the studio"
        tokens = request.query_params.getlist(TOKEN) if self._token else []
        right = self._token.encode()
        fits = all(hmac.compare_digest(token.encode(), right) for token in tokens)
        return "" if fits else f"The token is wrong: {PRINTED}"

    def knows(self, name: str) -> bool:
        """Whether a name means this machine, and can mean no other one tomorrow."""
        if name in ("localhost", "127.0.0.1", "::1", self._host):
            return True
        if is_loopback(self._host):
            return False
        try:
            return bool(ipaddress.ip_address(name))  # it needs no DNS, so nobody can rebind it
        except ValueError:
            return name in (socket.gethostname().lower(), socket.getfqdn().lower())

    def _hands_cookie(self, request: HTTPConnection, session: str) -> bool:
        """Whether a request is answered with a cookie, or with the address without the token."""
        scope, query = request.scope, request.query_params
        if (scope["type"], scope.get("method"), scope["path"]) != ("http", "GET", "/"):
            return False
        return TOKEN in query if self._token else not session and ASKED not in query

    def _cookie_page(self, session: str) -> HTMLResponse:
        """A page that goes on by itself to the address without the token, with a cookie.

        No redirection: a browser that comes from another site keeps SameSite=Strict cookies back.
        """
        home = "/" if self._token else f"/?{ASKED}=set"
        page = HTMLResponse(
            '<!doctype html><meta charset="utf-8"><title>cdpr studio</title>'
            f'<meta http-equiv="refresh" content="0;url={home}"><a href="{home}">cdpr studio</a>\n',
            headers={"referrer-policy": "no-referrer", **NO_STORE},
        )
        if not session:
            value = self._signer.sign(secrets.token_urlsafe(16)).decode()
            page.set_cookie(self._name, value, httponly=True, samesite="strict")
        return page


class Sessions:
    """Workbenches by the names of browser sessions."""

    def __init__(self, make: Callable[[], Workbench]) -> None:
        """With what makes a new workbench."""
        self._make = make
        self._benches: WeakValueDictionary[str, Workbench] = WeakValueDictionary()
        self._latest: dict[str, Workbench] = {}

    async def bench(self, session: str) -> Workbench:
        """The workbench of a session, made in another thread if there is none: it reads files.

        Raises:
            CdprError: It cannot be made.
        """
        bench = self._benches.get(session)
        if bench is None:
            made = await asyncio.to_thread(self._make)
            bench = self._benches.setdefault(session, made)  # of two requests at once, the first
        self._latest.pop(session, None)
        self._latest[session] = bench
        if len(self._latest) > MOST_SESSIONS:
            del self._latest[next(iter(self._latest))]
        return bench
