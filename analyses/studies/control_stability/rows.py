"""One row of a table of the study: a question and the shares of its verdicts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cdpr_drake.analyses.published import PublishedTable


@dataclass(frozen=True)
class StabilityRow:
    """One row of a table.

    Attributes:
        table: Name of the table.
        bound: Name of the bound that the row sets, angles with _deg; of a row of coverage "share".
        value: Its value [m, deg], or the part of the baseline bounds.
        published: Published share of the full workspace [%]; None for a row of coverage.
        shares: Share of the full workspace by verdict, cells with all corners stable [%].
        poses: Stable poses of the grid by verdict.
        grid: Poses of the grid.
        ordered: Whether at every pose certified implies searched and searched implies sampled.
    """

    table: str
    bound: str
    value: float
    published: float | None
    shares: dict[str, float]
    poses: dict[str, int]
    grid: int
    ordered: bool


def rows_of(table: PublishedTable, rows: Sequence[StabilityRow]) -> list[StabilityRow]:
    """Those rows that repeat a printed one of the table."""
    return [row for row in rows if row.table == table.name and row.published is not None]


def rows_covered(table: PublishedTable, rows: Sequence[StabilityRow]) -> str:
    """Words on how much of a table rows repeat, such as `all 44 printed rows`."""
    count = len(rows_of(table, rows))
    return f"{'all' if count == table.size else f'{count} of'} {table.size} printed rows"
