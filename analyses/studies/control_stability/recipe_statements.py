"""What follows from all recipes on all rows: the best one, and why tables are not met.

Each reason is computed: rows that the thesis' own definition forbids, and rows that no way in which
points may be wrong meets together.
"""

from __future__ import annotations

from itertools import pairwise, product

import numpy as np

from cdpr_drake.analyses.studies.control_stability.arrangements import ARRANGEMENTS
from cdpr_drake.analyses.studies.control_stability.exchanges import (
    CHOOSING_BOUND,
    PAIRS,
    PRINTED,
    exchange_means,
    exchange_name,
    other_rows,
)
from cdpr_drake.analyses.studies.control_stability.printed_limits import (
    covering_pairs,
    excluded,
    limits_of,
    nested_pairs,
    rising_rows,
)
from cdpr_drake.analyses.studies.control_stability.recipes import ARRANGED, ROW, RULES, difference
from cdpr_drake.analyses.studies.control_stability.table_reasons import by_mean, reasons_of
from cdpr_drake.analyses.studies.control_stability.tables import MET, SAME_MEAN, published
from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Runs
from cdpr_drake.analyses.studies.framework.statement import (
    FITTED,
    OURS,
    SOURCE,
    Finding,
    statement,
)
from cdpr_drake.analyses.studies.framework.summary import FULL
from cdpr_drake.analyses.studies.published.recipe_variants import (
    EXCHANGE,
    EXCHANGED_CABLES,
    IN_USE,
    PRESENT,
    RECIPES,
)
from cdpr_drake.analyses.studies.published.stability_tables import TABLES
from cdpr_drake.stability.perturbation_bounds import DIRECTIONS

NEARLY_WHOLE = 90.0
"""An arrangement of anchor points that leaves more at the baseline may be that of A.11 [%]."""

SIZE = sum(table.size for table in TABLES)
"""Number of printed rows."""


def every_row(runs: Runs) -> dict[str, Runs]:
    """All rows by recipe, the smallest mean first.

    Raises:
        MissingRuns: They are of coarse grids, or some are not there.
    """
    rows = by_mean(runs(question=ROW, grid=FULL))
    for name in RECIPES:
        if len(rows.get(name, ())) < SIZE:
            raise MissingRuns(f"rows of {name}")
    return rows


def table_means(rows: Runs) -> dict[str, float]:
    """Mean absolute difference by table of a recipe [points]."""
    return {table: difference(some) for table, some in rows.by("table")}


def _listed(means: dict[str, float]) -> str:
    return ", ".join(f"{name} {mean:.1f}" for name, mean in means.items())


@statement(
    f"Tables A.8 to A.18 by one recipe, all {SIZE} rows.",
    "shares",
    rule=f"mean absolute difference of at most {MET:g} points in each table, by the recipe with "
    "the smallest one over all rows; no row is left out",
    basis=FITTED,
    cause=SOURCE,
)
def best_recipe(runs: Runs) -> Finding:
    """One recipe for all tables."""
    rows = every_row(runs)
    best = next(iter(rows))
    names = dict.fromkeys((PRESENT.name, IN_USE.name, best))
    means = {name: table_means(rows[name]) for name in names}
    over = [table for table, mean in means[best].items() if mean > MET]
    parts = [f"{name} {difference(rows[name]):.1f} ({_listed(means[name])})" for name in names]
    return Finding(
        found=f"mean absolute difference in points: {'; '.join(parts)}",
        held=[table not in over for table in means[best]],
        why=f"Above {MET:g} points by the recipe with the smallest mean: "
        f"{', '.join(over) or 'none'}.",
    )


@statement(
    "A pose belongs to the workspace if Pi is positive definite for any error within the "
    "bounds, each exit and anchor point within its own sphere.",
    source="(3.27), 3.3.1",
    rule="no row prints more than any target, view and camera leaves, by the rule of the volume "
    "that leaves the most",
    cause=SOURCE,
)
def spheres(runs: Runs) -> Finding:
    """Rows that print more than any target leaves."""
    every_row(runs)
    rows = limits_of(runs, grid=FULL)(arrangement=PRESENT.name)
    words = []
    for table, mine in rows.by("table"):
        for bound, some in mine.by("bound"):
            pairs = ", ".join(
                f"{run['value']:g} m {published(run):.1f} > {run['at_most_percent']:.1f}"
                for run in some
                if excluded(run)
            )
            words += [f"{table} {bound} {pairs}"] if pairs else []
    held = [not excluded(run) for run in rows]
    return Finding(
        found=f"{held.count(False)} of {len(rows)} printed rows leave more than that with any "
        f"target, view and camera: {'; '.join(words)}",
        held=held,
        why="At these rows a perturbation within the bounds gives Pi an eigenvalue with a real "
        "part that is not positive, whatever the camera sees. So what is printed was found with "
        "fewer errors than the text allows, which it does not name; no choice that the text leaves "
        "open gives these numbers.",
    )


