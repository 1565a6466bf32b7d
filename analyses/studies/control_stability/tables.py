"""Tables of the study of control stability workspaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from rich.table import Table

from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.published.stability_tables import PublishedTable
from cdpr_drake.stability.verdict import VERDICTS

LARGE_CAMERA_TURN = 30.0
"""From this error of the camera's orientation on, no recipe meets the tables of PBVS [deg]."""


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


def rows_of(table: PublishedTable, rows: Sequence[StabilityRow]) -> list[StabilityRow]:
    """Those rows that repeat a printed one of the table."""
    return [row for row in rows if row.table == table.name and row.published is not None]


def rows_covered(table: PublishedTable, rows: Sequence[StabilityRow]) -> str:
    """Words on how much of a table rows repeat, such as `all 44 printed rows`."""
    count = len(rows_of(table, rows))
    return f"{'all' if count == table.size else f'{count} of'} {table.size} printed rows"


def mean_difference(rows: Sequence[StabilityRow], verdict: str) -> float:
    """Mean of |computed - published| over rows in points; NaN if there is none.

    Args:
        rows: Rows; those without a published value do not count.
        verdict: Whose shares.
    """
    found = [abs(row.shares[verdict] - row.published) for row in rows if row.published is not None]
    return float(np.mean(found)) if found else float("nan")


def small_camera_turns(rows: Sequence[StabilityRow]) -> list[StabilityRow]:
    """The rows without those of d_theta_pc from `LARGE_CAMERA_TURN` on."""
    return [row for row in rows if row.bound != "d_theta_pc_deg" or row.value < LARGE_CAMERA_TURN]


def control_stability_tables(
    asked: Sequence[PublishedTable], rows: Sequence[StabilityRow], quick: bool
) -> list[Table]:
    """One table per published one, then differences and coverage of the certificate."""
    tables = []
    for table in asked:
        mine = rows_of(table, rows)
        if mine:
            tables.append(_one(table, mine, quick))
    if rows:
        tables.append(_summary(asked, rows, quick))
    return tables


def _one(asked: PublishedTable, rows: Sequence[StabilityRow], quick: bool) -> Table:
    table = new_table(
        f"{asked.title}, {rows_covered(asked, rows)}; share of the full workspace in per cent",
        ("bound", "value"),
        ("published", *VERDICTS, "sampled - published"),
    )
    if quick:
        table.caption = "Coarse grid: not to be compared with the published numbers."
    before = ""
    for row in rows:
        if row.published is None:
            continue
        if before not in ("", row.bound):
            table.add_section()
        name = row.bound.removesuffix("_deg") if row.bound != before else ""
        before = row.bound
        table.add_row(
            name,
            f"{row.value:g} {'deg' if row.bound.endswith('_deg') else 'm'}",
            f"{row.published:.1f}",
            *(f"{row.shares[verdict]:.1f}" for verdict in VERDICTS),
            f"{row.shares['sampled'] - row.published:+.1f}",
        )
    return table


def _summary(asked: Sequence[PublishedTable], rows: Sequence[StabilityRow], quick: bool) -> Table:
    table = new_table(
        "Mean absolute difference to the published shares in points, and certified poses",
        ("table",),
        (
            "rows", *VERDICTS, "sampled, some rows", "certified of searched",
            "at 1/4 of the bounds", "ordered",
        ),
    )  # fmt: skip
    table.caption = (
        "Means over all rows that were computed, and in the column `some rows` over those without "
        f"d_theta_pc of {LARGE_CAMERA_TURN:g} deg and more, which no recipe meets under PBVS, with "
        "their number. Certified of searched: share of the poses at the baseline bounds that "
        "survive the search, perturbations cut into pieces; the column certified and the rows of "
        "the tables take them as a whole."
    )
    if quick:
        table.caption += " Coarse grid: the differences mean nothing."
    printed = [row for one in asked for row in rows_of(one, rows)]
    size = sum(one.size for one in asked)
    table.add_row("all of these", *_differences(printed, size), "", "", _ordered(rows))
    for one in asked:
        mine = [row for row in rows if row.table == one.name]
        if not mine:
            continue
        coverage = {
            row.value: 100.0 * row.poses["certified"] / max(row.poses["searched"], 1)
            for row in mine
            if row.published is None
        }
        table.add_row(
            one.title,
            *_differences(rows_of(one, rows), one.size),
            *(f"{coverage[x]:.1f} %" if x in coverage else "" for x in (1.0, 0.25)),
            _ordered(mine),
        )
    return table


def _differences(rows: Sequence[StabilityRow], size: int) -> list[str]:
    """Number of rows, mean differences by verdict, and that of `some rows`."""
    some = small_camera_turns(rows)
    means = [_number(mean_difference(rows, verdict)) for verdict in VERDICTS]
    return [
        f"{len(rows)} of {size}",
        *means,
        f"{_number(mean_difference(some, 'sampled'))} ({len(some)})",
    ]


def _ordered(rows: Sequence[StabilityRow]) -> str:
    return "yes" if all(row.ordered for row in rows) else "NO"


def _number(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.2f}"
