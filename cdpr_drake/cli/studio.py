"""`cdpr studio`: robots, poses, workspaces, runs and studies in a local web page."""

from __future__ import annotations

import sys
import webbrowser
from importlib.util import find_spec
from pathlib import Path
from threading import Thread
from typing import Annotated

import typer

from cdpr_drake.cli.completion import studio_words
from cdpr_drake.errors import CdprError


def studio(
    opened: Annotated[
        str | None,
        typer.Argument(
            metavar="[ROBOT|SCENARIO|FILE]",
            help="Robot or scenario by name, or the path of a file, also of another tool.",
            autocompletion=studio_words,
        ),
    ] = None,
    folder: Annotated[
        Path, typer.Option(help="Working folder; the page reads and writes no files elsewhere.")
    ] = Path(),
    host: Annotated[
        str,
        typer.Option(
            help="Name or address of this machine to listen at, * for all; where other machines "
            "reach it, the address that is printed has a token, without which nobody gets in."
        ),
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="Port, 0 for a free one.", min=0, max=65535)] = 8642,
    browser: Annotated[bool, typer.Option(help="Open the page in a browser.")] = True,
) -> None:
    """Opens the studio: a local page to edit a robot, see what it can do, and run it.

    Needs the extra `studio`: pip install 'cdpr_drake[studio]'.
    """
    if find_spec("nicegui") is None:
        raise CdprError("cdpr studio needs NiceGUI; pip install 'cdpr_drake[studio]'")
    print("cdpr studio: starting, Drake and the page are loaded", file=sys.stderr, flush=True)
    from cdpr_drake.cli.command_forms import command_forms
    from cdpr_drake.studio import StudioOptions, serve

    serve(
        StudioOptions(
            opened=opened,
            folder=folder,
            host=host,
            port=port,
            ready=_open_browser if browser else None,
            commands=command_forms(),
        )
    )


def _open_browser(address: str) -> None:
    """Opens the page in a thread of its own, as a browser of the terminal does not return."""
    Thread(target=webbrowser.open, args=[address], daemon=True).start()