@statement(
    "An error of the exit points of r contains a common shift, which is an error of the "
    "platform's place of r + 0.025 m at the baseline; so it cannot leave more.",
    source="(3.27)",
    rule="no row leaves more than the last digit above the row whose errors it contains; from the "
    "printed numbers alone, for every robot, target and scheme",
    cause=SOURCE,
)
def shifts(runs: Runs) -> Finding:
    """Printed rows that contradict each other."""
    pairs = [pair for table in TABLES for pair in nested_pairs(table)]
    bad = [pair for pair in pairs if pair.contradictory]
    return Finding(
        found=f"{len(bad)} of {len(pairs)} printed rows leave more: "
        + ", ".join(
            f"{p.table} {p.first:.1f} % at r_A = {p.r_A:g} m, {p.second:.1f} at r_bp = {p.r_bp:g} m"
            for p in bad
        ),
        held=[not pair.contradictory for pair in pairs],
    )


@statement(
    "The camera above the platform, the view straight ahead and the other anchor points were "
    f"chosen with rows of {RECIPES[IN_USE.name].sight} in sight; the other tables confirm it.",
    "shares",
    rule=f"no other table's mean difference gets worse by more than {SAME_MEAN:g} points",
    basis=OURS,
)
def unseen_rows(runs: Runs) -> Finding:
    """The recipe in use on tables with which it was not chosen."""
    rows = every_row(runs)
    before, after = table_means(rows[PRESENT.name]), table_means(rows[IN_USE.name])
    names = [name for name in before if name not in RECIPES[IN_USE.name].sight]
    return Finding(
        found="mean absolute difference in points before and after: "
        + ", ".join(f"{name} {before[name]:.1f} {after[name]:.1f}" for name in names),
        held=[after[name] <= before[name] + SAME_MEAN for name in names],
        some=any(after[name] < before[name] - SAME_MEAN for name in names),
    )


@statement(
    f"Of each table above {MET:g} points, rows of the bounds that are missed are ruled out by "
    "printed numbers or by the definition.",
    source="(3.27), 3.3.1",
    rule=f"the rows of each table's other bounds are off by at most {MET:g} points in the mean",
    basis=OURS,
)
def reasons(runs: Runs) -> Finding:
    """Why tables are not met."""
    every_row(runs)
    limits_of(runs, grid=FULL)
    some = reasons_of(runs)
    return Finding(
        found="; ".join(
            f"{r.recipe} {r.table} {r.mean:.1f}: {', '.join(r.rows) or 'none'} ruled out, other "
            f"bounds {r.rest:.1f}, {'' if r.explained else 'not '}explained"
            for r in some
        )
        or "no table is above",
        held=[reason.explained for reason in some],
        why="The rows stand in the table of reasons.",
    )


@statement(
    "A larger bound does not leave a larger workspace.",
    source="(3.27)",
    rule="no step from a printed row to the next leaves more than the last digit above it; from "
    "the printed numbers alone",
    cause=SOURCE,
)
def rising(runs: Runs) -> Finding:
    """Larger bounds."""
    bad = [(table.name, *row) for table in TABLES for row in rising_rows(table)]
    steps = [
        (table.name, bound, *step)
        for table in TABLES
        for bound, rows in table.rows.items()
        for step in pairwise(sorted(rows))
    ]
    return Finding(
        found=f"{len(bad)} of {len(steps)} steps from a printed row to the next leave more"
        + "".join(f"; {name} {bound} {low:g} to {high:g}" for name, bound, low, high in bad),
        held=[step not in bad for step in steps],
    )


@statement(
    "A common shift of the exit points by r is an error of the platform's place of at most "
    "r + 0.025 m at the baseline, so with such errors r_A = r leaves at least as much.",
    source="(3.27)",
    rule="no row leaves less than the row that contains a common shift, by more than the last "
    "digit; from the printed numbers alone",
    basis=OURS,
    cause=SOURCE,
)
def common_exits(runs: Runs) -> Finding:
    """Rows that cannot have exit points that are wrong in common."""
    pairs = [pair for table in TABLES for pair in covering_pairs(table)]
    bad = [pair for pair in pairs if pair.less]
    words = []
    for name in dict.fromkeys(pair.table for pair in bad):
        mine = [pair for pair in bad if pair.table == name]
        worst = max(mine, key=lambda pair: pair.second - pair.first)
        words.append(
            f"{name} {len(mine)}, most at r_A = {worst.r_A:g} m {worst.first:.1f} %, r_bp = "
            f"{worst.r_bp:g} m {worst.second:.1f}"
        )
    return Finding(
        found=f"{len(bad)} of {len(pairs)} printed rows leave less: {'; '.join(words)}",
        held=[not pair.less for pair in pairs],
        why="So exit points were not wrong in common at these rows, whatever the target.",
    )


