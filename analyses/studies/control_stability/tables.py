"""Tables of the study of control stability workspaces."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from rich.table import Table

from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.framework.runs import Run, Runs
from cdpr_drake.analyses.studies.framework.summary import note_coarse
from cdpr_drake.analyses.studies.published.stability_tables import TABLES, PublishedTable
from cdpr_drake.stability.verdict import VERDICTS

MET = 5.0
"""A table, or rows of one, whose mean absolute difference is not larger counts as met [points]."""

SAME_MEAN = 0.5
"""Means that differ by less are the same [points]."""

LARGE_CAMERA_TURN = 30.0
"""From this error of the camera's orientation on, no recipe meets the tables of PBVS [deg]."""

SHARE = "share"
"""Stands for the name of a bound in rows of coverage, which take this part of the baseline."""


def published(run: Run) -> float:
    """The printed share of the full workspace of a row that repeats one [%]."""
    (share,) = run.printed.values()
    return float(share)


def rows_of(table: PublishedTable, runs: Runs) -> Runs:
    """Those rows that repeat a printed one of the table."""
    some = [run for run in runs if run["table"] == table.name and run.printed]
    return Runs(some, runs.planned)


def rows_covered(table: PublishedTable, runs: Runs) -> str:
    """Words on how much of a table rows repeat, such as `all 44 printed rows`."""
    count = len(rows_of(table, runs))
    return f"{'all' if count == table.size else f'{count} of'} {table.size} printed rows"


def mean_difference(runs: Iterable[Run], verdict: str) -> float:
    """Mean of |computed - published| over rows in points; NaN if there is none.

    Args:
        runs: Rows that repeat printed ones.
        verdict: Whose shares, by the first words of their column.
    """
    found = [abs(run[f"{verdict}_percent"] - published(run)) for run in runs]
    return float(np.mean(found)) if found else float("nan")


def small_camera_turns(runs: Iterable[Run]) -> list[Run]:
    """The rows without those of d_theta_pc from `LARGE_CAMERA_TURN` on."""
    return [
        run for run in runs if run["bound"] != "d_theta_pc_deg" or run["value"] < LARGE_CAMERA_TURN
    ]


def stability_tables(runs: Runs) -> list[Table]:
    """One table per published one, then differences and coverage of the certificate."""
    if not len(runs):
        return []
    asked = [table for table in TABLES if any(run["table"] == table.name for run in runs)]
    tables = [_one(table, mine) for table in asked if len(mine := rows_of(table, runs))]
    return [*tables, _summary(asked, runs)]


def _one(asked: PublishedTable, runs: Runs) -> Table:
    table = new_table(
        f"{asked.title}, {rows_covered(asked, runs)}; share of the full workspace in per cent",
        ("bound", "value"),
        ("published", *VERDICTS, "sampled - published"),
    )
    note_coarse(table, runs, "not to be compared with the published numbers.")
    for bound, some in runs.by("bound"):
        if len(table.rows):
            table.add_section()
        for number, run in enumerate(some):
            table.add_row(
                "" if number else bound.removesuffix("_deg"),
                f"{run['value']:g} {'deg' if bound.endswith('_deg') else 'm'}",
                f"{published(run):.1f}",
                *(f"{run[f'{verdict}_percent']:.1f}" for verdict in VERDICTS),
                f"{run['sampled_percent'] - published(run):+.1f}",
            )
    return table


def _summary(asked: Sequence[PublishedTable], runs: Runs) -> Table:
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
    note_coarse(table, runs, "the differences mean nothing.")
    printed = [run for one in asked for run in rows_of(one, runs)]
    size = sum(one.size for one in asked)
    table.add_row("all of these", *_differences(printed, size), "", "", _ordered(runs))
    for one in asked:
        mine = runs(table=one.name)
        coverage = {
            run["value"]: 100.0 * run["certified_poses"] / max(run["searched_poses"], 1)
            for run in mine
            if not run.printed
        }
        table.add_row(
            one.title,
            *_differences(list(rows_of(one, runs)), one.size),
            *(f"{coverage[x]:.1f} %" if x in coverage else "" for x in (1.0, 0.25)),
            _ordered(mine),
        )
    return table


def _differences(rows: Sequence[Run], size: int) -> list[str]:
    """Number of rows, mean differences by verdict, and that of `some rows`."""
    some = small_camera_turns(rows)
    means = [_number(mean_difference(rows, verdict)) for verdict in VERDICTS]
    return [
        f"{len(rows)} of {size}",
        *means,
        f"{_number(mean_difference(some, 'sampled'))} ({len(some)})",
    ]


def _ordered(runs: Runs) -> str:
    return "yes" if all(run["ordered"] for run in runs) else "NO"


def _number(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.2f}"
