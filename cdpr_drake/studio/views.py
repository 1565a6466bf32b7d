"""A folder with results in the page: verdicts, tables, numbers, figures, pages and files.

Any command's folder is shown so, whatever it has of these. Nothing in a file is run with the
rights of the page: words are escaped, figures are images, pages are in a sandbox.
"""

from __future__ import annotations

import base64
import zipfile
from collections.abc import Awaitable, Callable, Iterator, Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

from nicegui import run, ui

from cdpr_drake.analyses.logs.log import unit_of
from cdpr_drake.errors import CdprError, OutputFolderError
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.studio.panels.numbers import fact_rows, number_words, plain_table
from cdpr_drake.studio.panels.panel import show_errors

RESULTS = ("results.json", "summary.json")
"""Files that have a command's numbers; the first that is there."""

FIGURES = {".png": "image/png", ".svg": "image/svg+xml"}
"""Types of the figures that a page shows, by their endings."""

STORED = (".png", ".npz", ".mp4", ".zip", ".jpg")
"""Endings of files that are small already."""

MOST_ROWS, MOST_COLUMNS = 60, 12
"""Of a table that is shown; the file has all."""

MOST_FILES = 200
"""Files that are listed."""

LARGEST_RESULTS, LARGEST_SHOWN = 64_000_000, 8_000_000
"""Sizes of numbers that are read, and of a figure or page that is shown [bytes]."""

SHADES = {"confirmed": "#1b7f4f", "in part": "#a86200", "not confirmed": "#c01010"}
"""Behind the words of verdicts; other verdicts are grey."""

BADGE = "white-space:nowrap;color:#ffffff;border-radius:3px;padding:0 0.3rem"

Leaf = int | float | str | None


@dataclass(frozen=True)
class ResultFolder:
    """What a command left in a folder.

    Attributes:
        folder: The folder.
        facts: Single numbers and words by what they are, with units.
        statements: Statements of a source with keys words, printed, found, verdict, why.
        tables: Tables by title: headings, and rows of words.
        files: All files here and one folder below, but hidden ones and links out of the folder.
    """

    folder: Path
    facts: list[tuple[str, str]]
    statements: list[dict[str, str]]
    tables: dict[str, tuple[list[str], list[list[str]]]]
    files: dict[str, Path]

    @property
    def figures(self) -> dict[str, Path]:
        """Files that are shown as images."""
        return {k: path for k, path in self.files.items() if path.suffix.lower() in FIGURES}

    @property
    def pages(self) -> dict[str, Path]:
        """Files that are pages of their own, such as a replay."""
        return {k: path for k, path in self.files.items() if path.suffix.lower() == ".html"}

    def remarks(self) -> str:
        """What limits the results, in words; empty: nothing."""
        words = {"interrupted": "stopped before its end", "quick": "short form"}
        return ", ".join(
            words[name] for name, value in self.facts if name in words and value == "yes"
        )

    def verdicts(self) -> str:
        """How many statements got each verdict; empty: there are none."""
        verdicts = [statement.get("verdict", "") for statement in self.statements]
        return ", ".join(f"{verdicts.count(one)} {one}" for one in dict.fromkeys(verdicts))


def read_results(folder: Path) -> ResultFolder:
    """Reads what a command left in a folder.

    Raises:
        CdprError: Its numbers cannot be read.
    """
    path = next((folder / name for name in RESULTS if (folder / name).is_file()), None)
    data: Any = {}
    if path is not None:
        name = f"{folder.name}: {path.name}"
        if path.stat().st_size > LARGEST_RESULTS:
            raise CdprError(f"{name}: is larger than {LARGEST_RESULTS} bytes")
        try:
            data = load_json(path.read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError) as problem:
            raise CdprError(f"{name}: cannot be read: {problem}") from problem
        if not isinstance(data, dict):
            raise CdprError(f"{name}: found no results of a command")
    tables = {key: rows for key, value in data.items() if (rows := _rows(key, value))}
    statements = [
        {str(key): _words(value) for key, value in row.items()}
        for row in tables.pop("statements", ())
    ]
    rest = {key: value for key, value in data.items() if key not in tables}
    return ResultFolder(
        folder, [(name, _words(value)) for name, value in leaves(rest)], statements,
        dict(_table(key, rows) for key, rows in tables.items()), _files(folder),
    )  # fmt: skip


