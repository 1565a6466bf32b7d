"""Results of any command in the page: verdicts, tables, numbers, figures, pages and files.

`show_results(folder)` shows what a folder has of these, `View(data)` numbers alone. Nothing in a
file is run with the rights of the page: words are escaped, figures are images, pages are in a
sandbox.
"""

from __future__ import annotations

import base64
import zipfile
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from html import escape
from io import BytesIO
from pathlib import Path
from typing import Any, TypeVar

from nicegui import run, ui

from cdpr_drake.analyses.logs.log import unit_of
from cdpr_drake.errors import CdprError
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.studio.boards import numbers_file
from cdpr_drake.studio.numbers import fact_rows, number_words, plain_table
from cdpr_drake.studio.panel import show_errors

FIGURES = {".png": "image/png", ".svg": "image/svg+xml"}
"""Types of the figures that a page shows, by their endings."""

MOST_ROWS, MOST_COLUMNS, MOST_FILES = 60, 12, 200
"""Of a table that is shown, whose file has all; and files that are listed."""

REMARKS = {"interrupted": "stopped before its end", "quick": "short form"}
"""What limits results, by keys that are true."""

LARGEST_RESULTS, LARGEST_SHOWN = 64_000_000, 8_000_000
"""Sizes of numbers that are read, and of a figure or page that is shown [bytes]."""

SHADES = {"confirmed": "#1b7f4f", "in part": "#a86200", "not confirmed": "#c01010"}
"""Behind the words of verdicts; other verdicts are grey."""

BADGE = "white-space:nowrap;color:#ffffff;border-radius:3px;padding:0 0.3rem"
WHOLE = "max-width: 100%; background: white"
"""Styles of a verdict, and of a figure that is as wide as the page."""

Leaf = int | float | str | None
Words = tuple[list[str], list[list[str]]]
"""Headings, and rows of words."""

T = TypeVar("T")


class View:
    """What a page shows of results.

    Attributes:
        facts: Single numbers and words by what they are, with units.
        statements: Statements of a source with keys words, printed, found, verdict, why.
        tables: Headings and rows of words, by title.
        folder: Their folder; None: there is none.
        files: Its files here and one folder below, but hidden ones and links out of the folder.
        figures: Those that are shown as images.
        robot: Name of the robot that they are about; empty: they do not say.
        remarks: What limits the results, in words; empty: nothing.
        verdicts: How many statements got each verdict; empty: there are none.
    """

    def __init__(
        self, data: Mapping[str, Any], folder: Path | None = None, most_rows: int = MOST_ROWS
    ) -> None:
        """Of a command's numbers as JSON with so many rows of its tables, and perhaps its files."""
        tables = {key: rows for key, value in data.items() if (rows := _rows(key, value))}
        self.statements = [
            {str(key): _words(value) for key, value in row.items()}
            for row in tables.pop("statements", ())
        ]
        rest = {key: value for key, value in data.items() if key not in tables}
        self.facts = [(name, _words(value)) for name, value in leaves(rest)]
        self.tables = dict(_table(key, rows, most_rows) for key, rows in tables.items())
        self.folder, self.files = folder, {} if folder is None else _files(folder)
        images = [name for name, path in self.files.items() if path.suffix.lower() in FIGURES]
        self.figures = {name: self.files[name] for name in images}
        robot = data.get("robot")
        self.robot = robot if isinstance(robot, str) else ""
        limits = [key for key in data if key in REMARKS and data[key] is True]
        self.remarks = ", ".join(REMARKS[key] for key in limits)
        counts = Counter(statement.get("verdict", "") for statement in self.statements)
        self.verdicts = ", ".join(f"{count} {verdict}" for verdict, count in counts.items())

    def place(self, unfolded: bool = False) -> None:
        """Places it into the current slot, with its numbers unfolded or folded."""
        if self.remarks:
            ui.label(f"These results: {self.remarks}.").classes("studio-soft")
        if self.statements:
            html = _statements(self.statements)
            ui.html(html, sanitize=False).classes("w-full").mark("statements")
        tables = {title: plain_table(*table) for title, table in self.tables.items()}
        if self.facts:
            tables = {"Numbers": fact_rows(self.facts)} | tables
        for title, html in tables.items():
            is_open = unfolded and title == "Numbers"
            with ui.expansion(title, value=is_open).classes("w-full studio-group"):
                content = ui.html(html, sanitize=False).classes("w-full")
                content.mark(f"table-{title.partition(',')[0].replace(' ', '-')}")
        if self.figures:
            self._place_figures()
        for name, path in self.files.items():
            if path.suffix.lower() == ".html":
                _place_page(name, path)
        if self.folder is not None:
            everything = {**self.files, "All as a zip archive": self.folder}
            with ui.expansion(f"Files, {len(self.files)}").classes("w-full studio-group"), ui.row():
                for name, path in everything.items():
                    button = ui.button(name, icon="download", on_click=partial(send_file, path))
                    button.props("dense no-caps outline")

    def _place_figures(self) -> None:
        chosen = ui.select(list(self.figures), value=next(iter(self.figures)), label="figure")
        chosen.classes("w-full").mark("figure")
        place = ui.element("div").classes("w-full")

        def show() -> None:
            with place.clear():
                place_figure(self.figures[str(chosen.value)])

        chosen.on_value_change(show)
        show()


