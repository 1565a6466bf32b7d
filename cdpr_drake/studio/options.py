"""How the studio is started."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from cdpr_drake.studio.commands import CommandForm

LOOPBACK = "127.0.0.1"
USUAL_PORT = 8642


@dataclass(frozen=True, kw_only=True)
class StudioOptions:
    """How the studio is started.

    Attributes:
        opened: Robot or scenario by name, or the path of a file; None: the usual robot.
        folder: Working folder: no file outside of it is read or written by the page.
        host: Address of this machine to listen at, `*` for all.
        port: Port; 0: a free one.
        token: Who opens the page has to know it; None: a random one, that is printed; empty: nobody
            is asked, which is accepted where this machine alone reaches the page.
        ready: Called with the page's address, with the token, when the server starts.
        commands: Forms of the commands that the page offers, by name.
    """

    opened: str | None = None
    folder: Path = field(default_factory=Path.cwd)
    host: str = LOOPBACK
    port: int = USUAL_PORT
    token: str | None = None
    ready: Callable[[str], None] | None = None
    commands: Mapping[str, CommandForm] = field(default_factory=dict)
