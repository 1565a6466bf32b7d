"""What the answers of all verbs can do: show themselves, give their numbers, draw a figure."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from io import StringIO
from typing import TYPE_CHECKING, Any

from cdpr_drake.errors import CdprError, accepted_names

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH = 120
"""Of a result in a program without a terminal [characters]."""

STOPPED = 130
"""Exit code of a command that was stopped."""


@dataclass(frozen=True)
class Table:
    """A table of words.

    Attributes:
        title: Its title, with units of what it holds.
        headings: Of the columns; none: a list of labels and words.
        rows: A word for each column.
    """

    title: str
    headings: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()


class Result(ABC):
    """An answer. It shows itself alike on a terminal, in a notebook and at Python's prompt."""

    @abstractmethod
    def as_dict(self) -> Any:
        """All numbers, for JSON; keys end in units. Of a list of things a list."""

    def tables(self) -> Sequence[Table]:
        """What it shows of itself."""
        return ()

    def lines(self) -> Sequence[str]:
        """Sentences below the tables."""
        return ()

    def notes(self) -> Sequence[str]:
        """Sentences on what was missing or stopped; a command says them on stderr."""
        return ()

    def figures(self) -> Mapping[str, Callable[[], Figure]]:
        """What draws it, by the name of each figure; the first one is the most telling."""
        return {}

    def plot(self, name: str | None = None) -> Figure:
        """A figure of it.

        Args:
            name: One of `figures`; None: the first.

        Raises:
            CdprError: There is no such figure.
        """
        figures = self.figures()
        if not figures:
            raise CdprError("plot: this result has no figure")
        if name is not None and name not in figures:
            raise CdprError(f"plot: found {name!r}; {accepted_names(name, figures)}")
        return figures[name or next(iter(figures))]()

    @property
    def exit_code(self) -> int:
        """Of a command that ends with it."""
        return 0

    def __repr__(self) -> str:
        from rich.console import Console

        console = Console(file=StringIO(), width=WIDTH, markup=False, highlight=False)
        self.show(console)
        return console.file.getvalue().rstrip()  # type: ignore[attr-defined]

    def show(self, console: Any) -> None:
        """Prints its tables and sentences on a console of rich."""
        from rich.box import SIMPLE_HEAD
        from rich.table import Table as Drawn

        for table in self.tables():
            drawn = Drawn(box=SIMPLE_HEAD, pad_edge=False, show_header=bool(table.headings))
            for k in range(max(map(len, (table.headings, *table.rows)), default=0)):
                right = bool(table.headings) and all(_is_number(row[k]) for row in table.rows)
                heading = table.headings[k] if table.headings else ""
                drawn.add_column(heading, justify="right" if right else "left")
            for row in table.rows:
                drawn.add_row(*row)
            console.print(table.title, soft_wrap=True)
            console.print(drawn)
        for line in self.lines():
            console.print(line, soft_wrap=True)

    def _repr_html_(self) -> str:
        parts = []
        for table in self.tables():
            head = "".join(f"<th>{escape(word)}</th>" for word in table.headings)
            rows = "".join(
                f"<tr>{''.join(f'<td>{escape(word)}</td>' for word in row)}</tr>"
                for row in table.rows
            )
            caption = f"<caption>{escape(table.title)}</caption>"
            parts.append(f"<table>{caption}<tr>{head}</tr>{rows}</table>")
        return "".join([*parts, *(f"<p>{escape(line)}</p>" for line in self.lines())])


@dataclass(frozen=True, repr=False)
class Listing(Result):
    """A list of things.

    Attributes:
        entries: Each thing, for JSON; keys end in units.
        table: The list; None: it is not shown.
        words: Sentences below it.
        code: Exit code of a command.
    """

    entries: Sequence[dict[str, Any]]
    table: Table | None = None
    words: Sequence[str] = ()
    code: int = 0

    def as_dict(self) -> list[dict[str, Any]]:
        """A list, an entry each."""
        return list(self.entries)

    def tables(self) -> list[Table]:
        """The list."""
        return [] if self.table is None else [self.table]

    def lines(self) -> Sequence[str]:
        """The sentences."""
        return self.words

    @property
    def exit_code(self) -> int:
        """Of a command."""
        return self.code


def _is_number(word: str) -> bool:
    return word in ("", "-") or word.lstrip("+-").replace(".", "", 1)[:1].isdigit()