def leaves(
    value: Mapping[str, Any], before: str = "", unit: str = ""
) -> Iterator[tuple[str, Leaf]]:
    """Numbers and words of a command's results, each by its name with the unit of its key."""
    for key, inner in value.items():
        mine = unit_of(key) or unit
        words = f"{before} {_plain(key)}".strip()
        if isinstance(inner, Mapping):
            yield from leaves(inner, words, mine)
        elif isinstance(inner, bool | str) or inner is None:
            yield words, None if inner in (None, "") else _words(inner)
        elif isinstance(inner, int | float):
            yield f"{words} [{mine}]" if mine else words, inner
        elif inner and not any(isinstance(one, Mapping | list) for one in inner[:MOST_COLUMNS]):
            yield f"{words} [{mine}]" if mine else words, ", ".join(map(_words, inner))


def _plain(key: str) -> str:
    """A key without its unit, in words."""
    return (key.rpartition("_")[0] if unit_of(key) else key).replace("_", " ")


def _rows(key: str, value: Any) -> list[Mapping[str, Any]]:
    """The rows of a table: a list of things, or things of the same kind by their names."""
    if isinstance(value, list):
        return value if all(isinstance(row, dict) for row in value) else []
    if not isinstance(value, dict) or len(value) < 2:
        return []
    first, *others = value.values()
    alike = isinstance(first, dict) and all(
        isinstance(row, dict) and row.keys() == first.keys() for row in others
    )
    return [{key: name, **row} for name, row in value.items()] if alike else []


def _table(
    key: str, rows: list[Mapping[str, Any]]
) -> tuple[str, tuple[list[str], list[list[str]]]]:
    shown, columns = rows[:MOST_ROWS], list(rows[0])
    single = [name for name in columns if not isinstance(rows[0][name], list | dict)][:MOST_COLUMNS]
    heads = [
        f"{_plain(name)} [{unit}]" if (unit := unit_of(name)) else _plain(name) for name in single
    ]
    count = f"{len(rows)}" if len(shown) == len(rows) else f"the first {len(shown)} of {len(rows)}"
    cells = [[_words(row.get(name)) for name in single] for row in shown]
    return f"{_plain(key)}, {count} rows", (heads, cells)


def _words(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float) or value is None:
        return number_words(value)
    return str(value)[:400]


def _files(folder: Path) -> dict[str, Path]:
    root = folder.resolve()
    paths = [
        path for pattern in ("*", "*/*") for path in sorted(folder.glob(pattern))
        if path.is_file() and path.resolve().is_relative_to(root)
        and not any(part.startswith(".") for part in path.relative_to(folder).parts)
    ]  # fmt: skip
    return {path.relative_to(folder).as_posix(): path for path in paths[:MOST_FILES]}


def zipped(folder: Path) -> bytes:
    """All of a folder as a zip archive, below the folder's name, without links.

    Raises:
        OutputFolderError: The folder is not there, or cannot be read.
    """
    if not folder.is_dir():
        raise OutputFolderError(f"{folder.name}: is not there any more")
    try:
        with TemporaryFile() as file:
            with zipfile.ZipFile(file, "w") as archive:
                for path in sorted(folder.rglob("*")):
                    if not path.is_symlink() and path.is_file():
                        small = path.suffix.lower() in STORED
                        kind = zipfile.ZIP_STORED if small else zipfile.ZIP_DEFLATED
                        archive.write(path, Path(folder.name) / path.relative_to(folder), kind)
            file.seek(0)
            return file.read()
    except OSError as problem:
        words = problem.strerror or problem
        raise OutputFolderError(f"{folder.name}: cannot be packed: {words}") from problem


async def show_results(folder: Path) -> ResultFolder | None:
    """Places what a command left in a folder into the current slot.

    It is read in another thread. What cannot be read is a message in the page.

    Args:
        folder: A results folder, of any command.

    Returns:
        What was read; None: it cannot be read, or the server is ending.
    """
    with show_errors():
        results = await run.io_bound(read_results, folder)
        if results is not None:
            _place(results)
        return results
    return None


