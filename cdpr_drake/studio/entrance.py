"""Token and cookie: who opens the printed address gets a cookie, and by it a session.

The token stands in the address once. It is answered with a cookie that only this server can make:
the name of a new session and a code over it (HMAC-SHA-256). Workbenches belong to such sessions, so
that a request without a cookie costs none. A page that goes on by itself sets the cookie, and no
redirection: a browser that comes from another site keeps SameSite=Strict cookies back on those.
"""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets

SHORTEST_TOKEN = 16
"""Characters of a token that somebody chooses."""

_TOKEN = re.compile(rf"[A-Za-z0-9._~-]{{{SHORTEST_TOKEN},200}}")


def token_words() -> str:
    """What is accepted as a token, in words."""
    return f"{SHORTEST_TOKEN} to 200 of the characters A-Z a-z 0-9 . _ ~ -"


def is_token(text: str) -> bool:
    """Whether a text may be a token: it has to stand in an address as it is."""
    return _TOKEN.fullmatch(text) is not None


class Entrance:
    """Knows the token, and makes and reads cookies."""

    def __init__(self, token: str, port: int) -> None:
        """Of a server.

        Args:
            token: What is asked for; empty: nothing, but sessions are told by cookies all the same.
            port: Its port, part of the cookie's name, since cookies know no ports.
        """
        self.needs_token = bool(token)
        self._token = token.encode()
        self._key = hashlib.sha256(self._token or secrets.token_bytes(32)).digest()
        self._name = f"cdpr_studio_{port}"

    def accepts(self, token: str) -> bool:
        """Whether a text is the token; takes as long for a wrong one as for a right one."""
        given = token.encode("utf-8", "surrogatepass")
        return self.needs_token and hmac.compare_digest(given, self._token)

    def new_cookie(self) -> str:
        """The header `Set-Cookie` of a new session."""
        session = secrets.token_urlsafe(16)
        value = f"{session}.{self._code(session)}"
        return f"{self._name}={value}; Path=/; HttpOnly; SameSite=Strict"

    def session(self, cookies: str) -> str:
        """The session of a header `Cookie`; empty: it has none of this server.

        Other servers of this machine may have set cookies of any form: they are passed over.
        """
        for pair in cookies.split(";"):
            name, _, value = pair.strip().partition("=")
            if name == self._name:
                session, _, code = value.partition(".")
                if hmac.compare_digest(
                    code.encode("utf-8", "replace"), self._code(session).encode()
                ):
                    return session
        return ""

    def _code(self, session: str) -> str:
        return hmac.new(self._key, f"{self._name} {session}".encode(), "sha256").hexdigest()
