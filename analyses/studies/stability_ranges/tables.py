"""Tables of stability ranges."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table

from cdpr_drake.analyses.reporting.statements import Statement, new_table, statement_table
from cdpr_drake.analyses.studies.stability_ranges.item import (
    PLANAR_ROBOT,
    PLANAR_VISION,
    SECTIONS,
    SINGLE,
    SPATIAL_CAMERA,
    SPATIAL_ROBOT,
    SPATIAL_VISION,
    RangeRow,
)

NAMES = (
    "place, height, psi, phi, theta: where the platform may be; error: length of e; r_, d_theta_: "
    "errors of the platform (bp), the camera (pc), the object (s), exit and anchor points (A, B)"
)
"""What the limits' names mean."""

HEIGHT = {"high": "height"}
"""All heights of one combination are the same here."""


def range_tables(
    rows: Sequence[RangeRow], statements: Sequence[Statement], quick: bool
) -> list[Table]:
    """A table for every section, one for the statements."""
    tables = []
    for section in SECTIONS:
        mine = [row for row in rows if row.section == section]
        if section == SPATIAL_VISION:
            tables += [_objects([row for row in mine if row.group == "place"])] * bool(mine)
            mine = [row for row in mine if row.group != "place"]
        if mine:
            tables.append(_rows(section, mine))
    if statements:
        caption = "Coarse grids: verdicts of the quick form count for little." if quick else ""
        tables.append(statement_table("What the servoing thesis states", statements, caption))
    return tables


def _rows(section: str, rows: Sequence[RangeRow]) -> Table:
    answers = list(dict.fromkeys(name for row in rows for name in row.answers))
    published = ("published",) if section in (SINGLE, PLANAR_VISION) else ()
    full = section in (PLANAR_ROBOT, SPATIAL_CAMERA, SPATIAL_ROBOT)
    others = ("other limits",) if full else ()
    table = new_table(
        f"{section} [m, deg]", ("given", "largest", *others), (*published, *answers, "unit")
    )
    table.caption = NAMES if full else None
    for group in dict.fromkeys(row.group for row in rows):
        mine = [row for row in rows if row.group == group]
        same = _common(mine) if others else set()
        for row in mine:
            form = ".3f" if row.unit == "m^3" else ".3g"
            cells = [f"{row.answers[n]:{form}}" if n in row.answers else "" for n in answers]
            known = ["" if row.published is None else f"{row.published:g}"] * len(published)
            varied = _words(row, set().union(*(r.limits for r in mine)) - same)
            words = [_words(row, same) if row is mine[0] else ""] * len(others)
            table.add_row(varied, row.sought, *words, *known, *cells, row.unit)
        table.add_section()
    return table


def _common(rows: Sequence[RangeRow]) -> set[str]:
    """Names of limits that are the same in all of several rows."""
    first = rows[0].limits
    if len(rows) == 1:
        return set()
    return {n for n in first if all(row.limits.get(n) == first[n] for row in rows)}


def _words(row: RangeRow, names: set[str]) -> str:
    """Limits in words; what is not there is zero, and the lowest height is the highest."""
    order = [*row.limits, *sorted(names - set(row.limits))]
    shown = [n for n in order if n in names and n != "low"]
    return ", ".join(f"{HEIGHT.get(n, n)} {row.limits.get(n, 0.0):g}" for n in shown)


def _objects(rows: Sequence[RangeRow]) -> Table:
    errors = list(dict.fromkeys(row.limits["d_theta_s"] for row in rows))
    table = new_table(
        f"{SPATIAL_VISION}: largest error of the object's place [m]",
        ("theta up to [deg]",),
        [f"its error {error:g}" for error in errors],
    )
    for turn in dict.fromkeys(row.limits["theta_u"] for row in rows):
        found = {r.limits["d_theta_s"]: r.found for r in rows if r.limits["theta_u"] == turn}
        cells = [f"{found[error]:.3f}" if error in found else "" for error in errors]
        table.add_row(f"{turn:g}", *cells)
    return table
