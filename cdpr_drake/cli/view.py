"""`cdpr view`: shows a robot or a mechanism in a browser."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Annotated

import typer

from cdpr_drake.analyses.frame.files import write_files
from cdpr_drake.analyses.visualization.mechanism_picture import (
    MechanismPicture,
    mechanism_picture,
)
from cdpr_drake.analyses.visualization.meshcat_window import LOCAL, open_meshcat, page_address
from cdpr_drake.analyses.visualization.replay import RobotPicture, robot_picture
from cdpr_drake.cli.options import LISTENING, Host, Port, RobotName, named_options
from cdpr_drake.cli.terminal import message_console, print_words, working
from cdpr_drake.errors import CdprError, OutputFolderError, plain_words
from cdpr_drake.models.mechanism_loader import load_robot_or_mechanism
from cdpr_drake.models.mechanism_schema import Mechanism

PAGES = (".html", ".htm")


def view(
    robot: RobotName,
    html: Annotated[
        Path | None,
        typer.Option(help="Write one page, .html, that opens without a server, and end."),
    ] = None,
    host: Host = None,
    port: Port = None,
) -> None:
    """Shows a robot or a mechanism at its home, held by its cables, in Meshcat.

    If no tensions hold it there, its cables are grey and stderr gives the reason.
    """
    if html is not None and (host is not None or port is not None):
        raise CdprError("--host, --port: accepted without --html only, which needs no server")
    loaded = load_robot_or_mechanism(robot)
    if html is not None and html.suffix.lower() not in PAGES:  # whose file it would replace
        raise OutputFolderError(f"--html: found {html}; accepted: a file that ends in .html")
    if html is not None and not html.absolute().parent.is_dir():
        raise OutputFolderError(f"{html}: found no folder to write to; accepted: one that exists")
    if html is not None and html.exists() and not _is_page(html):
        raise OutputFolderError(f"{html}: found what cdpr view did not write; accepted: a new name")
    with named_options(LISTENING):
        meshcat = open_meshcat(host or LOCAL, port) if html is None else open_meshcat()
    with working(message_console(), f"Drawing {loaded.name}"):
        if isinstance(loaded, Mechanism):
            picture: RobotPicture | MechanismPicture = mechanism_picture(loaded, meshcat)
        else:
            picture = robot_picture(loaded, meshcat)
    if picture.problem:
        print(f"warning: the cables are grey: {picture.problem}", file=sys.stderr)
    if html is not None:
        write_files(html.parent, {html.name: picture.html()}, overwrite=True)
        print_words(html)
        return
    where = page_address(picture.meshcat, host or LOCAL)
    print(plain_words(f"{loaded.name} at {where}; Ctrl-C ends"), flush=True)
    try:
        while True:
            time.sleep(1.0)
    except KeyboardInterrupt:
        print()


def _is_page(file: Path) -> bool:
    """Whether a file is a page of Meshcat, which may be replaced."""
    if not file.is_file():
        return False
    with file.open("rb") as content:
        return b"MeshCat" in content.read(4096)
