"""A robot or a mechanism in the browser."""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from cdpr_drake.analyses.frame.follow import NOBODY, Follow
from cdpr_drake.analyses.frame.result import Result, Table
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import ModelWord, refuse_arguments, words
from cdpr_drake.analyses.reporting.written_files import whole_file
from cdpr_drake.analyses.visualization.mechanism_replay import MechanismScene, mechanism_picture
from cdpr_drake.analyses.visualization.meshcat_window import LOCAL, open_meshcat, page_address
from cdpr_drake.analyses.visualization.replay import RobotPicture, robot_picture
from cdpr_drake.errors import OutputFolderError, plain_words, why_not_read
from cdpr_drake.models.mechanism_loader import load_robot_or_mechanism
from cdpr_drake.models.mechanism_schema import Mechanism

PAGES = (".html", ".htm")


@dataclass(frozen=True, eq=False, repr=False)
class View(Result):
    """A robot or a mechanism in the browser, for as long as this object is there.

    Attributes:
        name: Its name.
        picture: The scene in Meshcat.
        place: Address of the page, or the file that was written.
    """

    name: str
    picture: RobotPicture | MechanismScene
    place: str | Path

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {"name": self.name, "page": str(self.place), "problem": self.picture.problem}

    def tables(self) -> list[Table]:
        """No table."""
        return []

    def lines(self) -> list[str]:
        """Where the page is."""
        served = f"{self.name} at {self.place}; Ctrl-C ends"
        return [plain_words(str(self.place) if isinstance(self.place, Path) else served)]

    def show(self, console: Any) -> None:
        """Prints its lines; a page that is served stays until Ctrl-C."""
        super().show(console)
        with suppress(KeyboardInterrupt):
            while not isinstance(self.place, Path):
                time.sleep(1.0)


@verb()
def view(
    robot: ModelWord, *,
    html: Annotated[Path | None, words(Path, "a file that ends in .html", "FILE")] = None,
    host: str | None = None, port: int | None = None,
    follow: Annotated[Follow, Parameter(parse=False)] = NOBODY,
) -> View:  # fmt: skip
    """Shows a robot or a mechanism at its home, held by its cables, in Meshcat.

    If no tensions hold it there, its cables are grey and a line on stderr gives the reason.

    Args:
        robot: Robot or mechanism by name or file.
        html: Write one page, .html, that opens without a server, and end.
        host: Name or address of this machine at which Meshcat listens, * for all; default: only
            this machine can connect.
        port: Port of Meshcat; default: a free one from 7000 to 7099.
        follow: Hears why the cables are grey.

    Raises:
        OutputFolderError: The file is not accepted, or is there and no page of Meshcat.
        MeshcatError: The host is not this machine, or the port is taken.
    """
    if html is not None:
        refuse_arguments(
            "found with html; accepted: without html, as a page needs no server",
            host=host, port=port,
        )  # fmt: skip
    loaded = load_robot_or_mechanism(robot)
    if html is not None:
        _check_page(html)
    meshcat = open_meshcat(host or LOCAL, port) if html is None else open_meshcat()
    draw: Any = mechanism_picture if isinstance(loaded, Mechanism) else robot_picture
    picture = draw(loaded, meshcat)
    if picture.problem:
        follow.say(f"warning: the cables are grey: {picture.problem}")
    if html is None:
        return View(loaded.name, picture, page_address(picture.meshcat, host or LOCAL))
    try:
        with whole_file(html) as part:
            part.write_text(picture.html(), encoding="utf-8")
    except OSError as problem:
        raise OutputFolderError(f"{html}: cannot be written: {why_not_read(problem)}") from problem
    return View(loaded.name, picture, html)


def _check_page(html: Path) -> None:
    """Refuses a file that is no page, or that something else has written."""
    if html.suffix.lower() not in PAGES:  # whose file it would replace
        raise OutputFolderError(f"html: found {html}; accepted: a file that ends in .html")
    if not html.absolute().parent.is_dir():
        raise OutputFolderError(f"{html}: found no folder to write to; accepted: one that exists")
    if html.is_file():
        with html.open("rb") as content:
            is_page = b"MeshCat" in content.read(4096)
    if html.exists() and not (html.is_file() and is_page):
        raise OutputFolderError(f"{html}: found what cdpr view did not write; accepted: a new name")
