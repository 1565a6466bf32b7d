"""One row of a table of the study: a question and the shares of its verdicts."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
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
