"""How tables look in a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from rich.box import SIMPLE_HEAD
from rich.table import Table

if TYPE_CHECKING:
    from pandas import DataFrame


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


def frame_table(title: str, frame: DataFrame) -> Table:
    """A table of pandas; numbers have four digits, and what is not there is empty."""
    table = new_table(title, (), ())
    for heading in frame:
        numbers = frame[heading].dtype.kind in "iuf"
        table.add_column(str(heading), justify="right" if numbers else "left")
    for row in frame.itertuples(index=False):
        table.add_row(*map(_cell, row))
    return table


def _cell(value: Any) -> str:
    if value is None or value != value:  # NaN is no number
        return ""
    return f"{value:.4g}" if isinstance(value, float) else str(value)
