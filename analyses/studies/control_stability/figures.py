"""Figures of the study of control stability workspaces."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.studies.control_stability.tables import (
    published,
    rows_covered,
    rows_of,
)
from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Runs
from cdpr_drake.analyses.studies.framework.summary import COARSE
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


LINES: dict[str, dict[str, Any]] = {
    "sampled": {**line_style(SEEN["sampled"]), **COVERED_LINE},
    "searched": {**line_style(SEEN["searched"]), "marker": SEEN["searched"].marker, "ms": 6},
    "certified": {**line_style(SEEN["certified"]), "marker": SEEN["certified"].marker, "ms": 4},
}
"""Of the verdicts; each can be seen where it lies on another, and without colours."""


def table_figure(runs: Runs, table: PublishedTable) -> Figure:
    """Share of the workspace over each bound, published and by every verdict."""
    rows = rows_of(table, runs)
    if not len(rows):
        raise MissingRuns(table.name)
    names = list(rows.counts("bound"))
    columns = min(COLUMNS, len(names))
    lines = -(-len(names) // columns)
    size = (max(4.0 * columns + 1.0, 6.5), 3.2 * lines + 1.5)
    coarse = COARSE in rows.list("grid")
    hint = "\ncoarse grid, not to be compared with the published numbers" if coarse else ""
    title = f"Table {table.title}, {rows_covered(table, rows)}{hint}"
    figure, panels = new_figure(lines, columns, size, title)
    flat = list(np.atleast_1d(np.array(panels, object)).ravel())
    for axes, name in zip(flat, names, strict=False):
        some = rows(bound=name)
        values = some["value"]
        for verdict in VERDICTS:
            axes.plot(values, some[f"{verdict}_percent"], label=verdict, **LINES[verdict])
        axes.plot(
            values, [published(run) for run in some], PUBLISHED.marker, color=PUBLISHED.color,
            markersize=10, markeredgewidth=1.8, label="published",
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


FIGURES: dict[str, Callable[[Runs], Figure]] = {
    table_file(table.name): partial(table_figure, table=table) for table in TABLES
}
"""What draws the figures, by name."""
