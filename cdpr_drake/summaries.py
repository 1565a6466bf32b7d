"""How results show themselves: a few lines in a terminal, a small table in a notebook."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from html import escape
from typing import TypeVar

T = TypeVar("T")

MOST_LINES = 10
"""Lines that a result shows of itself, at most."""

LONGEST_WORDS = 160
"""Characters of one of these, at most."""


class Summarized(ABC):
    """A result that shows itself by a title and rows; what it shows is its method `summary`."""

    @abstractmethod
    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """A title, and rows of a label and words; at most `MOST_LINES` in all."""

    def __repr__(self) -> str:
        """Title and rows, one a line."""
        title, rows = self.summary()
        width = max((len(label) for label, _ in rows), default=0)
        lines = [title, *(f"  {label:<{width}}  {words}" for label, words in rows)]
        if len(lines) > MOST_LINES:
            lines[MOST_LINES - 1 :] = [f"  ... {len(lines) - MOST_LINES + 1} more"]
        return "\n".join(_cut(" ".join(line.splitlines())) for line in lines)

    def _repr_html_(self) -> str:
        """Title and rows as a table, for notebooks."""
        title, rows = self.summary()
        cells = "".join(
            f"<tr><th style='text-align:left'>{escape(label)}</th>"
            f"<td style='text-align:left'>{escape(words)}</td></tr>"
            for label, words in rows
        )
        return f"<table><caption>{escape(title)}</caption>{cells}</table>"


def numbers(values: Iterable[float], digits: int = 4) -> str:
    """Numbers in a row, with so many significant digits; what is no more than rounding is 0."""
    return ", ".join(f"{round(float(value), 9) + 0.0:.{digits}g}" for value in values)


def _cut(line: str) -> str:
    return line if len(line) <= LONGEST_WORDS else f"{line[: LONGEST_WORDS - 4]} ..."
