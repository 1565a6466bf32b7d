"""`cdpr studio`: robots, poses, workspaces, runs and studies in a local web page."""

from __future__ import annotations

import atexit
import os
import sys
import webbrowser
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from tempfile import NamedTemporaryFile
from threading import Thread
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from cdpr_drake.analyses.frame.words import OpenedWord, whole
from cdpr_drake.cli.call import parsed, shown_arguments
from cdpr_drake.cli.commands import COMMANDS
from cdpr_drake.errors import CdprError, install_words

if TYPE_CHECKING:
    from cdpr_drake.studio.verb_form import Verb

NOT_OFFERED = ("studio", "serve", "view")
"""Commands that the page does not start: itself, and those that wait for others."""

TOKEN_VARIABLE = "CDPR_STUDIO_TOKEN"
"""Of the environment: a token that is the same at each start."""


def studio(
    opened: OpenedWord = None, /, *, folder: Path = Path(), host: str = "127.0.0.1",
    port: Annotated[int, whole(0, 65535, "PORT")] = 8642,
    no_token: Annotated[bool, Parameter(name="--no-token", negative=())] = False,
    browser: bool = True,
) -> None:  # fmt: skip
    """Opens the studio: a local page to edit a robot, see what it can do, and run it.

    The printed address contains a token, new at each start, that every request needs. The
    environment variable CDPR_STUDIO_TOKEN sets the token, which is then not printed.

    Needs the extra `studio`: in its sources, pip install '.[studio]'.

    Args:
        opened: Robot or scenario by name, or the path of a file, also of another tool.
        folder: Working folder; the page reads and writes no files elsewhere.
        host: Name or address of this machine to listen at, * for all; the connection is not
            encrypted.
        port: Port, 0 for a free one.
        no_token: Disable token authentication: every program and user of this machine may then open
            the page, read and write in the working folder, and start runs. Not with --host of other
            machines.
        browser: Open the page in a browser.
    """
    token = _wanted_token(no_token)
    if find_spec("nicegui") is None:
        raise CdprError(f"cdpr studio needs NiceGUI; {install_words('studio')}")
    print("cdpr studio: starting, Drake and the page are loaded", file=sys.stderr, flush=True)
    from cdpr_drake.studio.server import serve

    ready = _open_browser if browser else lambda address: None
    serve(opened, folder=folder, host=host, port=port, token=token, ready=ready, commands=verbs)


def verbs() -> dict[str, Verb]:
    """The verbs that the page offers, by the words of their commands; imports none of them."""
    from cdpr_drake.studio.verb_form import Verb

    lines = {name: command.line for name, command in COMMANDS.items()}
    lines |= {
        f"{name} --{form}": line
        for name, command in COMMANDS.items() for form, (_, line) in command.forms.items()
    }  # fmt: skip
    return {
        words: Verb(words, line, partial(shown_arguments, *words.split()), parsed)
        for words, line in lines.items() if words not in NOT_OFFERED
    }  # fmt: skip


def _wanted_token(no_token: bool) -> str | None:
    """The token that is set; None: a random one, empty: none.

    Raises:
        CdprError: It is empty, or set and not wanted.
    """
    token = os.environ.pop(TOKEN_VARIABLE, None)  # commands that the studio starts need it not
    if no_token and token is not None:
        raise CdprError(f"--no-token: found it with {TOKEN_VARIABLE} set; accepted: one of them")
    if token == "":
        raise CdprError(f"{TOKEN_VARIABLE}: found an empty text; accepted: a token, or --no-token")
    return "" if no_token else token


def _open_browser(address: str) -> None:
    """Opens the page in a thread of its own, as a browser of the terminal does not return.

    The browser is given a file that only this user may read: all users see the words by which a
    program was started, and the address has the token.
    """
    with NamedTemporaryFile(
        "w", prefix="cdpr-studio-", suffix=".html", delete=False, encoding="utf-8"
    ) as file:
        file.write(
            '<!doctype html><meta charset="utf-8"><meta name="referrer" content="no-referrer">'
            f'<title>cdpr studio</title><meta http-equiv="refresh" content="0;url={address}">'
            f'<a href="{address}">cdpr studio</a>\n'
        )
    path = Path(file.name)
    atexit.register(path.unlink, missing_ok=True)
    Thread(target=webbrowser.open, args=[path.as_uri()], daemon=True).start()