def _place(results: ResultFolder) -> None:
    if results.remarks():
        words = f"These results: {results.remarks()}."
        ui.label(words).classes("studio-soft").mark("results-remarks")
    if results.statements:
        html = _statements(results.statements)
        ui.html(html, sanitize=False).classes("w-full").mark("statements")
    for title, (heads, rows) in results.tables.items():
        with ui.expansion(title).classes("w-full studio-group").mark("results-table"):
            ui.html(plain_table(heads, rows), sanitize=False).classes("w-full")
    if results.facts:
        with ui.expansion("Numbers").classes("w-full studio-group"):
            ui.html(fact_rows(results.facts), sanitize=False).classes("w-full").mark("numbers")
    if results.figures:
        figures = results.figures
        chosen = ui.select(list(figures), value=next(iter(figures)), label="figure")
        chosen.props("dense outlined").classes("w-full").mark("figure")
        place = ui.element("div").classes("w-full")

        def show() -> None:
            place.clear()
            with place:
                place_figure(figures[str(chosen.value)], "max-width: 100%; background: white")

        chosen.on_value_change(show)
        show()
    for name, path in results.pages.items():
        with ui.expansion(f"Page {name}").classes("w-full studio-group") as fold:
            _fill_once(fold, path)
    with ui.expansion(f"Files, {len(results.files)}").classes("w-full studio-group"), ui.row():
        for name, path in results.files.items():
            download_button(name, path)
        download_button("All as a zip archive", results.folder)


def _statements(statements: list[dict[str, str]]) -> str:
    """Verdicts in their colours, in front of what they are about."""
    heads = ("verdict", "the source says", "printed", "found", "remark")
    rows = [
        [row.get(key, "") for key in ("verdict", "words", "printed", "found", "why")]
        for row in statements
    ]
    html = plain_table(heads, rows)
    for verdict in {row[0] for row in rows}:
        cell, words = '<th scope="row">', escape(verdict)
        shade = SHADES.get(verdict, "#606060")
        badge = f'<b style="{BADGE};background:{shade}">{words}</b>'
        html = html.replace(f"{cell}{words}</th>", f"{cell}{badge}</th>")
    return html


def place_figure(path: Path, style: str) -> None:
    """Places a figure as an image; nothing in it is run, whatever it is."""
    words = escape(path.stem.replace("_", " "), quote=True)
    kind = FIGURES[path.suffix.lower()]

    async def fill() -> None:
        data = base64.b64encode(await _shown(path)).decode("ascii")
        if data:
            image = f'<img src="data:{kind};base64,{data}" alt="{words}" style="{style}">'
            ui.html(image, sanitize=False).mark("shown-figure")

    _soon(fill)


def _fill_once(fold: ui.expansion, path: Path) -> None:
    """Fills an expansion with a page when it is unfolded first.

    The sandbox lets it run, since a replay moves, but as of another origin than the studio.
    """

    async def fill() -> None:
        if fold.value and not place.default_slot.children:
            with place, show_errors():
                page = (await _shown(path)).decode("utf-8", "replace")
                frame = (
                    ui.element("iframe")
                    .mark("result-page")
                    .classes("w-full")
                    .style("height:70vh;border:0")
                )
                frame.props["srcdoc"], frame.props["title"] = page, path.name
                frame.props["sandbox"] = "allow-scripts"

    place = ui.element("div").classes("w-full")
    fold.on_value_change(fill)


def _soon(fill: Callable[[], Awaitable[None]]) -> None:
    """Fills a new place in the current slot as soon as the page is sent."""
    place = ui.element("div").classes("w-full")

    async def begin() -> None:
        with place, show_errors():
            await fill()

    ui.timer(0.0, begin, once=True)


async def _shown(path: Path) -> bytes:
    """A file, read in another thread; empty: the server is ending.

    Raises:
        CdprError: It is too large for a page.
    """

    def read() -> bytes:
        if path.stat().st_size > LARGEST_SHOWN:
            raise CdprError(f"{path.name}: too large to be shown; it is in {path.parent.name}")
        return path.read_bytes()

    return await run.io_bound(read) or b""


def download_button(words: str, path: Path) -> ui.button:
    """Places a button that hands over a file, or a folder as a zip archive."""

    async def send() -> None:
        with show_errors():
            is_folder = path.is_dir()
            data = await run.io_bound(zipped if is_folder else Path.read_bytes, path)
            if data is not None:
                ui.download(data, f"{path.name}.zip" if is_folder else path.name)

    button = ui.button(words, icon="download", on_click=send)
    return button.props("dense no-caps outline")