def read_numbers(folder: Path) -> dict[str, Any]:
    """Numbers that a command left in a folder, as JSON; empty: it has not finished there.

    Raises:
        CdprError: They cannot be read.
    """
    path = numbers_file(folder)
    if path is None:
        return {}
    name = f"{folder.name}: {path.name}"
    try:
        if path.stat().st_size > LARGEST_RESULTS:
            raise CdprError(f"{name}: is larger than {LARGEST_RESULTS} bytes")
        data = load_json(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as problem:
        raise CdprError(f"{name}: cannot be read: {problem}") from problem
    if not isinstance(data, dict):
        raise CdprError(f"{name}: found no results of a command")
    return data


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


def _table(key: str, rows: list[Mapping[str, Any]], most: int) -> tuple[str, Words]:
    single = [name for name, value in rows[0].items() if not isinstance(value, list | dict)]
    single, shown = single[:MOST_COLUMNS], rows[:most]
    heads = [_plain(name) + (f" [{unit}]" if (unit := unit_of(name)) else "") for name in single]
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
    """All of a folder as a zip archive, below the folder's name, without links."""
    file = BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(folder.rglob("*")):
            if not path.is_symlink() and path.is_file():
                archive.write(path, Path(folder.name) / path.relative_to(folder))
    return file.getvalue()


async def read_behind(read: Callable[[], T]) -> T | None:
    """What another thread reads, which the current slot shows a sign of meanwhile.

    None if nobody waits for it any more: the server is ending, or the slot shows something else.
    """
    sign = ui.spinner(size="lg")
    try:
        value = await run.io_bound(read)
        return None if sign.is_deleted else value
    finally:
        if not sign.is_deleted:
            sign.delete()


async def show_results(folder: Path) -> None:
    """Places what a command left in a folder into the current slot, or says what is wrong."""
    with show_errors():
        view = await read_behind(lambda: View(read_numbers(folder), folder))
        if view is not None:
            view.place()


def _statements(statements: list[dict[str, str]]) -> str:
    """Verdicts in their colours, in front of what they are about."""
    heads = ("verdict", "the source says", "printed", "found", "remark")
    keys = ("verdict", "words", "printed", "found", "why")
    html = plain_table(heads, [[row.get(key, "") for key in keys] for row in statements])
    for verdict in {row.get("verdict", "") for row in statements}:
        words, shade = escape(verdict), SHADES.get(verdict, "#606060")
        badge = f'<b style="{BADGE};background:{shade}">{words}</b>'
        html = html.replace(f'<th scope="row">{words}</th>', f'<th scope="row">{badge}</th>')
    return html


def place_figure(path: Path, style: str = WHOLE) -> None:
    """Places a figure as an image; nothing in it is run, whatever it is."""
    place = ui.element("div").classes("w-full")

    async def fill() -> None:
        with place:
            place_image(await _shown(path), path, style)

    ui.timer(0.0, fill, once=True)


def place_image(data: bytes, path: Path, style: str = WHOLE) -> None:
    """Places the data of a figure, whose type and words its path says."""
    words = escape(path.stem.replace("_", " "), quote=True)
    source = f"data:{FIGURES[path.suffix.lower()]};base64,{base64.b64encode(data).decode('ascii')}"
    image = ui.html(f'<img src="{source}" alt="{words}" style="{style}">', sanitize=False)
    image.classes("w-full").mark("shown-figure")


def _place_page(name: str, path: Path) -> None:
    """Places a page, which is filled when it is unfolded first.

    The sandbox lets it run, since a replay moves, but as of another origin than the studio.
    """

    async def fill() -> None:
        if fold.value and not place.default_slot.children:
            with place:
                page = (await _shown(path)).decode("utf-8", "replace")
                frame = ui.element("iframe").classes("w-full").style("height:70vh;border:0")
                frame.props["srcdoc"], frame.props["title"] = page, name
                frame.props["sandbox"] = "allow-scripts"
                frame.mark("result-page")

    with ui.expansion(f"Page {name}", on_value_change=fill).classes("w-full studio-group") as fold:
        place = ui.element("div").classes("w-full")
    fold.mark(f"page-{name}")


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


async def send_file(path: Path) -> None:
    """Hands over a file to the browser, or a folder as a zip archive; another thread reads it."""

    def read() -> tuple[bytes, str]:
        if path.is_dir():
            return zipped(path), f"{path.name}.zip"
        return path.read_bytes(), path.name

    content = await run.io_bound(read)
    if content is not None:  # the server is not ending
        ui.download(*content)
