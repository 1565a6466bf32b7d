"""Tables and figures of the control stability workspaces: printed shares beside computed ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.figures import COVERED_LINE, few_ticks, line_style, new_figure
from cdpr_drake.analyses.reporting.deferred_figures import NothingToDraw
from cdpr_drake.analyses.studies.facts import MissingRuns
from cdpr_drake.analyses.studies.recipe_variants import (
    FULLY_CONSTRAINED,
    IN_USE,
    RECIPES,
    Recipe,
)
from cdpr_drake.analyses.studies.stability_tables import (
    BY_NAME,
    DIGIT,
    TABLES,
    PublishedTable,
    covering_pairs,
    nested_pairs,
)
from cdpr_drake.analyses.studies.study import Frame
from cdpr_drake.palette import PUBLISHED
from cdpr_drake.palette import VERDICTS as LOOKS
from cdpr_drake.stability.verdict import VERDICTS

MET = 5.0
"""A table, or rows of one, whose mean distance is not larger counts as met [points]."""

LARGE_CAMERA_TURN = 30.0
"""From this error of the camera's orientation on, no recipe meets the tables of PBVS [deg]."""

RULES = ("corners", "cell_hulls", "points")
"""Rules of volumes in rows by recipes; the first is the one in use."""


def printed_rows(rows: Frame, question: str, table: str = "") -> Frame:
    """Rows of a question that repeat printed ones, of a table or of all.

    Raises:
        MissingRuns: There is none.
    """
    where = (rows["question"] == question) & rows["printed_percent"].notna()
    found = rows[where & ((rows["table"] == table) | (not table))]
    if not len(found):
        raise MissingRuns(f"{question} {table}")
    return found


def distance(rows: Frame, share: str = "corners") -> float:
    """Mean absolute difference of a share to the printed one [points]; NaN without rows."""
    apart = (rows[f"{share}_percent"] - rows["printed_percent"]).abs().to_numpy()
    return float(np.mean(apart)) if len(apart) else float("nan")


def by_distance(rows: Frame) -> dict[str, Frame]:
    """Rows by recipe, the recipe with the smallest mean distance over all rows first."""
    groups = dict([*printed_rows(rows, "row").groupby("recipe", sort=False)])
    return dict(sorted(groups.items(), key=lambda item: distance(item[1])))


def table_of(rows: Frame, name: str) -> Frame:
    """A printed table beside what was computed."""
    shares = ["printed_percent", *(f"{verdict}_percent" for verdict in VERDICTS)]
    repeated = printed_rows(rows, "verdicts", name)
    return repeated[["bound", "value", *shares]].round(dict.fromkeys(shares, 1))


def verdict_means(rows: Frame) -> Frame:
    """Mean distance from the printed shares by table [points], and certified poses of searched
    ones at the baseline bounds and at a quarter of them [%]."""
    lines, answers = [], rows[rows["question"] == "verdicts"]
    for name, repeated in printed_rows(rows, "verdicts").groupby("table", sort=False):
        large = (repeated["bound"] == "d_theta_pc_deg") & (repeated["value"] >= LARGE_CAMERA_TURN)
        own = answers[answers["table"] == name]
        coverage = own[own["bound"] == "share"].set_index("value")
        covered = 100.0 * coverage["certified_poses"] / coverage["searched_poses"].clip(lower=1)
        lines.append({
            "table": BY_NAME[name].title,
            "rows": f"{len(repeated)} of {BY_NAME[name].size}",
            **{verdict: distance(repeated, verdict) for verdict in VERDICTS},
            "sampled, turns below 30 deg": distance(repeated[~large], "sampled"),
            "certified of searched [%]": covered.get(1.0),
            "at 1/4 of the bounds [%]": covered.get(0.25),
            "ordered": bool(own["ordered"].all()),
        })  # fmt: skip
    return Frame(lines)