@statement(
    "Exit and anchor points are wrong in the same way in all tables.",
    source="3.3.1",
    rule=f"in each table the rows of r_A and those of r_B off by at most {MET:g} points in the "
    f"mean by one way of {', '.join(DIRECTIONS)}",
    basis=OURS,
    cause=SOURCE,
)
def points_together(runs: Runs) -> Finding:
    """Ways in which points may be wrong, against rows of exit and anchor points together."""
    rows = every_row(runs)
    words, good = [], []
    for table in (table.name for table in TABLES):
        means = {
            (bound, way): difference(rows[f"points-{way}"], table=table, bound=bound)
            for bound, way in product(("r_A", "r_B"), DIRECTIONS)
        }
        both = {way: max(means["r_A", way], means["r_B", way]) for way in DIRECTIONS}
        best = min(both, key=lambda way: both[way])
        good.append(both[best] <= MET)
        words.append(f"{table} {best} {means['r_A', best]:.1f} and {means['r_B', best]:.1f}")
    return Finding(
        found="best way by table, mean difference of the rows of r_A and of r_B in points: "
        + ", ".join(words),
        held=good,
    )


@statement(
    "The fully constrained ACROBOT has the exit points of table 3.1 and the anchor points of "
    "table A.1, by their numbers.",
    "97.0 % at the baseline of A.11",
    rule=f"more than {NEARLY_WHOLE:g} % by the numbers of both tables; in part: by some arrangement"
    " of the anchor points",
    cause=SOURCE,
)
def anchor_points(runs: Runs) -> Finding:
    """The robot of A.11."""
    rows, limits = every_row(runs), limits_of(runs, grid=FULL)(table="A.11")
    shares = {run["anchors"]: run["box_percent"] for run in runs(question=ARRANGED, grid=FULL)}
    if len(shares) < len(ARRANGEMENTS):
        raise MissingRuns(ARRANGED)
    whole = {name: share for name, share in shares.items() if share > NEARLY_WHOLE}
    kept = {
        name: rows[name].one(table="A.11", bound="r_bp", value=0.03)[f"{RULES[0]}_percent"]
        for name in (PRESENT.name, "kept-cables")
    }
    words = [
        f"{name} {sum(map(excluded, some))} of {len(some)}"
        for name, some in limits.by("arrangement")
    ]
    return Finding(
        found=f"{kept[PRESENT.name]:.1f} % at the baseline by the numbers of both tables, "
        f"{kept['kept-cables']:.1f} with the cables of the suspended robot; more than "
        f"{NEARLY_WHOLE:g} in {len(whole)} of {len(shares)} arrangements: "
        f"{'; '.join(f'{name} {share:.1f}' for name, share in whole.items())}. Rows of r_A and "
        f"r_B that print more than any target leaves: {', '.join(words)}",
        held=[kept[PRESENT.name] > NEARLY_WHOLE],
        some=bool(whole),
        why="Arrangements: which points the cables from above hold, and the corner, relative to "
        "that of the exit point, of cables from above; of those from the floor.",
    )


@statement(
    "Table 3.1 has two exit points of cables from above in each other's place, and the goal is "
    f"the centre: what the rows of {CHOOSING_BOUND} of A.11 choose, its other rows confirm.",
    f"{len(PAIRS) - 1} exchanges of two cables, and none",
    rule=f"{exchange_name(*EXCHANGE)} is the best or as good, within {SAME_MEAN:g} points, and the "
    f"other rows are off by at most {MET:g} points",
    basis=FITTED,
    cause=SOURCE,
)
def exchanged_cables(runs: Runs) -> Finding:
    """The exchange in table 3.1 that the rows of one bound choose, and the other rows."""
    rows = every_row(runs)
    means, used = exchange_means(runs(grid=FULL)), exchange_name(*EXCHANGE)
    rest = other_rows(rows[EXCHANGED_CABLES.name])
    chosen = means[used] <= min(means.values()) + SAME_MEAN
    return Finding(
        found=f"mean difference over the rows of {CHOOSING_BOUND} in points: "
        f"{_listed(dict(list(means.items())[:4]))}; as printed {means[PRINTED]:.1f}. The "
        f"{len(rest)} rows of other bounds, without the baseline, with {used}: mean "
        f"{np.mean(rest):.1f}, largest {max(rest):.1f}",
        held=[chosen, float(np.mean(rest)) <= MET],
        some=chosen,
        why="A2 A8 and A4 A6 are mirror images, which the table does not tell apart. The goal was "
        "chosen with all rows in sight.",
    )


CHECKS = (
    best_recipe, unseen_rows, reasons, spheres, shifts, common_exits, rising, points_together,
    anchor_points, exchanged_cables,
)  # fmt: skip
"""All of them."""
