"""`cdpr view`: shows a robot in a browser."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from cdpr_drake.analyses.pictures import robot_picture
from cdpr_drake.cli.options import RobotName
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.models import load_robot

PAGES = (".html", ".htm")


def view(
    robot: RobotName,
    html: Annotated[
        Path | None,
        typer.Option(help="Write one page, .html, that opens without a server, and end."),
    ] = None,
) -> None:
    """Shows a robot at its home pose, held by its cables, in Meshcat."""
    loaded = load_robot(robot)
    if html is not None and html.suffix.lower() not in PAGES:  # whose file it would replace
        raise OutputFolderError(f"--html: found {html}; accepted: a file that ends in .html")
    if html is not None and not html.absolute().parent.is_dir():
        raise OutputFolderError(f"{html}: found no folder to write to; accepted: one that exists")
    picture = robot_picture(loaded)
    if html is not None:
        try:
            html.write_text(picture.html(), encoding="utf-8")
        except OSError as problem:
            raise OutputFolderError(f"{html}: cannot be written: {problem.strerror}") from problem
        print(html)
        return
    print(f"{loaded.name} at {picture.meshcat.web_url()}; Ctrl-C ends")
    try:
        while True:
            time.sleep(1.0)
    except KeyboardInterrupt:
        print()
