"""How the tables of studies look."""

from __future__ import annotations

from collections.abc import Sequence

from rich.box import SIMPLE_HEAD
from rich.table import Table

from cdpr_drake.analyses.reporting.statements import Statement


def new_table(title: str, left: Sequence[str], right: Sequence[str]) -> Table:
    """An empty table with columns of words, then columns of numbers."""
    table = Table(
        title=title, title_justify="left", caption_justify="left", box=SIMPLE_HEAD, pad_edge=False
    )
    for heading in left:
        table.add_column(heading)
    for heading in right:
        table.add_column(heading, justify="right")
    return table


def statement_table(title: str, statements: Sequence[Statement], caption: str = "") -> Table:
    """What a source states, printed and found side by side."""
    table = new_table(title, ("statement", "printed", "found", "verdict", "why"), ())
    table.caption = caption or None
    for statement in statements:
        table.add_row(
            statement.words, statement.printed, statement.found, statement.verdict, statement.why
        )
        table.add_section()
    return table