def recipe_means(rows: Frame) -> Frame:
    """Mean distance by recipe, over all rows and by table [points]."""
    return Frame([
        {
            "recipe": name, "rows": len(some), "all": distance(some),
            **{table: distance(mine) for table, mine in some.groupby("table", sort=False)},
        }
        for name, some in printed_rows(rows, "row").groupby("recipe", sort=False)
    ])  # fmt: skip


def rule_means(rows: Frame) -> Frame:
    """Mean distance by recipe and rule of the volume [points], and by the rule in use over rows in
    sight when the recipe was chosen and over the others."""
    lines = []
    for name, some in printed_rows(rows, "row").groupby("recipe", sort=False):
        fitted = some["fitted"].astype(bool)
        lines.append({
            "recipe": name, **{rule: distance(some, rule) for rule in RULES},
            "in sight": distance(some[fitted]), "others": distance(some[~fitted]),
            "chosen with more rows in sight": RECIPES[name].sight,
        })  # fmt: skip
    return Frame(lines)


def excluded_rows(rows: Frame) -> Frame:
    """Rows that print more than any target, view and camera leaves."""
    limits = rows[rows["question"] == "any target"]
    if not len(limits):
        return limits
    return limits[limits["printed_percent"] > limits["at_most_percent"] + DIGIT]


def limit_table(rows: Frame) -> Frame:
    """Rows that print more than any target leaves, and that [%]."""
    columns = ["table", "arrangement", "bound", "value", "printed_percent", "at_most_percent"]
    return excluded_rows(rows)[columns]


def pair_table(rows: Frame) -> Frame:
    """Printed rows of exit points beside rows of the platform's place; from the print alone."""
    words = {pair: "contradiction, leaves more" for pair in nested_pairs() if pair.more}
    words |= {pair: "no common shift, leaves less" for pair in covering_pairs() if pair.less}
    return Frame([{**pair._asdict(), "what it says": said} for pair, said in words.items()])


def reasons(rows: Frame) -> list[dict[str, Any]]:
    """Of each table that the recipe in use or the best one does not meet: why.

    The rows of a bound are ruled out for a recipe if one of them prints more than any target leaves
    with the recipe's cables, prints more than a row whose errors it contains, or prints less than a
    row that contains its errors though the recipe moves exit points in common.

    Returns:
        recipe; table; mean: distance over all rows [points]; rows: what rules them out, in words by
        bound; rest: distance over the rows of all other bounds [points]; explained: true if these
        are met.
    """
    groups, found = by_distance(rows), []
    for name in dict.fromkeys((IN_USE.name, *list(groups)[:1])):
        for table, some in groups[name].groupby("table", sort=False) if name in groups else ():
            mean = distance(some)
            if mean <= MET:
                continue
            words = ruled_out(RECIPES[name], BY_NAME[table], excluded_rows(rows))
            rest = distance(some[~some["bound"].isin(list(words))])
            found.append({
                "recipe": name, "table": table, "mean": mean, "rows": words, "rest": rest,
                "explained": bool(words) and rest <= MET,
            })  # fmt: skip
    return found


def ruled_out(recipe: Recipe, table: PublishedTable, excluded: Frame) -> dict[str, str]:
    """What rules rows of a table out for a recipe, in words by bound."""
    words: dict[str, list[str]] = {}
    for row in excluded[excluded["table"] == table.name].to_dict("records"):
        # Recipes have other cables for this robot alone.
        own = RECIPES[row["arrangement"]].anchors == recipe.anchors
        if own or table.robot != FULLY_CONSTRAINED:
            words.setdefault(row["bound"], []).append(
                f"{row['value']:g} m prints {row['printed_percent']:.1f}, any target leaves "
                f"{row['at_most_percent']:.1f}"
            )
    pairs = [(pair, "more") for pair in nested_pairs([table]) if pair.more]
    if recipe.directions(table.robot, table.scheme, "r_A") == "common":
        pairs += [(pair, "less") for pair in covering_pairs([table]) if pair.less]
    for pair, word in pairs:
        words.setdefault("r_A", []).append(
            f"{pair.r_A:g} m prints {pair.first:.1f}, {word} than r_bp = {pair.r_bp:g} m with "
            f"{pair.second:.1f}"
        )
    return {bound: "; ".join(some) for bound, some in words.items()}


