"""Figures of the study of control stability workspaces."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.studies.control_stability.tables import StabilityRow, rows_covered, rows_of
from cdpr_drake.analyses.studies.published.stability_recipe import recipe_grid
from cdpr_drake.analyses.studies.published.stability_tables import TABLES, PublishedTable
from cdpr_drake.analyses.visualization.figure_style import (
    COVERED_LINE,
    few_ticks,
    line_style,
    new_figure,
)
from cdpr_drake.palette import PUBLISHED
from cdpr_drake.palette import VERDICTS as SEEN
from cdpr_drake.stability.verdict import VERDICTS

COLUMNS = 3
"""Panels side by side."""


def table_file(name: str) -> str:
    """Name of the file of a table's figure."""
    return "table_" + name.replace(".", "").lower()


FIGURES = tuple(table_file(table.name) for table in TABLES)
"""Names of all figures that the study can write."""

LINES: dict[str, dict[str, Any]] = {
    "sampled": {**line_style(SEEN["sampled"]), **COVERED_LINE},
    "searched": {**line_style(SEEN["searched"]), "marker": SEEN["searched"].marker, "ms": 6},
    "certified": {**line_style(SEEN["certified"]), "marker": SEEN["certified"].marker, "ms": 4},
}
"""Of the verdicts; each can be seen where it lies on another, and without colours."""


def control_stability_drawings(
    asked: Sequence[PublishedTable], rows: Sequence[StabilityRow]
) -> dict[str, Callable[[], Figure]]:
    """What draws a figure for each table of which there are rows, by name."""
    return {
        table_file(table.name): partial(table_figure, table, mine)
        for table in asked
        if (mine := rows_of(table, rows))
    }


def table_figure(table: PublishedTable, rows: Sequence[StabilityRow]) -> Figure:
    """Share of the workspace over each bound, published and by every verdict."""
    names = list(dict.fromkeys(row.bound for row in rows))
    columns = min(COLUMNS, len(names))
    lines = -(-len(names) // columns)
    size = (max(4.0 * columns + 1.0, 6.5), 3.2 * lines + 1.5)
    coarse = any(row.grid < recipe_grid(table.robot).size for row in rows)
    hint = "\ncoarse grid, not to be compared with the published numbers" if coarse else ""
    title = f"Table {table.title}, {rows_covered(table, rows)}{hint}"
    figure, panels = new_figure(lines, columns, size, title)
    flat = list(np.atleast_1d(np.array(panels, object)).ravel())
    for axes, name in zip(flat, names, strict=False):
        some = [row for row in rows if row.bound == name]
        values = [row.value for row in some]
        for verdict in VERDICTS:
            axes.plot(
                values, [row.shares[verdict] for row in some], label=verdict, **LINES[verdict]
            )
        published = [row.published for row in some]
        axes.plot(
            values, published, PUBLISHED.marker, color=PUBLISHED.color, markersize=10,
            markeredgewidth=1.8, label="published",
        )  # fmt: skip
        axes.set_xlim(0.0, 1.06 * max(values))
        axes.set_ylim(-3.0, 103.0)
        few_ticks(axes.xaxis)
        angle = name.endswith("_deg")
        axes.set_xlabel(f"{name.removesuffix('_deg')} [{'deg' if angle else 'm'}]")
    for axes in flat[len(names) :]:
        axes.remove()
    for axes in flat[: len(names) : columns]:
        axes.set_ylabel("workspace [%]")
    handles, labels = flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=min(4, 2 * columns))
    return figure
