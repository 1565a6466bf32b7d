"""Tables of stability ranges."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table

from cdpr_drake.analyses.ranges.range_item import (
    PLANAR_VISION,
    SECTIONS,
    SINGLE,
    SPATIAL_VISION,
    RangeRow,
)
from cdpr_drake.analyses.statements import Statement
from cdpr_drake.analyses.study_tables import new_table, statement_table


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
    table = new_table(section, ("limits [m, deg]", "largest"), (*published, *answers, "unit"))
    group = rows[0].group
    for row in rows:
        if row.group != group:
            table.add_section()
            group = row.group
        cells = [f"{row.answers[n]:.3g}" if n in row.answers else "" for n in answers]
        known = ["" if row.published is None else f"{row.published:g}"] * len(published)
        limits = ", ".join(f"{name} {value:g}" for name, value in row.limits.items())
        table.add_row(limits, row.sought, *known, *cells, row.unit)
    return table


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
