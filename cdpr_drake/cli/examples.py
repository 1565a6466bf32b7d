"""`cdpr examples`: short programs that come with the package, listed or copied."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Annotated

import typer
from rich.box import SIMPLE_HEAD
from rich.table import Table

from cdpr_drake.cli.completion import words_among
from cdpr_drake.cli.notebooks import FOLDER, copy_new
from cdpr_drake.cli.options import AsJson
from cdpr_drake.cli.terminal import print_json, print_words, wide_console
from cdpr_drake.errors import CdprError
from cdpr_drake.schema.typed_yaml import closest

EXAMPLES = FOLDER / "examples"
"""Where they are in the package."""


def example_names() -> list[str]:
    """Names of the examples, without the ending."""
    return sorted(path.stem for path in EXAMPLES.glob("*.py"))


def examples(
    name: Annotated[
        str | None,
        typer.Argument(
            help="Example to copy, or all; without it, they are listed.",
            autocompletion=words_among((*example_names(), "all")),
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder to copy to; default: the working folder.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Lists short programs to start from, or copies one; never overwrites a file."""
    if out is not None and name is None:
        raise CdprError(f"--out: found {out} without an example; accepted: with a name, or all")
    folder = Path() if out is None else out
    titles = {each: _title(each) for each in example_names()}
    if name is not None:
        if name not in (*titles, "all"):
            raise CdprError(f"example {name!r} is unknown; {closest(name, [*titles, 'all'])}")
        chosen = list(titles) if name == "all" else [name]
        contents = {f"{each}.py": (EXAMPLES / f"{each}.py").read_bytes() for each in chosen}
        copy_new(contents, folder)
        titles = {each: titles[each] for each in chosen}
    if as_json:
        print_json([{"name": each, "title": words} for each, words in titles.items()])
    elif name is not None:
        for each in titles:
            print_words(folder / f"{each}.py")
    else:
        table = Table(title="Examples", box=SIMPLE_HEAD, padding=(0, 1), pad_edge=False)
        table.add_column("name", no_wrap=True)
        table.add_column("what it shows")
        for each, words in titles.items():
            table.add_row(each, words)
        wide_console().print(table)


def _title(name: str) -> str:
    """First line of an example's docstring."""
    words = ast.get_docstring(ast.parse((EXAMPLES / f"{name}.py").read_text(encoding="utf-8")))
    return (words or "").splitlines()[0]
