"""Tables of workspaces: volumes of the figures, shares of kinds, statements."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from rich.table import Table

from cdpr_drake.analyses.reporting.statements import Statement, new_table, statement_table
from cdpr_drake.analyses.studies.workspaces.items import EVERY, FIGURE, FoundWorkspace, LeftOut
from cdpr_drake.analyses.workspaces.conditions import KINDS

ALL = "all"
"""What all kinds of a robot have in common."""

ALL_BUT_CLOSURE = "all but wrench-closure"
"""The same without the kind that robots hanging on their cables never have."""


def shares_of(one: FoundWorkspace) -> dict[str, float]:
    """Shares of the poses where each kind holds, where all but one do, and all."""
    shares = {kind: float(np.mean(holds)) for kind, holds in one.holds.items()}
    others = [holds for kind, holds in one.holds.items() if kind != "wrench-closure"]
    return {
        **shares,
        ALL_BUT_CLOSURE: float(np.mean(np.logical_and.reduce(others))),
        ALL: float(np.mean(one.all_kinds)),
    }


def workspace_tables(
    found: Sequence[FoundWorkspace],
    left_out: Sequence[LeftOut],
    statements: Sequence[Statement],
    quick: bool,
) -> list[Table]:
    """What was found, as far as it is there."""
    tables = []
    figures = [one for one in found if one.item.group == FIGURE]
    if figures:
        tables.append(_figure_table(figures))
    kinds = [one for one in found if one.item.group == EVERY]
    if kinds:
        tables.append(_kind_table(kinds, left_out))
    if statements:
        caption = "Coarse grids: verdicts of the quick form count for little." if quick else ""
        title = "What the theses state and what has to hold"
        tables.append(statement_table(title, statements, caption))
    return tables


def _figure_table(figures: Sequence[FoundWorkspace]) -> Table:
    table = new_table(
        "Static feasible workspace (servoing thesis, figures 1.17 and 1.18), platform unturned",
        ("robot", "upper limit"),
        ("limits [N]", "volume [m^3]", "of the frame [%]", "points"),
    )
    table.caption = "The upper limit is not printed: the robot file's, half and twice of it."
    for one in figures:
        volume = one.volume(one.holds["static"])
        low, high = one.item.limits
        own = one.item.upper_share == 1.0
        table.add_row(
            one.item.robot,
            "of the robot file" if own else f"{one.item.upper_share:g} of that",
            f"{low:g} to {high:g}",
            f"{volume.value:.4g}",
            f"{100.0 * volume.share:.1f}",
            " x ".join(str(n) for n in one.item.question.grid.shape[1:]),
        )
    return table


def _kind_table(kinds: Sequence[FoundWorkspace], left_out: Sequence[LeftOut]) -> Table:
    table = new_table(
        "Share of the frame's poses where each kind holds [%]",
        ("kind",),
        [one.item.robot for one in kinds],
    )
    shares = [shares_of(one) for one in kinds]
    for name in (*KINDS, ALL_BUT_CLOSURE, ALL):
        cells = [f"{100.0 * mine[name]:.1f}" if name in mine else "-" for mine in shares]
        table.add_row(name, *cells)
    table.caption = "\n".join(f"- {one.robot}, {one.kind}: {one.why}" for one in left_out) or None
    return table
