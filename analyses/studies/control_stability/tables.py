"""Tables of the study of control stability workspaces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.table import Table

from cdpr_drake.analyses.published import PublishedTable
from cdpr_drake.analyses.studies.control_stability.rows import (
    StabilityRow,
    rows_covered,
    rows_of,
)
from cdpr_drake.stability import VERDICTS

LARGE_CAMERA_TURN = 30.0
"""From this error of the camera's orientation on, no recipe meets the tables of PBVS [deg]."""


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


def _new(title: str, left: Sequence[str], right: Sequence[str]) -> Table:
    table = Table(
        title=title, title_justify="left", caption_justify="left", box=SIMPLE_HEAD, pad_edge=False
    )
    for heading in left:
        table.add_column(heading)
    for heading in right:
        table.add_column(heading, justify="right")
    return table


def _one(asked: PublishedTable, rows: Sequence[StabilityRow], quick: bool) -> Table:
    table = _new(
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
    table = _new(
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
