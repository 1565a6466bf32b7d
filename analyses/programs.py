"""Notebooks and examples that come with the package: listed or copied."""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import cdpr_drake
from cdpr_drake.analyses.frame.files import copy_new
from cdpr_drake.analyses.frame.result import Listing, Table
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import OutFolder, one_of
from cdpr_drake.errors import CdprError
from cdpr_drake.schema.json_text import load_json

NOTEBOOKS = Path(cdpr_drake.__file__).parent / "notebooks"
"""Where they are in the package; in its sources, a link."""

EXAMPLES = NOTEBOOKS / "examples"

ALL = "all"
"""In the place of an example: each."""


def _listed(titles: Mapping[str, str], kind: str, copied: Sequence[str] | None = None) -> Listing:
    """Programs by their titles; a table only if none was copied."""
    entries = [{"name": name, "title": title} for name, title in titles.items()]
    if copied is not None:
        return Listing(entries, words=copied)
    return Listing(entries, Table(kind, ("name", "title"), list(titles.items())))


@verb()
def copy_notebooks(folder: Path | None = None, /) -> Listing:
    """Copies the notebooks to a folder, or lists them; never overwrites a file.

    Args:
        folder: Folder to copy them to; without it they are listed.

    Raises:
        OutputFolderError: A file of such a name has another content, or the folder is none.
    """
    paths = [*sorted(NOTEBOOKS.glob("*.ipynb")), *sorted(NOTEBOOKS.glob("*.py"))]
    contents = {path.name: path.read_bytes() for path in paths}
    titles = {name: _notebook_title(name, words) for name, words in contents.items()}
    if folder is None:
        return _listed(titles, "Notebooks")
    count = len(copy_new(contents, folder))
    words = f"{folder}: {count} copied, {len(contents) - count} were there"
    return _listed(titles, "Notebooks", [f"{words}; begin with tour.ipynb"])


def _notebook_title(name: str, content: bytes) -> str:
    """The heading that a notebook begins with, or the first line of a program."""
    if name.endswith(".py"):
        return content.decode().splitlines()[0].strip('"')
    first: dict[str, Any] = load_json(content)["cells"][0]
    return "".join(first["source"]).splitlines()[0].lstrip("# ")


def example_names() -> list[str]:
    """Names of the examples, without the ending."""
    return sorted(path.stem for path in EXAMPLES.glob("*.py"))


@verb()
def copy_examples(
    name: Annotated[str | None, one_of([*example_names(), ALL])] = None, /, *,
    out: OutFolder = None,
) -> Listing:  # fmt: skip
    """Lists short programs to start from, or copies one; never overwrites a file.

    Args:
        name: Example to copy, or all; without it, they are listed.
        out: Folder to copy to; default: the working folder.

    Raises:
        CdprError: A folder without an example.
        OutputFolderError: A file of such a name has another content, or the folder is none.
    """
    if out is not None and name is None:
        raise CdprError(f"out: found {out} without an example; accepted: with a name, or all")
    names = [name] if name is not None and name != ALL else example_names()
    titles = {each: _example_title(each) for each in names}
    if name is None:
        return _listed(titles, "Examples")
    folder = out or Path()
    contents = {f"{each}.py": (EXAMPLES / f"{each}.py").read_bytes() for each in names}
    copy_new(contents, folder)
    return _listed(titles, "Examples", [str(folder / file) for file in contents])


def _example_title(name: str) -> str:
    """First line of an example's docstring."""
    words = ast.get_docstring(ast.parse((EXAMPLES / f"{name}.py").read_text(encoding="utf-8")))
    return (words or "").splitlines()[0]
