"""`cdpr notebooks`: copies the notebooks that come with the package to a folder of the user's."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.box import SIMPLE_HEAD
from rich.table import Table

from cdpr_drake.cli.options import AsJson
from cdpr_drake.cli.robot_folder import check_no_file
from cdpr_drake.cli.terminal import print_json, print_words, wide_console
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.schema.json_text import load_json

FOLDER = Path(__file__).parent.parent / "notebooks"
"""Where they are in the package; in its sources, a link."""


def notebooks(
    folder: Annotated[
        Path | None, typer.Argument(help="Folder to copy them to; without it they are listed.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Copies the notebooks to a folder, or lists them; never overwrites a file."""
    paths = [*sorted(FOLDER.glob("*.ipynb")), *sorted(FOLDER.glob("*.py"))]
    contents = {path.name: path.read_bytes() for path in paths}
    if folder is not None:
        copied = copy_new(contents, folder)
    if as_json:
        found = contents.items()
        print_json([{"name": name, "title": title_of(name, words)} for name, words in found])
    elif folder is None:
        table = Table(title="Notebooks", box=SIMPLE_HEAD, padding=(0, 1), pad_edge=False)
        table.add_column("name", no_wrap=True)
        table.add_column("title")
        for name, words in contents.items():
            table.add_row(name, title_of(name, words))
        wide_console().print(table)
    else:
        there = len(contents) - len(copied)
        print_words(f"{folder}: {len(copied)} copied, {there} were there; begin with tour.ipynb")


def title_of(name: str, content: bytes) -> str:
    """The heading that a notebook begins with, or the first line of a program."""
    if name.endswith(".py"):
        return content.decode().splitlines()[0].strip('"')
    first: dict[str, Any] = load_json(content)["cells"][0]
    return "".join(first["source"]).splitlines()[0].lstrip("# ")


def copy_new(contents: dict[str, bytes], folder: Path) -> list[str]:
    """Writes files that are not there yet; returns their names.

    Args:
        contents: By name.
        folder: Where to; made where it is not there.

    Raises:
        OutputFolderError: A file of that name is there with another content, and nothing was
            written; or one cannot be written, and none is left.
    """
    check_no_file(folder)
    found = [name for name in contents if (folder / name).exists() or (folder / name).is_symlink()]
    other = [name for name in found if not _holds(folder / name, contents[name])]
    if other:
        raise OutputFolderError(
            f"{folder}: found {', '.join(other)} with other content, which is never "
            "overwritten; accepted: another folder"
        )
    written: list[str] = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in contents:
            if name not in found:
                with (folder / name).open("xb") as file:
                    written.append(name)
                    file.write(contents[name])
    except OSError as problem:
        for name in written:
            (folder / name).unlink(missing_ok=True)
        raise OutputFolderError(f"{folder}: cannot be written: {problem.strerror}") from problem
    return written


def _holds(path: Path, content: bytes) -> bool:
    """Whether a file has this content."""
    try:
        return path.is_file() and path.read_bytes() == content
    except OSError:
        return False