def reason_table(rows: Frame) -> Frame:
    """A line for each bound that is ruled out, of tables that are not met."""
    return Frame([
        {
            "recipe": one["recipe"], "table": one["table"], "bound": bound,
            "what rules its rows out": words, "points": one["mean"], "other bounds": one["rest"],
        }
        for one in reasons(rows)
        for bound, words in (one["rows"] or {"none": "nothing was found"}).items()
    ])  # fmt: skip


TABLES_OF_ROWS: Mapping[str, Callable[[Frame], Frame]] = {
    **{
        f"Table {table.title}, share of the full workspace in per cent": partial(
            table_of, name=table.name
        )
        for table in TABLES
    },
    "Mean absolute difference to the printed shares in points, and certified poses": verdict_means,
    "Mean absolute difference by recipe and table, in points": recipe_means,
    "Mean absolute difference by recipe and rule of the volume, in points": rule_means,
    "Rows that print more than any target, view and camera leaves, in per cent": limit_table,
    "Printed rows of exit points beside rows of the platform's place, in per cent": pair_table,
    f"Tables above {MET:g} points, and which of their bounds are ruled out": reason_table,
}


STYLES: Mapping[str, dict[str, Any]] = {
    "sampled": {**line_style(LOOKS["sampled"]), **COVERED_LINE},
    "searched": {**line_style(LOOKS["searched"]), "marker": LOOKS["searched"].marker, "ms": 6},
    "certified": {**line_style(LOOKS["certified"]), "marker": LOOKS["certified"].marker, "ms": 4},
}
"""Of the verdicts; each can be seen where it lies on another, and without colours."""


def table_figure(rows: Frame, table: PublishedTable) -> Figure:
    """Share of the workspace over each bound of a table, printed and by every verdict."""
    try:
        repeated = printed_rows(rows, "verdicts", table.name)
    except MissingRuns:
        raise NothingToDraw from None
    groups = dict([*repeated.groupby("bound", sort=False)])
    columns = min(3, len(groups))
    lines = -(-len(groups) // columns)
    count = (
        f"all {table.size}" if len(repeated) == table.size else f"{len(repeated)} of {table.size}"
    )
    title = f"Table {table.title}, {count} printed rows"
    if (repeated["grid"] == "coarse").any():
        title += "\ncoarse grid, not to be compared with the published numbers"
    size = (max(4.0 * columns + 1.0, 6.5), 3.2 * lines + 1.5)
    figure, panels = new_figure(lines, columns, size, title)
    flat = list(np.ravel(panels))
    for axes, (bound, some) in zip(flat, groups.items(), strict=False):
        for verdict in VERDICTS:
            axes.plot(some["value"], some[f"{verdict}_percent"], label=verdict, **STYLES[verdict])
        axes.plot(
            some["value"], some["printed_percent"], PUBLISHED.marker, color=PUBLISHED.color,
            markersize=10, markeredgewidth=1.8, label="published",
        )  # fmt: skip
        axes.set(xlim=(0.0, 1.06 * some["value"].max()), ylim=(-3.0, 103.0))
        few_ticks(axes.xaxis)
        unit = "deg" if bound.endswith("_deg") else "m"
        axes.set_xlabel(f"{bound.removesuffix('_deg')} [{unit}]")
    for axes in flat[len(groups) :]:
        axes.remove()
    for axes in flat[: len(groups) : columns]:
        axes.set_ylabel("workspace [%]")
    handles = flat[0].get_legend_handles_labels()
    figure.legend(*handles, loc="outside lower center", ncols=min(4, 2 * columns))
    return figure


FIGURES = {
    f"table_{table.name.replace('.', '').lower()}": partial(table_figure, table=table)
    for table in TABLES
}
"""What draws the figures, by name."""
